"""Faults of vehicles in one run; effects: `remoras.condition`, kinds: `missions.faults`."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial

from remoras.condition import SOUND, Condition
from remoras.events import Host, Observer, Priority

ANY = "any"
"""Selector of a vehicle drawn among those that a fault may affect."""
HEAD_OF = "head of "
"""Selector prefix: the agreed leader of a group."""
OVER = "over"
"""Detail in the table of faults at the end of a fault."""


@dataclass(frozen=True, slots=True)
class Fault:
    """Fault of one vehicle in one run; ``until_s`` is infinite if permanent.

    ``leaves`` is the effect meanwhile. It may end by a restart, with memory or not (``remembers``); None: no restart.
    """

    kind: str
    vehicle: str
    from_s: float
    until_s: float = math.inf
    leaves: Condition = SOUND
    detail: str = ""
    remembers: bool | None = None


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


class Faults(Observer):
    """Observer that applies the faults of a run."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self._faults = tuple(faults)
        self._active: dict[str, list[Fault]] = {}  # by vehicle

    def on_start(self, host: Host) -> None:
        for fault in self._faults:
            host.at(fault.from_s, Priority.FAULT, partial(self._change, fault, True))
            # A permanent one ends after ``last_s``, so ``at`` drops its end.
            host.at(fault.until_s, Priority.FAULT, partial(self._change, fault, False))

    def _change(self, fault: Fault, begins: bool, host: Host) -> None:
        vehicle, active = host.named(fault.vehicle), self._active.setdefault(fault.vehicle, [])
        if begins:
            active.append(fault)
        else:
            active.remove(fault)
            if fault.remembers is not None and not vehicle.functional.exhausted:
                vehicle = host.restart(vehicle, fault.remembers)
        vehicle.suffer(condition_under(active))
        host.recorder.faults.append((host.now_s, fault.vehicle, fault.kind, fault.detail if begins else OVER))


def hears_throughout(faults: Iterable[Fault], vehicle: str, from_s: float, until_s: float) -> bool:
    """Return whether no fault blocks reception from ``from_s`` to the end at the receiver."""
    for fault in faults:
        is_early = from_s < fault.until_s
        if fault.vehicle == vehicle and fault.from_s <= until_s and is_early and not fault.leaves.hears:
            return False
    return True
