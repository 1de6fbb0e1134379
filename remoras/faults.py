"""Faults of vehicles: when they hold, and their effect on a vehicle.

What kinds there are nobody here knows: a kind says what condition it leaves a vehicle in.

The schedule of a run is a pure function of (declared faults, seed, agreement). Each draw is keyed by the kind, whom it
is about, and how many faults of that description stand before it. So no draw is shifted by loss rate or strategy, by a
fault that is added behind the others, or by one of another description, wherever it stands. Of two rates the higher
never comes later.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from exchange.acoustics import loss
from exchange.arithmetic import log1p
from remoras.condition import SOUND, Condition
from remoras.database import AUVDatabase, VehicleData
from remoras.events import Host, Observer, Priority
from remoras.organisation import Group, Organisation

ANY = "any"
"""Stands for a vehicle that is drawn among those that a fault may befall."""
HEAD_OF = "head of "
"""Before the name of a group: the vehicle that was agreed to lead it before the mission."""
OVER = "over"
"""Detail in the table of faults when a fault is over."""

_SELECTORS = 1 << 16
"""Numbers of whom a fault is about: 0 for any, then the nodes, and from half of this on the heads of groups."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault of one vehicle in one run.

    Attributes:
        kind: name of its kind; vehicle: that it befalls.
        from_s: when it begins to hold; until_s: when it is over, infinite for good.
        leaves: what it leaves of the vehicle meanwhile.
        detail: what the table of faults says when it begins.
        remembers: the vehicle begins anew when it is over, and then still knows what it knew; None if it goes on.
    """

    kind: str
    vehicle: str
    from_s: float
    until_s: float = math.inf
    leaves: Condition = SOUND
    detail: str = ""
    remembers: bool | None = None


class Declared(Protocol):
    """A fault as a scenario declares it, before anything is drawn."""

    @property
    def vehicle(self) -> str:
        """Name of the vehicle, ``any``, or ``head of GROUP``."""
        ...

    @property
    def number(self) -> int:
        """Of its kind; each has its own, below 2^25."""
        ...

    @property
    def sensor_meant(self) -> str | None:
        """Name of the sensor that it is about; None if it is about none, or all."""
        ...

    @property
    def span_s(self) -> tuple[float, float] | None:
        """Earliest and latest time at which it begins (s); None if a rate says when."""
        ...

    @property
    def rate_per_h(self) -> float | None:
        """Of the first such event, in faults per hour; None with a time."""
        ...

    def able(self, database: AUVDatabase, groups: Mapping[str, Group]) -> list[VehicleData]:
        """Vehicles among which ``any`` is drawn, in the order of the nodes."""
        ...

    def befalling(self, data: VehicleData, at_s: float) -> Fault:
        """The fault as it befalls a vehicle at a time (s)."""
        ...


def condition_under(faults: Iterable[Fault]) -> Condition:
    """The condition of a vehicle while all these faults of it hold.

    Args:
        faults: of one vehicle.

    >>> one, other = Condition(speed_factor=0.5), Condition(is_mute=True)
    >>> condition_under(Fault("mine", "AUV00", 0.0, leaves=left) for left in (one, one, other)).speed_factor
    0.25
    """
    holding = tuple(faults)
    left = [fault.leaves for fault in holding]
    out_of_contact = [fault for fault in holding if not fault.leaves.is_in_contact]
    for_good = [fault.leaves for fault in holding if math.isinf(fault.until_s)]
    return Condition(
        is_there=all(condition.is_there for condition in left),
        is_running=all(condition.is_running for condition in left),
        is_mute=any(condition.is_mute for condition in left),
        is_deaf=any(condition.is_deaf for condition in left),
        speed_factor=math.prod(condition.speed_factor for condition in left),
        dead_sensors=frozenset(name for condition in left for name in condition.dead_sensors),
        drain_w=math.fsum(condition.drain_w for condition in left),
        readings=tuple(change for condition in left for change in condition.readings),
        lost_for_good=not all(condition.is_alive for condition in for_good),
        will_return=bool(out_of_contact) and all(math.isfinite(fault.until_s) for fault in out_of_contact),
        dead_for_good=frozenset(name for condition in for_good for name in condition.dead_sensors),
    )


@dataclass(frozen=True, slots=True)
class FaultChanges:
    """A fault begins to hold, or is over; others of the vehicle hold as they did.

    Attributes:
        holding: faults of the run that hold now, by the name of the vehicle.
    """

    fault: Fault
    begins: bool
    holding: dict[str, list[Fault]]

    def act(self, host: Host) -> None:
        """Let it hold from now on, or no longer."""
        fault, vehicle = self.fault, host.named(self.fault.vehicle)
        holding = self.holding.setdefault(fault.vehicle, [])
        if self.begins:
            holding.append(fault)
        else:
            holding.remove(fault)
            if fault.remembers is not None and not vehicle.functional.exhausted:
                vehicle = host.restart(vehicle, fault.remembers)
        vehicle.suffer(condition_under(holding))
        detail = fault.detail if self.begins else OVER
        host.recorder.faults.append((host.now_s, fault.vehicle, fault.kind, detail))


class Faults(Observer):
    """Lets faults befall the vehicles of a run.

    Args:
        faults: of the run.
    """

    def __init__(self, faults: Iterable[Fault]) -> None:
        self._faults = tuple(faults)

    def on_start(self, host: Host) -> None:
        """Schedule when each begins and when it is over."""
        holding: dict[str, list[Fault]] = {}
        for fault in self._faults:
            host.at(fault.from_s, Priority.FAULT, FaultChanges(fault, True, holding))
            host.at(fault.until_s, Priority.FAULT, FaultChanges(fault, False, holding))


def hears_throughout(faults: Iterable[Fault], vehicle: str, from_s: float, until_s: float) -> bool:
    """True if no fault keeps the vehicle from hearing at any time of a packet.

    Args:
        faults: of the run.
        vehicle: who is to hear.
        from_s: start of the packet; until_s: its end where the vehicle is.
    """
    for fault in faults:
        is_early = from_s < fault.until_s
        if fault.vehicle == vehicle and fault.from_s <= until_s and is_early and not fault.leaves.hears:
            return False
    return True


def drawn(
    faults: Sequence[Declared], seed: int, database: AUVDatabase, organisation: Organisation, duration_s: float
) -> tuple[Fault, ...]:
    """The faults of one run, in the order in which they begin to hold.

    What would begin after the mission, or after it were over, does not happen.

    Args:
        faults: as the scenario declares them, in its order.
        seed: root of the draws.
        database: of all vehicles.
        organisation: as agreed before the mission.
        duration_s: of the mission.
    """
    known = {name: number for number, name in enumerate(dict.fromkeys(_all_sensors(database)), 1)}
    counts: Counter[int] = Counter()
    found: list[tuple[tuple[float, int, int, float], Fault]] = []
    for one in faults:
        number = one.number * _SELECTORS + _selector(one.vehicle, database, organisation)
        stream = number * _SELECTORS + known.get(one.sensor_meant or "", 0)
        nth = counts[stream]
        counts[stream] += 1
        at_s = _time_s(one, seed, stream, nth)
        data = database[_name(one, seed, stream, nth, database, organisation)]
        fault = one.befalling(data, at_s)
        if fault.from_s < min(duration_s, fault.until_s):
            found.append(((fault.from_s, data.node, one.number, at_s), fault))
    return tuple(fault for _, fault in sorted(found, key=lambda dated: dated[0]))


def _selector(vehicle: str, database: AUVDatabase, organisation: Organisation) -> int:
    """Number of whom a fault is about; the same whatever vehicles and groups are called."""
    if vehicle in database:
        return database[vehicle].node + 1
    return 0 if vehicle == ANY else _SELECTORS // 2 + list(organisation.groups).index(vehicle.removeprefix(HEAD_OF))


def _time_s(fault: Declared, seed: int, stream: int, nth: int) -> float:
    """When the fault begins; drawn unless the scenario says it exactly."""
    earliest_s, latest_s = fault.span_s or (0.0, 0.0)
    if fault.rate_per_h is None and earliest_s == latest_s:
        return earliest_s
    share = loss.uniform(seed, loss.FAULTS, stream, nth, 0)
    if fault.rate_per_h is not None:
        return -3600.0 * log1p(-share) / fault.rate_per_h
    return earliest_s + share * (latest_s - earliest_s)


def _name(fault: Declared, seed: int, stream: int, nth: int, database: AUVDatabase, organisation: Organisation) -> str:
    """Whom a fault is about; the n-th ``any`` of a kind is the n-th vehicle of one drawn order, so all differ."""
    if fault.vehicle in database:
        return fault.vehicle
    if fault.vehicle != ANY:
        heads = organisation.heads(fault.vehicle.removeprefix(HEAD_OF))
        return min(heads, key=lambda name: database[name].node)
    able = fault.able(database, organisation.groups)
    order = sorted(able, key=lambda data: loss.uniform(seed, loss.FAULTS, stream, 0, data.node + 1))
    return order[nth].name


def _all_sensors(database: AUVDatabase) -> list[str]:
    return [settings.name for data in database.values() for settings in data.sensors]
