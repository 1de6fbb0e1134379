"""Head counts: ``[[headcount]]`` records the number of live vehicles at given times."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from pydantic import Field

from missions.errors import ConfigurationFault
from missions.feature import Feature, Joining
from remoras.events import Host, Observer, Priority
from remoras.recorder import TIME, Column, Table
from remoras.table import NotNegative, Section

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario
    from remoras.mission import Mission

KEY = "headcount"
HEADCOUNT = Table("headcount", (TIME, Column("alive", "int")))


class HeadcountTable(Section):
    """One ``[[headcount]]``."""

    at_s: NotNegative = Field(description="time of the count")


def headcount_faults(scenario: Scenario, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Yield a fault for each count after the end of the mission."""
    for number, table in enumerate(scenario.of_feature(KEY), 1):
        yield from scenario.after_end(f"{KEY}.{number}.at_s", table.at_s)


def count(host: Host) -> None:
    """Write a row: an event of the run."""
    alive = sum(host.named(name).is_alive for name in host.names)
    host.recorder.rows(HEADCOUNT.name).append((host.now_s, alive))


class HeadCounts(Observer):
    """Counts of a run."""

    def __init__(self, joining: Joining) -> None:
        joining.recorder.declare(HEADCOUNT)
        self.tables = joining.scenario.of_feature(KEY)

    def on_start(self, host: Host) -> None:
        """Schedule all counts."""
        for table in self.tables:
            host.at(table.at_s, Priority.FAULT, count)


FEATURE = Feature({"": {KEY: (tuple[HeadcountTable, ...], ())}}, HeadCounts, headcount_faults)
