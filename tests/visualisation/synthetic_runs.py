"""Results of runs that never took place: what the figures must stand, written as a real run writes them."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import tomli_w

from missions.runs.results import Results, table
from remoras.recorder import TABLES

LONG = "AnExtraordinarilyLongNameOfFortyLettersX"
SQUARE = ((0.0, 0.0), (0.0, 100.0), (100.0, 100.0), (100.0, 0.0))


@dataclass
class Fiction:
    """A run: vehicles that circle, one role each or more, milestones as given."""

    vehicles: Sequence[str] = ("A", "B")
    roles: Sequence[tuple[str, str]] = (("Team", "Leader"), ("Team", "Mapper"))
    areas: Sequence[str] = ("bay",)
    rally_points: Sequence[str] = ("buoy",)
    milestones: Sequence[tuple[str, str, str, float]] = ()
    end_s: float = 1000.0
    radius_m: float = 90.0
    recorded: bool = True
    completed: bool = True
    extra_roles: list[tuple[Any, ...]] = field(default_factory=list)

    def write(self, folder: Path) -> Results:
        """The folder of the run, read back."""
        folder.mkdir(parents=True)
        rows = self._rows() if self.recorded else {}
        for name in TABLES:
            pq.write_table(table(name, rows.get(name, [])), folder / f"{name}.parquet")
        (folder / "summary.json").write_text(json.dumps(self._summary()))
        (folder / "manifest.json").write_text(json.dumps({"scenario": tomli_w.dumps(self._scenario())}))
        return Results.read(folder)

    def _scenario(self) -> dict[str, Any]:
        return {
            "world": {"x_m": [-500.0, 500.0], "y_m": [-500.0, 500.0], "cell_m": 25.0},
            "area": [
                {"name": name, "corners_m": [[x + 100.0 * at, y] for x, y in SQUARE]}
                for at, name in enumerate(self.areas)
            ],
            "rally_point": [
                {"name": name, "position_m": [10.0 * at, -20.0]} for at, name in enumerate(self.rally_points)
            ],
            "vehicle": [{"name": name} for name in self.vehicles],
        }

    def _summary(self) -> dict[str, Any]:
        names = ("name", "vehicle", "group", "time_s")
        return {
            "scenario": "fiction", "strategy": "remoras", "policy": "m-ack", "channel": "bernoulli", "per": 0.25,
            "seed": 77, "n_vehicles": len(self.vehicles), "completed": self.completed,
            "reason": "" if self.completed else "out of time", "mission_time_s": self.end_s,
            "coverage_fraction": 0.5 if self.recorded and self.areas else 0.0,
            "milestones": [dict(zip(names, row, strict=True)) for row in self.milestones],
        }  # fmt: skip

    def _rows(self) -> dict[str, list[tuple[Any, ...]]]:
        times_s = [self.end_s * step / 60 for step in range(61)]
        tracks = [
            (
                t,
                name,
                self.radius_m * (1 + at / 9) * math.cos(t / 60 + at),
                self.radius_m * math.sin(t / 60 + at),
                0.0,
                1.0,
                t,
            )
            for t in times_s
            for at, name in enumerate(self.vehicles)
        ]
        roles = [
            (time_s, name, *role, event)
            for time_s, event in ((0.0, "assigned"), (0.1 * self.end_s, "active"), (0.8 * self.end_s, "inactive"))
            for name in self.vehicles
            for role in self.roles
        ]
        values = [
            (t, name, *role, int(120 * math.sin(t / 99 + at)))
            for t in times_s
            for name in self.vehicles
            for at, role in enumerate(self.roles)
        ]
        cells = [(times_s[at], name, at, 0) for at, name in enumerate(self.vehicles) if self.areas]
        return {
            "trajectories": tracks, "roles": sorted([*roles, *self.extra_roles]), "satisfaction": values,
            "coverage": cells,
        }  # fmt: skip


ROLES = [
    ("Coordination", "Administrator"),
    ("Operational", "Performer"),
    ("Operational", "Mapper"),
    ("Third", "Mapper"),
]
FLEET = [f"AUV{number:02}" for number in range(16)]

FICTIONS = {
    "two vehicles": Fiction(),
    "one vehicle": Fiction(vehicles=("Solo",), milestones=[("mission_complete", "", "", 1000.0)]),
    "sixteen vehicles": Fiction(
        vehicles=FLEET,
        roles=ROLES,
        areas=[f"area {number}" for number in range(16)],
        rally_points=[f"rally {number}" for number in range(6)],
        milestones=[("mapping_done", name, "", 900.0 + at) for at, name in enumerate(FLEET)],
    ),
    "no areas": Fiction(areas=(), rally_points=()),
    "not completed": Fiction(completed=False, end_s=14400.0, milestones=[("mapping_done", "A", "", 1700.0)]),
    "empty tables": Fiction(recorded=False),
    "long names": Fiction(
        vehicles=[LONG, LONG[::-1]],
        roles=[(LONG, LONG), (LONG[::-1], LONG)],
        areas=[LONG, LONG[::-1]],
        rally_points=[LONG, "US$ and $x^2"],
        milestones=[("mapping_stopped", LONG, "", 500.0), ("gathered", "", LONG, 500.0)],
    ),
    "nobody moves": Fiction(radius_m=0.0, areas=(), rally_points=()),
    "wide sea": Fiction(radius_m=45678.9),
    "everything at the end": Fiction(
        milestones=[
            ("mapping_stopped", "A", "", 950.0), *(("gathered", "", f"g{n}", 990.0 + n / 4) for n in range(40))
        ],
        extra_roles=[(940.0 + n, "A", "Team", "Leader", ("active", "inactive")[n % 2]) for n in range(20)],
    ),
    "at once": Fiction(end_s=0.0, recorded=False, completed=False),
}  # fmt: skip
