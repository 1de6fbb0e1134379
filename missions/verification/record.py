"""Record of one run as plain values and arrays, kinds of faults, and findings of the checks."""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field, fields
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pyarrow as pa

ENERGY = "energy"  # kind of the row of a vehicle with an empty battery; it is never declared


KINDS = frozenset({"lost", "mute", "deaf", "slow", "sensor", "biased", "restarts", "joins", "drains"})
"""Kinds of faults that come with the program."""
FLOATING = ("lost", "restarts", ENERGY)  # kinds of rows during which a vehicle floats
AWAY = (*FLOATING, "joins")  # kinds of rows during which a vehicle is out of operation
OUT_OF_CONTACT = (*AWAY, "mute", "deaf")
NOT_HEARING = ("lost", "restarts", "joins", "deaf")


Row = tuple[Any, ...]
LISTED = 20  # maximum number of listed findings per check


class NoResults(Exception):
    """Folder without readable results."""


@dataclass(frozen=True, slots=True)
class Discrepancy:
    """Stated value that differs from the expected one (``follows``)."""

    check: str
    table: str
    time_s: float | None
    vehicle: str
    stated: str
    follows: str
    key: str = ""

    def __str__(self) -> str:
        where = [self.table, *([f"run {self.key}"] if self.key else [])]
        where += [f"{self.time_s:g} s"] if self.time_s is not None else []
        where += [self.vehicle] if self.vehicle else []
        return f"{', '.join(where)}: {self.stated}; expected: {self.follows} [{self.check}]"


@dataclass
class CheckReport:
    """Findings of a verification, the first of each check.

    ``checked`` is the number of values, by check; ``not_checked`` reasons, by omitted check; ``key`` the current run in
    a sweep. Findings about a vehicle later than ``strange`` (s), its first fault of an external kind, are not reliable.
    """

    findings: list[Discrepancy] = field(default_factory=list)
    n_findings: Counter[str] = field(default_factory=Counter)
    checked: Counter[str] = field(default_factory=Counter)
    not_checked: dict[str, str] = field(default_factory=dict)
    key: str = ""
    strange: Mapping[str, float] = field(default_factory=dict)

    def add(self, check: str, table: str, time_s: Any, vehicle: str, stated: Any, follows: Any) -> None:
        """Add a finding, unless a fault of an external kind may explain it."""
        if self.strange and (vehicle == "" or float(time_s or 0.0) >= self.strange.get(vehicle, math.inf)):
            self.skip(f"{check} after a fault of a kind from outside", "what it does is known to its own class alone")
            return
        self.n_findings[check] += 1
        if self.n_findings[check] <= LISTED:
            at_s = None if time_s is None else float(time_s)
            self.findings.append(Discrepancy(check, table, at_s, vehicle, str(stated), str(follows), self.key))

    def look(self, check: str, n: int = 1) -> None:
        """Count ``n`` checked values."""
        self.checked[check] += n

    def each(self, check: str, record: Record, table: str, columns: str, n: int = 1) -> Iterator[tuple[Any, ...]]:
        """Yield the rows of a table with ``n`` checked values each.

        Before each row comes a function (stated, follows) that adds a finding at its time and vehicle, the first
        ``columns``.
        """
        for row in record.rows(table, columns):
            self.look(check, n)
            yield partial(self.add, check, table, row[0], row[1]), *row

    def skip(self, what: str, why: str) -> None:
        """Record an omitted check with its reason."""
        self.not_checked[what] = why

    def same(self, check: str, table: str, name: str, stated: Any, follows: Any, within: float = 0.0) -> None:
        """Compare a stated value with the expected one, within a tolerance for numbers."""
        self.look(check)
        if not _is_close(stated, follows, within):
            self.add(check, table, None, "", f"{name} is {shown(stated)}", shown(follows))

    def alike(self, check: str, table: str, stated: Iterable[Row], other: str, due: Iterable[Row]) -> None:
        """Compare rows (time, vehicle, ...) of a table with expected ones as multisets."""
        recorded, follows = Counter(stated), Counter(due)
        self.look(check, recorded.total() + follows.total())
        for row in recorded - follows:
            self.add(check, table, row[0], row[1], " ".join(map(str, row[2:])), f"none, by {other}")
        for row in follows - recorded:
            self.add(check, table, row[0], row[1], "no row", f"{' '.join(map(str, row[2:]))}, by {other}")

    @property
    def as_json(self) -> dict[str, Any]:
        """Report as a JSON value."""
        return {
            "ok": not self.findings,
            "findings": [asdict(finding) for finding in self.findings],
            "n_findings": dict(sorted(self.n_findings.items())),
            "checked": dict(sorted(self.checked.items())),
            "not_checked": dict(sorted(self.not_checked.items())),
        }

    @property
    def lines(self) -> Iterable[str]:
        """One line per finding, and one per check with unlisted findings."""
        yield from map(str, self.findings)
        for check, n in sorted(self.n_findings.items()):
            if n > LISTED:
                yield f"{n - LISTED} more [{check}]"


