"""TDMA exchange of world knowledge between vehicles, over acoustic links that lose packets.

The kernels stand here: `ack` (who holds what), `policies`, `packets`, `blocks`, `ledger`, `interests` (who needs what),
`values` (what it is worth to say it), `schedule`, and `manager`, which a vehicle runs. `exchange.wire` makes bits of
packets, `exchange.queueing` has what waits to be said, `exchange.peering` what is known of peers. `exchange.acoustics`
has the sea; `exchange.study` compares policies.

The names below are promised to stay. Each is loaded when it is first used; none of them needs Numba, and NumPy only
those of `exchange.wire.batch`: `Observations`, `encode_observations`, `decode_observations`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exchange.ack import Acknowledgement
    from exchange.errors import ConfigurationError, ExchangeError
    from exchange.manager import ExchangeManager
    from exchange.packets import Fragment, InfluenceSignal, ItemUid, Packet, Reception, StatusUid, Transmission
    from exchange.policies import ACKNOWLEDGEMENTS, POLICIES, AckPolicy, header_bits, policy_named
    from exchange.schedule import TdmaSchedule
    from exchange.wire.batch import Observations, decode_observations, encode_observations
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
    "Observations",
    "Packet",
    "Reception",
    "StatusUid",
    "TdmaSchedule",
    "Transmission",
    "decode_observations",
    "encode_observations",
    "header_bits",
    "policy_named",
]

_MODULE_OF = {
    **dict.fromkeys(("ACKNOWLEDGEMENTS", "POLICIES", "AckPolicy", "header_bits", "policy_named"), "policies"),
    "Acknowledgement": "ack",
    **dict.fromkeys(("Observations", "decode_observations", "encode_observations"), "wire.batch"),
    "Codec": "wire.codec",
    "FieldSize": "wire.codes",
    **dict.fromkeys(("ConfigurationError", "ExchangeError"), "errors"),
    "ExchangeManager": "manager",
    **dict.fromkeys(
        ("Fragment", "InfluenceSignal", "ItemUid", "Packet", "Reception", "StatusUid", "Transmission"), "packets"
    ),
    "TdmaSchedule": "schedule",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"exchange.{_MODULE_OF[name]}"), name)
