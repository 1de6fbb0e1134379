"""Operator bans, ``[[ban]]``: facts by which a vehicle declares another's observations invalid, or valid again."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

from pydantic import Field

from missions.errors import ConfigurationFault, one_of
from missions.feature import Feature, Joining
from remoras.events import Host, Observer, say_at
from remoras.table import NotNegative, Positive, Section
from worldmodel import ontology_path
from worldmodel.holdings import BANNED_FROM

if TYPE_CHECKING:
    from pathlib import Path

    from missions.scenarios.scenario import Scenario
    from remoras.beliefs import Beliefs, Fact
    from remoras.mission import Mission

KEY = "ban"


class BanTable(Section):
    """One ``[[ban]]``."""

    issuer: str = Field(description="vehicle that issues it, entered at its console by a person")
    vehicle: str = Field(description="vehicle whose observations are excluded")
    at_s: NotNegative = Field(description="time of issue")
    from_s: int = Field(0, ge=0, le=604_800, description="time from which its observations are excluded")
    until_s: Positive | None = Field(None, description="time of withdrawal by the issuer; never if absent")

    def contradictions(self) -> Iterator[tuple[str, str]]:
        if self.vehicle == self.issuer:
            yield "issuer", "a vehicle cannot exclude itself: name another issuer"
        if self.until_s is not None and self.until_s <= self.at_s:
            yield "until_s", f"must be above at_s = {self.at_s:g}"


def ban_faults(scenario: Scenario, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Yield faults: bans that name unknown vehicles or start after the end of the mission."""
    vehicles = scenario.vehicle_names
    for number, table in enumerate(scenario.of_feature(KEY), 1):
        key = f"{KEY}.{number}"
        yield from one_of(f"{key}.issuer", table.issuer, vehicles)
        yield from one_of(f"{key}.vehicle", table.vehicle, vehicles)
        yield from scenario.after_end(f"{key}.at_s", table.at_s)


def stated(vehicle: str, from_s: float | None) -> Callable[[Beliefs], list[Fact]]:
    """Return a builder of the fact that excludes observations of ``vehicle`` from ``from_s``; None lifts the ban."""

    def facts(beliefs: Beliefs) -> list[Fact]:
        latest_s = beliefs.model.tbox.attribute_named(BANNED_FROM).fields[0].maximum
        # Facts cannot be deleted: a ban from the latest possible time on excludes nothing.
        return [beliefs.fact(vehicle, BANNED_FROM, latest_s if from_s is None else from_s)]

    return facts


class Bans(Observer):
    """Scheduler of the issuers' ban statements and withdrawals."""

    def __init__(self, joining: Joining) -> None:
        self._tables: tuple[BanTable, ...] = joining.scenario.of_feature(KEY)

    def on_start(self, host: Host) -> None:
        for table in self._tables:
            until_s, unsaid = math.inf if table.until_s is None else table.until_s, ("ban not said", table.vehicle)
            say_at(host, table.at_s, table.issuer, stated(table.vehicle, table.from_s), unsaid)
            say_at(host, until_s, table.issuer, stated(table.vehicle, None), unsaid)


def words(scenario: Scenario) -> Sequence[Path]:
    """Return the Turtle file that defines bans if the scenario has any."""
    return (ontology_path("bans"),) if scenario.of_feature(KEY) else ()


FEATURE = Feature(
    {"": {KEY: (tuple[BanTable, ...], ())}},
    Bans,
    ban_faults,
    words,
    (BANNED_FROM,),
    for_all=(BANNED_FROM,),
)
