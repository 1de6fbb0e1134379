"""Steering: faults come when something rare is under way, and to whom it concerns.

Drawn evenly over a mission, few faults meet the second in which a head gives a role, or a group is about to gather.
The run without faults says when these are (its instants). Half of the schedules have one of them in focus, each kind
of instant as often as any other: most of their faults begin just before, at, or just after it, and half of these befall
the vehicle that it is about. Production code has no part in this; FoundationDB's simulator has such places in its code.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from remoras.mission import Milestone
from remoras.recorder import Recorder
from stress.draws import STEERING, Draws
from stress.kinds import Family, kind_of
from stress.schedule import StressFault, excludes

P_FOCUS, P_NEAR, P_CONCERNED = 0.5, 0.7, 0.5
"""Shares of schedules with an instant in focus, of their faults that come near it, of these that befall whom it is
about."""
NEAR_S = (-20.0, -6.0, -2.0, -0.5, 0.0, 0.5, 2.0, 6.0)
"""When such a fault begins, from the instant on: some frames before it to some after."""
HEAL_AFTER_S = 30.0
"""What is transient lasts at least until so long after the instant in focus."""
MOST_OF_A_SORT = 6


class Instant(NamedTuple):
    """When something rare was under way without faults: what, and the vehicle that it is about, if any."""

    at_s: float
    sort: str
    vehicle: str = ""


def instants_of(recorder: Recorder, milestones: Sequence[Milestone], ended_s: float) -> tuple[Instant, ...]:
    """Instants of a run, in time order, at most six of a sort."""
    kept: dict[str, list[Instant]] = {}
    for instant in sorted({*_instants(recorder, milestones, ended_s)}):
        kept.setdefault(instant.sort, []).append(instant)
    return tuple(sorted(instant for found in kept.values() for instant in _spread(found)))


def _instants(recorder: Recorder, milestones: Sequence[Milestone], ended_s: float) -> Iterator[Instant]:
    for milestone in milestones:
        yield Instant(milestone.time_s, milestone.name, milestone.vehicle or "")
    for time_s, vehicle, _, _, event in recorder.roles:
        if time_s > 0.0 and event in ("assigned", "left"):
            yield Instant(time_s, f"role {event}", vehicle)
    for row in recorder.organisation:
        if row[0] > 0.0 and row[5] in ("given", "assigned") and row[6]:
            yield Instant(row[0], f"act {row[5]}", row[6])  # whose will it is
    for time_s, vehicle, _, event in recorder.membership:
        yield Instant(time_s, f"taken for {event}", vehicle)
    if recorder.packets:
        yield Instant(recorder.packets[0][1], "first packet", recorder.packets[0][2])
        yield Instant(recorder.packets[-1][1], "last packet", recorder.packets[-1][2])
    yield Instant(ended_s, "end")


def _spread(found: Sequence[Instant]) -> Sequence[Instant]:
    """At most six of them, evenly, with the first and the last."""
    if len(found) <= MOST_OF_A_SORT:
        return found
    return [found[index * (len(found) - 1) // (MOST_OF_A_SORT - 1)] for index in range(MOST_OF_A_SORT)]


def steered(
    instants: Sequence[Instant], seed: int, heal_s: float, faults: Sequence[StressFault], sensing: Sequence[str]
) -> tuple[float, list[StressFault]]:
    """When all heals, and the faults, of a schedule with an instant in focus; as they are in one without.

    Args:
        instants: of the run without faults.
        seed: of the schedule.
        heal_s: when what is transient is over (s).
        faults: as they were drawn.
        sensing: names of the vehicles with sensors.
    """
    draws = Draws(seed, 0, STEERING)
    if draws.uniform() >= P_FOCUS:
        return heal_s, list(faults)
    sort = draws.one_of(sorted({instant.sort for instant in instants}))
    focus = draws.one_of([instant for instant in instants if instant.sort == sort])
    heal_s = round(max(heal_s, focus.at_s + HEAL_AFTER_S), 1)
    found: list[StressFault] = []
    for number, fault in enumerate(faults, 1):
        own = Draws(seed, number, STEERING)
        is_near, is_concerned = own.uniform() < P_NEAR, own.uniform() < P_CONCERNED
        after_s, is_long = own.one_of(NEAR_S), own.uniform() < 0.5
        changed = fault
        if is_near:
            changed = _moved(fault, max(1.0, round(focus.at_s + after_s, 1)), heal_s, is_long)
        if is_near and is_concerned and _may_befall(changed, focus.vehicle, sensing):
            changed = changed.model_copy(update={"vehicle": focus.vehicle})
        found += [added for added in (changed, fault) if not any(excludes(added, other) for other in found)][:1]
    return heal_s, found


def _moved(fault: StressFault, at_s: float, heal_s: float, is_long: bool) -> StressFault:
    """A fault that begins at a time, and is over before all heals: at once, or as late as that."""
    kind = kind_of(fault.kind)
    if kind.is_of_start or (fault.until_s is None and not kind.is_sudden and not fault.is_permanent):
        return fault
    if fault.until_s is None:
        return fault.model_copy(update={"at_s": at_s})
    until_s = heal_s if is_long else min(heal_s, round(at_s + fault.until_s - fault.at_s, 1))
    return fault.model_copy(update={"at_s": at_s, "until_s": until_s}) if at_s < until_s else fault


def _may_befall(fault: StressFault, vehicle: str, sensing: Sequence[str]) -> bool:
    """True if a fault may befall a vehicle in place of the one that it was drawn for; what stays is of one alone."""
    if not vehicle or not fault.vehicle or fault.is_permanent or vehicle == fault.peer:
        return False
    return kind_of(fault.kind).family is not Family.SENSOR or vehicle in sensing
