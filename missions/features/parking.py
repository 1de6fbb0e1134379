"""No parking: ``communication.parking = false``, by which all is waited for, however long a vehicle is silent.

Exchange managers have parking unless they are told otherwise, see ``exchange.peering.parking``.
"""

from missions.feature import on_unless_off
from remoras.events import Observer
from remoras.vehicle import Vehicle


class Without(Observer):
    """Takes parking out of vehicles."""

    def on_vehicle(self, vehicle: Vehicle) -> None:
        """Take it out of the exchange manager."""
        vehicle.radio.manager.leave_out("parking")


FEATURE = on_unless_off(
    "parking",
    "what a vehicle needs is not waited for while it is silent for longer than loss explains; it catches up when it is "
    "heard again",
    Without,
)
