"""The sea: its current, how vehicles know where they are in it, and that a current leaves them a way against it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from pydantic import Field, field_validator

from exchange.acoustics import loss
from missions.errors import ConfigurationFault
from missions.scenarios.abilities import sensor_tables
from missions.scenarios.tables import (
    Name,
    NotNegative,
    PointM,
    Positive,
    Raw,
    Section,
    Sparse,
    entries,
    names_of,
    one_of,
    point_of,
    table_of,
)
from remoras.current import Current, Surge
from remoras.database import VehicleData
from remoras.navigation import NavigationConstants, takes_s


class SurgeTable(Section):
    """One ``[[current.surge]]``: the current rises for a time, or turns."""

    between_s: tuple[NotNegative, NotNegative] = Field(description="[earliest, latest] start, drawn once per run")
    lasts_s: Positive = Field(description="how long it lasts")
    east_mps: float = Field(0.0, ge=-5.0, le=5.0, description="what is added towards the east, at all depths")
    north_mps: float = Field(0.0, ge=-5.0, le=5.0, description="what is added towards the north, at all depths")

    @field_validator("between_s")
    @classmethod
    def _in_order(cls, given: PointM) -> PointM:
        if given[0] > given[1]:
            raise ValueError("the earliest start may not be later than the latest")
        return given

    def drawn(self, seed: int, number: int) -> Surge:
        """The surge of the run with that seed; its number in the scenario keys the draw."""
        earliest_s, latest_s = self.between_s
        share = loss.uniform(seed, loss.SURGES, number, 0, 0) if latest_s > earliest_s else 0.0
        from_s = earliest_s + share * (latest_s - earliest_s)
        return Surge(from_s, from_s + self.lasts_s, self.east_mps, self.north_mps)


class CurrentTable(Sparse):
    """The table ``[current]``."""

    UNSAID = frozenset({"surge"})

    east_mps: float = Field(0.0, ge=-5.0, le=5.0, description="current towards the east at the surface")
    north_mps: float = Field(0.0, ge=-5.0, le=5.0, description="current towards the north at the surface")
    shear_depth_m: Positive | None = Field(
        None, description="depth at which the current has fallen to nothing, evenly; alike at all depths if absent"
    )
    tide_period_h: Positive | None = Field(
        None, description="time in which the current turns and returns, 12.42 for the moon's tide; steady if absent"
    )
    tide_phase: float = Field(
        0.0, ge=0.0, le=1.0, description="share of the period that is over at the start: 0 full, 0.25 slack, 0.5 turned"
    )

    surge: tuple[SurgeTable, ...] = Field((), description="when it rises or turns for a time, a table each")

    def water(self, seed: int) -> Current | None:
        """The current of the run with that seed; None where the water stands."""
        if self.east_mps == self.north_mps == 0.0 and not self.surge:
            return None
        depth_m = math.inf if self.shear_depth_m is None else self.shear_depth_m
        period_s = math.inf if self.tide_period_h is None else 3600.0 * self.tide_period_h
        surges = tuple(one.drawn(seed, number) for number, one in enumerate(self.surge))
        return Current(self.east_mps, self.north_mps, depth_m, period_s, self.tide_phase, surges)


class NavigationTable(Sparse):
    """The table ``[navigation]``."""

    UNSAID = frozenset({"vertical_speed_mps"})

    drift: float = Field(
        0.0,
        ge=0.0,
        le=0.2,
        description="share of its way under water by which a vehicle comes to err about its place",
    )
    fix_s: Positive = Field(10.0, description="time in which that error falls to 1/e, at the surface and near a beacon")
    vertical_speed_mps: Positive = Field(
        0.5, description="speed at which vehicles that err go up to learn where they are, and down again"
    )

    def fix_m(self, vehicles: Sequence[VehicleData]) -> float:
        """Error (m) that the worst of these vehicles comes to in the time of a fix; 0 where they make none."""
        if self.drift == 0.0:
            return 0.0
        constants = NavigationConstants(self.drift, self.fix_s, vertical_speed_mps=self.vertical_speed_mps)
        ways_m = [one.survey_speed_mps * takes_s(constants, one.depth_m) for one in vehicles]
        return self.drift * max(ways_m, default=0.0)


class BeaconTable(Sparse):
    """One ``[[beacon]]``, which stands somewhere or is carried by a vehicle."""

    UNSAID = frozenset({"position_m", "vehicle", "sensor"})

    name: Name = Field(description="name of the beacon")
    position_m: PointM | None = Field(None, description="where it stands, x east, y north; or name a vehicle")
    vehicle: str | None = Field(None, description="vehicle that carries it, instead of position_m")
    sensor: str | None = Field(
        None, description="sensor of that vehicle by which it is a beacon: while the sensor is dead there is no fix"
    )
    range_m: Positive = Field(description="within this distance of it vehicles learn where they are")


def current_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """A current that is as fast as the slowest vehicle at its depth, or faster."""
    table = table_of(raw, "current")
    given = {key: table.get(key, 0.0) for key in ("east_mps", "north_mps")}
    shear_depth_m = table.get("shear_depth_m", math.inf)
    spread = table_of(raw, "uncertainty").get("speed_spread", 0.0)
    if not all(_is_number(one) for one in (*given.values(), spread)) or not _is_positive(shear_depth_m):
        return
    yield from _late_surges(raw)
    current = Current(**given, shear_depth_m=shear_depth_m, surges=_surges(table))
    worst: tuple[float, str] | None = None
    for vehicle in entries(raw, "vehicle"):
        depth_m, speed_mps = vehicle.get("depth_m", 0.0), vehicle.get("survey_speed_mps")
        if not _is_number(depth_m) or not _is_number(speed_mps):
            continue
        runs_mps, slowest_mps = current.greatest_mps(depth_m), speed_mps * (1.0 - spread)
        excess_mps = runs_mps - slowest_mps
        if runs_mps >= slowest_mps > 0.0 and (worst is None or excess_mps > worst[0]):
            allowed = (
                f"the current runs at {runs_mps:.3g} m/s at the {depth_m:g} m of {vehicle.get('name')}, which could "
                f"not stay where it is; allowed: less than {slowest_mps:.3g} m/s, its survey_speed_mps"
                + (f" less the uncertainty.speed_spread of {spread:g}" if spread else "")
            )
            worst = excess_mps, allowed
    if worst is not None:
        key = max(given, key=lambda key: abs(given[key]))
        yield ConfigurationFault(f"current.{key}", str(given[key]), worst[1])


def beacon_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """Beacons that neither stand somewhere nor are carried, or both; carried by nobody, or by what nobody has."""
    vehicles = entries(raw, "vehicle")
    for beacon in entries(raw, "beacon"):
        key, carrier = f"beacon.{beacon.get('name')}", beacon.get("vehicle")
        if ("position_m" in beacon) == ("vehicle" in beacon):
            given = "both" if "vehicle" in beacon else "neither"
            allowed = f"has {given} position_m and vehicle; allowed: one of them"
            yield ConfigurationFault(key, "", allowed.replace("neither position_m and", "neither position_m nor"))
        yield from one_of(f"{key}.vehicle", carrier, names_of(raw, "vehicle"))
        if "sensor" in beacon and carrier is not None:
            own = [table for one in vehicles if one.get("name") == carrier for table in sensor_tables(one)]
            names = [str(table.get("name") or table.get("type")) for table in own]
            yield from one_of(f"{key}.sensor", beacon["sensor"], names)


def _late_surges(raw: Raw) -> Iterator[ConfigurationFault]:
    """Surges that cannot begin before the end."""
    given_s = table_of(raw, "scenario").get("duration_s")
    duration_s = float(given_s) if isinstance(given_s, int | float) else math.inf
    for number, surge in enumerate(entries(table_of(raw, "current"), "surge"), 1):
        for earliest_s, latest_s in point_of(surge, "between_s"):
            if earliest_s >= duration_s:
                given = f"[{earliest_s:g}, {latest_s:g}]"
                allowed = f"begins after the end: before scenario.duration_s = {duration_s:g}"
                yield ConfigurationFault(f"current.surge.{number}.between_s", given, allowed)


def _surges(table: Raw) -> tuple[Surge, ...]:
    """What surges add, from the earliest time to the latest that they may last to; malformed ones are passed over."""
    found = []
    for one in entries(table, "surge"):
        added, lasts_s = [one.get(key, 0.0) for key in ("east_mps", "north_mps")], one.get("lasts_s")
        if all(map(_is_number, [*added, lasts_s])) and (spans := point_of(one, "between_s")):
            earliest_s, latest_s = spans[0]
            found.append(Surge(earliest_s, latest_s + float(lasts_s), *added))  # type: ignore[arg-type]
    return tuple(found)


def _is_number(value: object) -> bool:
    return type(value) in (int, float) and math.isfinite(value)  # type: ignore[arg-type]


def _is_positive(value: object) -> bool:
    return type(value) in (int, float) and value > 0.0  # type: ignore[operator]
