"""No summaries: ``communication.summaries = false``, by which vehicles tell no summary vectors and heed none.

Exchange managers have summaries unless they are told otherwise, see ``exchange.peering.summaries``.
"""

from missions.feature import on_unless_off
from remoras.events import Observer
from remoras.vehicle import Vehicle


class Without(Observer):
    """Takes summaries out of vehicles."""

    def on_vehicle(self, vehicle: Vehicle) -> None:
        """Take it out of the exchange manager."""
        vehicle.radio.manager.leave_out("summaries")


FEATURE = on_unless_off(
    "summaries",
    "vehicles tell, where a packet has room or a peer needs to catch up, up to which number they hold the items of "
    "each",
    Without,
)
