"""Record of one run as plain values and arrays, kinds of its faults, and findings of the checks."""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pyarrow as pa

ENERGY = "energy"
"""RecordedKind of the row of a vehicle whose battery is empty; nobody declares it."""


@dataclass(frozen=True, slots=True)
class RecordedKind:
    """What a kind does while it holds.

    Attributes:
        is_away: the vehicle does nothing; is_lost: for the mission; is_late: it has not come yet; begins_anew: at the
            end.
        is_mute: nobody hears it; is_deaf: it hears nobody.
        kills: the detail begins with the sensors that yield nothing.
        drains: the detail begins with the power that the battery loses.
    """

    is_away: bool = False
    is_lost: bool = False
    is_late: bool = False
    begins_anew: bool = False
    is_mute: bool = False
    is_deaf: bool = False
    kills: bool = False
    drains: bool = False

    @property
    def is_out(self) -> bool:
        """True if it keeps a vehicle from hearing or being heard."""
        return self.is_away or self.is_mute or self.is_deaf


KINDS = {
    "lost": RecordedKind(is_away=True, is_lost=True),
    "mute": RecordedKind(is_mute=True),
    "deaf": RecordedKind(is_deaf=True),
    "slow": RecordedKind(),
    "sensor": RecordedKind(kills=True),
    "biased": RecordedKind(),
    "restarts": RecordedKind(is_away=True, begins_anew=True),
    "joins": RecordedKind(is_away=True, is_late=True),
    "drains": RecordedKind(drains=True),
}
NOTHING = RecordedKind()
AWAY = (*(name for name, kind in KINDS.items() if kind.is_away), ENERGY)
"""Kinds of rows while which a vehicle does nothing."""
FLOATING = (*(name for name, kind in KINDS.items() if kind.is_away and not kind.is_late), ENERGY)
"""Those while which it floats."""
OUT_OF_CONTACT = (*(name for name, kind in KINDS.items() if kind.is_out), ENERGY)
NOT_HEARING = tuple(name for name, kind in KINDS.items() if kind.is_away or kind.is_deaf)


def kind_of(name: str) -> RecordedKind:
    """What is known of a kind of rows; nothing of those that nobody declares, and of those from outside."""
    return KINDS.get(name, NOTHING)


def forgets(kind: str, detail: str) -> bool:
    """True if a vehicle has lost its memory once a fault is over."""
    return kind_of(kind).begins_anew and "kept" not in detail


def lost_w(kind: str, detail: str) -> float:
    """Power that the battery loses while a fault holds: "50 W, until 72.2 s"."""
    return float(detail.split(maxsplit=1)[0]) if kind_of(kind).drains else 0.0


def dead_sensors(kind: str, detail: str) -> list[str]:
    """Names of the sensors that yield nothing while a fault holds: "sonar, mapping, for good"."""
    return detail.rpartition(", ")[0].split(", ") if kind_of(kind).kills else []


Row = tuple[Any, ...]
LISTED = 20
"""Findings of one check that are listed; the others are counted."""


class NoResults(Exception):
    """A folder holds no results that can be read."""


@dataclass(frozen=True, slots=True)
class Discrepancy:
    """One thing that does not follow.

    Attributes:
        check: that found it; table: file in which it stands.
        time_s, vehicle: which row; None and empty where it is of no time or vehicle.
        stated: what the file says; follows: what it should say, in words or numbers.
        key: of the run, in a sweep.
    """

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
        return f"{', '.join(where)}: {self.stated}; it follows {self.follows} [{self.check}]"


