"""Plug-ins: objects named by module or file.

There is no registry. A Python caller passes the object; a file names it; ``faults_of`` says what it lacks of its seam.
Where the environment has ``REMORAS_NO_PLUGINS``, which worker processes inherit, only shipped objects are loaded.

A folder on Python's path serves everybody: a library that tries ``import orjson`` gets whatever lies there under that
name. So folders of plug-ins are not on the path. A finder behind all others takes from them the module that is being
``asked_for``, and what a module that came from a folder imports itself, then or later. What is installed comes first.
"""

from __future__ import annotations

import importlib
import inspect
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any, Final, TypeVar

from remoras.errors import PluginError

NO_PLUGINS = "REMORAS_NO_PLUGINS"
"""Variable of the environment by which only shipped code is loaded, unless it is empty."""
SHIPPED = frozenset({"worldmodel", "exchange", "remoras", "missions", "visualisation"})
"""Packages that are shipped."""


def refuse_unshipped(module: str, named: str) -> None:
    """Let only shipped code be loaded where that was asked for.

    Args:
        module: that would be imported, or that has what was found; named: what the user named.

    Raises:
        PluginError: it is none of ``SHIPPED``.
    """
    if os.environ.get(NO_PLUGINS) and module.partition(".")[0] not in SHIPPED:
        raise PluginError(
            f"{named} is not shipped, and no other code is loaded with --no-plugins; allowed: shipped code"
        )


def named_object(reference: str) -> Any:
    """The object named ``package.module:object``.

    Raises:
        PluginError: the text is no such name, or the module or the object cannot be loaded, or may not be.

    >>> named_object("math:pi")
    3.141592653589793
    """
    module, colon, name = reference.partition(":")
    if not (module and colon and name):
        raise PluginError(f"{reference!r} names no object; allowed: package.module:object")
    refuse_unshipped(module, reference)
    try:
        with asked_for(module):
            found = getattr(importlib.import_module(module), name)
    except Exception as error:  # it is somebody else's module: anything may be wrong with it
        why = next(iter(str(error).splitlines()), "")
        raise PluginError(f"package.module:object that can be imported ({type(error).__name__}: {why})") from error
    has_home = inspect.isroutine(found) or isinstance(found, type)
    refuse_unshipped(str((found if has_home else type(found)).__module__), reference)
    return found


def faults_of(found: Any, seam: type, compulsory: tuple[str, ...]) -> Iterator[str]:
    """What an object lacks of a seam, in words.

    Args:
        found: the plug-in.
        seam: the documented Protocol.
        compulsory: names of the members that it must have.
    """
    missing = [name for name in compulsory if not hasattr(found, name)]
    missing += sorted(getattr(found, "__abstractmethods__", frozenset()) - set(missing))
    lacking: dict[type, list[str]] = {}
    for name in missing:
        asks = [base for base in getattr(found, "__mro__", ()) if name in vars(base) and base not in seam.__mro__]
        lacking.setdefault(asks[0] if asks else seam, []).append(name)
    for asking, names in lacking.items():
        yield f"lacks {', '.join(names)} of {asking.__module__}.{asking.__qualname__}"
    for name in compulsory:
        wanted, given = getattr(seam, name, None), getattr(found, name, None)
        if inspect.isroutine(wanted) and name not in missing:
            if not callable(given):
                yield f"{name} is {type(given).__name__}, not a function"
            elif (text := _signature_fault(name, wanted, given, isinstance(found, type))) is not None:
                yield text


def _signature_fault(name: str, wanted: Callable[..., Any], given: Callable[..., Any], is_class: bool) -> str | None:
    """How a function cannot be called as its seam says; None if it can, or if Python does not know."""
    parameters = [p for p in inspect.signature(wanted).parameters if p not in ("self", "cls")]
    try:
        own = inspect.signature(given)
    except (TypeError, ValueError):
        return None
    is_plain = is_class and inspect.isfunction(inspect.getattr_static(given, "__func__", given))
    takes_self = is_plain and not inspect.ismethod(given) and next(iter(own.parameters), "") == "self"
    try:
        own.bind(*([None] if takes_self else []), *[None] * len(parameters))
    except TypeError:
        return f"{name}{own} cannot be called as {name}({', '.join(parameters)})"
    return None


LONGEST_REPR = 80
Answer = TypeVar("Answer")


