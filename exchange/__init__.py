"""TDMA exchange of world knowledge between vehicles, over acoustic links that lose packets.

The kernels stand here: `ack` (who holds what), `policies`, `selection`, `packets`, `codec`, `blocks`, `ledger`,
`interests` (who needs what), `schedule`, and `manager`, which a vehicle runs. `exchange.acoustics` has the sea;
`exchange.study` compares policies.

The names below are promised to stay. Each is loaded when it is first used; none of them needs Numba or NumPy.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exchange.ack import Acknowledgement
    from exchange.codec import Codec, FieldSize
    from exchange.errors import ConfigurationError, ExchangeError
    from exchange.manager import ExchangeManager, Reception, Transmission
    from exchange.packets import Fragment, InfluenceSignal, ItemUid, Packet, StatusUid
    from exchange.policies import ACKNOWLEDGEMENTS, POLICIES, AckPolicy, header_bits, policy_named
    from exchange.schedule import TdmaSchedule

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

_MODULE_OF = {
    **dict.fromkeys(("ACKNOWLEDGEMENTS", "POLICIES", "AckPolicy", "header_bits", "policy_named"), "policies"),
    "Acknowledgement": "ack",
    **dict.fromkeys(("Codec", "FieldSize"), "codec"),
    **dict.fromkeys(("ConfigurationError", "ExchangeError"), "errors"),
    **dict.fromkeys(("ExchangeManager", "Reception", "Transmission"), "manager"),
    **dict.fromkeys(("Fragment", "InfluenceSignal", "ItemUid", "Packet", "StatusUid"), "packets"),
    "TdmaSchedule": "schedule",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"exchange.{_MODULE_OF[name]}"), name)