@dataclass
class CheckReport:
    """What came of checking.

    Attributes:
        findings: the first of each check; n_findings: all, by check.
        checked: how many values each check looked at; not_checked: why, by what could not be.
        key: of the run that is being checked, in a sweep.
        strange: vehicles of that run that a fault befell of which nobody here knows what it does, and from when on (s).
    """

    findings: list[Discrepancy] = field(default_factory=list)
    n_findings: Counter[str] = field(default_factory=Counter)
    checked: Counter[str] = field(default_factory=Counter)
    not_checked: dict[str, str] = field(default_factory=dict)
    key: str = ""
    strange: Mapping[str, float] = field(default_factory=dict)

    def add(self, check: str, table: str, time_s: Any, vehicle: str, stated: Any, follows: Any) -> None:
        """Something does not follow, unless nobody here knows what befell the vehicle, or one of them."""
        if self.strange and (vehicle == "" or float(time_s or 0.0) >= self.strange.get(vehicle, math.inf)):
            self.skip(f"{check} after a fault of a kind from outside", "what it does is known to its own class alone")
            return
        self.n_findings[check] += 1
        if self.n_findings[check] <= LISTED:
            at_s = None if time_s is None else float(time_s)
            self.findings.append(Discrepancy(check, table, at_s, vehicle, str(stated), str(follows), self.key))

    def look(self, check: str, n: int = 1) -> None:
        """So many values are looked at by a check."""
        self.checked[check] += n

    def skip(self, what: str, why: str) -> None:
        """Something cannot be checked."""
        self.not_checked[what] = why

    def same(self, check: str, table: str, name: str, stated: Any, follows: Any, within: float = 0.0) -> None:
        """A stated value must be the one that follows, as far as numbers were rounded."""
        self.look(check)
        if not _is_close(stated, follows, within):
            self.add(check, table, None, "", f"{name} is {_shown(stated)}", _shown(follows))

    def alike(self, check: str, table: str, stated: Iterable[Row], other: str, due: Iterable[Row]) -> None:
        """Rows (time, vehicle, ...) of a table are those that follow from another, each as often."""
        given, follows = Counter(stated), Counter(due)
        self.look(check, given.total() + follows.total())
        for row in given - follows:
            self.add(check, table, row[0], row[1], " ".join(map(str, row[2:])), f"none, by {other}")
        for row in follows - given:
            self.add(check, table, row[0], row[1], "no row", f"{' '.join(map(str, row[2:]))}, by {other}")

    @property
    def as_json(self) -> dict[str, Any]:
        """All of it as one JSON value."""
        return {
            "ok": not self.findings,
            "findings": [asdict(finding) for finding in self.findings],
            "n_findings": dict(sorted(self.n_findings.items())),
            "checked": dict(sorted(self.checked.items())),
            "not_checked": dict(sorted(self.not_checked.items())),
        }

    @property
    def lines(self) -> Iterable[str]:
        """A line for each finding, and one for each check that has more."""
        yield from map(str, self.findings)
        for check, n in sorted(self.n_findings.items()):
            if n > LISTED:
                yield f"{n - LISTED} more [{check}]"


def _is_close(stated: Any, follows: Any, within: float) -> bool:
    if isinstance(stated, bool) or isinstance(follows, bool) or not isinstance(follows, int | float):
        return bool(stated == follows and isinstance(stated, bool) == isinstance(follows, bool))
    return isinstance(stated, int | float) and abs(stated - follows) <= within


def _shown(value: Any) -> str:
    return f"{value:.10g}" if isinstance(value, float) else repr(value) if isinstance(value, str) else str(value)


Array = npt.NDArray[Any]
TIME_STEP_S, PLACE_STEP_M, ANGLE_STEP_RAD, SPEED_STEP_MPS = 2.0**-12, 2.0**-7, 2.0**-10, 2.0**-10
"""Steps to which numbers of the tables are kept (docs/howto/results.md)."""
CLOSE_S = 2.0 * TIME_STEP_S
"""By how much two roundings of one time may differ, and a sum of two."""
Role = tuple[str, str]
"""Group and role."""


class TableColumns:
    """The columns of a table: numbers as arrays, all else, and numbers of which some are null, as lists."""

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
        """Rows of some columns, as plain values."""
        columns = (self[name] for name in names)
        return zip(*(column.tolist() if isinstance(column, np.ndarray) else column for column in columns), strict=True)


