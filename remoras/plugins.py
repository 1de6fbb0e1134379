"""Plug-ins: objects that a scenario names as ``package.module:object``, and what they have to have.

There is no registry. A Python caller passes the object; a file names it; ``faults_of`` says what it lacks of its seam.
Where the environment has ``REMORAS_NO_PLUGINS``, which worker processes inherit, only shipped objects are loaded.
"""

from __future__ import annotations

import importlib
import inspect
import os
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from remoras.errors import PluginError
from remoras.plugin_folders import asked_for

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
