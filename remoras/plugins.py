"""Plug-ins: objects named by module or file, without a registry.

With ``REMORAS_NO_PLUGINS``, inherited by worker processes, only shipped objects are loaded. A folder on Python's path
serves all imports: a library's ``import orjson`` would get a file of that name. Plug-in folders are therefore not on
the path. A finder after all others loads from them only the module that is ``asked_for`` and imports made by modules
that came from a folder. Installed packages take precedence.

A distribution names its plug-ins by entry points ``KIND.NAME = package.module:object``. A scenario stores the object.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from traceback import walk_tb
from types import ModuleType
from typing import Any, Final, NamedTuple, TypeVar

from remoras.errors import PluginError

NO_PLUGINS = "REMORAS_NO_PLUGINS"
"""Environment variable that allows only shipped code, if not empty."""
SHIPPED = frozenset({"worldmodel", "exchange", "remoras", "missions", "visualisation"})


GROUP = "remoras.plugins"
"""Group of entry points."""
RAISED: Final = (Exception, SystemExit)
"""Exceptions of plug-in code; interruptions by the user pass."""
INSTALLED_KINDS = ("strategy", "mission", "sensor", "metric", "figure", "channel", "policy", "fault", "feature")


class Installed(NamedTuple):
    """Plug-in of an installed distribution (name and version); ``reference`` names its object."""

    kind: str
    name: str
    reference: str
    distribution: str

    def __str__(self) -> str:
        return f"{self.reference} of {self.distribution}"


def installed_plugins() -> tuple[Installed, ...]:
    """Return the plug-ins of installed distributions, sorted; none if only shipped code is allowed."""
    # Reading the metadata of all distributions takes four times as long.
    files = (file for folder in sys.path for file in Path(folder).glob("*-info/entry_points.txt"))
    if os.environ.get(NO_PLUGINS) or not any(map(_has_group, files)):
        return ()
    from importlib.metadata import entry_points

    return tuple(
        sorted(
            Installed(*point.name.partition(".")[::2], point.value, f"{point.dist.name} {point.dist.version}")
            for point in entry_points(group=GROUP)
            if point.dist is not None
        )
    )


def _has_group(file: Path) -> bool:
    try:
        return f"[{GROUP}]".encode() in file.read_bytes()
    except OSError:  # unreadable, as for importlib
        return False


def installed(kind: str, name: str) -> str:
    """Return the reference of an installed plug-in, ``name`` itself if there is none; PluginError for two."""
    if ":" in name:
        return name
    found = [plugin for plugin in installed_plugins() if (plugin.kind, plugin.name) == (kind, name)]
    if len(found) > 1:
        raise PluginError(f"{kind} {name} is {' and '.join(map(str, found))}; name one of the objects, or remove one")
    return found[0].reference if found else name


def refuse_unshipped(module: str, named: str) -> None:
    """Raise PluginError for a module outside ``SHIPPED`` if only shipped code is allowed."""
    if os.environ.get(NO_PLUGINS) and module.partition(".")[0] not in SHIPPED:
        raise PluginError(
            f"{named} is not shipped, and no other code is loaded with --no-plugins; allowed: shipped code"
        )


def named_object(reference: str) -> Any:
    """Return the object named ``package.module:object``; raise PluginError on any failure."""
    module, colon, name = reference.partition(":")
    if not (module and colon and name):
        raise PluginError(f"{reference!r} names no object; allowed: package.module:object")
    refuse_unshipped(module, reference)
    try:
        with asked_for(module):
            imported = importlib.import_module(module)
            named = getattr(imported, name, None)
    except RAISED as error:
        raise PluginError(f"package.module:object that can be imported ({named_error(error)})") from error
    if named is None:
        from worldmodel import suggestion  # loaded for mistyped names only

        allowed = _shortened(", ".join(_objects_of(imported)) or "none")
        raise PluginError(f"an object of {module} ({allowed}), which has no {name}{suggestion(name, dir(imported))}")
    # A shipped module may only import the object, or make it by a class from elsewhere.
    refuse_unshipped(_home(named), reference)
    return named


def _home(value: Any) -> str:
    """Module of a class or function, else of the class of an object."""
    return str((value if _is_defined(value) else type(value)).__module__)


def _is_defined(value: Any) -> bool:
    return inspect.isroutine(value) or isinstance(value, type)


def _objects_of(module: ModuleType) -> Iterator[str]:
    """Yield the public classes and functions that a module defines, and its objects of classes not of Python itself."""
    for name, value in vars(module).items():
        is_made = not _is_defined(value) and _home(value).partition(".")[0] not in sys.stdlib_module_names
        if not name.startswith("_") and (is_made or _home(value) == module.__name__):
            yield name


def instance_of(loaded: Any, name: str) -> Any:
    """Return an object, made without arguments if a class is named; PluginError if the class raises."""
    if not isinstance(loaded, type):
        return loaded
    try:
        return loaded()
    except RAISED as error:
        why = f"{name} raised {named_error(error)}"
        raise PluginError(f"a class that needs no arguments, or an object; {why}") from error


def known_or_named(kind: str, name: str, known: Mapping[str, Any], *more: str) -> Any:
    """Return the object ``known`` by a name, or named by its module; else raise PluginError."""
    if ":" in name:
        return named_object(name)
    if name not in known:
        raise PluginError(allowed_names(kind, name, known, *more))
    return known[name]


def allowed_names(kind: str, name: str, known: Iterable[str], *more: str) -> str:
    """Return the message of allowed names of a kind of plug-in, shipped and installed, with the nearest to ``name``."""
    from worldmodel import suggestion  # loaded for mistyped names only

    names = list(dict.fromkeys((*known, *(plugin.name for plugin in installed_plugins() if plugin.kind == kind))))
    return f"allowed: {', '.join([*names, *more])}{suggestion(name, names)}"


def refuse(what: str, faults: Iterable[str]) -> None:
    """Raise PluginError for an object (``what``) with faults."""
    if text := "; ".join(faults):
        raise PluginError(f"{what}: {text}")


def refuse_other(candidate: Any, base: type, name: str) -> None:
    """Raise PluginError for any object except a subclass of ``base``; ``name`` is that of users."""
    if not (isinstance(candidate, type) and issubclass(candidate, base)):
        kind = f"class {candidate.__name__}" if isinstance(candidate, type) else f"object of {type(candidate).__name__}"
        raise PluginError(f"a subclass of {name} is needed, not the {kind}")


def faults_of(candidate: Any, seam: type, compulsory: tuple[str, ...]) -> Iterator[str]:
    """Yield violations of the interface ``seam`` with ``compulsory`` members, as text."""
    missing = [name for name in compulsory if not hasattr(candidate, name)]
    missing += sorted(getattr(candidate, "__abstractmethods__", frozenset()) - set(missing))
    lacking: dict[type, list[str]] = {}
    for name in missing:
        asks = [base for base in getattr(candidate, "__mro__", ()) if name in vars(base) and base not in seam.__mro__]
        lacking.setdefault(asks[0] if asks else seam, []).append(name)
    for asking, names in lacking.items():
        yield f"lacks {', '.join(names)} of {asking.__module__}.{asking.__qualname__}"
    for name in compulsory:
        wanted, member = getattr(seam, name, None), getattr(candidate, name, None)
        if inspect.isroutine(wanted) and name not in missing:
            if not callable(member):
                yield f"{name} is {type(member).__name__}, not a function"
            elif (text := _signature_fault(name, wanted, member, isinstance(candidate, type))) is not None:
                yield text


def _signature_fault(name: str, wanted: Callable[..., Any], offered: Callable[..., Any], is_class: bool) -> str | None:
    parameters = [p for p in inspect.signature(wanted).parameters if p not in ("self", "cls")]
    try:
        own = inspect.signature(offered)
    except (TypeError, ValueError):
        return None
    is_plain = is_class and inspect.isfunction(inspect.getattr_static(offered, "__func__", offered))
    takes_self = is_plain and not inspect.ismethod(offered) and next(iter(own.parameters), "") == "self"
    try:
        own.bind(*([None] if takes_self else []), *[None] * len(parameters))
    except TypeError:
        return f"{name}{own} cannot be called as {name}({', '.join(parameters)})"
    return None


LONGEST_TEXT = 120
Answer = TypeVar("Answer")


def _shortened(text: str) -> str:
    return text if len(text) <= LONGEST_TEXT else text[:LONGEST_TEXT] + "..."


def named_error(error: BaseException) -> str:
    """Return kind and text of an exception, and its place in a user's file: the last line called there.

    >>> print(named_error(ValueError("too deep")))
    ValueError: too deep
    """
    text = f"{type(error).__name__}: {_shortened(' '.join(str(error).split()))}"
    others = SHIPPED | sys.stdlib_module_names
    theirs = [
        (Path(frame.f_code.co_filename), line) for frame, line in walk_tb(error.__traceback__)
        if str(frame.f_globals.get("__name__")).partition(".")[0] not in others
    ]  # fmt: skip
    # An installed package counts only where the plug-in is one.
    for file, line in [place for place in theirs if "site-packages" not in place[0].parts][-1:] or theirs[-1:]:
        text += f", in {file.name}, line {line}"
    return text


def broken_promise(who: str, part: str, expected: str, result: object) -> PluginError:
    """Return the error for a plug-in function that raised, or returned a wrong ``result``.

    >>> print(broken_promise("strategy mine", "form", "an Organisation", None))
    strategy mine: form returned None; expected: an Organisation
    """
    came = f"returned {_shortened(repr(result))}"
    if isinstance(result, RAISED):
        came = f"raised {named_error(result)}"
    return PluginError(f"{who}: {part} {came}; expected: {expected}")


def answer(
    who: str, part: str, expected: str, is_expected: type | Callable[[Any], bool], asked: Callable[[], Answer]
) -> Answer:
    """Return the result of a plug-in call; PluginError if it raises, is of another type or else not as expected."""
    try:
        value = asked()
        sound = isinstance(value, is_expected) if isinstance(is_expected, type) else is_expected(value)
    except PluginError:
        raise
    except RAISED as error:
        raise broken_promise(who, part, expected, error) from error
    if not sound:
        raise broken_promise(who, part, expected, value)
    return value


def docstring(documented: Any) -> str:
    """Return the docstring of a module or function; ``python -OO`` drops it, so there from its source."""
    if text := inspect.getdoc(documented):
        return text
    source: Any = ast.parse(inspect.getsource(documented))
    return ast.get_docstring(source if inspect.ismodule(documented) else source.body[0]) or ""


SAFE_PATH: Final = "PYTHONSAFEPATH"
"""Environment variable that keeps the current folder off the start of Python's path."""
IMPORT_SYSTEM = frozenset({"_frozen_importlib", "_frozen_importlib_external", "importlib"})
_asked: ContextVar[str] = ContextVar("_asked", default="")


