"""Switch ``communication.relaying = false``: no relaying (``exchange.manager.relaying``)."""

from missions.feature import on_unless_off
from remoras.events import LeavingOut

FEATURE = on_unless_off(
    "relaying",
    "under policies in which only origins send, a vehicle with a much better link to a peer than the "
    "origin relays its items",
    LeavingOut("relaying"),
)