def _is_close(stated: Any, follows: Any, within: float) -> bool:
    if isinstance(stated, bool) or isinstance(follows, bool) or not isinstance(follows, int | float):
        return bool(stated == follows and isinstance(stated, bool) == isinstance(follows, bool))
    return isinstance(stated, int | float) and abs(stated - follows) <= within


def shown(value: Any) -> str:
    """Return a value as in messages."""
    return f"{value:.10g}" if isinstance(value, float) else repr(value) if isinstance(value, str) else str(value)


Array = npt.NDArray[Any]
TIME_STEP_S, PLACE_STEP_M, ANGLE_STEP_RAD, SPEED_STEP_MPS = 2.0**-12, 2.0**-7, 2.0**-10, 2.0**-10
"""Rounding steps of the numbers in tables (docs/howto/results.md)."""
CLOSE_S = 2.0 * TIME_STEP_S  # tolerance of two roundings of a time, or of a sum of two times (s)
Role = tuple[str, str]
Cell = tuple[int, int]


class TableColumns:
    """Table columns: arrays of numbers; lists for other types and numbers with nulls."""

    def __init__(self, table: pa.Table) -> None:
        self.arrow = table
        self._made: dict[str, Any] = {}

    def __len__(self) -> int:
        return int(self.arrow.num_rows)

    def __getitem__(self, name: str) -> Any:
        if name not in self._made:
            column = self.arrow[name]
            is_number = pa.types.is_floating(column.type) or pa.types.is_integer(column.type)
            self._made[name] = column.to_numpy() if is_number and not column.null_count else column.to_pylist()
        return self._made[name]

    def rows(self, *names: str) -> zip[Any]:
        """Return the rows of some columns, as plain values."""
        columns = (self[name] for name in names)
        return zip(*(column.tolist() if isinstance(column, np.ndarray) else column for column in columns), strict=True)


@dataclass(frozen=True)
class Track:
    """Motion of a vehicle per tick, as arrays of one length."""

    time_s: Array
    x_m: Array
    y_m: Array
    heading_rad: Array
    speed_mps: Array
    energy_j: Array
    depth_m: Array


@dataclass(frozen=True, slots=True)
class Spell:
    """Fault of a vehicle from ``from_s`` to before ``until_s``."""

    vehicle: str
    kind: str
    from_s: float
    until_s: float
    detail: str

    @property
    def forgets(self) -> bool:
        """True if the vehicle has lost its memory at the end."""
        return self.kind == "restarts" and "kept" not in self.detail

    @property
    def lost_w(self) -> float:
        """Lost battery power (W): "50 W, until 72.2 s"."""
        return float(self.detail.split(maxsplit=1)[0]) if self.kind == "drains" else 0.0

    @property
    def dead_sensors(self) -> list[str]:
        """Disabled sensors: "sonar, mapping, for good"."""
        return self.detail.rpartition(", ")[0].split(", ") if self.kind == "sensor" else []


