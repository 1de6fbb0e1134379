"""Switch ``communication.parking = false``: no suspension (``exchange.manager.receiver``)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.feature import on_unless_off
from remoras.events import Observer

if TYPE_CHECKING:
    from remoras.fleet.vehicle import Vehicle


class Without(Observer):
    """Run hooks that disable suspension for absent peers."""

    def on_vehicle(self, vehicle: Vehicle) -> None:
        """Disable it in the vehicle's exchange manager."""
        vehicle.radio.manager.leave_out("parking")


FEATURE = on_unless_off(
    "parking",
    "items do not wait for a vehicle whose silence exceeds loss; it resynchronises on its return",
    Without,
)
