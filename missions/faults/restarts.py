"""``restarts``: a vehicle is off, then restarts in place and regains its roles from peers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import ClassVar, Literal

from pydantic import Field

from missions.errors import ConfigurationFault
from missions.fault import Absence
from missions.scenarios.faults import DeclaredFault
from missions.scenarios.scenario import Scenario
from remoras.condition import Condition
from remoras.database import VehicleData
from remoras.mission import Mission

MOST = 3  # restarts allowed per run: packets distinguish four incarnations
KEPT, FORGOTTEN = "memory kept", "memory lost"  # endings of the detail in the table of faults


class Restarts(DeclaredFault):
    """One ``[[fault]]`` of kind ``restarts``."""

    NUMBER = 7
    CONDITION = Condition(is_running=False)
    TEXT = "it is off from at_s on and restarts at until_s"
    NOT_USED: ClassVar[Mapping[str, str]] = {"rate_per_h": "a vehicle restarts at a time: give at_s"}
    REQUIRED: ClassVar[Mapping[str, str]] = {"until_s": "missing: time of the restart"}
    ABSENCE = Absence.PAUSE
    DISABLES = True

    memory: Literal["kept", "lost"] | None = Field(
        None,
        description="whether the vehicle keeps its knowledge; lost if absent. The others restore its roles and jobs",
    )

    def detail(self, data: VehicleData, how_long: str) -> str:
        return f"off {how_long}, {KEPT if self.memory == 'kept' else FORGOTTEN}"

    @property
    def remembers(self) -> bool:
        return self.memory == "kept"

    @classmethod
    def began_anew(cls, detail: str) -> bool | None:
        return detail.endswith(KEPT)

    def checks(
        self, key: str, scenario: Scenario, mission: type[Mission], before: Sequence[tuple[str, DeclaredFault]]
    ) -> Iterator[ConfigurationFault]:
        # The epoch in a packet has two bits: a further incarnation would be taken for the first.
        if len(before) >= MOST:
            allowed = f"restarts for the {len(before) + 1}th time: {MOST} times are allowed in a run"
            yield ConfigurationFault(f"{key}.vehicle", "", allowed)
        elif any(self.overlaps(fault) for _, fault in before):
            allowed = "restarts while it is off already; one has to be over by its until_s before the other"
            yield ConfigurationFault(f"{key}.vehicle", "", allowed)


KIND = Restarts
