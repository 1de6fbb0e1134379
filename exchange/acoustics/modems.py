"""Modem profiles: the shipped ones, read from ``modems.toml`` beside this file, and any others from their tables."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from exchange.acoustics.error_rates import Modulation

FILE = "modems.toml"
"""Where the profiles stand."""
MEASURED = "table"
"""Modulation of a profile whose losses were measured."""


@dataclass(frozen=True, slots=True)
class Modem:
    """What the exchange and the acoustic channel need to know of a modem.

    Attributes:
        payload_bytes: largest packet.
        frame_bytes: of its frames, each of which is lost or passes for itself; the packet if it has no frames.
        rate_bps: net rate while the payload is sent.
        head_s: time before the payload (preamble, cycle initialisation).
        range_m: nominal range.
        title: one line for listings.
        band_khz: lower and upper end of the band; None where nobody says.
        modulation: how bits are written; None where nobody says, or where losses were measured.
        per_at_snr: losses that were measured: signal-to-noise ratio in the band (dB), by which they are sorted, and the
            packet error rate of a whole frame.
        margin_db: by which its receiver falls short of its modulation or its curve; fitted to its nominal range.
        source_level_db: dB re 1 uPa at 1 m; None where nobody says.
        receive_w: power while it listens; None where nobody says. Runs count it if ``communication.count_listening``
            is set; else the ``hotel_w`` of the vehicles has it.
        unverified: names of those numbers above that no source was found for: estimates.
        equipment: class of the ontology that it is of.
    """

    name: str
    payload_bytes: int
    frame_bytes: int
    rate_bps: float
    head_s: float
    range_m: float
    title: str = ""
    band_khz: tuple[float, float] | None = None
    modulation: Modulation | None = None
    per_at_snr: tuple[tuple[float, float], ...] = ()
    margin_db: float = 0.0
    source_level_db: float | None = None
    receive_w: float | None = None
    unverified: tuple[str, ...] = ()
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
    text = Path(__file__).with_name(FILE).read_text(encoding="utf-8")
    return {name: modem_of(name, profile) for name, profile in tomllib.loads(text).items()}


def modem_of(name: str, profile: Mapping[str, Any]) -> Modem:
    """The profile that a table has, whose values are right one by one.

    >>> modem_of("own", {"payload_bytes": 48, "rate_bps": 300.0, "head_s": 0.2, "range_m": 1500.0}).packet_s(384)
    1.48
    """
    values = {
        "frame_bytes": profile["payload_bytes"],
        **profile,
        "unverified": tuple(profile.get("unverified", ())),
    }
    if "band_khz" in profile:
        values["band_khz"] = tuple(profile["band_khz"])
    if "modulation" in profile:
        measured = profile["modulation"] == MEASURED
        values["modulation"] = None if measured else Modulation(profile["modulation"])
    if "per_at_snr" in profile:
        values["per_at_snr"] = tuple(map(tuple, profile["per_at_snr"]))
    return Modem(name=name, **values)
