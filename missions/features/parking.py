"""No parking: ``communication.parking = false``, by which all is waited for, however long a vehicle is silent.

Exchange managers have parking unless they are told otherwise, see ``exchange.peering.parking``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import Field

from missions.feature import Feature, Joining, Trial
from remoras.events import Part

if TYPE_CHECKING:
    from remoras.vehicle import Vehicle

KEY, OFF = "parking", "communication.parking"


def part_of(joining: Joining) -> Part:
    """Take it out of every vehicle."""

    def equip(vehicle: Vehicle) -> None:
        vehicle.radio.manager.parking.clear()

    return Part(equip=equip)


FEATURE = Feature(
    {
        "communication": {
            KEY: (
                bool,
                Field(
                    True,
                    description="what a vehicle needs is not waited for while it is silent for longer than loss "
                    "explains; it catches up when it is heard again",
                ),
            )
        }
    },
    part_of,
    trials=(Trial(KEY, f"no {KEY}", (OFF,), lambda draws, scenario: {OFF: False}),),
)
