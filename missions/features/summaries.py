"""No summaries: ``communication.summaries = false``, by which vehicles tell no summary vectors and heed none.

Exchange managers have summaries unless they are told otherwise, see ``exchange.peering.summaries``.
"""

from missions.feature import on_unless_off
from remoras.events import Part

FEATURE = on_unless_off(
    "summaries",
    "vehicles tell, where a packet has room or a peer needs to catch up, up to which number they hold the items of "
    "each",
    lambda joining: Part(equip=lambda vehicle: vehicle.radio.manager.summaries.clear()),
)
