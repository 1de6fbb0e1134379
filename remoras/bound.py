"""What a strategy that is a bound does away with: all know at once what one has told; under any other this is nothing.

See ``remoras.strategies.oracle``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from remoras.vehicle import Vehicle


def share_at_once(sender: Vehicle, vehicles: Sequence[Vehicle], shown_s: Callable[[Vehicle], float]) -> None:
    """Let all vehicles know what one has told since the last time.

    Args:
        sender: who has told it; vehicles: of the fleet.
        shown_s: the time that the clock of a vehicle shows (s).
    """
    if sender.radio.is_bound and (blocks := sender.radio.told()):
        for vehicle in vehicles:
            if vehicle is not sender:
                vehicle.learn(sender.name, blocks, shown_s(vehicle))


def share_all_with(anew: Vehicle, vehicles: Sequence[Vehicle], shown_s: Callable[[Vehicle], float]) -> None:
    """Let a vehicle that begins anew know all that the others were told."""
    for vehicle in vehicles if anew.radio.is_bound else ():
        if vehicle is not anew:
            model = vehicle.beliefs.model
            blocks = [*(block for _, block in model.items() if block is not None), *model.statuses()]
            anew.learn(vehicle.name, blocks, shown_s(anew))
