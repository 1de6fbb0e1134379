"""What is in an object, all the way down, as values that can be compared later: so that a change in it is seen."""

from collections.abc import Mapping
from typing import Any

MAX_DEPTH = 12


def picture_of(value: Any, depth: int = 0) -> Any:
    """An object's content, all the way down, as values that can be compared later."""
    if depth > MAX_DEPTH or value is None or isinstance(value, str | int | float | bool | bytes | type):
        return value
    if isinstance(value, Mapping):
        return {repr(key): picture_of(one, depth + 1) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [picture_of(one, depth + 1) for one in value]
    if isinstance(value, set | frozenset):
        return sorted(repr(one) for one in value)
    if hasattr(value, "__dict__") and not callable(value):
        return {name: picture_of(one, depth + 1) for name, one in vars(value).items()}
    return type(value).__name__


def difference(before: Any, after: Any, path: str) -> str:
    """Where two pictures differ first; empty if they do not."""
    if isinstance(before, dict) and isinstance(after, dict):
        for name in [*before, *(name for name in after if name not in before)]:
            inner = f"{path}.{name}"
            if (name in before) != (name in after):
                return inner
            if found := difference(before[name], after[name], inner):
                return found
        return ""
    if before == after:
        return ""
    return path
