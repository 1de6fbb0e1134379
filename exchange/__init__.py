"""TDMA exchange of world knowledge between vehicles over lossy acoustic links.

Core modules are here: `ack` (received packets), `policies`, `packets`, `blocks`, `interests` (information needs),
`values` (utility of queued items), `schedule`, and `manager`, which a vehicle runs. `exchange.wire` encodes packets,
`exchange.queueing` queues items, `exchange.peering` keeps the state of peers, `exchange.acoustics` models the channel,
`exchange.study` compares policies.

The names below are stable. Each is loaded on first use; none needs NumPy or Numba.
"""

from typing import TYPE_CHECKING

from exchange import lazily

if TYPE_CHECKING:
    from exchange.ack import Acknowledgement
    from exchange.errors import ConfigurationError, ExchangeError
    from exchange.manager import ExchangeManager
    from exchange.packets import Fragment, InfluenceSignal, ItemUid, Packet, Reception, StatusUid, Transmission
    from exchange.policies import ACKNOWLEDGEMENTS, POLICIES, AckPolicy, header_bits, policy_named
    from exchange.schedule import TdmaSchedule
    from exchange.wire.codec import Codec
    from exchange.wire.codes import FieldSize

__all__ = [
    "ACKNOWLEDGEMENTS",
    "POLICIES",
    "AckPolicy",
    "Acknowledgement",
    "Codec",
    "ConfigurationError",
    "ExchangeError",
    "ExchangeManager",
    "FieldSize",
    "Fragment",
    "InfluenceSignal",
    "ItemUid",
    "Packet",
    "Reception",
    "StatusUid",
    "TdmaSchedule",
    "Transmission",
    "header_bits",
    "policy_named",
]
__getattr__ = lazily.loader(__name__, __file__)
