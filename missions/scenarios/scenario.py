"""Scenario: the frozen input of a run; missions extend its tables by subclasses, named in their ``Scenario``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated, Any, Final, Self

import tomli_w
from pydantic import ConfigDict, Field, SerializeAsAny

from exchange.channel.models import Deployment
from missions.errors import ConfigurationFault
from missions.scenarios.channel import ChannelTable
from missions.scenarios.communication import Communication, ModemTable, modem_named
from missions.scenarios.faults import DeclaredFault
from missions.scenarios.features import with_features
from missions.scenarios.fleet import MAX_VEHICLES, FleetTable, VehicleTable
from missions.scenarios.knowledge import WorldModelTable
from missions.scenarios.organisation import GroupTable, Role
from remoras.executive.decision import DecisionTable
from remoras.motion.attraction import GuidanceTable
from remoras.table import RISING, Name, PointM, Section, Sparse, unless

BY_GROUPS: Final = "groups"  # needs follow from groups; otherwise all vehicles have equal needs
HELD: Final = "held by head"  # information about jobs is held by the group leader instead of all members


class About(Sparse):
    """The table ``[scenario]``."""

    UNSAID = frozenset({"settle_s", "metrics"})

    name: Name = Field(description="name of the scenario; used in file names and results")
    title: str = Field("", description="one line for reports")
    mission: str = Field(description="mission class as package.module:object")
    duration_s: float = Field(gt=0.0, le=604_800.0, description="end of the run if the mission has not completed")
    tick_s: float = Field(1.0, ge=0.01, le=1.0, description="motion tick")
    settle_s: float = Field(
        0.0,
        ge=0.0,
        le=604_800.0,
        description="maximum duration of the exchange after the mission, until all items are delivered",
    )
    metrics: tuple[str, ...] = Field(
        (), description="additional metrics in the summary, each package.module:object or file.py:object"
    )


Coordinate = Annotated[float, Field(ge=-100_000.0, le=100_000.0)]
"""Coordinate (m) on the planar map, limited as the greatest operating range of modems."""
Borders = Annotated[tuple[Coordinate, Coordinate], RISING]
Latitude = Annotated[float, Field(ge=-89.0, le=89.0)]  # latitude (deg) where east and north are defined
Longitude = Annotated[float, Field(ge=-180.0, le=180.0)]


class World(Section):
    """The table ``[world]``."""

    x_m: Borders = Field(description="west and east border of the area of operations")
    y_m: Borders = Field(description="south and north border of the area of operations")
    sound_speed_mps: float = Field(
        1500.0,
        ge=1400.0,
        le=1600.0,
        description="speed of sound in water; the channel acoustic has its own, from temperature and salinity",
    )
    origin_deg: tuple[Latitude, Longitude] | None = Field(
        None,
        description="latitude -89 to 89 and longitude -180 to 180 (WGS 84) of the point x = 0, y = 0; "
        "maps need it, no run depends on it",
    )

    @property
    def box_m(self) -> tuple[float, float, float, float]:
        """Borders of the operations (x_min, y_min, x_max, y_max)."""
        return self.x_m[0], self.y_m[0], self.x_m[1], self.y_m[1]

    def holds(self, place_m: PointM) -> bool:
        """Return whether a place is within the borders."""
        (x_m, y_m), (x_min, y_min, x_max, y_max) = place_m, self.box_m
        return x_min <= x_m <= x_max and y_min <= y_m <= y_max

    def outside(self, places_m: Iterable[tuple[str, PointM]]) -> Iterator[ConfigurationFault]:
        """Yield faults of positions, by key, outside the world."""
        x_min, y_min, x_max, y_max = self.box_m
        for key, (x, y) in places_m:
            if not self.holds((x, y)):
                allowed = f"outside the world, x {x_min} to {x_max}, y {y_min} to {y_max}"
                yield ConfigurationFault(key, f"[{x}, {y}]", allowed)


class StrategyTable(Section):
    """The table ``[strategy]``."""

    name: str = Field(description="organisational strategy, a shipped name or package.module:object")
    parameters: dict[str, Any] = Field(  # the strategy validates them
        {}, description="parameters of the strategy, see `remoras list strategies`; others keep their defaults"
    )


class RallyPoint(Section):
    """One ``[[rally_point]]``."""

    name: Name = Field(description="name of the rally point")
    position_m: PointM = Field(description="x east, y north")


@with_features("")
class Scenario(Sparse):
    """Input of a run; a mission with further tables subclasses it.

    >>> from missions.scenarios import load
    >>> scenario: Scenario = load("mapping-rendezvous")
    >>> scenario.vehicle_names, scenario.channel.name
    (['ASV00', 'AUV00', 'AUV01', 'AUV02'], 'bernoulli')
    """

    model_config = ConfigDict(json_schema_extra=unless("organisation", "group"))
    UNSAID = frozenset({"role", "group_template", "worldmodel", "modem"})

    organisation: str | None = Field(
        None,
        exclude=True,
        description="file with role, group_template and group, relative to this one; else they are here",
    )
    scenario: About
    world: World
    communication: Communication
    modem: dict[Name, ModemTable] = Field({}, description="additional modems by name, a table each")
    channel: ChannelTable
    strategy: StrategyTable
    decision: DecisionTable = DecisionTable.usual()
    guidance: GuidanceTable = GuidanceTable.usual()
    mission: Section = Field(Section.usual(), description="settings of the mission")
    worldmodel: WorldModelTable = WorldModelTable.usual()
    rally_point: tuple[RallyPoint, ...] = ()
    role: tuple[dict[str, Any], ...] = Field(
        (), description="roles that roles of groups extend, a table each, with the keys of a group.role"
    )
    group_template: tuple[dict[str, Any], ...] = Field(
        (), description="common parts of groups, a table each, with the keys of a group; `extends` names others"
    )
    group: tuple[GroupTable, ...] = Field(min_length=1)
    fleet: FleetTable | None = Field(None, exclude=True)
    vehicle: tuple[VehicleTable, ...] = Field(min_length=1, max_length=MAX_VEHICLES)
    fault: SerializeAsAny[tuple[DeclaredFault, ...]] = ()

    @property
    def vehicle_names(self) -> list[str]:
        """Names of the vehicles in file order."""
        return [vehicle.name for vehicle in self.vehicle]

    @property
    def roles(self) -> dict[tuple[str, str], Role]:
        """All roles by (group, role)."""
        return {(group.name, role.name): role for group in self.group for role in group.role}

    def for_seed(self, seed: int) -> Self:
        """Return the scenario of a run; a mission with grounds drawn by the seed overrides it."""
        return self

    def able_to_play(self, group: str, role: str) -> list[VehicleTable]:
        """Return the vehicles able to play a role of a group."""
        return [vehicle for vehicle in self.vehicle if vehicle.can_play(group, role)]

    def after_end(self, key: str, at_s: float) -> Iterator[ConfigurationFault]:
        """Yield a fault of a time after the end of the mission."""
        if at_s >= (end_s := self.scenario.duration_s):
            allowed = f"must be below scenario.duration_s = {end_s:g}, when the mission is over"
            yield ConfigurationFault(key, "", allowed)

    def taken_names(self, *more: str) -> dict[str, str]:
        """Return the kind of table by name, for vehicles, groups, rally points and ``more``."""
        kinds = ("vehicle", "group", "rally_point", *more)
        # Reversed, so that a vehicle wins over a group of its name.
        return {entry.name: kind for kind in reversed(kinds) for entry in getattr(self, kind)}

    @property
    def deployment(self) -> Deployment:
        """Fleet as seen by channel models."""
        by_node = sorted(self.vehicle, key=lambda table: table.slot)
        return Deployment(
            nodes={table.name: table.slot for table in by_node},
            depths_m=tuple(table.depth_m for table in by_node),
            modem=modem_named(self.communication.modem, self.modem),
            range_m=self.communication.range_m,
            duration_s=self.scenario.duration_s,
        )

    @property
    def sound_speed_mps(self) -> float:
        """Speed of sound (m/s) of the channel model, else of the world."""
        speed_mps = self.channel.sound_speed_mps(self.deployment)
        return self.world.sound_speed_mps if speed_mps is None else speed_mps

    @property
    def names_by_slot(self) -> list[str]:
        """Names of the vehicles in node order."""
        return [vehicle.name for vehicle in sorted(self.vehicle, key=lambda vehicle: vehicle.slot)]

    @property
    def text(self) -> str:
        """Resolved scenario as TOML."""
        return tomli_w.dumps(self.model_dump(mode="json", exclude_none=True))

    def __repr__(self) -> str:
        named = f"strategy {self.strategy.name}, policy {self.communication.policy}, channel {self.channel.name}"
        return f"<Scenario {self.scenario.name}: {len(self.vehicle)} vehicles, {named}>"
