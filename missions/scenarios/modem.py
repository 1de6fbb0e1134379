"""Modem profiles of scenarios: the shipped ones by name, and a user's own, each a table ``[modem.NAME]``.

A modem of one's own may stand in a file, which ``communication.modem`` names in place of the modem. It is read once, as
the scenario is: its table becomes part of the scenario, goes into the manifest of a run and into the keys of a sweep.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError

from exchange.acoustics.modems import MEASURED, Modem, modem_of, modems
from missions.document import Document
from missions.errors import ConfigurationFault
from missions.files import LARGEST_BYTES, is_file, shown, text_of
from missions.scenarios.tables import (
    NotNegative,
    Positive,
    Probability,
    Raw,
    Section,
    is_number,
    list_of,
    one_of,
    point_of,
    table_of,
)

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


def modem_named(name: str, own: Mapping[str, ModemTable]) -> Modem:
    """The profile of a modem, one of a checked scenario's own or a shipped one.

    >>> modem_named("nanomodem-v3", {}).payload_bytes
    64
    """
    return modem_of(name, own[name].model_dump(mode="json", exclude_none=True)) if name in own else modems()[name]


def modem_in(raw: Raw) -> Modem | None:
    """The modem that tables name which are not checked yet; None if there is none, or if its own table is malformed."""
    name, own = table_of(raw, "communication").get("modem"), table_of(raw, TABLE)
    if not isinstance(name, str) or name not in own:
        return modems().get(str(name))
    try:
        table = ModemTable.model_validate_json(json.dumps(own[name], default=str), strict=True)
        return modem_named(name, {name: table})
    except ValidationError:
        return None


def with_modem_read(
    document: Document, raw: dict[str, Any], options: Collection[str]
) -> tuple[Document, dict[str, Any], list[ConfigurationFault]]:
    """A scenario with the modem of the file that ``communication.modem`` names, or what is wrong with the file.

    Args:
        document: the scenario, whose place its files are relative to.
        raw: its tables with overrides applied.
        options: dotted keys of the overrides; a file that one of them names is looked for in the current folder.

    Returns:
        The document with that file as a part of it; tables in which the modem is one of the scenario's own; faults.

    Raises:
        ConfigurationError: the file cannot be read, or is not TOML.
    """
    communication: Mapping[str, Any] = table_of(raw, "communication")
    given = communication.get("modem")
    if not isinstance(given, str) or not given.endswith(".toml"):
        return document, raw, []
    path = (Path() if {KEY, "communication"} & set(options) else Path(document.path).parent) / given
    if not is_file(path):
        allowed = f"there is no file {path}; allowed: a TOML file with one [modem.NAME], or {', '.join(modems())}"
        return document, raw, [ConfigurationFault(KEY, shown(given), allowed)]
    part = Document.of_text(text_of(path, LARGEST_BYTES), str(path))
    found, own = table_of(part.raw, TABLE), table_of(raw, TABLE)
    if set(part.raw) != {TABLE} or len(found) != 1:
        allowed = f"{path} must hold one table [modem.NAME] and nothing else"
        return document, raw, [ConfigurationFault(KEY, shown(given), allowed)]
    (name,) = found
    faults = []
    if name in own:
        key, allowed = f"{TABLE}.{name}", f"{path} has one of this name, too; rename one of them"
        faults.append(ConfigurationFault(key, "", allowed, document.line_of(key), document.path))
    tables = {**raw, TABLE: {**own, **found}, "communication": {**communication, "modem": name}}
    return replace(document, parts=(*document.parts, part)), tables, faults


def modem_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """A modem that is none of those known, and what has to hold within the tables of a user's own."""
    own = table_of(raw, TABLE)
    yield from one_of(KEY, table_of(raw, "communication").get("modem"), list({**own, **modems()}))
    for name, table in own.items():
        if isinstance(table, dict):
            yield from _faults_of(name, table)


def _faults_of(name: str, table: Raw) -> Iterator[ConfigurationFault]:
    key = f"{TABLE}.{name}"
    if name in modems():
        yield ConfigurationFault(key, "", "is the name of a shipped profile; give it another")
    frame_bytes, payload_bytes = table.get("frame_bytes"), table.get("payload_bytes")
    if is_number(frame_bytes) and is_number(payload_bytes) and frame_bytes > payload_bytes:
        allowed = f"allowed: up to payload_bytes = {payload_bytes}"
        yield ConfigurationFault(f"{key}.frame_bytes", shown(frame_bytes), allowed)
    for low_khz, high_khz in point_of(table, "band_khz"):
        if low_khz >= high_khz:
            yield ConfigurationFault(f"{key}.band_khz", shown([low_khz, high_khz]), "the lower end must come first")
    yield from _curve_faults(key, table)
    for marked in list_of(table, "unverified"):
        yield from one_of(f"{key}.unverified", marked, sorted(table.keys() - {"unverified"}))


def _curve_faults(key: str, table: Raw) -> Iterator[ConfigurationFault]:
    """A table of losses that is missing, in vain, or out of order."""
    curve, is_measured = list_of(table, CURVE), table.get("modulation") == MEASURED
    if is_measured and len(curve) < 2:
        allowed = f'{len(curve)} points; modulation = "{MEASURED}" needs 2 or more, [[snr_db, per], ...]'
        yield ConfigurationFault(f"{key}.{CURVE}", "", allowed)
    if curve and not is_measured:
        allowed = f'has an effect with modulation = "{MEASURED}" alone'
        yield ConfigurationFault(f"{key}.{CURVE}", shown(table[CURVE]), allowed)
    ratios_db = [point[0] for point in curve if isinstance(point, list) and point and is_number(point[0])]
    for before_db, snr_db in pairwise(ratios_db):
        if snr_db <= before_db:
            allowed = f"{snr_db:g} dB comes behind {before_db:g} dB; sort its points by rising SNR, each once"
            yield ConfigurationFault(f"{key}.{CURVE}", shown(curve), allowed)
            return
