"""Faults of vehicles: what a scenario declares, what one run draws of it, and what is left of a vehicle meanwhile.

The schedule of a run is a pure function of (declared faults, seed, agreement). Each draw is keyed by the kind, whom it
is about, and how many faults of that description stand before it. So no draw is shifted by loss rate or strategy, by a
fault that is added behind the others, or by one of another description, wherever it stands. Of two rates the higher
never comes later.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from exchange.acoustics import loss
from exchange.arithmetic import log1p
from remoras.database import AUVDatabase, VehicleData
from remoras.organisation import Group, Organisation

ANY = "any"
"""Stands for a vehicle that is drawn among those of ``able_to_work``."""
HEAD_OF = "head of "
"""Before the name of a group: the vehicle that was agreed to lead it before the mission."""
SLOW_FACTOR = 0.5
"""Speed of a slow vehicle as a share of its usual one, unless the fault says otherwise."""

_SELECTORS = 1 << 16
"""Numbers of whom a fault is about: 0 for any, then the nodes, and from half of this on the heads of groups."""


class FaultKind(StrEnum):
    """What may befall a vehicle."""

    LOST = "lost"
    MUTE = "mute"
    DEAF = "deaf"
    SLOW = "slow"
    SENSOR = "sensor"
    JOINS = "joins"
    BIASED = "biased"
    RESTARTS = "restarts"
    DRAINS = "drains"


@dataclass(frozen=True, slots=True)
class Bias:
    """By how much the readings of sensors are off, which the vehicle does not know.

    Attributes:
        attribute: of the facts that are off.
        offset: what is added to its values: one number, or (east, north) for points.
        sensors: names of the sensors that it is about.
    """

    attribute: str
    offset: tuple[float, ...]
    sensors: tuple[str, ...] = ()

    def of(self, sensor: str, attribute: str) -> tuple[float, ...] | None:
        """What is added to the values of an attribute that a sensor reads; None if nothing is."""
        return self.offset if attribute == self.attribute and sensor in self.sensors else None


@dataclass(frozen=True, slots=True)
class DeclaredFault:
    """A fault as a scenario declares it, before anything is drawn.

    Attributes:
        kind: what befalls the vehicle.
        vehicle: its name, ``any``, or ``head of GROUP``.
        at_s: (earliest, latest), equal for an exact time; None with a rate.
        rate_per_h: of the first such event, in faults per hour; None with a time.
        until_s: when the fault is over, infinite for good.
        factor: what a slow vehicle's speeds are multiplied by.
        sensor: which sensor is dead or biased; all of them if None.
        bias: of kind biased: by how much, and of which attribute.
        keeps_memory: of kind restarts: True if the vehicle still knows then what it knew.
        drain_w: of kind drains: power that is lost.
    """

    kind: FaultKind
    vehicle: str
    at_s: tuple[float, float] | None = None
    rate_per_h: float | None = None
    until_s: float = math.inf
    factor: float = SLOW_FACTOR
    sensor: str | None = None
    bias: Bias | None = None
    keeps_memory: bool = False
    drain_w: float = 0.0


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault of one vehicle in one run.

    Attributes:
        kind: what befalls the vehicle; vehicle: its name.
        at_s: when it begins; for ``joins``, when the vehicle joins.
        until_s: when it is over, infinite for good.
        factor: what a slow vehicle's speeds are multiplied by.
        sensors: names of the sensors that are dead or biased.
        bias: of kind biased: by how much, and of which attribute.
        keeps_memory: of kind restarts: True if the vehicle still knows then what it knew.
        drain_w: of kind drains: power that is lost.
    """

    kind: FaultKind
    vehicle: str
    at_s: float
    until_s: float = math.inf
    factor: float = SLOW_FACTOR
    sensors: tuple[str, ...] = ()
    bias: Bias | None = None
    keeps_memory: bool = False
    drain_w: float = 0.0

    @property
    def span_s(self) -> tuple[float, float]:
        """From when on, and until before when, it holds; a vehicle that joins is away until then."""
        return (0.0, self.at_s) if self.kind is FaultKind.JOINS else (self.at_s, self.until_s)

    @property
    def detail(self) -> str:
        """What the table of faults says when it begins."""
        _, until_s = self.span_s
        how_long = "for good" if math.isinf(until_s) else f"until {until_s:g} s"
        match self.kind:
            case FaultKind.SLOW:
                return f"by the factor {self.factor:g}, {how_long}"
            case FaultKind.DRAINS:
                return f"{self.drain_w:g} W, {how_long}"
            case FaultKind.SENSOR:
                return f"{', '.join(self.sensors)}, {how_long}"
            case FaultKind.JOINS:
                return f"away {how_long}"
            case FaultKind.RESTARTS:
                return f"off {how_long}, {MEMORY_KEPT if self.keeps_memory else MEMORY_LOST}"
            case FaultKind.BIASED if self.bias is not None:
                off = ", ".join(f"{one:g}" for one in self.bias.offset)
                return f"{', '.join(self.sensors)}: {self.bias.attribute} off by {off}, {how_long}"
        return how_long


