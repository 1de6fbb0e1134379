"""Scenario: the frozen input of a run. ``remoras explain`` prints the field descriptions.

Key names include units. A mission may extend the tables by subclasses, named in its ``Scenario``.
``missions.scenarios.loading`` reads and validates a scenario.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, ClassVar, Final, Literal

from pydantic import ConfigDict, Field

from exchange.channel.models import Deployment
from missions.errors import ConfigurationFault
from missions.scenarios.channel import ChannelTable
from missions.scenarios.communication import Communication, ModemTable, modem_named
from missions.scenarios.faults import DeclaredFault
from missions.scenarios.features import with_features
from missions.scenarios.knowledge import WorldModelTable
from remoras.executive.satisfaction import DecisionTable
from remoras.motion.attraction import GuidanceTable
from remoras.organisation import Subgroups
from remoras.table import Name, NotNegative, OneOrMore, PointM, Positive, Section, Sparse, card, number_text, unless

BY_GROUPS: Final = "groups"
"""Needs follow from groups; otherwise all vehicles have equal needs."""
MAX_VEHICLES: Final = 256
"""Most vehicles of one fleet, by the number of TDMA slots."""
SPACING_M: Final = 10.0
"""Distance between copies in one layer: twice the separation of passing vehicles."""
HELD: Final = "held by head"
"""Information about jobs is held by the group leader instead of all members."""


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


class World(Section):
    """The table ``[world]``."""

    MOST_M: ClassVar[float] = 100_000.0
    """Limit of the planar map, equal to the greatest operating range of modems."""
    MOST_LATITUDE_DEG: ClassVar[float] = 89.0
    """Limit of the planar map: nearer to a pole, east and north are undefined."""

    x_m: PointM = Field(description="west and east border of the area of operations")
    y_m: PointM = Field(description="south and north border of the area of operations")
    sound_speed_mps: float = Field(
        1500.0,
        ge=1400.0,
        le=1600.0,
        description="speed of sound in water; the channel acoustic has its own, from temperature and salinity",
    )
    origin_deg: tuple[float, float] | None = Field(
        None,
        description="latitude -89 to 89 and longitude -180 to 180 (WGS 84) of the point x = 0, y = 0; "
        "maps need it, no run depends on it",
    )

    def contradictions(self) -> Iterator[tuple[str, str]]:
        """Yield borders out of order or range, and an invalid origin."""
        for key, names in (("x_m", "west {} east"), ("y_m", "south {} north")):
            low, high = getattr(self, key)
            if low >= high:
                yield key, f"{names.format('border must be below')} border"
            elif low < -self.MOST_M or high > self.MOST_M:
                yield key, f"allowed: {-self.MOST_M:.0f} to {self.MOST_M:.0f}"
        latitude_deg, longitude_deg = self.origin_deg or (0.0, 0.0)
        if abs(latitude_deg) > self.MOST_LATITUDE_DEG or abs(longitude_deg) > 180.0:
            most_deg = self.MOST_LATITUDE_DEG
            yield "origin_deg", f"allowed: latitude {-most_deg:.0f} to {most_deg:.0f}, longitude -180 to 180"

    @property
    def box_m(self) -> tuple[float, float, float, float]:
        """Borders of the operations (x_min, y_min, x_max, y_max)."""
        return self.x_m[0], self.y_m[0], self.x_m[1], self.y_m[1]

    def outside(self, places_m: Iterable[tuple[str, PointM]]) -> Iterator[ConfigurationFault]:
        """Yield faults of positions, by key, outside the world."""
        x_min, y_min, x_max, y_max = self.box_m
        for key, (x, y) in places_m:
            if not (x_min <= x <= x_max and y_min <= y <= y_max):
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


class Requires(Sparse):
    """Requirements of a role on its vehicle; a table in a ``[[group.role]]``."""

    UNSAID = frozenset({"capability"})

    sensor: str | None = Field(None, description="kind or name of a required sensor")
    capability: str | None = Field(None, description="class in the ontology by its equipment, such as SurveyPlatform")
    speed_mps: Positive | None = Field(None, description="minimum transit speed")
    depth_m: Positive | None = Field(None, description="minimum depth rating")
    endurance_s: Positive | None = Field(None, description="minimum battery life at survey speed")
    social_layer: bool = Field(False, description="it has the social layer")


class Role(Sparse):
    """One ``[[group.role]]``."""

    UNSAID = frozenset({"incompatible", "authority", "requires"})

    name: Name = Field(description="name of the role")
    minimum: int = Field(0, ge=0, description="minimum holders")
    maximum: int | None = Field(None, ge=1, description="maximum holders; any number if absent")
    head: bool = Field(False, description="its holder leads the group")
    founding: bool = Field(False, description="held from the start, not allocated during the mission")
    job: str | None = Field(None, description="job of its holder")
    played_by: str | None = Field(None, description="Group.Role whose holder must play it")
    influences: tuple[str, ...] = Field((), description="roles of the group that its influence signals address")
    incompatible: tuple[str, ...] = Field(
        (), description="roles incompatible with it: Role of the group, or Group.Role; holds in both directions"
    )
    authority: tuple[str, ...] = Field(
        (), description="roles of the group that its holders may assign, release and give objectives"
    )
    requires: Requires | None = Field(None, description="requirements on a vehicle")
    extends: tuple[str, ...] = Field(
        (),
        exclude=True,
        description="roles whose keys it inherits: of the group or a [[role]]; the later wins, its own keys over all",
    )
    abstract: bool = Field(False, exclude=True, description="abstract, to be extended only: no role of the group")

    def contradictions(self) -> Iterator[tuple[str, str]]:
        """Yield a minimum above the maximum."""
        if self.maximum is not None and self.minimum > self.maximum:
            yield "minimum", f"allowed: 0 to maximum = {self.maximum}"


class GroupTable(Sparse):
    """One ``[[group]]``."""

    model_config = ConfigDict(json_schema_extra=unless("template", "rally_point", "role"))
    UNSAID = frozenset({"template", "within", "subgroup", "information"})

    name: Name = Field(description="name of the group")
    template: str | None = Field(
        None, description="[[group_template]] whose keys and roles it inherits, in addition to or overridden by its own"
    )
    within: str | None = Field(None, description="parent group, whose leader supervises it")
    subgroup: tuple[Subgroups, ...] = Field((), description="number of subgroups per template; any if absent")
    rally_point: str = Field(description="rally point of the group")
    mission: str | None = Field(None, description="initial mission; else assigned at run time")
    formed_by: str | None = Field(
        None,
        description="group whose leader forms and dissolves this one at run time; formed before the mission if absent",
    )
    succession: tuple[str, ...] = Field(
        (), description="roles of the group whose holders succeed a lost leader, in this order"
    )
    information: Literal["replicated", "held by head"] = Field(
        "replicated",
        description="need for facts on the jobs of the group: of all members, or of leader and assignee",
    )
    role: tuple[Role, ...] = Field(min_length=1, description="roles of the group")

    @property
    def head(self) -> Role | None:
        """Role whose holder leads the group; None if not declared."""
        return next((role for role in self.role if role.head), None)

    @property
    def role_names(self) -> list[str]:
        """Names of its roles."""
        return [role.name for role in self.role]


@with_features("vehicle")
class VehicleTable(Sparse):
    """One ``[[vehicle]]``."""

    name: Name = Field(description="name of the vehicle")
    vehicle_type: Literal["AUV", "ASV"] = Field(description="AUV or ASV")
    slot: int = Field(ge=0, lt=MAX_VEHICLES, description="TDMA slot that the vehicle owns, 0 to number of vehicles - 1")
    social_layer: bool = Field(True, description="able to lead a group, and to divide jobs with others")
    start_m: PointM = Field(
        description="position at time 0, x east, y north; the nearest free place if too close to another in its layer"
    )
    depth_m: NotNegative = Field(0.0, description="working depth")
    depth_limit_m: NotNegative = Field(0.0, description="maximum depth")
    transit_speed_mps: float = Field(gt=0.0, le=20.0, description="transit speed")
    survey_speed_mps: float = Field(gt=0.0, le=20.0, description="speed while working")
    turn_rate_radps: Positive = Field(0.5, description="maximum turn rate")
    acceleration_mps2: Positive = Field(0.5, description="maximum acceleration")
    energy_j: Positive = Field(description="battery capacity")
    hotel_w: NotNegative = Field(description="power at rest")
    drag_w_per_mps3: NotNegative = Field(description="power of propulsion per cubed speed")
    playable_roles: tuple[str, ...] | None = Field(
        None,
        description="roles the vehicle can play, preferred first: Role of any group, or Group.Role; if absent, "
        "all whose requirements it meets",
    )
    sensor: OneOrMore[dict[str, Any]] = Field(  # each kind of sensor validates its keys
        (), description="sensors of the vehicle, a table each; `type` names the kind, or package.module:object"
    )

    def can_play(self, group: str, role: str) -> bool:
        """True if it lists the role of the group."""
        return not {role, f"{group}.{role}"}.isdisjoint(self.playable_roles or ())

    def sensor_names(self, default: str) -> list[str]:
        """Return the names of its sensors; ``default`` is the kind of an unnamed one."""
        return [str(table.get("name") or table.get("type") or default) for table in self.sensor]

    def contradictions(self) -> Iterator[tuple[str, str]]:
        """Yield a depth beyond the limit, and a survey speed above transit speed."""
        if self.depth_m > self.depth_limit_m:
            yield "depth_m", f"allowed: 0 to depth_limit_m = {self.depth_limit_m}"
        if self.survey_speed_mps > self.transit_speed_mps:
            yield "survey_speed_mps", f"allowed: up to transit_speed_mps = {self.transit_speed_mps}"


class FleetTable(Section):
    """Size of the fleet; absent from the resolved scenario, which lists every vehicle."""

    size: int | None = Field(
        None,
        ge=2,
        le=MAX_VEHICLES,
        description="fleet size, listed vehicles and copies; those listed if absent",
    )
    copies_of: str | None = Field(None, description="vehicle to copy to reach the size of the fleet")
    spacing_m: float = Field(SPACING_M, ge=1.0, description="distance between starting copies at one depth")
    layers: bool = Field(True, description="copies get own depth layers; false: all stay in that of the original")


@with_features("")
class Scenario(Sparse):
    """Input of a run; a mission with further tables subclasses it."""

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
    fault: tuple[DeclaredFault, ...] = ()

    @property
    def vehicle_names(self) -> list[str]:
        """Names of the vehicles in file order."""
        return [vehicle.name for vehicle in self.vehicle]

    @property
    def roles(self) -> dict[tuple[str, str], Role]:
        """All roles by (group, role)."""
        return {(group.name, role.name): role for group in self.group for role in group.role}

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

    def __repr__(self) -> str:
        named = f"strategy {self.strategy.name}, policy {self.communication.policy}, channel {self.channel.name}"
        return f"<Scenario {self.scenario.name}: {len(self.vehicle)} vehicles, {named}>"

    def _repr_html_(self) -> str:
        table, groups = self.scenario, ((group.name, [role.name for role in group.role]) for group in self.group)
        rows = [
            ("mission", table.mission),
            ("ends after", f"{number_text(table.duration_s)} s at the latest"),
            ("vehicles", ", ".join(f"{vehicle.name} ({vehicle.vehicle_type})" for vehicle in self.vehicle)),
            *((f"group {name}", ", ".join(roles)) for name, roles in groups),
            ("strategy", self.strategy.name),
            ("policy, modem", f"{self.communication.policy}, {self.communication.modem}"),
            ("channel", self.channel.name),
            ("faults", ", ".join(fault.kind for fault in self.fault) or "none"),
        ]
        return card(f"{table.name}: {table.title}", rows, "its attributes, such as scenario.channel, are its tables")
