"""Which packets of a run were refused as they arrived, and by whom."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

NUMBERS = re.compile(r"\d+(\.\d+)?")


def kind_of(reason: str) -> str:
    """A reason without its numbers, by which refusals are counted.

    >>> kind_of("a packet of node 2 of slot 17 arrives in slot 19.5")
    'a packet of node n of slot n arrives in slot n'
    """
    return NUMBERS.sub("n", reason)


def packets_refused(
    packets: Sequence[Mapping[str, Any]], refusals: Iterable[Mapping[str, Any]]
) -> Iterator[tuple[int, str]]:
    """Number of each packet that was refused, and the vehicle that refused it.

    What a refused packet says of itself may be wrong, so a packet is found by the time at which it arrived, else by its
    slot. A refusal of what no vehicle of the run sent belongs to none.

    Args:
        packets: rows of the table ``packets``.
        refusals: rows of the table ``refused``.
    """
    arrived: dict[tuple[str, float], int] = {}
    slots: dict[tuple[str, int], int] = {}
    for at, row in enumerate(packets):
        times_s = row.get("arrivals_s") or [None] * len(row["receivers"])
        for receiver, time_s in zip(row["receivers"], times_s, strict=True):
            slots[receiver, row["slot"]] = at
            if time_s is not None:
                arrived[receiver, time_s] = at
    for row in refusals:
        vehicle = row["vehicle"]
        found = arrived.get((vehicle, row["time_s"]), slots.get((vehicle, row["slot"])))
        if found is not None:
            yield found, vehicle
