"""Decisions of vehicles, from the rows of the table ``decisions``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

Row = Mapping[str, Any]
Key = tuple[str, str, str, str, tuple[str, ...]]  # group, role, objective, argument, activities


class Decision(NamedTuple):
    """Weighed activity sets; ``acts`` are the chosen ones, without permanent activities."""

    time_s: float
    vehicle: str
    rows: list[Row]
    acts: dict[Key, Row]


def key_of(row: Row) -> Key:
    """Return the identity of an activity set, independent of its motivation."""
    return row["group"], row["role"], row["objective"], row["argument"], tuple(row["activities"])


def motivation_of(row: Row) -> float:
    """Return the motivation of an activity set."""
    return float(row["own"] + row["external"])


def decisions_of(rows: Iterable[Row]) -> Iterator[Decision]:
    """Yield decisions in the order of the rows; of several of a vehicle at one time, the last."""
    decided: dict[tuple[float, str], list[Row]] = {}
    for row in rows:
        own = decided.setdefault((row["time_s"], row["vehicle"]), [])
        # Rows of a decision are in the order of its sets, of which permanent ones come first.
        if own and key_of(own[0]) == key_of(row):
            own.clear()
        own.append(row)
    for (time_s, vehicle), own in decided.items():
        acts = {key_of(row): row for row in own if row["chosen"] and (row["role"] or row["best_mean"] is None)}
        yield Decision(time_s, vehicle, own, acts)