def broken_promise(who: str, part: str, expected: str, given: object) -> PluginError:
    """The error for a part of a plug-in that returned something else than its seam says, or raised.

    Args:
        who: the plug-in, as the user knows it.
        part: the function that was called; expected: what it has to return.
        given: what it returned, or the exception that it raised.

    >>> print(broken_promise("strategy mine", "form", "an Organisation", None))
    strategy mine: form returned None; expected: an Organisation
    """
    if isinstance(given, Exception):
        came = f"raised {type(given).__name__}: {given}"
    else:
        text = repr(given)
        came = f"returned {text if len(text) <= LONGEST_REPR else text[:LONGEST_REPR] + '...'}"
    return PluginError(f"{who}: {part} {came}; expected: {expected}")


def answer(
    who: str, part: str, expected: str, is_expected: Callable[[Any], bool], asked: Callable[[], Answer]
) -> Answer:
    """What a plug-in answers.

    Args:
        who: the plug-in; part: the function that is called; expected: what it has to return, in words.
        is_expected: tells whether an answer is that.
        asked: calls the part.

    Raises:
        PluginError: it raises, or answers with something else.
    """
    try:
        found = asked()
        sound = is_expected(found)
    except PluginError:
        raise
    except Exception as error:  # it is somebody else's code: anything may be wrong with it
        raise broken_promise(who, part, expected, error) from error
    if not sound:
        raise broken_promise(who, part, expected, found)
    return found


SAFE_PATH: Final = "PYTHONSAFEPATH"
"""Variable of the environment by which Python does not put the current folder before all others."""
IMPORT_SYSTEM = frozenset({"_frozen_importlib", "_frozen_importlib_external", "importlib"})
_asked: ContextVar[str] = ContextVar("_asked", default="")


class PluginFolders:
    """Finds modules in folders of plug-ins, for those who may have them."""

    def __init__(self) -> None:
        self.folders: list[str] = []
        self._found_in: dict[str, str] = {}

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Where a module is, if none of the other finders has it; for arguments see ``importlib``."""
        if path is not None or not self.folders:  # what is in a package is found in it
            return None
        home = self._found_in.get(_importer())
        for folder in self.folders if fullname == _asked.get() else [] if home is None else [home]:
            spec = PathFinder.find_spec(fullname, [folder])
            if spec is not None:
                self._found_in[fullname] = folder
                return spec
        return None

    def invalidate_caches(self) -> None:
        """Nothing is kept: a folder that was added is looked at anew."""


def _importer() -> str:
    """Top package of the code that imports a module now; empty if none does."""
    frame = sys._getframe(1).f_back
    while frame is not None:
        top = str(frame.f_globals.get("__name__", "")).partition(".")[0]
        if top not in IMPORT_SYSTEM:
            return top
        frame = frame.f_back
    return ""


_finder = PluginFolders()


def look_in(folders: Sequence[str]) -> None:
    """Take named plug-ins from more folders, behind those that are known already.

    Args:
        folders: absolute paths.
    """
    if _finder not in sys.meta_path:
        sys.meta_path.append(_finder)
    _finder.folders += [folder for folder in folders if folder not in _finder.folders]
    PathFinder.invalidate_caches()


def plugin_folders() -> tuple[str, ...]:
    """The folders that named plug-ins are taken from."""
    return tuple(_finder.folders)


@contextmanager
def asked_for(module: str) -> Iterator[None]:
    """Let the module that a file or an option names be found in the folders.

    Args:
        module: its dotted name.
    """
    token = _asked.set(module.partition(".")[0])
    try:
        yield
    finally:
        _asked.reset(token)


@contextmanager
def safe_path() -> Iterator[None]:
    """Let processes of Python that start meanwhile not put the current folder before all others, as ``-c`` does."""
    before = os.environ.get(SAFE_PATH)
    os.environ[SAFE_PATH] = "1"
    try:
        yield
    finally:
        del os.environ[SAFE_PATH]
        if before is not None:
            os.environ[SAFE_PATH] = before


def drop_current_folder() -> None:
    """Take the current folder off the path where ``python -m`` has put it, unless this program itself lies there."""
    here, program = os.path.realpath(os.curdir), os.path.realpath(__file__)
    if sys.path and os.path.realpath(sys.path[0] or os.curdir) == here and not program.startswith(here + os.sep):
        del sys.path[0]
