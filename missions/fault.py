"""Kinds of vehicle faults, one file each in ``missions/faults``, which defines ``KIND``, a ``DeclaredFault``."""

from __future__ import annotations

import importlib
import pkgutil
from collections import Counter
from collections.abc import Iterable, Iterator
from enum import StrEnum
from functools import cache
from typing import Any

from missions.files import is_reference

KINDS_FOLDER = "missions.faults"
SEAM_OF_KINDS = "missions.scenarios.faults"
EMPTY = "energy"  # kind of table row for an empty battery, which needs no declaration

OVER = "over"  # detail of a row in the table of faults at the end of a fault


class Absence(StrEnum):
    """Absence of a vehicle during a fault: inactive, and no obstacle.

    >>> absence("lost") is Absence.LOSS, absence("mute")
    (True, None)
    """

    BEFORE = "before"
    """Not deployed yet."""
    LOSS = "loss"
    """Lost, without power."""
    PAUSE = "pause"
    """Off; it restarts."""


@cache  # 20 ms of imports, asked for each fault
def kinds() -> dict[str, Any]:
    """Return the available kinds by name, in order of their numbers."""
    names = sorted(module.name for module in pkgutil.iter_modules(importlib.import_module(KINDS_FOLDER).__path__))
    by_name = {name: importlib.import_module(f"{KINDS_FOLDER}.{name}").KIND for name in names}
    return dict(sorted(by_name.items(), key=lambda named: named[1].number_of(named[0])))


def kind_of_row(kind: str) -> Any:
    """Return the kind of a row in the fault table; None for an undeclared failure, PluginError if unavailable."""
    if kind in kinds() or not is_reference(kind):
        return kinds().get(kind)
    return importlib.import_module(SEAM_OF_KINDS).kind_named(kind)


def absence(kind: str) -> Absence | None:
    """Return the absence that a fault of this kind starts; None if the vehicle stays active."""
    if kind == EMPTY:
        return Absence.LOSS
    declared = kind_of_row(kind)
    of_kind: Absence | None = None if declared is None else declared.ABSENCE
    return of_kind


def absences(faults: Iterable[tuple[float, str, str, str]]) -> Iterator[tuple[float, str, bool]]:
    """Yield time (s), vehicle and whether it is absent from then on, from rows of the table of faults."""
    n_faults: Counter[str] = Counter()
    for time_s, vehicle, kind, detail in faults:
        if absence(kind) is None:
            continue
        # Faults of a vehicle may overlap: it is present again once all are over.
        before = n_faults[vehicle]
        n_faults[vehicle] += -1 if detail == OVER else 1
        if (before == 0) != (n_faults[vehicle] == 0):
            yield time_s, vehicle, n_faults[vehicle] != 0
