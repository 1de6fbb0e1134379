"""No parking: ``communication.parking = false``, by which all is waited for, however long a vehicle is silent.

Exchange managers have parking unless they are told otherwise, see ``exchange.peering.parking``.
"""

from missions.feature import on_unless_off
from remoras.events import Part

FEATURE = on_unless_off(
    "parking",
    "what a vehicle needs is not waited for while it is silent for longer than loss explains; it catches up when it is "
    "heard again",
    lambda joining: Part(equip=lambda vehicle: vehicle.radio.manager.parking.clear()),
)
