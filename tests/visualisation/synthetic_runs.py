"""Results of runs that never took place, as a folder has them: what the figures must stand.

Their mission inspects wrecks: it declares a figure of the finds, a layer with the finds, and a mark where a vehicle
broke off. Nothing in the package knows of wrecks.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

import tomli_w

from missions.figure import Declared, Figure, Layer, Mark, Place, RunResults, Style
from missions.runs.results import Results
from missions.runs.tables import arrow_table, parquet
from remoras.recorder import TABLES, TIME, VEHICLE, Column, Table

LONG = "AnExtraordinarilyLongNameOfFortyLettersX"
SQUARE = ((0.0, 0.0), (0.0, 100.0), (100.0, 100.0), (100.0, 0.0))
FINDS_TABLE = Table("finds", (TIME, VEHICLE, Column("x_m", "float", "m"), Column("y_m", "float", "m")))
RECORDED = (*TABLES, FINDS_TABLE)
ABSENT = ("membership", "activities", "items")
SLOT_S = 10.0
RUN = "0123456789abcdef0123"


def draw_finds(axes: Any, results: RunResults, style: Style) -> str:
    """Finds of every vehicle over time."""
    rows = results.table("finds").to_pylist()
    for vehicle, look in style.looks.items():
        times_s = [row["time_s"] for row in rows if row["vehicle"] == vehicle]
        axes.step(times_s, range(1, len(times_s) + 1), color=look.colour, linestyle=look.line, label=vehicle)
    axes.set_xlabel(style.axis("time", "s"))
    axes.set_ylabel(style.axis("finds"))
    return f"Found by {style.time(results.summary['mission_time_s'])}: {len(rows)}."


def draw_wrecks(axes: Any, results: RunResults, style: Style) -> str:
    """Where something was found."""
    rows = results.table("finds").to_pylist()
    tint = style.tint(style.grey, 0.5)
    axes.scatter([row["x_m"] for row in rows], [row["y_m"] for row in rows], s=9, color=[tint], label="finds")
    return "Dots: finds."


FINDS = Figure("finds", "Finds of the vehicles over mission time", draw_finds, needs=("finds",))
DECLARED: tuple[Declared, ...] = (
    FINDS,
    Layer("wrecks", draw_wrecks, needs=("finds",)),
    Mark("broken_off", "broken off"),
)


@dataclass
class Fiction:
    """A run: vehicles that circle, one role each or more, milestones as given."""

    vehicles: Sequence[str] = ("A", "B")
    roles: Sequence[tuple[str, str]] = (("Team", "Leader"), ("Team", "Diver"))
    outlines: Sequence[str] = ("bay",)
    points: Sequence[str] = ("buoy",)
    milestones: Sequence[tuple[str, str, str, float]] = ()
    end_s: float = 1000.0
    radius_m: float = 90.0
    recorded: bool = True
    completed: bool = True
    extra_roles: list[tuple[Any, ...]] = field(default_factory=list)
    faults: Sequence[tuple[float, str, str, str]] = ()
    groups: Sequence[dict[str, Any]] = ()
    changes: Sequence[tuple[Any, ...]] = ()
    collides: bool = False
    parked: Sequence[tuple[float, str, str, str]] = ()

    def write(self, folder: Path) -> Results:
        """The folder of the run, read back."""
        folder.mkdir(parents=True)
        rows = self._rows() if self.recorded else {}
        for table in RECORDED:
            if table.name not in ABSENT:
                made = arrow_table(table, rows.get(table.name, [])).replace_schema_metadata({"run_id": RUN})
                (folder / f"{table.name}.parquet").write_bytes(parquet(made))
        faults = [{"kind": kind} for _, _, kind, _ in self.faults if kind != "energy"]
        scenario = {"vehicle": [{"name": name} for name in self.vehicles], "fault": faults}
        scenario["group"] = list(self.groups)
        (folder / "summary.json").write_text(json.dumps(self._summary()))
        (folder / "manifest.json").write_text(
            json.dumps({"version": "0", "run_id": RUN, "scenario": tomli_w.dumps(scenario)})
        )
        return Results(folder)

    @property
    def places(self) -> tuple[Place, ...]:
        """Squares side by side, and points."""
        squares = [
            Place(name, "search box", tuple((x + 100.0 * at, y) for x, y in SQUARE))
            for at, name in enumerate(self.outlines)
        ]
        points = [Place(name, "dock", ((10.0 * at, -20.0),)) for at, name in enumerate(self.points)]
        return (*squares, *points)

    def _organisation(self) -> list[tuple[Any, ...]]:
        """Every vehicle holds every role, for itself and for the first one, which refuses the last one's order.

        What the fiction has as ``changes`` comes on top.
        """
        (group, _), last = self._first_and_last
        rows: list[tuple[Any, ...]] = [
            (0.0, viewer, name, *role, "assigned", "", "assign", "", "", "success")
            for name in self.vehicles
            for viewer in dict.fromkeys((name, self.vehicles[0]))
            for role in self.roles
        ]
        refusal = (self.vehicles[-1], "assign", "", "", "issuer without authority")
        rows.append((0.4 * self.end_s, self.vehicles[0], self.vehicles[0], *last, "refused", *refusal))
        mission = (self.vehicles[0], "mission", "", "Survey", "success")
        rows.append((0.0, self.vehicles[0], "", group, "", "given", *mission))
        return sorted([*rows, *self.changes], key=lambda row: row[0])

    def _plans(self) -> list[tuple[Any, ...]]:
        """The first vehicle plans the mission of its group: the last one's dive fails half-way and is done by another.

        Every vehicle has a plan of its own, to home, which lasts.
        """
        (group, leader), (_, diver) = self._first_and_last
        half_s = 0.5 * self.end_s
        mission = (self.vehicles[0], group, "", "", "")
        dive = f"AssignObjective({group}, {diver}, Diving, bay)"
        top, branch = (0, -1, f"Survey({group})"), (1, 0, f"Dive({group}, {diver}, bay)")
        rows: list[tuple[Any, ...]] = [
            (0.0, *mission, *top, "dive, then meet", "running", None, None),
            (0.0, *mission, *branch, "to who plays it", "running", None, None),
            (0.0, *mission, 2, 1, dive, "", "running", 0.75 * self.end_s, 5.0),
            (0.0, *mission, 3, 0, f"Meet({group})", "", "waiting", None, None),
            (half_s, *mission, *branch, "to another", "running", None, None),
            (half_s, *mission, 2, 1, dive, "", "failed", None, None),
            (half_s, *mission, 4, 1, dive, "", "running", None, None),
            (self.end_s, *mission, *branch, "to another", "done", None, None),
            (self.end_s, *mission, 4, 1, dive, "", "done", None, None),
            (self.end_s, *mission, 3, 0, f"Meet({group})", "", "dropped", None, None),
        ]
        for name in self.vehicles if self.recorded else ():
            about = (name, group, leader, "Homing", LONG)
            rows += [(0.0, *about, 0, -1, "PursueHoming", "go home", "running", None, None),
                     (0.0, *about, 1, 0, "Homing", "", "running", 0.5 * self.end_s, 5.0)]  # fmt: skip
        return sorted(rows, key=lambda row: row[0]) if self.recorded else []

    def _summary(self) -> dict[str, Any]:
        names = ("name", "vehicle", "group", "time_s")
        return {
            "scenario": "fiction", "strategy": "remoras", "policy": "m-ack", "channel": "bernoulli", "per": 0.25,
            "run_id": RUN, "seed": 77, "n_vehicles": len(self.vehicles), "completed": self.completed,
            "reason": "" if self.completed else "out of time", "mission_time_s": self.end_s,
            "milestones": [dict(zip(names, row, strict=True)) for row in self.milestones],
        }  # fmt: skip

    def _rows(self) -> dict[str, list[tuple[Any, ...]]]:
        times_s = [self.end_s * step / 60 for step in range(61)]
        r_m = self.radius_m
        tracks = [
            (t, name, r_m * (1 + at / 9) * math.cos(t / 60 + at), r_m * math.sin(t / 60 + at), 0.0, 1.0, t, 0.0)
            for t in times_s
            for at, name in enumerate(self.vehicles)
        ]
        events = ((0.0, "assigned"), (0.1 * self.end_s, "active"), (0.8 * self.end_s, "inactive"))
        each = list(product(self.vehicles, self.roles))
        roles = [(time_s, name, *role, event) for time_s, event in events for name, role in each]
        seats = [(row[0], row[1], *row[3:6]) for row in self.changes if row[5] in ("assigned", "left")]
        values = [
            (t, name, *role, int(120 * math.sin(t / 99 + self.roles.index(role))))
            for t in times_s
            for name, role in each
        ]
        finds = [(times_s[at], name, 10.0 * at, 0.0) for at, name in enumerate(self.vehicles) if self.outlines]
        packets = [self._packet(slot) for slot in range(int(self.end_s / SLOT_S))]
        told = [(packet[1], packet[2], f"{packet[2]}-{packet[0]}", packet[2], "observed") for packet in packets]
        heard = [
            (time_s + 1.0, name, item, sender, "received")
            for (time_s, sender, item, *_), packet in zip(told, packets, strict=True)
            for name in packet[6]
        ]
        (_, leader), (_, diver) = self._first_and_last
        weighed = [
            ("", "Evading", 1.0, True, None), (leader, LONG, 0.5, True, 0.4), (diver, "Homing", 0.3, False, 0.3)
        ]  # fmt: skip
        decisions = [
            (0.1 * self.end_s * (at + 1), name, "", role, "", "", [aim, "Logging"], 1.0, own, 0.25 * at, "", None,
             chosen, mean)
            for at, name in enumerate(self.vehicles)
            for role, aim, own, chosen, mean in weighed
        ]  # fmt: skip
        return {
            "decisions": decisions, "plans": self._plans(), "organisation": self._organisation(),
            "trajectories": tracks, "roles": sorted([*roles, *seats, *self.extra_roles]), "satisfaction": values,
            "finds": finds, "faults": list(self.faults), "packets": packets, "knowledge": sorted([*told, *heard]),
            "refused": self._refused(packets), "links": self._links(times_s), "peers": list(self.parked),
        }  # fmt: skip

    @property
    def _first_and_last(self) -> tuple[tuple[str, str], tuple[str, str]]:
        """Roles that decisions and plans are for; those of a run without roles have others."""
        named = self.roles or (("Team", "Leader"), ("Team", "Diver"))
        return named[0], named[-1]

    def _packet(self, slot: int) -> tuple[Any, ...]:
        """One packet in each slot, of each vehicle in turn; every third listener loses it, another one each time."""
        sender = self.vehicles[slot % len(self.vehicles)]
        others = [name for name in self.vehicles if name != sender]
        lost = [name for at, name in enumerate(others) if (at + slot // len(self.vehicles)) % 3 == 0]
        heard = [name for name in others if name not in lost]
        time_s, collided = slot * SLOT_S, lost[:1] if self.collides and slot % 4 == 0 else []
        arrivals_s = [time_s + 1.0] * len(heard)
        return slot, time_s, sender, 100, 1, 0, heard, lost, time_s, arrivals_s, [], [], [], [], [], collided

    def _refused(self, packets: Sequence[tuple[Any, ...]]) -> list[tuple[Any, ...]]:
        """Every fifth colliding packet is refused by its first receiver; one more refusal has no packet."""
        if not self.collides:
            return []
        fifth = [packet for packet in packets[::5] if packet[6]]
        rows = [
            (time_s + 1.0, heard[0], sender, slot, f"epoch {slot} is older" if slot % 2 else "another frame")
            for slot, time_s, sender, _, _, _, heard, *_ in fifth
        ]
        return [*rows, (self.end_s, self.vehicles[0], self.vehicles[-1], 10_000, "speaks as me")]

    def _links(self, times_s: Sequence[float]) -> list[tuple[Any, ...]]:
        """Estimates of a vehicle about its peers rise with their numbers and over time; the last peer has none."""
        return [
            (time_s, name, peer, way, min(1.0, (number + 0.5 * (way == "outgoing") + step / 60) / 20), step)
            for step, time_s in enumerate(times_s)
            for name in self.vehicles
            for number, peer in enumerate(self.vehicles[:-1])
            for way in ("incoming", "outgoing")
            if name != peer
        ]


ROLES = [("Coordination", "Administrator"), ("Operational", "Performer"), ("Operational", "Diver"), ("Third", "Diver")]
CROWD = [f"AUV{number:02}" for number in range(32)]
FLEET = CROWD[:16]


def nested() -> list[dict[str, Any]]:
    """Fleet > Wing > three teams, whose roles have the same names, and a group that is formed at sea only."""
    roles = [
        {"name": "Leader", "minimum": 1, "maximum": 1, "head": True}, {"name": "Diver", "minimum": 2, "maximum": 9},
        {"name": "Spare", "minimum": 0},
    ]  # fmt: skip
    teams = [{"name": f"Team {letter}", "within": "Wing", "role": roles} for letter in "ABC"]
    above = [{"name": "Fleet", "role": roles[:1]}, {"name": "Wing", "within": "Fleet", "role": roles[:1]}]
    return [*above, *teams, {"name": "Inspection", "formed_by": "Team B", "role": roles[:2]}]


def seats(vehicles: Sequence[str]) -> list[tuple[Any, ...]]:
    """Three per team, with a succession of the leader in A; from 300 to 700 s two of B form a group."""

    def seat(time_s: float, name: str, group: str, role: str, event: str = "assigned", act: str = "assign") -> Any:
        return time_s, name, name, group, role, event, name, act, "", "", "success"

    def acts(time_s: float, act: str, event: str, head: str = "", role: str = "") -> Any:
        return time_s, vehicles[5], head, "Inspection", role, event, vehicles[5], act, "", "", "success"

    teams = [
        seat(0.0, vehicles[2 + 3 * number + at], f"Team {letter}", "Leader" if at == 0 else "Diver")
        for number, letter in enumerate("ABC")
        for at in range(3)
    ]
    return [
        seat(0.0, vehicles[0], "Fleet", "Leader"), seat(0.0, vehicles[1], "Wing", "Leader"), *teams,
        seat(500.0, vehicles[2], "Team A", "Leader", "left"),
        seat(520.0, vehicles[3], "Team A", "Leader", "assigned", "succeed"),
        acts(300.0, "create", "formed", vehicles[6], "Leader"), seat(310.0, vehicles[6], "Inspection", "Leader"),
        seat(320.0, vehicles[7], "Inspection", "Diver"), seat(700.0, vehicles[6], "Inspection", "Leader", "left"),
        seat(700.0, vehicles[7], "Inspection", "Diver", "left"), acts(700.0, "dissolve", "dissolved"),
    ]  # fmt: skip


FICTIONS = {
    "two vehicles": Fiction(),
    "one vehicle": Fiction(vehicles=("Solo",), milestones=[("mission_complete", "", "", 1000.0)]),
    "sixteen vehicles": Fiction(
        FLEET, ROLES, [f"box {number}" for number in range(16)], [f"dock {number}" for number in range(6)],
        milestones=[("work_done", name, "", 900.0 + at) for at, name in enumerate(FLEET)],
    ),
    "no places": Fiction(outlines=(), points=()),
    "not completed": Fiction(completed=False, end_s=14400.0, milestones=[("work_done", "A", "", 1700.0)]),
    "empty tables": Fiction(recorded=False),
    "long names": Fiction(
        [LONG, LONG[::-1]], [(LONG, LONG), (LONG[::-1], LONG)], [LONG, LONG[::-1]], [LONG, "US$ and $x^2"],
        milestones=[("broken_off", LONG, "", 500.0), ("gathered", "", LONG, 500.0)],
    ),
    "nobody moves": Fiction(radius_m=0.0, outlines=(), points=()),
    "wide sea": Fiction(radius_m=45678.9),
    "everything at the end": Fiction(
        milestones=[
            ("broken_off", "A", "", 950.0), *(("gathered", "", f"g{n}", 990.0 + n / 4) for n in range(40))
        ],
        extra_roles=[(940.0 + n, "A", "Team", "Leader", ("active", "inactive")[n % 2]) for n in range(20)],
    ),
    "faults": Fiction(
        faults=[
            (0.0, "B", "joins", "away until 200 s"), (200.0, "B", "joins", "over"), (300.0, "A", "mute", "until 600 s"),
            (400.0, "A", "energy", "battery exhausted"), (500.0, "B", "lost", "for good"), (600.0, "A", "mute", "over"),
        ],
    ),
    "collisions": Fiction(
        vehicles=("A", "B", "C", "D"), collides=True,
        parked=[
            (200.0, "A", "D", "parked"), (250.0, "B", "D", "parked"), (600.0, "A", "D", "heard again"),
            (650.0, "A", "C", "begins anew"), (900.0, "C", "D", "parked"),
        ],
    ),
    "thirty-two vehicles": Fiction(
        CROWD, extra_roles=[(100.0, name, "Team", f"Left{name}", "assigned") for name in CROWD[::4]]
    ),
    "nested": Fiction(FLEET, (("Fleet", "Reporter"),), groups=nested(), changes=seats(FLEET)),
    "at once": Fiction(end_s=0.0, recorded=False, completed=False),
}  # fmt: skip
