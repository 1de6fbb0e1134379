"""No summaries: ``communication.summaries = false``, by which vehicles tell no summary vectors and heed none.

Exchange managers have summaries unless they are told otherwise, see ``exchange.peering.summaries``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import Field

from missions.feature import Feature, Joining, Trial
from remoras.events import Part

if TYPE_CHECKING:
    from remoras.vehicle import Vehicle

KEY, OFF = "summaries", "communication.summaries"


def part_of(joining: Joining) -> Part:
    """Take it out of every vehicle."""

    def equip(vehicle: Vehicle) -> None:
        vehicle.radio.manager.summaries.clear()

    return Part(equip=equip)


FEATURE = Feature(
    {
        "communication": {
            KEY: (
                bool,
                Field(
                    True,
                    description="vehicles tell, where a packet has room or a peer needs to catch up, up to which "
                    "number they hold the items of each",
                ),
            )
        }
    },
    part_of,
    trials=(Trial(KEY, f"no {KEY}", (OFF,), lambda draws, scenario: {OFF: False}),),
)
