"""A world model put together again of the tables: blocks of rows, and when a vehicle had them and forgot them."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import count, takewhile
from operator import itemgetter
from typing import Any, NamedTuple, TypeVar

from exchange.packets import guid_of
from exchange.schedule import TdmaSchedule
from missions.fault import absence, kind_of_row
from remoras.faults import OVER
from remoras.organisation import Group
from remoras.social.agreement import Agreement
from worldmodel import Block, FaultCode, WorldModel, merge, tidy

T = TypeVar("T")
Row = Mapping[str, Any]
GAVE_UP = frozenset({f"dropped block: {FaultCode.TIMED_OUT}", f"refused block: {FaultCode.CROWDED_OUT}"})
"""Kinds of faults by which a vehicle forgot blocks that it had heard; see ``remoras.radio``."""


class RebuiltLife(NamedTuple):
    """A life of a vehicle.

    Attributes:
        from_s: when it began.
        epoch: how many there were before.
        remembers: True if it began with what the vehicle had known.
    """

    from_s: float
    epoch: int
    remembers: bool


def lives_of(faults: Iterable[Row], vehicle: str) -> list[RebuiltLife]:
    """The lives of a vehicle, by the table ``faults``."""
    lives, remembers = [RebuiltLife(0.0, 0, False)], dict[str, bool]()
    for row in (fault for fault in faults if fault["vehicle"] == vehicle):
        kind = row["kind"]
        if row["detail"] == OVER and kind in remembers:
            lives.append(RebuiltLife(row["time_s"], len(lives), remembers[kind]))
        elif (found := kind_of_row(kind)) is not None and (keeps := found.began_anew(row["detail"])) is not None:
            remembers[kind] = keeps
    return lives


def gave_up_s(faults: Iterable[Row], vehicle: str) -> list[float]:
    """When a vehicle forgot blocks that waited, by the table ``faults`` (s), in order."""
    return sorted({row["time_s"] for row in faults if row["vehicle"] == vehicle and row["kind"] in GAVE_UP})


def tidied_s(faults: Iterable[Row], vehicle: str, schedule: TdmaSchedule, end_s: float) -> list[float]:
    """When a vehicle tidied: at the ends of the TDMA frames of the mission in which it was there (s), in order.

    Args:
        faults: rows of the table ``faults``.
        vehicle: its name.
        schedule: TDMA.
        end_s: end of the mission (s); in the exchange that may follow nobody tidies.
    """
    changes = [
        (row["time_s"], -1 if row["detail"] == OVER else 1)
        for row in faults
        if row["vehicle"] == vehicle and absence(row["kind"])
    ]
    ends_s = (schedule.frame_start_s(frame) for frame in count(1))
    return [
        time_s
        for time_s in takewhile(lambda time: time <= end_s, ends_s)
        if not sum(change for since_s, change in changes if since_s <= time_s)
    ]


def fill(
    model: WorldModel,
    known: Iterable[tuple[float, Block]],
    at_s: float,
    given_up_s: Iterable[float],
    frame_ends_s: Iterable[float],
) -> None:
    """Let a model hold what a vehicle held.

    Merging has one outcome whatever the order. What was given up or pruned has none, since a ban keeps from pruning
    what it hides: so blocks go in in the order in which the vehicle had them, and it is tidied where the vehicle was.

    Args:
        model: that knows nothing.
        known: since when the vehicle had which blocks (s).
        at_s: the time for which it is asked (s).
        given_up_s: when it forgot blocks (s).
        frame_ends_s: when it tidied, before it recorded anything at that time (s).
    """
    rest = deque(sorted((arrival for arrival in known if arrival[0] <= at_s), key=itemgetter(0)))
    times_s = [(time_s, True) for time_s in given_up_s]
    if model.pruning:
        times_s += [(time_s, False) for time_s in frame_ends_s]
    for time_s, with_it in sorted(moment for moment in times_s if moment[0] <= at_s):
        while rest and (rest[0][0] <= time_s if with_it else rest[0][0] < time_s):
            since_s, block = rest.popleft()
            merge(model, [block], since_s)
        tidy(model, time_s)
    for since_s, block in rest:
        merge(model, [block], since_s)


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


def memories(lives: Sequence[RebuiltLife]) -> Iterator[tuple[float, float]]:
    """From when to when a vehicle kept in mind what it heard; a restart with its memory ends nothing."""
    begins_s = [life.from_s for life in lives if not life.remembers]
    yield from zip(begins_s, [*begins_s[1:], math.inf], strict=True)


def left_over(events: Iterable[tuple[T, bool]]) -> frozenset[T]:
    """What was put in (True) and has not been taken out (False) since."""
    members: set[T] = set()
    for member, is_in in events:
        (members.add if is_in else members.discard)(member)
    return frozenset(members)


def formed(agreement: Agreement, changes: Iterable[Row]) -> tuple[dict[str, Group], list[Row]]:
    """Groups that there are after changes of the organisation, and what they were given since they were formed last."""
    groups, given = dict(agreement.organisation.groups), list[Row]()
    for row in changes:
        name = row["group"]
        if row["event"] in ("formed", "dissolved"):
            groups.pop(name, None)
            given = [row for row in given if row["group"] != name or not row["issuer"]]
            if row["event"] == "formed":
                groups[name] = agreement.at_sea[name]
        elif row["event"] == "given":
            given.append(row)
    return groups, given
