"""Kinds of faults: what may befall a vehicle, each in one file of ``missions/faults`` that has its name.

A file there has a ``KIND``, a subclass of ``missions.scenarios.faults.DeclaredFault``: its keys of ``[[fault]]``, what
it leaves of a vehicle, what it does when it begins and ends, and what readers of results have to know of it. There is
no list of them: whoever puts a file there has a kind, and whoever takes it away has one less. One from outside is named
``package.module:Class`` and needs no file there.
"""

from __future__ import annotations

import importlib
import pkgutil
import re
from enum import StrEnum
from functools import cache
from typing import Any

KINDS_FOLDER = "missions.faults"
SEAM_OF_KINDS = "missions.scenarios.faults"
NAMED_KIND = re.compile(r"[\w.]+:\w+")
EMPTY = "energy"
"""Kind of the row in the table of faults of a vehicle whose battery is empty: it befalls by itself."""


class Absence(StrEnum):
    """How a vehicle is away while a fault holds: it does nothing, and is in nobody's way."""

    BEFORE = "before"
    """It has not been there yet."""
    LOSS = "loss"
    """It is out of the mission, and has no power where it is."""
    PAUSE = "pause"
    """It is off, and begins anew."""


@cache
def kinds() -> dict[str, Any]:
    """The kinds that are there, by name, in the order of their numbers."""
    names = sorted(module.name for module in pkgutil.iter_modules(importlib.import_module(KINDS_FOLDER).__path__))
    found = {name: importlib.import_module(f"{KINDS_FOLDER}.{name}").KIND for name in names}
    return dict(sorted(found.items(), key=lambda named: named[1].number_of(named[0])))


def kind_of_row(kind: str) -> Any:
    """The kind of a row in the table of faults; None if what it tells was not declared but went wrong by itself.

    Raises:
        PluginError: a kind from outside that cannot be had here.
    """
    if kind in kinds() or not NAMED_KIND.fullmatch(kind):
        return kinds().get(kind)
    return importlib.import_module(SEAM_OF_KINDS).kind_named(kind)


def absence(kind: str) -> Absence | None:
    """How a vehicle is away from a row in the table of faults on, by the kind of the row, until that is over.

    Raises:
        PluginError: see ``kind_of_row``.
    """
    if kind == EMPTY:
        return Absence.LOSS
    found = kind_of_row(kind)
    of_kind: Absence | None = None if found is None else found.ABSENCE
    return of_kind
