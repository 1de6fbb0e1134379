"""Modem profiles, read from ``modems.toml`` beside this file."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources


@dataclass(frozen=True, slots=True)
class Modem:
    """What the exchange needs to know of a modem.

    Attributes:
        payload_bytes: largest packet.
        rate_bps: net rate while the payload is sent.
        head_s: time before the payload (preamble, cycle initialisation).
        range_m: nominal range.
        equipment: class of the ontology that it is of.
    """

    name: str
    title: str
    payload_bytes: int
    rate_bps: float
    head_s: float
    range_m: float
    equipment: str = "AcousticModem"

    @property
    def payload_bits(self) -> int:
        """Largest packet, in bits."""
        return 8 * self.payload_bytes

    def packet_s(self, size_bits: int) -> float:
        """Time on the air of a packet of ``size_bits``.

        >>> round(modems()["nanomodem-v3"].packet_s(512), 3)
        1.106
        """
        return self.head_s + size_bits / self.rate_bps


@cache
def modems() -> dict[str, Modem]:
    """The shipped profiles by name."""
    text = resources.files("exchange.acoustics").joinpath("modems.toml").read_text(encoding="utf-8")
    return {name: Modem(name=name, **profile) for name, profile in tomllib.loads(text).items()}
