"""Names that other tools take: vehicles may be called anything, topics, frames and files may not."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable


def topic_names(vehicles: Iterable[str]) -> dict[str, str]:
    """A name of lower-case letters, digits and ``_`` for every vehicle, for topics and frames of ROS.

    >>> topic_names(["AUV00", "auv00", "7 seas", "\\U0001f420"])
    {'AUV00': 'auv00', 'auv00': 'auv00_2', '7 seas': 'v7_seas', '\\U0001f420': 'vehicle'}
    """
    return _unlike(vehicles, lambda name: re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_"))


def file_names(vehicles: Iterable[str]) -> dict[str, str]:
    """A name of letters, digits, ``_`` and ``-`` for every vehicle; no two differ in capitals alone.

    >>> file_names(["AUV00", "a/b"])
    {'AUV00': 'AUV00', 'a/b': 'a_b'}
    """
    return _unlike(vehicles, lambda name: re.sub(r"[^A-Za-z0-9-]+", "_", name).strip("_"))


def _unlike(names: Iterable[str], simple: Callable[[str], str]) -> dict[str, str]:
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        short = stem = simple(name) or "vehicle"
        if stem[0].isdigit():
            short = stem = f"v{stem}"
        number = 2
        while short.lower() in taken:
            short, number = f"{stem}_{number}", number + 1
        taken.add(short.lower())
        found[name] = short
    return found
