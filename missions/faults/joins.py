"""``joins``: a vehicle is absent until it joins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import ClassVar

from missions.errors import ConfigurationFault
from missions.fault import Absence
from missions.scenarios.faults import DeclaredFault
from missions.scenarios.scenario import Scenario
from remoras.condition import Condition
from remoras.database import VehicleData
from remoras.mission import Mission


class Joins(DeclaredFault):
    """One ``[[fault]]`` of kind ``joins``."""

    NUMBER = 5
    CONDITION = Condition(is_there=False)
    TEXT = "it is absent before at_s"
    NOT_USED: ClassVar[Mapping[str, str]] = {
        "rate_per_h": "a vehicle joins at a time: give at_s",
        "until_s": "a vehicle that has joined stays; leave until_s out, or add a fault of kind lost",
    }
    ABSENCE = Absence.BEFORE

    def detail(self, data: VehicleData, how_long: str) -> str:
        return f"away {how_long}"

    def holds_s(self, at_s: float) -> tuple[float, float]:
        return 0.0, at_s

    def checks(
        self, key: str, scenario: Scenario, mission: type[Mission], before: Sequence[tuple[str, DeclaredFault]]
    ) -> Iterator[ConfigurationFault]:
        if self.span_s is not None and self.span_s[0] <= 0.0:
            allowed = "must be above 0: a vehicle that is there from the start does not join"
            yield ConfigurationFault(f"{key}.at_s", "", allowed)
        if before:
            allowed = f"joins twice, here and by {before[0][0]}: leave one out"
            yield ConfigurationFault(f"{key}.vehicle", "", allowed)


KIND = Joins
