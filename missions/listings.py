"""What can be named: scenarios, strategies, policies, channels and modems, each with one line of text."""

from __future__ import annotations

import sys
from collections.abc import Callable

from exchange.acoustics.link import LINKS
from exchange.acoustics.modems import modems
from exchange.policies import POLICIES, Acknowledgement
from missions.scenario import load, shipped
from remoras.strategies import strategies


def _scenarios() -> dict[str, str]:
    return {name: load(name).scenario.title for name in shipped()}


def _strategies() -> dict[str, str]:
    docs = {name: sys.modules[type(strategy).__module__].__doc__ or "" for name, strategy in strategies().items()}
    return {name: doc.strip().splitlines()[0] for name, doc in docs.items()}


def _policies() -> dict[str, str]:
    meanings = {
        Acknowledgement.ACK: "packet acknowledgements",
        Acknowledgement.M_ACK: "acknowledgement matrix",
        Acknowledgement.MPS_ACK: "acknowledgement matrix with pseudo-acknowledgements",
    }
    return {
        policy.name: meanings[Acknowledgement(policy.acknowledgement)]
        + (", others repeat items" if policy.repeat else ", only the origin sends an item")
        for policy in POLICIES.values()
    }


def _modems() -> dict[str, str]:
    return {
        modem.name: f"{modem.title}: {modem.payload_bytes} B in {modem.packet_s(modem.payload_bits):.2f} s"
        for modem in modems().values()
    }


LISTINGS: dict[str, Callable[[], dict[str, str]]] = {
    "scenarios": _scenarios,
    "strategies": _strategies,
    "policies": _policies,
    "channels": lambda: dict(LINKS),
    "modems": _modems,
}
"""Name and text of everything of a kind."""
