"""What is in an object, all the way down, as values that can be compared later: so that a change in it is seen."""

from collections.abc import Mapping
from typing import Any


def picture_of(value: Any, seen: dict[int, int] | None = None) -> Any:
    """An object's content, all the way down, as values that can be compared later.

    Args:
        value: to be looked into; objects may share others, or refer back to themselves.
        seen: number of each object that was looked into before, by its identity; it stands for the object from then on.
    """
    seen = {} if seen is None else seen
    if value is None or isinstance(value, str | int | float | bool | bytes | type):
        return value
    if isinstance(value, list | tuple):
        return [picture_of(item, seen) for item in value]
    if isinstance(value, set | frozenset):
        return sorted(repr(item) for item in value)
    is_mapping = isinstance(value, Mapping)
    if not is_mapping and (callable(value) or not hasattr(value, "__dict__")):
        return type(value).__name__
    if id(value) in seen:
        return f"object {seen[id(value)]}"
    seen[id(value)] = len(seen)
    parts = {repr(key): one for key, one in value.items()} if is_mapping else vars(value)
    return {name: picture_of(part, seen) for name, part in parts.items()}


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
