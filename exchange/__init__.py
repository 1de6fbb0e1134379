"""TDMA exchange of world knowledge between vehicles, over acoustic links that lose packets.

The kernels stand here: `ack` (which packets were received), `policies`, `packets`, `blocks`, `interests` (who needs
what), `values` (what it is worth to say it), `schedule`, and `manager`, which a vehicle runs. `exchange.wire` makes
bits of packets, `exchange.queueing` has what waits to be said, `exchange.peering` what is known of peers.
`exchange.acoustics` has the sea; `exchange.study` compares policies.

The names below are promised to stay. Each is loaded when it is first used; none of them needs NumPy or Numba.
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
