"""What becomes of blocks that a vehicle hears."""

from remoras.authority import Ruling
from remoras.fleet.vehicle import Vehicle
from worldmodel import Block, merge


def hear(vehicle: Vehicle, *blocks: Block) -> list[Ruling]:
    """The vehicle hears blocks; what becomes of them at the end of the round."""
    rulings = []
    for block in blocks:
        rulings += vehicle.social.consider(merge(vehicle.beliefs.model, [block]).changes).rulings
    return rulings + vehicle.social.consult().rulings
