"""Switch ``communication.summaries = false``: see ``exchange.manager.summaries``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.feature import on_unless_off
from remoras.events import Observer

if TYPE_CHECKING:
    from remoras.fleet.vehicle import Vehicle


class Without(Observer):
    """Run hooks that disable summary vectors."""

    def on_vehicle(self, vehicle: Vehicle) -> None:
        """Disable them in the vehicle's exchange manager."""
        vehicle.radio.manager.leave_out("summaries")


FEATURE = on_unless_off(
    "summaries",
    "vehicles report, with spare packet capacity or to resynchronise a peer, their received prefix per origin",
    Without,
)
