"""Run as read by exports, independent of its storage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from missions.figure import Place
from visualisation import output
from visualisation.run_records import Floats, Track, outages, tenures, tracks

if TYPE_CHECKING:
    from missions.runs.reader import RunReader

SEMI_MAJOR_M = 6378137.0
FLATTENING = 1.0 / 298.257223563
ECCENTRICITY_2 = FLATTENING * (2.0 - FLATTENING)
ROUNDS = 4  # iterations of the latitude, each at least 150 times more exact


class Datum(NamedTuple):
    """Origin x = 0, y = 0 on the WGS 84 ellipsoid, degrees; the simulation plane is tangent there, x east and y north.

    Points are projected along the ellipsoid normal, via earth-centred coordinates. Distances from the datum are exact
    to 3 cm within 10 km and to 3 m within 50 km.
    """

    latitude_deg: float
    longitude_deg: float

    def degrees(self, x_m: Any, y_m: Any) -> tuple[Floats, Floats]:
        """Return latitudes and longitudes of points, to 1e-8 degrees (1 mm); numbers or arrays."""
        east, north = np.asarray(x_m, dtype=float), np.asarray(y_m, dtype=float)
        latitude, longitude = np.radians(self.latitude_deg), np.radians(self.longitude_deg)
        sine, cosine = np.sin(latitude), np.cos(latitude)
        normal_m = SEMI_MAJOR_M / np.sqrt(1.0 - ECCENTRICITY_2 * sine**2)
        outward_m = normal_m * cosine - sine * north  # from the axis, in the meridian of the datum
        up_m = normal_m * (1.0 - ECCENTRICITY_2) * sine + cosine * north  # above the equator
        radius_m = np.hypot(outward_m, east)
        geodetic = np.arctan2(up_m, radius_m * (1.0 - ECCENTRICITY_2))
        # The first value is exact on the ellipsoid; the plane lies above it, ever more so with distance.
        for _ in range(ROUNDS):
            sines = np.sin(geodetic)
            normals_m = SEMI_MAJOR_M / np.sqrt(1.0 - ECCENTRICITY_2 * sines**2)
            geodetic = np.arctan2(up_m + ECCENTRICITY_2 * normals_m * sines, radius_m)
        longitudes = np.degrees(longitude + np.arctan2(east, outward_m))
        return np.round(np.degrees(geodetic), 8), np.round((longitudes + 180.0) % 360.0 - 180.0, 8)


WAITING = "waiting"  # state of a vehicle without active role
OUT = "out"  # state of a vehicle that is lost, not yet present, or without energy


class RoleState(NamedTuple):
    """Active roles of a vehicle from ``time_s`` on, or its outage."""

    time_s: float
    vehicle: str
    roles: tuple[str, ...]
    is_out: bool = False

    @property
    def text(self) -> str:
        """Roles separated by commas, ``waiting`` without any, or ``out``."""
        return OUT if self.is_out else ", ".join(self.roles) or WAITING


class Selection(NamedTuple):
    """Exported knowledge: of a vehicle, None for all; at a time, None for the end."""

    vehicle: str | None = None
    at_s: float | None = None


ALL = Selection()


@dataclass(frozen=True)
class Voyage:
    """One run, with the places declared by its mission, the format name, and the knowledge to export."""

    results: RunReader
    places: Sequence[Place] = ()
    format: str = ""
    selection: Selection = ALL

    @property
    def about(self) -> dict[str, str]:
        """Provenance: version, key, seed, outcome, and scenario for repetition."""
        summary = self.results.summary
        ended = "completed" if summary["completed"] else f"not completed: {summary['reason']}"
        return {
            **output.about_run(self.results),
            "ended": f"{ended}, {self.results.ended_s:g} s",
            "scenario_toml": self.results.manifest["scenario"],
        }

    @property
    def vehicles(self) -> dict[str, str]:
        """Vehicle types by name, in scenario order."""
        return {
            table["name"]: table.get("vehicle_type", "AUV") for table in self.results.scenario_tables.get("vehicle", ())
        }

    @property
    def datum(self) -> Datum | None:
        """Origin of coordinates; None if the scenario has none."""
        origin_deg = self.results.scenario_tables.get("world", {}).get("origin_deg")
        return None if origin_deg is None else Datum(*map(float, origin_deg))

    @cached_property  # all trajectories
    def tracks(self) -> dict[str, Track]:
        """Recorded tracks in scenario order."""
        return tracks(self.results) if self.results.has("trajectories") else {}

    @cached_property  # read per vehicle
    def states(self) -> list[RoleState]:
        """States of all vehicles in time order, from 0 s on at every change."""
        out, end_s = outages(self.results), self.results.ended_s
        states: list[RoleState] = []
        for vehicle, own in tenures(self.results).items():
            active = [(span, tenure.role, tenure.group) for tenure in own for span in tenure.active]
            gone = out.get(vehicle, [])
            last: RoleState | None = None
            for time_s in sorted(
                {0.0, *(time_s for span in (*gone, *(span for span, *_ in active)) for time_s in span)}
            ):
                roles = sorted((role, group) for span, role, group in active if span.holds(time_s))
                names = tuple(dict.fromkeys(role for role, _ in roles))
                state = RoleState(time_s, vehicle, names, any(span.holds(time_s) for span in gone))
                if time_s < end_s and (last is None or state[2:] != last[2:]):
                    states.append(state)
                    last = state
        return sorted(states, key=lambda state: state.time_s)
