"""Modem profiles, shipped in ``modems.toml`` or defined by a table of the user."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

FILE = "modems.toml"
MEASURED = "table"
LEAST_BYTES = 16
"""Bytes of a packet besides acknowledgements: header, a signal, a block of one fact."""
Positive = Annotated[float, Field(gt=0.0)]
Probability = Annotated[float, Field(ge=0.0, le=1.0)]


class Profile(BaseModel):
    """Modem parameters for exchange and acoustic channel, the keys of a table ``[NAME]``."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    title: str = Field("", description="one line for reports")
    payload_bytes: int = Field(ge=LEAST_BYTES, le=65_535, description="largest packet")
    frame_bytes: int | None = Field(
        None, ge=1, le=65_535, description="size of its frames, lost independently; the packet if left out"
    )
    rate_bps: Positive = Field(description="net bit rate while the payload is sent")
    head_s: float = Field(0.0, ge=0.0, description="transmission time before the payload")
    range_m: Positive = Field(description="nominal range")
    band_khz: tuple[Positive, Positive] | None = Field(
        None, description="lower and upper end of the band; the channel acoustic needs it"
    )
    modulation: Literal["fsk-noncoherent", "fsk-coherent", "psk", "dpsk", "table"] | None = Field(
        None, description="modulation, or table of measured losses; the channel acoustic needs it"
    )
    per_at_snr: tuple[tuple[float, Probability], ...] = Field(
        (),
        description="for modulation table: signal-to-noise ratio in the band (dB), rising, and packet error rate of a "
        "whole frame",
    )
    margin_db: float = Field(
        0.0,
        ge=-100.0,
        le=100.0,
        description="implementation loss of the receiver against modulation or table; shipped ones fit nominal ranges",
    )
    source_level_db: float | None = Field(
        None, ge=100.0, le=250.0, description="dB re 1 uPa at 1 m; the channel acoustic needs it, or a key of its own"
    )
    receive_w: float | None = Field(
        None, ge=0.0, le=1000.0, description="power while listening, see communication.count_listening"
    )
    unverified: tuple[str, ...] = Field((), description="keys of this table whose values are estimates")
    equipment: str = Field("AcousticModem", description="class in the ontology")


class Modem(Profile):
    """Profile with the modem's name."""

    name: str

    @property
    def payload_bits(self) -> int:
        """Largest packet (bits)."""
        return 8 * self.payload_bytes

    @property
    def frame_bits(self) -> int:
        """Size (bits) of an independently lost part of a packet."""
        return 8 * (self.frame_bytes or self.payload_bytes)

    def packet_s(self, size_bits: int) -> float:
        """Return the transmission time (s) of a packet of ``size_bits``.

        >>> round(modems()["nanomodem-v3"].packet_s(512), 3)
        1.106
        """
        return self.head_s + size_bits / self.rate_bps


@cache  # 2 ms to parse, asked for each vehicle
def modems() -> dict[str, Modem]:
    """Return the shipped profiles by name."""
    text = Path(__file__).with_name(FILE).read_text(encoding="utf-8")
    return {name: Modem(name=name, **profile) for name, profile in tomllib.loads(text).items()}
