"""What a strategy that is a bound does away with: all know at once what one has told; under any other this is nothing.

See ``remoras.strategies.oracle``.
"""

from __future__ import annotations

from collections.abc import Sequence

from remoras.events import Joined
from remoras.vehicle import Vehicle
from worldmodel import Block


class Bound:
    """Shares what vehicles know without a packet.

    A block from the future of a clock that is behind does not count there yet: it is shared again until it does.

    Args:
        fleet: of the vehicles.
    """

    def __init__(self, fleet: Joined) -> None:
        self._fleet = fleet
        self._early: dict[str, list[tuple[str, Block]]] = {}

    def share(self, sender: Vehicle) -> None:
        """Let all vehicles know what one has told since the last time."""
        told = sender.radio.told()
        for vehicle in self._fleet.vehicles if told or self._early else ():
            for name, block in self._early.pop(vehicle.name, ()):
                self._learn(vehicle, name, [block])
            if told and vehicle is not sender:
                self._learn(vehicle, sender.name, told)

    def share_all(self, anew: Vehicle) -> None:
        """Let a vehicle that begins anew know all that the others were told."""
        for vehicle in self._fleet.vehicles:
            if vehicle is not anew:
                model = vehicle.beliefs.model
                blocks = [block for _, block in model.items() if block is not None]
                self._learn(anew, vehicle.name, [*blocks, *model.statuses()])

    def _learn(self, vehicle: Vehicle, emitter: str, blocks: Sequence[Block]) -> None:
        if vehicle.functional.exhausted:
            return
        vehicle.learn(emitter, blocks, self._fleet.shown_s(vehicle))
        model = vehicle.beliefs.model
        early = [(emitter, one) for one in blocks if not (one.is_status or model.has_arrived(one.guid))]
        if early:
            self._early.setdefault(vehicle.name, []).extend(early)


def share_at_once(fleet: Joined) -> None:
    """Let all vehicles of a fleet know at once what any of them tells.

    Args:
        fleet: whose strategy is a bound.
    """
    bound = Bound(fleet)
    fleet.acted.append(bound.share)
    fleet.restarted.append(bound.share_all)
