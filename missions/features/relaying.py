"""Switch ``communication.relaying = false``: no relaying (``exchange.manager.relaying``)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.feature import on_unless_off
from remoras.events import Observer

if TYPE_CHECKING:
    from remoras.fleet.vehicle import Vehicle


class Without(Observer):
    """Run hooks that disable relaying."""

    def on_vehicle(self, vehicle: Vehicle) -> None:
        """Disable it in the vehicle's exchange manager."""
        vehicle.radio.manager.leave_out("relaying")


FEATURE = on_unless_off(
    "relaying",
    "under policies in which only origins send, a vehicle with a much better link to a peer than the "
    "origin relays its items",
    Without,
)
