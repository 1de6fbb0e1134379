"""``lost``: a vehicle stops working."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from missions.errors import ConfigurationFault
from missions.fault import Absence
from missions.scenarios.faults import DeclaredFault
from missions.scenarios.scenario import Scenario
from remoras.condition import Condition
from remoras.faults import ANY
from remoras.mission import Mission


class Lost(DeclaredFault):
    """One ``[[fault]]`` of kind ``lost``."""

    NUMBER = 0
    CONDITION = Condition(is_running=False)
    TEXT = "all its functions fail"
    ABSENCE = Absence.LOSS
    DISABLES = True

    def checks(
        self, key: str, scenario: Scenario, mission: type[Mission], before: Sequence[tuple[str, DeclaredFault]]
    ) -> Iterator[ConfigurationFault]:
        first = next((where for where, other in before if self.overlaps(other)), None)
        if self.vehicle != ANY and first is not None:
            allowed = f"lost twice, here and by {first}; the first has to end by its until_s before the other"
            yield ConfigurationFault(f"{key}.vehicle", "", allowed)


KIND = Lost
