"""Faults that befall vehicles in a run: when each begins and is over, and what those that hold leave of a vehicle."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from remoras.clock import Priority
from remoras.errors import PluginError
from remoras.events import Host, Part
from remoras.faults import OVER, Fault, condition_under
from remoras.plugins import broken_promise

if TYPE_CHECKING:
    from remoras.vehicle import Vehicle


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
            _begin(fault, vehicle)
        else:
            holding.remove(fault)
            _end(fault, vehicle, host)
            before, vehicle = vehicle, host.named(fault.vehicle)
            for one in holding if vehicle is not before else ():  # it has begun anew
                _begin(one, vehicle)
        vehicle.suffer(condition_under(holding))
        detail = fault.detail if self.begins else OVER
        host.recorder.faults.append((host.now_s, fault.vehicle, fault.kind, detail))


def _begin(fault: Fault, vehicle: Vehicle) -> None:
    """Let a fault do what it does when it begins; whatever its kind raises names the kind."""
    if fault.acts is None:
        return
    try:
        fault.acts.begin(vehicle)
    except PluginError:
        raise
    except Exception as error:  # it may be somebody else's class
        raise broken_promise(f"fault kind {fault.kind}", "begin", "it returns", error) from error


def _end(fault: Fault, vehicle: Vehicle, host: Host) -> None:
    """Let a fault do what it does when it is over; whatever its kind raises names the kind."""
    if fault.acts is None:
        return
    try:
        fault.acts.end(vehicle, host)
    except PluginError:
        raise
    except Exception as error:  # it may be somebody else's class
        raise broken_promise(f"fault kind {fault.kind}", "end", "it returns", error) from error


def faults_part(faults: Iterable[Fault]) -> Part:
    """What lets faults befall the vehicles of a run.

    Args:
        faults: of the run.
    """

    def begin(host: Host) -> None:
        holding = _Holding()
        for fault in faults:
            host.at(fault.from_s, Priority.FAULT, FaultChanges(fault, True, holding))
            host.at(fault.until_s, Priority.FAULT, FaultChanges(fault, False, holding))

    return Part(begin)
