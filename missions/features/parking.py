"""Switch ``communication.parking = false``: no suspension (``exchange.manager.peers``)."""

from missions.feature import on_unless_off
from remoras.events import LeavingOut

FEATURE = on_unless_off(
    "parking",
    "items do not wait for a vehicle whose silence exceeds loss; it resynchronises on its return",
    LeavingOut("parking"),
)
