"""Switch ``communication.summaries = false``: see ``exchange.manager.beliefs``."""

from missions.feature import on_unless_off
from remoras.events import LeavingOut

FEATURE = on_unless_off(
    "summaries",
    "vehicles report, with spare packet capacity or to resynchronise a peer, their received prefix per origin",
    LeavingOut("summaries"),
)
