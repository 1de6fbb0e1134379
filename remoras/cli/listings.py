"""What can be named: scenarios, strategies, policies, channels, modems and studies, each with one line of text.

Of strategies there are details too: where each is from, what its vehicles tell each other, what can be set.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from exchange.acoustics.modems import Modem, modems
from exchange.acoustics.network import shipped as shipped_networks
from exchange.acoustics.shipped import CHANNELS
from exchange.policies import POLICIES
from missions.files import shipped_abouts, shipped_studies
from remoras.strategies import bounds, factors_of, parameters, strategies

UNVERIFIED = "(?)"
"""Stands behind a number of a modem's profile for which no source was found."""


def _scenarios() -> dict[str, str]:
    return {name: str(about.get("title", "")) for name, about in shipped_abouts().items()}


def _strategies() -> dict[str, str]:
    docs = {name: sys.modules[type(strategy).__module__].__doc__ or "" for name, strategy in strategies().items()}
    marks = {name: "(bound) " if name in bounds() else "" for name in docs}
    return {name: marks[name] + doc.strip().splitlines()[0] for name, doc in docs.items()}


def _of_strategy(name: str) -> dict[str, Any]:
    strategy = strategies()[name]
    return {
        "source": strategy.declaration.source,
        "messages": dict(strategy.declaration.messages),
        "factors": None if (factors := factors_of(strategy)) is None else asdict(factors),
        "authorities": sorted(authority.value for authority in strategy.declaration.authorities),
        "parameters": [asdict(parameter) for parameter in parameters(strategy)],
    }


def _policies() -> dict[str, str]:
    return {policy.name: policy.title for policy in POLICIES.values()}


def _modems() -> dict[str, str]:
    return {modem.name: _of_modem(modem) for modem in modems().values()}


def _of_modem(modem: Modem) -> str:
    """What a profile says of a modem, with a mark on each number that is not verified."""

    def marked(key: str, text: str) -> str:
        return f"{text}{UNVERIFIED}" if key in modem.unverified else text

    n_frames = -(-modem.payload_bytes // modem.frame_bytes)
    frames = f" ({n_frames} frames)" if n_frames > 1 else ""
    parts = [
        f"{modem.payload_bytes} B{frames} in {modem.packet_s(modem.payload_bits):.2f} s",
        marked("rate_bps", f"{modem.rate_bps:g} bit/s"),
        marked("head_s", f"head {modem.head_s:g} s"),
        marked("range_m", f"range {modem.range_m:g} m"),
        "band unknown" if modem.band_khz is None else marked("band_khz", "{:g}-{:g} kHz".format(*modem.band_khz)),
        _losses_of(modem) if modem.modulation is None else marked("modulation", modem.modulation.value),
        "source level unknown"
        if modem.source_level_db is None
        else marked("source_level_db", f"{modem.source_level_db:g} dB re 1 uPa at 1 m"),
    ]
    if modem.margin_db:
        parts.append(marked("margin_db", f"margin {modem.margin_db:g} dB"))
    if modem.receive_w is not None:
        parts.append(marked("receive_w", f"{modem.receive_w:g} W to receive"))
    return f"{modem.title}: {', '.join(parts)}"


def _losses_of(modem: Modem) -> str:
    """What is known of the losses of a modem without a modulation."""
    if not modem.per_at_snr:
        return "modulation unknown"
    return f"measured losses from {modem.per_at_snr[0][0]:g} to {modem.per_at_snr[-1][0]:g} dB"


def _studies() -> dict[str, str]:
    return {name: _first_sentence(path.read_text(encoding="utf-8")) for name, path in shipped_studies().items()}


def _first_sentence(text: str) -> str:
    """The first sentence of the comment at the top of a file.

    >>> _first_sentence("# What it is\\n# for. More of it.\\n[study]")
    'What it is for'
    """
    comment = itertools.takewhile(lambda line: line.startswith("#"), text.splitlines())
    return " ".join(line.strip("# ") for line in comment).partition(". ")[0]


LISTINGS: dict[str, Callable[[], dict[str, str]]] = {
    "scenarios": _scenarios,
    "strategies": _strategies,
    "policies": _policies,
    "channels": lambda: {name: model.title for name, model in CHANNELS.items()},
    "modems": _modems,
    "networks": lambda: {name: network.title for name, network in shipped_networks().items()},
    "studies": _studies,
}
"""Name and text of everything of a kind."""

NOTES: dict[str, str] = {
    "modems": f"{UNVERIFIED} no source was found for this number: it is an estimate",
    "networks": "source, losses and what is not known of one: remoras sea NAME",
}
"""What is to be known of a kind as a whole."""

DETAILS: dict[str, Callable[[str], dict[str, Any]]] = {"strategies": _of_strategy}
"""What else there is to say of something by its name, where there is more than one line."""
