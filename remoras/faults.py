"""Faults of vehicles: times and effects; kinds of faults are defined elsewhere.

The schedule of a run is a pure function of (declared faults, seed, agreement). Each draw is keyed by the kind, the
selector (vehicle, ``any``, leader of a group), the sensor, and the number of equal faults before it. So loss rate,
strategy and other faults shift no draw. Of two rates the higher never gives a later time.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from exchange.arithmetic import log1p
from exchange.channel import loss
from remoras.condition import SOUND, Condition
from remoras.database import AUVDatabase, VehicleData
from remoras.events import Host, Observer, Priority
from remoras.organisation import Group, Organisation

ANY = "any"
"""Selector of a vehicle drawn among those that a fault may affect."""
HEAD_OF = "head of "
"""Selector prefix: the agreed leader of a group."""
OVER = "over"
"""Detail in the table of faults at the end of a fault."""

_SELECTORS = 1 << 16
"""Number of selectors: 0 for any, then nodes; leaders of groups from half of this."""


@dataclass(frozen=True, slots=True)
class Fault:
    """Fault of one vehicle in one run.

    Attributes:
        until_s: infinite if permanent.
        leaves: effect on the vehicle meanwhile.
        detail: of its first row in the table of faults.
        remembers: the vehicle restarts at the end, with its memory if True; None without a restart.
    """

    kind: str
    vehicle: str
    from_s: float
    until_s: float = math.inf
    leaves: Condition = SOUND
    detail: str = ""
    remembers: bool | None = None


class Declared(Protocol):
    """Fault as declared in a scenario, before sampling."""

    @property
    def vehicle(self) -> str:
        """Name of the vehicle, ``any``, or ``head of GROUP``."""
        ...

    @property
    def number(self) -> int:
        """Unique number of its kind, below 2^25."""
        ...

    @property
    def sensor_meant(self) -> str | None:
        """Name of the affected sensor; None for none or all."""
        ...

    @property
    def span_s(self) -> tuple[float, float] | None:
        """Earliest and latest start (s); None with a rate."""
        ...

    @property
    def rate_per_h(self) -> float | None:
        """Rate of its start, in faults per hour; None with a time."""
        ...

    def able(self, database: AUVDatabase, groups: Mapping[str, Group]) -> list[VehicleData]:
        """Return the vehicles among which ``any`` is drawn, in node order."""
        ...

    def befalling(self, data: VehicleData, at_s: float) -> Fault:
        """Return the fault of a vehicle from a time (s) on."""
        ...


def condition_under(faults: Iterable[Fault]) -> Condition:
    """Return the condition of a vehicle under all its active faults.

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
    """Start or end of a fault; ``holding`` are the active faults of the run by vehicle."""

    fault: Fault
    begins: bool
    holding: dict[str, list[Fault]]

    def act(self, host: Host) -> None:
        """Update the vehicle's condition; restart it at the end if the fault demands it."""
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
    """Observer that applies the faults of a run."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self._faults = tuple(faults)

    def on_start(self, host: Host) -> None:
        """Schedule start and end of each fault."""
        holding: dict[str, list[Fault]] = {}
        for fault in self._faults:
            host.at(fault.from_s, Priority.FAULT, FaultChanges(fault, True, holding))
            host.at(fault.until_s, Priority.FAULT, FaultChanges(fault, False, holding))


def hears_throughout(faults: Iterable[Fault], vehicle: str, from_s: float, until_s: float) -> bool:
    """Return whether no fault blocks reception from ``from_s`` to the end at the receiver."""
    for fault in faults:
        is_early = from_s < fault.until_s
        if fault.vehicle == vehicle and fault.from_s <= until_s and is_early and not fault.leaves.hears:
            return False
    return True


def drawn(
    faults: Sequence[Declared], seed: int, database: AUVDatabase, organisation: Organisation, duration_s: float
) -> tuple[Fault, ...]:
    """Return the faults of one run by start; omit those after the mission or their own end."""
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
    """Return the number of a selector, independent of names of vehicles and groups."""
    if vehicle in database:
        return database[vehicle].node + 1
    return 0 if vehicle == ANY else _SELECTORS // 2 + list(organisation.groups).index(vehicle.removeprefix(HEAD_OF))


def _time_s(fault: Declared, seed: int, stream: int, nth: int) -> float:
    """Return the start of the fault; drawn unless the scenario fixes it."""
    earliest_s, latest_s = fault.span_s or (0.0, 0.0)
    if fault.rate_per_h is None and earliest_s == latest_s:
        return earliest_s
    share = loss.uniform(seed, loss.FAULTS, stream, nth, 0)
    if fault.rate_per_h is not None:
        return -3600.0 * log1p(-share) / fault.rate_per_h
    return earliest_s + share * (latest_s - earliest_s)


def _name(fault: Declared, seed: int, stream: int, nth: int, database: AUVDatabase, organisation: Organisation) -> str:
    """Return the affected vehicle; the n-th ``any`` of a kind is n-th in one drawn order."""
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
