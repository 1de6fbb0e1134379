"""``biased``: readings of an attribute by one or all sensors have an unknown offset."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar

from pydantic import Field

from missions.errors import ConfigurationFault, one_of
from missions.scenarios.faults import DeclaredFault, FaultOfSensors, one_or_two
from missions.scenarios.knowledge import words_in
from missions.scenarios.scenario import Scenario
from remoras.condition import Condition
from remoras.database import VehicleData
from remoras.mission import Mission
from remoras.sensor import Observation
from remoras.table import PointM
from worldmodel import TBox

AN_OFFSET = "a number, or [east, north] for a point"


@dataclass(frozen=True, slots=True)
class Bias:
    """Offset (one number or two) of sensor readings, clipped to the attribute's range."""

    attribute: str
    offset: tuple[float, ...]
    sensors: tuple[str, ...]

    def __call__(self, sensor: str, observation: Observation, tbox: TBox) -> Observation:
        """Return the observation with the offset added to the readings of these sensors."""
        if sensor not in self.sensors or not observation.facts:
            return observation
        facts = list(observation.facts)
        for position, (subject, attribute, value, *rest) in enumerate(facts):
            if attribute != self.attribute:
                continue
            fields = tbox.attribute_named(attribute).fields
            numbers: Any = value if isinstance(value, tuple) else (value,)
            pairs = zip(numbers, self.offset, fields, strict=True)
            off = [min(max(n + by, field.minimum), field.maximum) for n, by, field in pairs]
            read: Any = (subject, attribute, tuple(off) if len(off) > 1 else off[0], *rest)
            facts[position] = read
        return replace(observation, facts=tuple(facts))


class Biased(FaultOfSensors):
    """One ``[[fault]]`` of kind ``biased``."""

    NUMBER = 6
    TEXT = "its sensor readings of attribute have an error of offset"
    REQUIRED: ClassVar[Mapping[str, str]] = {
        "attribute": "required by kind biased: of which attribute readings are off",
        "offset": "required by kind biased: by how much",
    }

    attribute: str | None = Field(None, description="attribute of the wrong facts")
    offset: Annotated[float | PointM | None, one_or_two(AN_OFFSET)] = Field(
        None, description="offset of a number, or [east, north] of a point"
    )

    @property
    def by(self) -> tuple[float, ...]:
        """Offset as a tuple: one number, or (east, north)."""
        return self.offset if isinstance(self.offset, tuple) else (self.offset or 0.0,)

    def detail(self, data: VehicleData, how_long: str) -> str:
        off = ", ".join(f"{offset:g}" for offset in self.by)
        return f"{', '.join(self.of(data))}: {self.attribute} off by {off}, {how_long}"

    def leaves(self, data: VehicleData) -> Condition:
        return Condition(readings=(Bias(self.attribute or "", self.by, self.of(data)),))

    def checks(
        self, key: str, scenario: Scenario, mission: type[Mission], before: Sequence[tuple[str, DeclaredFault]]
    ) -> Iterator[ConfigurationFault]:
        yield from super().checks(key, scenario, mission, before)
        tbox = words_in(scenario, mission)
        axes = {a.name: len(a.fields) for a in tbox.attributes if a.fields} if tbox is not None else {}
        if axes:
            yield from one_of(f"{key}.attribute", self.attribute, sorted(axes))
        # An unknown attribute has its own fault, hence no second one about the dimension.
        if self.offset is not None and len(self.by) != axes.get(self.attribute or "", len(self.by)):
            kind = "point: [east, north]" if axes[self.attribute or ""] == 2 else "number: one number"
            yield ConfigurationFault(f"{key}.offset", "", f"{self.attribute} is a {kind}")


KIND = Biased
