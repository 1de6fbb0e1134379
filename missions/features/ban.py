"""Operator bans: ``[[ban]]``, by which a person at the console of one vehicle lets the fleet not believe another.

The vehicle states a fact, and takes it back by another. What comes of it is decided by every vehicle for itself, from
what it has heard; see ``worldmodel.bans``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pydantic import Field

from missions.errors import ConfigurationFault
from missions.feature import Feature, Joining
from missions.files import shown
from missions.scenarios.tables import NotNegative, Positive, Raw, Section, entries, names_of, one_of, table_of
from remoras.events import Host, Observer, Says, say_at
from worldmodel import ontology_path
from worldmodel.bans import BANNED_FROM

if TYPE_CHECKING:
    from pathlib import Path

    from missions.scenarios.scenario import Scenario
    from remoras.beliefs import Beliefs, Fact
    from remoras.mission import Mission

KEY = "ban"


class BanTable(Section):
    """One ``[[ban]]``."""

    issuer: str = Field(description="vehicle that says so, told by a person at its console")
    vehicle: str = Field(description="vehicle whose observations do not count")
    at_s: NotNegative = Field(description="when the issuer says so")
    from_s: int = Field(0, ge=0, le=604_800, description="from which time on its observations do not count")
    until_s: Positive | None = Field(None, description="when the issuer takes the ban back; never if absent")


def ban_faults(raw: Raw, mission: type[Mission] | None) -> Iterator[ConfigurationFault]:
    """Bans by vehicles or of vehicles that there are not, of the issuer itself, and at times that cannot be."""
    vehicles, end_s = names_of(raw, "vehicle"), _number(table_of(raw, "scenario"), "duration_s")
    for number, table in enumerate(entries(raw, KEY), 1):
        key, issuer, vehicle = f"{KEY}.{number}", table.get("issuer"), table.get("vehicle")
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


def stated(vehicle: str, from_s: float | None) -> Callable[[Beliefs], list[Fact]]:
    """The fact that nobody is to believe what ``vehicle`` observed from a time on (s); None takes the ban back.

    Args:
        vehicle: its name.
        from_s: from which time on.

    Returns:
        What makes it of the names that the beliefs of the issuer have.
    """

    def facts(beliefs: Beliefs) -> list[Fact]:
        latest_s = beliefs.model.tbox.attribute_named(BANNED_FROM).fields[0].maximum
        return [beliefs.fact(vehicle, BANNED_FROM, latest_s if from_s is None else from_s)]

    return facts


class Bans(Observer):
    """Lets the issuers state their bans, and take them back, at their times."""

    def __init__(self, joining: Joining) -> None:
        self._tables: tuple[BanTable, ...] = joining.scenario.of_feature(KEY)

    def on_start(self, host: Host) -> None:
        """Schedule the statements."""
        for table in self._tables:
            until_s, unsaid = math.inf if table.until_s is None else table.until_s, ("ban not said", table.vehicle)
            say_at(host, table.at_s, Says(table.issuer, stated(table.vehicle, table.from_s), unsaid))
            say_at(host, until_s, Says(table.issuer, stated(table.vehicle, None), unsaid))


def words(scenario: Scenario) -> Sequence[Path]:
    """The Turtle file with the word for bans, where a scenario has any."""
    return (ontology_path("bans"),) if scenario.of_feature(KEY) else ()


FEATURE = Feature(
    {"": {KEY: (tuple[BanTable, ...], ())}},
    Bans,
    ban_faults,
    words,
    (BANNED_FROM,),
    for_all=(BANNED_FROM,),
)
