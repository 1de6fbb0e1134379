"""Bans: ``[[ban]]``, by which a person at the console of one vehicle lets the fleet not believe another."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from pydantic import Field

from missions.errors import ConfigurationFault
from missions.files import shown
from missions.scenarios.tables import NotNegative, Positive, Raw, Section, entries, names_of, one_of, table_of
from remoras.bans import Ban
from worldmodel import ban_ontology_path


class BanTable(Section):
    """One ``[[ban]]``."""

    issuer: str = Field(description="vehicle that says so, told by a person at its console")
    vehicle: str = Field(description="vehicle whose observations do not count")
    at_s: NotNegative = Field(description="when the issuer says so")
    from_s: int = Field(0, ge=0, le=604_800, description="from which time on its observations do not count")
    until_s: Positive | None = Field(None, description="when the issuer takes the ban back; never if absent")

    def declared(self) -> Ban:
        """The ban as a value."""
        until_s = math.inf if self.until_s is None else self.until_s
        return Ban(self.issuer, self.vehicle, self.at_s, self.from_s, until_s)


class _WithBans(Protocol):
    @property
    def ban(self) -> Sequence[BanTable]: ...


def ban_words(scenario: _WithBans) -> tuple[Path, ...]:
    """The Turtle file with the word for bans, where a scenario has any; items are numbered by their words."""
    return (ban_ontology_path(),) if scenario.ban else ()


def ban_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """Bans by vehicles or of vehicles that there are not, of the issuer itself, and at times that cannot be.

    Args:
        raw: the tables as TOML has them.
    """
    vehicles, end_s = names_of(raw, "vehicle"), _number(table_of(raw, "scenario"), "duration_s")
    for number, table in enumerate(entries(raw, "ban"), 1):
        key, issuer, vehicle = f"ban.{number}", table.get("issuer"), table.get("vehicle")
        yield from one_of(f"{key}.issuer", issuer, vehicles)
        yield from one_of(f"{key}.vehicle", vehicle, vehicles)
        if vehicle in vehicles and vehicle == issuer:
            allowed = "what a vehicle says of itself does not count: name another issuer"
            yield ConfigurationFault(f"{key}.issuer", shown(issuer), allowed)
        at_s, until_s = _number(table, "at_s"), _number(table, "until_s")
        if at_s is not None and end_s is not None and at_s >= end_s:
            allowed = f"must be below scenario.duration_s = {end_s:g}, when the mission is over"
            yield ConfigurationFault(f"{key}.at_s", shown(table["at_s"]), allowed)
        if at_s is not None and until_s is not None and until_s <= at_s:
            yield ConfigurationFault(f"{key}.until_s", shown(until_s), f"must be above at_s = {at_s:g}")


def _number(table: Mapping[str, Any], key: str) -> float | None:
    value = table.get(key)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
