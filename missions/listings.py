"""What can be named: scenarios, strategies, policies, channels and modems, each with one line of text.

Of strategies there are details too: where each is from, what its vehicles tell each other, what can be set.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from exchange.acoustics.link import LINKS
from exchange.acoustics.modems import modems
from exchange.policies import POLICIES, Acknowledgement
from missions.scenario import load, shipped
from remoras.strategies import parameters, strategies


def _scenarios() -> dict[str, str]:
    return {name: load(name).scenario.title for name in shipped()}


def _strategies() -> dict[str, str]:
    docs = {name: sys.modules[type(strategy).__module__].__doc__ or "" for name, strategy in strategies().items()}
    return {name: doc.strip().splitlines()[0] for name, doc in docs.items()}


def _of_strategy(name: str) -> dict[str, Any]:
    strategy = strategies()[name]
    return {
        "source": strategy.declaration.source,
        "messages": dict(strategy.declaration.messages),
        "parameters": [asdict(parameter) for parameter in parameters(strategy)],
    }


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

DETAILS: dict[str, Callable[[str], dict[str, Any]]] = {"strategies": _of_strategy}
"""What else there is to say of something by its name, where there is more than one line."""
