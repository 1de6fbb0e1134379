"""What a strategy that is a bound does away with: all know at once what one has told; under any other this is nothing.

See ``remoras.strategies.oracle``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from remoras.vehicle import Vehicle
from worldmodel import Block

ShownS = Callable[[Vehicle], float]
"""The time that the clock of a vehicle shows (s)."""


class Bound:
    """Shares what vehicles know without a packet.

    A block from the future of a clock that is behind does not count there yet: it is shared again until it does.
    """

    def __init__(self) -> None:
        self._early: dict[str, list[tuple[str, Block]]] = {}

    def share(self, sender: Vehicle, vehicles: Sequence[Vehicle], shown_s: ShownS) -> None:
        """Let all vehicles know what one has told since the last time."""
        told = sender.radio.told() if sender.radio.is_bound else ()
        for vehicle in vehicles if told or self._early else ():
            for name, block in self._early.pop(vehicle.name, ()):
                self._learn(vehicle, name, [block], shown_s)
            if told and vehicle is not sender:
                self._learn(vehicle, sender.name, told, shown_s)

    def share_all(self, anew: Vehicle, vehicles: Sequence[Vehicle], shown_s: ShownS) -> None:
        """Let a vehicle that begins anew know all that the others were told."""
        for vehicle in vehicles if anew.radio.is_bound else ():
            if vehicle is not anew:
                model = vehicle.beliefs.model
                blocks = [block for _, block in model.items() if block is not None]
                self._learn(anew, vehicle.name, [*blocks, *model.statuses()], shown_s)

    def _learn(self, vehicle: Vehicle, emitter: str, blocks: Sequence[Block], shown_s: ShownS) -> None:
        if vehicle.functional.exhausted:
            return
        vehicle.learn(emitter, blocks, shown_s(vehicle))
        model = vehicle.beliefs.model
        early = [(emitter, one) for one in blocks if not (one.is_status or model.has_arrived(one.guid))]
        if early:
            self._early.setdefault(vehicle.name, []).extend(early)
