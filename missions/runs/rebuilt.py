"""A world model put together again of the tables: blocks of rows, and when a vehicle had them and forgot them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from exchange.packets import guid_of
from worldmodel import Block, FaultCode, WorldModel, merge, tidy

Row = Mapping[str, Any]
GAVE_UP = frozenset({f"dropped block: {FaultCode.TIMED_OUT}", f"refused block: {FaultCode.CROWDED_OUT}"})
"""Kinds of faults by which a vehicle forgot blocks that it had heard; see ``remoras.radio``."""


def gave_up_s(faults: Iterable[Row], vehicle: str) -> list[float]:
    """When a vehicle forgot blocks that waited, by the table ``faults`` (s), in order."""
    return sorted({row["time_s"] for row in faults if row["vehicle"] == vehicle and row["kind"] in GAVE_UP})


def fill(
    model: WorldModel, known: Iterable[tuple[float, Block]], at_s: float, given_up_s: Iterable[float], frame_s: float
) -> None:
    """Let a model hold what a vehicle held.

    Merging has one outcome whatever the order. What was given up has none: so blocks go in in the order in which the
    vehicle had them, up to when it tidied, and then those that it had later.

    Args:
        model: that knows nothing.
        known: since when the vehicle had which blocks (s).
        at_s: the time for which it is asked (s).
        given_up_s: when it forgot blocks (s).
        frame_s: length of a TDMA frame, at the end of which vehicles tidy (s).
    """
    times_s = [time_s for time_s in given_up_s if time_s <= at_s]
    if model.pruning and at_s >= frame_s:
        times_s.append(max(*times_s, math.floor(at_s / frame_s) * frame_s, 0.0))
    rest = [(since_s, block) for since_s, block in known if since_s <= at_s]
    if times_s:
        rest.sort(key=lambda one: one[0])
    for time_s in times_s:
        n = sum(since_s <= time_s for since_s, _ in rest)
        for since_s, block in rest[:n]:
            merge(model, [block], since_s)
        rest = rest[n:]
        tidy(model, time_s)
    merge(model, (block for _, block in rest))


def blocks_of(rows: Iterable[Row]) -> Iterator[list[Row]]:
    """The rows of the table ``items`` block by block."""
    block: list[Row] = []
    for row in rows:
        if block and not _goes_on(block, row):
            yield block
            block = []
        block.append(row)
    if block:
        yield block


def _goes_on(block: Sequence[Row], row: Row) -> bool:
    """True if a row is of the same block as those before it; two statuses may have one name, but begin alike."""
    first = block[0]
    if "@" not in row["uid"]:
        return guid_of(row["uid"]) == guid_of(first["uid"])
    slot = row["subject"], row["attribute"]
    return (row["uid"], row["recorded_s"]) == (first["uid"], first["recorded_s"]) and slot != (
        first["subject"],
        first["attribute"],
    )
