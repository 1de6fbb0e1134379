"""Modem profiles, shipped in ``modems.toml`` or defined by a table of the user."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from exchange.acoustics.error_rates import Modulation

FILE = "modems.toml"
"""File of the shipped profiles."""
MEASURED = "table"
"""Modulation of a profile with measured losses."""


@dataclass(frozen=True, slots=True)
class Modem:
    """Modem parameters for exchange and acoustic channel.

    Attributes:
        payload_bytes: largest packet.
        frame_bytes: independently lost part of a packet; the packet if it has no frames.
        rate_bps: net rate during the payload.
        head_s: time before the payload (preamble, cycle initialisation).
        band_khz: lower and upper end of the band; None if unknown.
        modulation: None if unknown or if losses were measured.
        per_at_snr: measured losses: in-band signal-to-noise ratio (dB, rising), packet error rate of a whole frame.
        margin_db: shortfall of the receiver against modulation or curve; fitted to the nominal range.
        source_level_db: dB re 1 uPa at 1 m; None if unknown.
        receive_w: listening power, used with ``communication.count_listening``, else part of ``hotel_w``; None if
            unknown.
        unverified: names of fields that are estimates without a source.
        equipment: its class in the ontology.
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
        """Largest packet (bits)."""
        return 8 * self.payload_bytes

    def packet_s(self, size_bits: int) -> float:
        """Return the transmission time (s) of a packet of ``size_bits``.

        >>> round(modems()["nanomodem-v3"].packet_s(512), 3)
        1.106
        """
        return self.head_s + size_bits / self.rate_bps


@cache
def modems() -> dict[str, Modem]:
    """Return the shipped profiles by name."""
    text = Path(__file__).with_name(FILE).read_text(encoding="utf-8")
    return {name: modem_of(name, profile) for name, profile in tomllib.loads(text).items()}


def modem_of(name: str, profile: Mapping[str, Any]) -> Modem:
    """Return the profile of a table with valid values.

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