MEMORY_KEPT, MEMORY_LOST = "memory kept", "memory lost"
"""Ends of the detail in the table of faults of a vehicle that restarts."""
OVER = "over"
"""Detail in the table of faults when a fault is over."""


@dataclass(frozen=True, slots=True)
class Condition:
    """What faults leave of a vehicle.

    Attributes:
        is_there: False before it joins; it is then no obstacle either.
        is_running: False while it is lost or off; lost_for_good: it will not come back.
        is_mute: nobody hears it; is_deaf: it hears nobody; will_return: it is out of contact, but not for good.
        speed_factor: what its speeds are multiplied by.
        dead_sensors: names of the sensors that yield nothing; dead_for_good: of those of them that never will again;
            biases: of the others.
        drain_w: power that is lost.
    """

    is_there: bool = True
    is_running: bool = True
    lost_for_good: bool = False
    is_mute: bool = False
    is_deaf: bool = False
    will_return: bool = False
    speed_factor: float = 1.0
    dead_sensors: frozenset[str] = frozenset()
    dead_for_good: frozenset[str] = frozenset()
    biases: tuple[Bias, ...] = ()
    drain_w: float = 0.0

    @property
    def is_alive(self) -> bool:
        """True while it is there and running."""
        return self.is_there and self.is_running

    @classmethod
    def under(cls, faults: Iterable[Fault]) -> Condition:
        """The condition of a vehicle while all these faults of it hold.

        >>> slow = Fault(FaultKind.SLOW, "AUV00", 10.0)
        >>> Condition.under([slow, slow, Fault(FaultKind.MUTE, "AUV00", 0.0)]).speed_factor
        0.25
        """
        holding = tuple(faults)
        kinds = {fault.kind for fault in holding}
        absences = [fault for fault in holding if fault.kind in OUT_OF_CONTACT]
        dying = [fault for fault in holding if fault.kind is FaultKind.SENSOR]
        return cls(
            is_there=FaultKind.JOINS not in kinds,
            is_running=kinds.isdisjoint((FaultKind.LOST, FaultKind.RESTARTS)),
            lost_for_good=any(fault.kind is FaultKind.LOST and math.isinf(fault.until_s) for fault in holding),
            is_mute=FaultKind.MUTE in kinds,
            is_deaf=FaultKind.DEAF in kinds,
            will_return=bool(absences) and all(math.isfinite(fault.span_s[1]) for fault in absences),
            speed_factor=math.prod(fault.factor for fault in holding if fault.kind is FaultKind.SLOW),
            dead_sensors=frozenset(name for fault in dying for name in fault.sensors),
            dead_for_good=frozenset(name for fault in dying if math.isinf(fault.until_s) for name in fault.sensors),
            biases=tuple(replace(fault.bias, sensors=fault.sensors) for fault in holding if fault.bias is not None),
            drain_w=math.fsum(fault.drain_w for fault in holding),
        )


OF_SENSORS = (FaultKind.SENSOR, FaultKind.BIASED)
"""Kinds that befall sensors."""
SOUND = Condition()
"""The condition of a vehicle without faults."""
NOT_HEARING = (FaultKind.LOST, FaultKind.DEAF, FaultKind.JOINS, FaultKind.RESTARTS)
OUT_OF_CONTACT = (*NOT_HEARING, FaultKind.MUTE)


