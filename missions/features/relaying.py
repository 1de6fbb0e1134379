"""No relaying: ``communication.relaying = false``, by which nobody but its origin sends an item if the policy says so.

Exchange managers relay unless they are told otherwise or all repeat by the policy, see ``exchange.peering.relaying``.
"""

from missions.feature import on_unless_off
from remoras.events import Observer
from remoras.vehicle import Vehicle


class Without(Observer):
    """Takes relaying out of vehicles."""

    def on_vehicle(self, vehicle: Vehicle) -> None:
        """Take it out of the exchange manager."""
        vehicle.radio.manager.leave_out("relaying")


FEATURE = on_unless_off(
    "relaying",
    "where only origins send items by the policy, a vehicle that a peer receives much better than the origin of an "
    "item sends that, too",
    Without,
)
