"""Faults that befall vehicles in a run: when each begins and is over, and what those that hold leave of a vehicle."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from remoras.clock import Priority
from remoras.events import Host, Part
from remoras.faults import OVER, Condition, Fault, FaultKind


@dataclass(slots=True)
class _Holding:
    """Faults of a run that hold now, by the name of the vehicle."""

    faults: dict[str, list[Fault]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class FaultChanges:
    """A fault begins to hold, or is over; others of the vehicle hold as they did."""

    fault: Fault
    begins: bool
    holding: _Holding

    def act(self, host: Host) -> None:
        """Let it hold from now on, or no longer."""
        fault, vehicle = self.fault, host.named(self.fault.vehicle)
        holding = self.holding.faults.setdefault(fault.vehicle, [])
        if self.begins:
            holding.append(fault)
        else:
            holding.remove(fault)
            if fault.kind is FaultKind.RESTARTS and not vehicle.functional.exhausted:
                vehicle = host.restart(vehicle, fault)
        vehicle.suffer(Condition.under(holding))
        detail = fault.detail if self.begins else OVER
        host.recorder.faults.append((host.now_s, fault.vehicle, fault.kind.value, detail))


def faults_part(faults: Iterable[Fault]) -> Part:
    """What lets faults befall the vehicles of a run.

    Args:
        faults: of the run.
    """

    def begin(host: Host) -> None:
        holding = _Holding()
        for fault in faults:
            from_s, until_s = fault.span_s
            host.at(from_s, Priority.FAULT, FaultChanges(fault, True, holding))
            host.at(until_s, Priority.FAULT, FaultChanges(fault, False, holding))

    return Part(begin)
