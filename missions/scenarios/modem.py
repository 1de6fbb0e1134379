"""Modem profiles of scenarios: the shipped ones by name, and a user's own, each a table ``[modem.NAME]``.

A modem of one's own may stand in a file, which ``communication.modem`` names in place of the modem. It is read once, as
the scenario is: its table becomes part of the scenario, goes into the manifest of a run and into the keys of a sweep.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from exchange.acoustics.modems import MEASURED, Modem, modem_of, modems
from missions.document import Document
from missions.errors import ConfigurationFault
from missions.files import LARGEST_BYTES, is_file, shown, text_of
from missions.scenarios.tables import one_of
from remoras.table import NotNegative, Positive, Probability, Section

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario

TABLE, KEY = "modem", "communication.modem"
"""Table of a scenario that has a user's own modems by name; and the key that names the one in use."""
CURVE = "per_at_snr"
"""Key of the losses that were measured."""
LEAST_BYTES = 16
"""A packet needs them beside its acknowledgements: its head, a signal, a block of one fact."""


class ModemTable(Section):
    """One ``[modem.NAME]``: the profile of a modem."""

    title: str = Field("", description="one line for reports")
    payload_bytes: int = Field(ge=LEAST_BYTES, le=65_535, description="largest packet")
    frame_bytes: int | None = Field(
        None, ge=1, le=65_535, description="of its frames, each lost or passed for itself; the packet if left out"
    )
    rate_bps: Positive = Field(description="net bit rate while the payload is sent")
    head_s: NotNegative = Field(0.0, description="time on the air before the payload")
    range_m: Positive = Field(description="nominal range")
    band_khz: tuple[Positive, Positive] | None = Field(
        None, description="lower and upper end of the band; the channel acoustic needs it"
    )
    modulation: Literal["fsk-noncoherent", "fsk-coherent", "psk", "dpsk", "table"] | None = Field(
        None, description="how bits are written, or table where losses were measured; the channel acoustic needs it"
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
        description="by which the receiver falls short of its modulation or table; shipped ones fit nominal ranges",
    )
    source_level_db: float | None = Field(
        None, ge=100.0, le=250.0, description="dB re 1 uPa at 1 m; the channel acoustic needs it, or a key of its own"
    )
    receive_w: float | None = Field(
        None, ge=0.0, le=1000.0, description="power while it listens, see communication.count_listening"
    )
    unverified: tuple[str, ...] = Field((), description="keys of this table whose values are estimates")
    equipment: str = Field("AcousticModem", description="class of the ontology that it is of")

    def contradictions(self) -> Iterator[tuple[str, str]]:
        """Frames larger than packets, a band in the wrong order, a curve that is missing, in vain, or out of order."""
        if self.frame_bytes is not None and self.frame_bytes > self.payload_bytes:
            yield "frame_bytes", f"allowed: up to payload_bytes = {self.payload_bytes}"
        if self.band_khz is not None and self.band_khz[0] >= self.band_khz[1]:
            yield "band_khz", "the lower end must come first"
        curve, is_measured = self.per_at_snr, self.modulation == MEASURED
        if is_measured and len(curve) < 2:
            yield CURVE, f'{len(curve)} points; modulation = "{MEASURED}" needs 2 or more, [[snr_db, per], ...]'
        if curve and not is_measured:
            yield CURVE, f'has an effect with modulation = "{MEASURED}" alone'
        for (before_db, _), (snr_db, _) in pairwise(curve):
            if snr_db <= before_db:
                yield CURVE, f"{snr_db:g} dB comes behind {before_db:g} dB; sort its points by rising SNR, each once"
                break
        for marked in self.unverified:
            yield from _allowed("unverified", marked, sorted(self.model_fields_set - {"unverified"}))


def _allowed(key: str, given: str, names: Sequence[str]) -> Iterator[tuple[str, str]]:
    yield from ((key, fault.allowed) for fault in one_of(key, given, names))


def modem_named(name: str, own: Mapping[str, ModemTable]) -> Modem:
    """The profile of a modem, one of a checked scenario's own or a shipped one.

    >>> modem_named("nanomodem-v3", {}).payload_bytes
    64
    """
    return modem_of(name, own[name].model_dump(mode="json", exclude_none=True)) if name in own else modems()[name]


def modem_in(scenario: Scenario) -> Modem | None:
    """The modem of a scenario that is being checked; None if there is none of the name."""
    name, own = scenario.communication.modem, scenario.modem
    return modem_named(name, own) if name in {**own, **modems()} else None


def with_modem_read(document: Document, folder: Path) -> tuple[Document, list[ConfigurationFault]]:
    """A scenario with the modem of the file that ``communication.modem`` names, and what is wrong with the file.

    Args:
        document: the scenario with overrides applied.
        folder: that the path of the file starts from.

    Returns:
        The document with that file as a part of it, in which the modem is one of the scenario's own; faults.

    Raises:
        ConfigurationError: the file cannot be read, or is not TOML.
    """
    communication, own = document.raw.get("communication"), document.raw.get(TABLE, {})
    given = communication.get("modem") if isinstance(communication, dict) else None
    if not isinstance(communication, dict) or not isinstance(given, str) or not given.endswith(".toml"):
        return document, []
    path = folder / given
    if not is_file(path):
        allowed = f"there is no file {path}; allowed: a TOML file with one [modem.NAME], or {', '.join(modems())}"
        return document, [ConfigurationFault(KEY, shown(given), allowed)]
    part = Document.of_text(text_of(path, LARGEST_BYTES), str(path))
    found: Any = part.raw.get(TABLE)
    if set(part.raw) != {TABLE} or not isinstance(found, dict) or len(found) != 1 or not isinstance(own, dict):
        allowed = f"{path} must hold one table [modem.NAME] and nothing else"
        return document, [ConfigurationFault(KEY, shown(given), allowed)]
    (name,) = found
    faults = []
    if name in own:
        key, allowed = f"{TABLE}.{name}", f"{path} has one of this name, too; rename one of them"
        faults.append(ConfigurationFault(key, "", allowed, document.line_of(key), document.path))
    raw = {**document.raw, TABLE: {**own, **found}, "communication": {**communication, "modem": name}}
    return replace(document, raw=raw, parts=(*document.parts, part)), faults


def modem_faults(scenario: Scenario) -> Iterator[ConfigurationFault]:
    """A modem that is none of those known, one of a taken name, and a power that its profile does not have."""
    communication, own = scenario.communication, scenario.modem
    yield from one_of(KEY, communication.modem, list({**own, **modems()}))
    for name in own.keys() & modems():
        yield ConfigurationFault(f"{TABLE}.{name}", "", "is the name of a shipped profile; give it another")
    modem = modem_in(scenario)
    counts = communication.count_listening and communication.receive_power_w is None
    if counts and modem is not None and modem.receive_w is None:
        allowed = f"the profile {modem.name} has no receive_w; set communication.receive_power_w (W)"
        yield ConfigurationFault("communication.count_listening", "", allowed)