class WeighedRow(NamedTuple):
    """Row of the table of decisions: a candidate set of activities."""

    time_s: float
    vehicle: str
    group: str
    role: str
    objective: str
    argument: str
    activities: list[str]
    stimulus: float
    own: float
    external: float
    source: str
    slot: int | None
    chosen: bool
    best_mean: float | None

    @property
    def about(self) -> tuple[str, ...]:
        """Identity of the set, independent of its motivation."""
        return (*self[2:6], *self.activities)

    @property
    def purpose(self) -> tuple[str, ...]:
        """Identity without place or object: sets of one purpose have the same importance."""
        return (*self[2:5], *self.activities)

    @property
    def motivation(self) -> float:
        """Motivation of each of its activities."""
        return self.own + self.external


@dataclass
class Record:
    """Data of one run; ``scenario`` has its resolved tables, ``modem`` is None if unknown."""

    scenario: dict[str, Any]
    seed: Any
    summary: dict[str, Any]
    tables: Mapping[str, TableColumns]
    modem: dict[str, Any] | None = None

    def of(self, section: str) -> dict[str, Any]:
        """Return a table of the scenario, or an empty one."""
        table = self.scenario.get(section, {})
        return table if isinstance(table, dict) else {}

    def __getitem__(self, name: str) -> TableColumns:
        return self.tables[name]

    def rows(self, table: str, columns: str) -> zip[Any]:
        """Return the rows of a table, as plain values; ``columns`` is separated by blanks."""
        return self.tables[table].rows(*columns.split())

    @cached_property  # 2 % of a check
    def vehicles(self) -> dict[str, dict[str, Any]]:
        """Vehicles by name, in scenario order."""
        return {vehicle["name"]: vehicle for vehicle in self.scenario["vehicle"]}

    @property
    def drifts(self) -> bool:
        """True if vehicles have position errors."""
        return bool(self.of("navigation").get("drift"))

    def milestones(self, name: str) -> list[dict[str, Any]]:
        """Return the milestones of a name in the summary."""
        return [milestone for milestone in self.summary["milestones"] if milestone["name"] == name]

    @cached_property  # 2 % of a check
    def anew(self) -> set[str]:
        """Restarted vehicles."""
        return {spell.vehicle for spell in self.spells if spell.kind == "restarts"}

    @property
    def newcomers(self) -> set[str]:
        """Restarted and late vehicles."""
        return self.anew | {spell.vehicle for spell in self.spells if spell.kind == "joins"}

    @property
    def names(self) -> set[str]:
        """Names of all objects in the scenario."""
        sections = [entry for section in self.scenario.values() if isinstance(section, list) for entry in section]
        return {str(entry["name"]) for entry in sections if isinstance(entry, dict) and "name" in entry}

    @cached_property  # 2 % of a check
    def by_slot(self) -> list[str]:
        """Vehicle names by node number, the position in the TDMA frame."""
        return sorted(self.vehicles, key=lambda name: int(self.vehicles[name]["slot"]))

    @cached_property  # 1 % of a check
    def declared_roles(self) -> dict[Role, dict[str, Any]]:
        """Roles of the scenario, by group and name."""
        groups = self.scenario["group"]
        return {(group["name"], role["name"]): role for group in groups for role in group.get("role", [])}

    def is_able(self, vehicle: str, role: Role) -> bool:
        """True if a vehicle can play a role."""
        playable = self.vehicles[vehicle].get("playable_roles")
        return playable is None or not {role[1], ".".join(role)}.isdisjoint(playable)

    @property
    def roles_with_jobs(self) -> set[Role]:
        """Roles with a job."""
        return {key for key, role in self.declared_roles.items() if role.get("job") is not None}

    @cached_property  # 3 % of a check
    def decisions(self) -> list[tuple[float, str, list[WeighedRow]]]:
        """Decisions with time, vehicle and candidates; where the first candidate recurs, a new decision begins."""
        decisions: list[tuple[float, str, list[WeighedRow]]] = []
        for row in map(WeighedRow._make, self["decisions"].rows(*WeighedRow._fields)):
            if not decisions or decisions[-1][:2] != row[:2] or decisions[-1][2][0].about == row.about:
                decisions.append((row.time_s, row.vehicle, []))
            decisions[-1][2].append(row)
        return decisions

    @cached_property  # 1 to 7 % of a check
    def given_s(self) -> dict[tuple[str, ...], float]:
        """First assignment time of objectives, by (viewer, group, role, objective, argument)."""
        columns = "vehicle group role objective argument time_s event"
        rows = [row for row in self.rows("organisation", columns) if row[6] == "given"]
        # Reversed, so that the first assignment remains.
        return {row[:5]: row[5] for row in reversed(rows)}

    def roles_at(self, vehicle: str, at_s: float, event: str = "assigned") -> frozenset[Role]:
        """Return the roles of a vehicle at a time, or its active ones; none after a restart."""
        times_s, roles = self._role_changes.get((vehicle, event), ([], []))
        index = bisect_right(times_s, at_s)
        return roles[index - 1] if index else frozenset()

    @cached_property  # 8 % of a check
    def _role_changes(self) -> dict[tuple[str, str], tuple[list[float], list[frozenset[Role]]]]:
        ends = {"left": "assigned", "inactive": "active"}
        rows = list(self.rows("roles", "time_s vehicle group role event"))
        anew = [(spell.until_s, spell.vehicle) for spell in self.spells if spell.kind == "restarts"]
        # Just before the restart, so that the new roles at the same time remain.
        rows += [(at_s - CLOSE_S, vehicle, "", "", event) for at_s, vehicle in anew for event in ("left", "inactive")]
        changes: dict[tuple[str, str], tuple[list[float], list[frozenset[Role]]]] = defaultdict(lambda: ([], []))
        for time_s, vehicle, group, role, event in sorted(rows, key=lambda row: row[0]):
            times_s, roles = changes[vehicle, ends.get(event, event)]
            now, changed = roles[-1] if roles else frozenset[Role](), {(group, role)}
            times_s.append(time_s)
            roles.append(frozenset() if not group else now - changed if event in ends else now | changed)
        return dict(changes)

    @cached_property  # 3 % of a check
    def influenced(self) -> dict[str, set[str]]:
        """Roles that a role may signal to: declared ones, and roles with jobs among themselves."""
        jobs = self.roles_with_jobs
        return {
            f"{group}.{name}": {f"{group}.{other}" for other in role.get("influences", ())}
            | {f"{group}.{other}" for g, other in jobs if g == group and (group, name) in jobs}
            for (group, name), role in self.declared_roles.items()
        }

    @property
    def covered(self) -> dict[Cell, tuple[float, str]]:
        """First time (s) of each covered cell, and its vehicle."""
        rows = reversed(list(self.rows("coverage", "cell_x cell_y time_s vehicle")))
        return {(x, y): (time_s, vehicle) for x, y, time_s, vehicle in rows}

    @cached_property  # 14 to 25 % of a check
    def packet_of_slot(self) -> dict[int, tuple[str, dict[str, float]]]:
        """Sender and reception times of the packet in each slot."""
        rows = self.rows("packets", "slot sender receivers arrivals_s")
        return {slot: (sender, dict(zip(names, times_s, strict=False))) for slot, sender, names, times_s in rows}

    @cached_property  # 2 % of a check
    def tick_s(self) -> float:
        """Length of a motion tick."""
        return float(self.of("scenario")["tick_s"])

    @property
    def without_decision_s(self) -> float:
        """Maximum time to the next decision (s): the period in whole ticks, more with a clock that may be set back."""
        n_ticks = math.ceil(float(self.of("decision")["period_s"]) / self.tick_s - TIME_STEP_S)
        return self.tick_s * (n_ticks if self.has_exact_clocks else 2 * n_ticks + 1)

    @cached_property  # 3 to 9 ms, asked thousands of times
    def tracks(self) -> dict[str, Track]:
        """Tracks of the vehicles that have one."""
        table = self["trajectories"]
        names = np.array(table["vehicle"], dtype=object)
        tracks = {}
        for name in self.vehicles:
            rows = np.flatnonzero(names == name)
            if len(rows):
                tracks[name] = Track(*(np.asarray(table[field.name])[rows] for field in fields(Track)))
        return tracks

    @cached_property  # 20 to 30 % of a check
    def end_s(self) -> float:
        """Time of the last motion tick."""
        times = self["trajectories"]["time_s"]
        return float(times.max()) if len(times) else 0.0

    @cached_property  # 17 to 90 % of a check
    def spells(self) -> list[Spell]:
        """Faults in the table; the end is infinite if not recorded."""
        rows = list(self.rows("faults", "time_s vehicle kind detail"))
        ends = [(time_s, vehicle, kind) for time_s, vehicle, kind, detail in rows if detail == "over"]
        spells = []
        for time_s, vehicle, kind, detail in rows:
            if detail == "over":
                continue
            match = re.search(r"until (\S+) s", detail)
            until_s = math.inf if match is None else float(match[1])
            own_s = [at_s for at_s, *of in ends if of == [vehicle, kind]]
            # Times in details have six digits.
            ended_s = (at_s for at_s in own_s if math.isclose(at_s, until_s, rel_tol=1e-5, abs_tol=1e-3))
            spells.append(Spell(vehicle, kind, time_s, next(ended_s, math.inf), detail))
        return spells

    def during(self, vehicle: str, kinds: Iterable[str], times_s: Any) -> Array:
        """Return for each time if a fault of these kinds affects a vehicle."""
        own = (spell for spell in self.spells if spell.vehicle == vehicle and spell.kind in kinds)
        return self.lasting(own, times_s)

    def lasting(self, spells: Iterable[Spell], times_s: Any) -> Array:
        """Return for each time if one of these faults lasts."""
        times_s = np.asarray(times_s, dtype=float)
        lasts = np.zeros(times_s.shape, dtype=bool)
        for spell in spells:
            lasts |= (times_s >= spell.from_s) & (times_s < spell.until_s)
        return lasts

    def away(self, vehicle: str, times_s: Any) -> Array:
        """Return for each time if a vehicle is lost, off, late or without energy."""
        return self.during(vehicle, AWAY, times_s)

    def drained(self, vehicle: str, times_s: Any) -> Array:
        """Return for each time if a vehicle is without energy."""
        return self.during(vehicle, (ENERGY,), times_s)

    def is_away(self, vehicle: str, at_s: float) -> bool:
        """True if a vehicle is lost, off, late or without energy at a time."""
        return bool(self.away(vehicle, at_s))

    @property
    def strange(self) -> dict[str, float]:
        """Time (s) of the first fault of an external kind, by vehicle."""
        declared = {str(fault.get("kind")) for fault in self.scenario.get("fault", [])} - KINDS
        first_s: dict[str, float] = {}
        for spell in self.spells:
            if spell.kind in declared:
                first_s[spell.vehicle] = min(spell.from_s, first_s.get(spell.vehicle, math.inf))
        return first_s

    @property
    def packet_s(self) -> tuple[float, float] | None:
        """Transmission time before the bits and per bit (s); None without modem profile."""
        if self.modem is None:
            return None
        return float(self.modem["head_s"]), 1.0 / float(self.modem["rate_bps"])

    @property
    def spread(self) -> float:
        """Maximum relative deviation of vehicle speeds."""
        return float(self.of("uncertainty").get("speed_spread", 0.0))

    @property
    def has_exact_clocks(self) -> bool:
        """True unless a vehicle has its own clock."""
        has_own = any("clock" in vehicle for vehicle in self.vehicles.values())
        return not has_own and "clocks" not in self.of("communication")

    @property
    def access(self) -> str:
        """Access to the channel in a recording of other programs: slots or free; empty for a run."""
        return str(self.of("mission").get("access", ""))

    @cached_property  # asked per report
    def needed(self) -> set[str]:
        """Attributes with an information need; a vehicle keeps all others to itself."""
        needs = self.scenario.get("need", [])
        return {*self.of("communication").get("needs", {}), *(need["attribute"] for need in needs)}

    @property
    def all_need_all(self) -> bool:
        """True if every vehicle needs all items throughout the run."""
        return self.of("communication").get("needs_follow", "all") == "all" and not self.scenario.get("need")