def hears_throughout(faults: Iterable[Fault], vehicle: str, from_s: float, until_s: float) -> bool:
    """True if no fault keeps the vehicle from hearing at any time of a packet.

    Args:
        faults: of the run.
        vehicle: who is to hear.
        from_s: start of the packet; until_s: its end where the vehicle is.
    """
    for fault in faults:
        if fault.vehicle == vehicle and fault.kind in NOT_HEARING:
            begins_s, ends_s = fault.span_s
            if begins_s <= until_s and from_s < ends_s:
                return False
    return True


def able_to_work(database: AUVDatabase, groups: Mapping[str, Group], fault: DeclaredFault) -> list[VehicleData]:
    """Vehicles among which ``any`` is drawn, in the order of the nodes.

    They have a sensor, or are able to play a role with a job; for a dead or biased sensor, they have that sensor.

    Args:
        database: of all vehicles.
        groups: by name.
        fault: whose vehicle is to be drawn.
    """
    if fault.kind in OF_SENSORS:
        return [data for data in database.values() if _sensors(data, fault.sensor)]
    working = [(group.name, role.name) for group in groups.values() for role in group.roles if role.job is not None]
    return [data for data in database.values() if data.sensors or any(data.can_play(*role) for role in working)]


def drawn(
    faults: Sequence[DeclaredFault], seed: int, database: AUVDatabase, organisation: Organisation, duration_s: float
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
    found = []
    for one in faults:
        number = _kind_number(one.kind) * _SELECTORS + _selector(one.vehicle, database, organisation)
        stream = number * _SELECTORS + known.get(one.sensor or "", 0)
        nth = counts[stream]
        counts[stream] += 1
        at_s = _time_s(one, seed, stream, nth)
        data = database[_name(one, seed, stream, nth, database, organisation)]
        if at_s < min(duration_s, one.until_s) or one.kind is FaultKind.JOINS:
            sensors = _sensors(data, one.sensor) if one.kind in OF_SENSORS else ()
            of = one.until_s, one.factor, sensors, one.bias, one.keeps_memory, one.drain_w
            found.append(Fault(one.kind, data.name, at_s, *of))
    return tuple(sorted(found, key=lambda f: (f.span_s[0], database[f.vehicle].node, _kind_number(f.kind), f.at_s)))


def _kind_number(kind: FaultKind) -> int:
    return list(FaultKind).index(kind)


def _selector(vehicle: str, database: AUVDatabase, organisation: Organisation) -> int:
    """Number of whom a fault is about; the same whatever vehicles and groups are called."""
    if vehicle in database:
        return database[vehicle].node + 1
    return 0 if vehicle == ANY else _SELECTORS // 2 + list(organisation.groups).index(vehicle.removeprefix(HEAD_OF))


def _time_s(fault: DeclaredFault, seed: int, stream: int, nth: int) -> float:
    """When the fault begins; drawn unless the scenario says it exactly."""
    earliest_s, latest_s = fault.at_s or (0.0, 0.0)
    if fault.rate_per_h is None and earliest_s == latest_s:
        return earliest_s
    share = loss.uniform(seed, loss.FAULTS, stream, nth, 0)
    if fault.rate_per_h is not None:
        return -3600.0 * log1p(-share) / fault.rate_per_h
    return earliest_s + share * (latest_s - earliest_s)


def _name(
    fault: DeclaredFault, seed: int, stream: int, nth: int, database: AUVDatabase, organisation: Organisation
) -> str:
    """Whom a fault is about; the n-th ``any`` of a kind is the n-th vehicle of one drawn order, so all differ."""
    if fault.vehicle in database:
        return fault.vehicle
    if fault.vehicle != ANY:
        heads = organisation.heads(fault.vehicle.removeprefix(HEAD_OF))
        return min(heads, key=lambda name: database[name].node)
    able = able_to_work(database, organisation.groups, fault)
    order = sorted(able, key=lambda data: loss.uniform(seed, loss.FAULTS, stream, 0, data.node + 1))
    return order[nth].name


def _sensors(data: VehicleData, sensor: str | None) -> tuple[str, ...]:
    return tuple(settings.name for settings in data.sensors if sensor in (None, settings.name))


def _all_sensors(database: AUVDatabase) -> list[str]:
    return [settings.name for data in database.values() for settings in data.sensors]