class PluginFolders:
    """Import finder for plug-in folders."""

    def __init__(self) -> None:
        self.folders: list[str] = []
        self._found_in: dict[str, str] = {}

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the spec of a module not found elsewhere; arguments as in ``importlib``."""
        if path is not None or not self.folders:  # submodules are found in their package
            return None
        home = self._found_in.get(_importer())
        for folder in self.folders if fullname == _asked.get() else [] if home is None else [home]:
            spec = PathFinder.find_spec(fullname, [folder])
            if spec is not None:
                self._found_in[fullname] = folder
                return spec
        return None


def _importer() -> str:
    frame = sys._getframe(1).f_back
    while frame is not None:
        top = str(frame.f_globals.get("__name__", "")).partition(".")[0]
        if top not in IMPORT_SYSTEM:
            return top
        frame = frame.f_back
    return ""


_finder = PluginFolders()


def look_in(folders: Sequence[str]) -> None:
    """Append absolute paths of plug-in folders."""
    if _finder not in sys.meta_path:
        sys.meta_path.append(_finder)
    _finder.folders += [folder for folder in folders if folder not in _finder.folders]
    PathFinder.invalidate_caches()


def plugin_folders() -> tuple[str, ...]:
    """Return the plug-in folders."""
    return tuple(_finder.folders)


@contextmanager
def asked_for(module: str) -> Iterator[None]:
    """Allow import of the named module from plug-in folders inside the context."""
    token = _asked.set(module.partition(".")[0])
    try:
        yield
    finally:
        _asked.reset(token)


@contextmanager
def switched_on(variable: str) -> Iterator[None]:
    """Set an environment variable to 1 inside the context, also for processes started there."""
    before = os.environ.get(variable)
    os.environ[variable] = "1"
    try:
        yield
    finally:
        del os.environ[variable]
        if before is not None:
            os.environ[variable] = before


def drop_current_folder() -> None:
    """Remove the current folder, if it is not the program's, from the path of ``python -m``."""
    here, program = os.path.realpath(os.curdir), os.path.realpath(__file__)
    # There any file named like a library would be imported in its place.
    if sys.path and os.path.realpath(sys.path[0] or os.curdir) == here and not program.startswith(here + os.sep):
        del sys.path[0]