@dataclass(frozen=True)
class Track:
    """Where a vehicle was at every tick: arrays of one length."""

    time_s: Array
    x_m: Array
    y_m: Array
    heading_rad: Array
    speed_mps: Array
    energy_j: Array
    depth_m: Array


@dataclass(frozen=True, slots=True)
class Spell:
    """A fault of a vehicle from ``from_s`` until before ``until_s``, with its detail."""

    vehicle: str
    kind: str
    from_s: float
    until_s: float
    detail: str


class WeighedRow(NamedTuple):
    """A row of the table of decisions: a set of activities that could be chosen."""

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
        """What it is, whatever moves it."""
        return (*self[2:6], *self.activities)

    @property
    def purpose(self) -> tuple[str, ...]:
        """The same for every place or thing: what its importance depends on."""
        return (*self[2:5], *self.activities)

    @property
    def motivation(self) -> float:
        """Motivation of each of its activities."""
        return self.own + self.external


@dataclass
class Record:
    """One run.

    Attributes:
        scenario: tables of the resolved scenario, as TOML has them; seed: of the run.
        summary: its figures; tables: by name.
        modem: profile of its modem, None where the folder does not say.
    """

    scenario: dict[str, Any]
    seed: Any
    summary: dict[str, Any]
    tables: Mapping[str, TableColumns]
    modem: dict[str, Any] | None = None
    _spells: list[Spell] = field(default_factory=list)

    def of(self, section: str) -> dict[str, Any]:
        """A table of the scenario, empty if it has none."""
        found = self.scenario.get(section, {})
        return found if isinstance(found, dict) else {}

    def __getitem__(self, name: str) -> TableColumns:
        return self.tables[name]

    def rows(self, table: str, columns: str) -> zip[Any]:
        """Rows of a table, as plain values; names of columns with blanks between them."""
        return self.tables[table].rows(*columns.split())

    @cached_property
    def vehicles(self) -> dict[str, dict[str, Any]]:
        """Vehicles of the scenario by name, in its order."""
        return {vehicle["name"]: vehicle for vehicle in self.scenario["vehicle"]}

    @cached_property
    def drifts(self) -> bool:
        """True if vehicles err about where they are."""
        return bool(self.of("navigation").get("drift"))

    @cached_property
    def anew(self) -> set[str]:
        """Vehicles that began anew."""
        return {spell.vehicle for spell in self.spells if kind_of(spell.kind).begins_anew}

    @cached_property
    def newcomers(self) -> set[str]:
        """Vehicles that began anew or came late."""
        return self.anew | {spell.vehicle for spell in self.spells if kind_of(spell.kind).is_late}

    @cached_property
    def names(self) -> set[str]:
        """Names of all that the scenario has."""
        sections = [one for section in self.scenario.values() if isinstance(section, list) for one in section]
        return {str(one["name"]) for one in sections if isinstance(one, dict) and "name" in one}

    @cached_property
    def by_slot(self) -> list[str]:
        """Names of the vehicles by their numbers, which are their places in a TDMA frame."""
        return sorted(self.vehicles, key=lambda name: int(self.vehicles[name]["slot"]))

    @cached_property
    def declared_roles(self) -> dict[Role, dict[str, Any]]:
        """Roles of the scenario by group and name."""
        groups = self.scenario["group"]
        return {(group["name"], role["name"]): role for group in groups for role in group.get("role", [])}

    def is_able(self, vehicle: str, role: Role) -> bool:
        """True if a vehicle is able to play a role."""
        playable = self.vehicles[vehicle].get("playable_roles")
        return playable is None or not {role[1], ".".join(role)}.isdisjoint(playable)

    @cached_property
    def roles_with_jobs(self) -> set[Role]:
        """Roles that have a job."""
        return {key for key, role in self.declared_roles.items() if role.get("job") is not None}

    @cached_property
    def decisions(self) -> list[tuple[float, str, list[WeighedRow]]]:
        """Decisions with their time, their vehicle and all that they weighed: each begins with the same set."""
        found: list[tuple[float, str, list[WeighedRow]]] = []
        for row in map(WeighedRow._make, self["decisions"].rows(*WeighedRow._fields)):
            if not found or found[-1][:2] != row[:2] or found[-1][2][0].about == row.about:
                found.append((row.time_s, row.vehicle, []))
            found[-1][2].append(row)
        return found

    @cached_property
    def given_s(self) -> dict[tuple[str, ...], float]:
        """When a role was first given an objective, by (vehicle in whose view, group, role, objective, argument)."""
        names = ("vehicle", "group", "role", "objective", "argument", "time_s", "event")
        rows = [row for row in self["organisation"].rows(*names) if row[6] == "given"]
        return {row[:5]: row[5] for row in reversed(rows)}

    def roles_at(self, vehicle: str, at_s: float, event: str = "assigned") -> frozenset[Role]:
        """Roles that a vehicle has at a time, or that drive it (``active``); none once it has begun anew."""
        times_s, roles = self._role_changes.get((vehicle, event), ([], []))
        at = bisect_right(times_s, at_s)
        return roles[at - 1] if at else frozenset()

    @cached_property
    def _role_changes(self) -> dict[tuple[str, str], tuple[list[float], list[frozenset[Role]]]]:
        """By vehicle and the event by which they begin, when its roles changed, and which it had from then on."""
        ends = {"left": "assigned", "inactive": "active"}
        rows = list(self["roles"].rows("time_s", "vehicle", "group", "role", "event"))
        anew = [(spell.until_s, spell.vehicle) for spell in self.spells if kind_of(spell.kind).begins_anew]
        rows += [(at_s - CLOSE_S, vehicle, "", "", event) for at_s, vehicle in anew for event in ("left", "inactive")]
        found: dict[tuple[str, str], tuple[list[float], list[frozenset[Role]]]] = defaultdict(lambda: ([], []))
        for time_s, vehicle, group, role, event in sorted(rows, key=lambda row: row[0]):
            times_s, roles = found[vehicle, ends.get(event, event)]
            now, changed = roles[-1] if roles else frozenset[Role](), {(group, role)}
            times_s.append(time_s)
            roles.append(frozenset() if not group else now - changed if event in ends else now | changed)
        return dict(found)

    @cached_property
    def influenced(self) -> dict[str, set[str]]:
        """Roles that a role may signal to: those that it influences; with a job all of its group that have one."""
        jobs = self.roles_with_jobs
        return {
            f"{group}.{name}": {f"{group}.{one}" for one in role.get("influences", ())}
            | {f"{group}.{one}" for of, one in jobs if of == group and (group, name) in jobs}
            for (group, name), role in self.declared_roles.items()
        }

    @cached_property
    def packet_of_slot(self) -> dict[int, tuple[str, dict[str, float]]]:
        """Sender of the packet of a slot, and when each receiver had heard it."""
        rows = self["packets"].rows("slot", "sender", "receivers", "arrivals_s")
        return {slot: (sender, dict(zip(names, times_s, strict=False))) for slot, sender, names, times_s in rows}

    @cached_property
    def tick_s(self) -> float:
        """Length of a motion tick."""
        return float(self.of("scenario")["tick_s"])

    @cached_property
    def without_decision_s(self) -> float:
        """The most that passes until the next decision of a vehicle: its period, in whole ticks.

        A vehicle with a clock of its own may come to it a tick later, and if the clock is set back a period later.
        """
        n_ticks = math.ceil(float(self.of("decision")["period_s"]) / self.tick_s - TIME_STEP_S)
        return self.tick_s * (n_ticks if self.has_exact_clocks else 2 * n_ticks + 1)

    @cached_property
    def tracks(self) -> dict[str, Track]:
        """Tracks of the vehicles that have one."""
        table = self["trajectories"]
        names = np.array(table["vehicle"], dtype=object)
        found = {}
        for name in self.vehicles:
            at = np.flatnonzero(names == name)
            if len(at):
                columns = ("time_s", "x_m", "y_m", "heading_rad", "speed_mps", "energy_j", "depth_m")
                found[name] = Track(*(np.asarray(table[column])[at] for column in columns))
        return found

    @cached_property
    def end_s(self) -> float:
        """Time of the last motion tick."""
        times = self["trajectories"]["time_s"]
        return float(times.max()) if len(times) else 0.0

    @cached_property
    def mission_s(self) -> float:
        """What the mission took: until the last tick if it is complete, else the whole duration."""
        return self.end_s if self.summary.get("completed") else float(self.of("scenario")["duration_s"])

    @cached_property
    def spells(self) -> list[Spell]:
        """What befell vehicles, as the table of faults says; an end that is not in it is infinite."""
        rows = list(self["faults"].rows("time_s", "vehicle", "kind", "detail"))
        ends = [(time_s, vehicle, kind) for time_s, vehicle, kind, detail in rows if detail == "over"]
        found = []
        for time_s, vehicle, kind, detail in rows:
            if detail == "over":
                continue
            said = re.search(r"until (\S+) s", detail)
            until_s = math.inf if said is None else float(said[1])
            near = [
                end for end in ends if end[1:] == (vehicle, kind) and abs(end[0] - until_s) <= 1e-3 + 1e-5 * until_s
            ]
            found.append(Spell(vehicle, kind, time_s, near[0][0] if near else math.inf, detail))
        return found

    def during(self, vehicle: str, kinds: tuple[str, ...], times_s: Any) -> Array:
        """Whether a fault of some kinds holds for a vehicle at each of some times."""
        times_s = np.asarray(times_s, dtype=float)
        found = np.zeros(times_s.shape, dtype=bool)
        for spell in self.spells:
            if spell.vehicle == vehicle and spell.kind in kinds:
                found |= (times_s >= spell.from_s) & (times_s < spell.until_s)
        return found

    def is_away(self, vehicle: str, at_s: float) -> bool:
        """True if a vehicle is lost, off, not there yet, or without energy at a time."""
        return any(
            spell.vehicle == vehicle and spell.kind in AWAY and spell.from_s <= at_s < spell.until_s
            for spell in self.spells
        )

    @cached_property
    def strange(self) -> dict[str, float]:
        """Vehicles that a fault befell of which nobody here knows what it does, and from when on (s)."""
        declared = {str(fault.get("kind")) for fault in self.scenario.get("fault", [])} - set(KINDS)
        found: dict[str, float] = {}
        for spell in self.spells:
            if spell.kind in declared:
                found[spell.vehicle] = min(spell.from_s, found.get(spell.vehicle, math.inf))
        return found

    @cached_property
    def packet_s(self) -> tuple[float, float] | None:
        """(time before the bits, time per bit) of a packet on the air, by its modem; None where nobody says."""
        if self.modem is None:
            return None
        return float(self.modem["head_s"]), 1.0 / float(self.modem["rate_bps"])

    @cached_property
    def spread(self) -> float:
        """By which share vehicles may be faster or slower than their data."""
        return float(self.of("uncertainty").get("speed_spread", 0.0))

    @cached_property
    def has_exact_clocks(self) -> bool:
        """True unless a vehicle has a clock of its own."""
        return "clocks" not in self.of("communication") and not any(
            "clock" in vehicle for vehicle in self.vehicles.values()
        )

    @cached_property
    def all_need_all(self) -> bool:
        """True if every vehicle needs all that is told, from the start and for good."""
        communication = self.of("communication")
        is_limited = self.scenario.get("need") or communication.get("on_demand")
        return communication.get("needs_follow", "all") == "all" and not is_limited
