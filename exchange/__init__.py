"""TDMA exchange of world knowledge between vehicles over lossy acoustic links.

`exchange.policy` has the rules (acknowledgements, repeats, queue, coded repairs), `exchange.wire` encodes packets,
`exchange.manager` runs in a vehicle, `exchange.channel` models the sea, `exchange.study` compares policies and
`exchange.drivers` connects modems. Shared by all are `packets` (messages) and `schedule`.

The names below are stable. Each is loaded on first use; none needs NumPy or Numba.
"""

from typing import TYPE_CHECKING

from exchange import lazily

if TYPE_CHECKING:
    from exchange.errors import ConfigurationError, ExchangeError
    from exchange.manager.manager import ExchangeManager
    from exchange.packets import Fragment, InfluenceSignal, ItemUid, Packet, Reception, StatusUid, Transmission
    from exchange.policy.acknowledgement import Acknowledgement
    from exchange.policy.policies import ACKNOWLEDGEMENTS, POLICIES, AckPolicy, header_bits, policy_named
    from exchange.schedule import TdmaSchedule
    from exchange.wire.codec import Codec
    from exchange.wire.factcodec import FieldSize

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
