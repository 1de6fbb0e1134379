"""Run data of figures, replay and exports: tracks, outages, roles, milestones, outcomes of packets."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from missions.fault import OVER, Absence, absence, absences
from missions.figure import RunResults, run_end_s
from missions.spans import Span, outside, spans_by

K = TypeVar("K")
RoleKey = tuple[str, str]  # group, role


def preorder(nodes: Iterable[K], below: Callable[[K], Iterable[K]], depth: int = 0) -> Iterator[tuple[K, int]]:
    """Yield the nodes of trees, each before those below it, with the number of nodes above."""
    for node in nodes:
        yield node, depth
        yield from preorder(below(node), below, depth + 1)


class RoleDemand(NamedTuple):
    """Demand of a role: ``minimum`` to ``maximum`` holders; None is unlimited."""

    name: str
    minimum: int = 0
    maximum: int | None = None
    is_head: bool = False

    @property
    def cardinality(self) -> str:
        """Short form of the number of holders: ``(1)``, ``(0–2)``, ``(≥ 1)``, or empty without bounds."""
        if self.maximum is None:
            return f"(\u2265 {self.minimum})" if self.minimum else ""
        return f"({self.minimum})" if self.minimum == self.maximum else f"({self.minimum}\u2013{self.maximum})"


class GroupNode(NamedTuple):
    """A group; ``above`` is its supervising group or empty, ``is_founded`` True if initial."""

    name: str
    above: str
    roles: tuple[RoleDemand, ...]
    is_founded: bool = True


def group_nodes(scenario: Mapping[str, Any], met: Iterable[RoleKey] = ()) -> list[GroupNode]:
    """Return groups in scenario order, then those only in ``met``: groups and roles in the tables of the run.

    The supervising group is that of ``within`` or ``formed_by``. A group with neither, and without an initial mission,
    is supervised by the first group with a mission.
    """
    declared = list(scenario.get("group", ()))
    leading = next((group["name"] for group in declared if group.get("mission")), "")
    nodes: dict[str, GroupNode] = {}
    for group in declared:
        flat = "" if group.get("mission") else leading
        above = group.get("formed_by") or group.get("within") or flat
        roles = tuple(_role(role) for role in group.get("role", ()))
        nodes[group["name"]] = GroupNode(group["name"], above, roles, not group.get("formed_by"))
    for name, role in met:
        group = nodes.get(name, GroupNode(name, "", ()))
        if role and all(role != other.name for other in group.roles):
            group = group._replace(roles=(*group.roles, RoleDemand(role)))
        nodes[name] = group
    return [group._replace(above=group.above if group.above in nodes else "") for group in nodes.values()]


def _role(role: Mapping[str, Any]) -> RoleDemand:
    return RoleDemand(role["name"], role.get("minimum", 0), role.get("maximum"), role.get("head", False))


def outages(results: RunResults) -> dict[str, list[Span]]:
    """Return the outages per affected vehicle, in order of their start; a restart is none."""
    rows = (row for row in results.rows("faults") if absence(row["kind"]) is not Absence.PAUSE)
    changes = absences((float(row["time_s"]), row["vehicle"], row["kind"], row["detail"]) for row in rows)
    return spans_by((vehicle, time_s, is_absent) for time_s, vehicle, is_absent in changes)


Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Track(NamedTuple):
    """Track of a vehicle in time order; arrays of equal length."""

    time_s: Floats
    x_m: Floats
    y_m: Floats
    depth_m: Floats
    heading_rad: Floats
    speed_mps: Floats
    energy_j: Floats

    def at(self, *times_s: float) -> list[tuple[float, float, float]]:
        """Return interpolated x, y and depth at each time."""
        columns = (np.interp(times_s, self.time_s, along).tolist() for along in (self.x_m, self.y_m, self.depth_m))
        return list(zip(*columns, strict=True))


def array(column: Any) -> NDArray[Any]:
    """Convert an Arrow column of numbers; missing values become NaN."""
    whole = column.combine_chunks() if hasattr(column, "combine_chunks") else column
    # Not to_numpy: loading pandas takes longer than all work here.
    if whole.null_count:
        return np.array(whole.to_pylist(), dtype=float)
    return np.from_dlpack(whole)


def joined(tracks: Iterable[Track], column: str) -> Floats:
    """Return a column of several tracks, one after the other."""
    return np.concatenate([np.empty(0), *(getattr(track, column) for track in tracks)])


class Tenure(NamedTuple):
    """One role of a vehicle: intervals held, and intervals as active role."""

    group: str
    role: str
    held: tuple[Span, ...]
    active: tuple[Span, ...]


class MilestoneRow(NamedTuple):
    """Milestone; vehicle and group are empty if not applicable."""

    name: str
    vehicle: str
    group: str
    time_s: float

    @property
    def label(self) -> str:
        """Display name with vehicle or group."""
        return ": ".join(part for part in (self.name.replace("_", " "), self.vehicle or self.group) if part)


class VehicleFault(NamedTuple):
    """Fault of a vehicle; its interval ends with the run at the latest."""

    vehicle: str
    kind: str
    detail: str
    span: Span


def vehicle_names(results: RunResults) -> list[str]:
    """Return the vehicle names in scenario order."""
    return [vehicle["name"] for vehicle in results.scenario_tables.get("vehicle", ())]


def error_rate(results: RunResults) -> str:
    """Return the packet error rate; ``expected`` if the channel computes it before the run; empty without one."""
    rate, given = results.summary.get("per"), results.scenario_tables.get("channel", {}).get("per")
    return "" if rate is None else f"{'expected ' * (rate not in (0.0, given))}PER {100 * rate:.3g} %"


def tracks(results: RunResults) -> dict[str, Track]:
    """Return the recorded tracks in scenario order."""
    table = results.table("trajectories")
    names = np.asarray(table["vehicle"].to_pylist(), dtype=str)
    columns = [array(table[name]) for name in Track._fields]
    own = {name: names == name for name in vehicle_names(results)}
    return {name: Track(*(column[rows] for column in columns)) for name, rows in own.items() if rows.any()}


def milestones(results: RunResults) -> list[MilestoneRow]:
    """Return the milestones in time order."""
    rows = results.summary["milestones"]
    return [MilestoneRow(m["name"], m["vehicle"], m["group"], float(m["time_s"])) for m in rows]


def vehicle_faults(results: RunResults) -> list[VehicleFault]:
    """Return faults declared in the scenario, in order of their start."""
    kinds = {fault.get("kind") for fault in results.scenario_tables.get("fault", ())}
    last_s = run_end_s(results)
    faults: list[VehicleFault] = []
    for row in results.rows("faults"):
        vehicle, kind, time_s = row["vehicle"], row["kind"], float(row["time_s"])
        if kind not in kinds:
            continue  # undeclared, such as an empty battery
        if row["detail"] != OVER:
            faults.append(VehicleFault(vehicle, kind, row["detail"], Span(time_s, last_s)))
            continue
        for number, fault in enumerate(faults):
            if (fault.vehicle, fault.kind, fault.span.end_s) == (vehicle, kind, last_s):
                faults[number] = fault._replace(span=Span(fault.span.start_s, time_s))
                break
    return faults


def tenures(results: RunResults) -> dict[str, list[Tenure]]:
    """Return the roles of every vehicle by group, in order of first appearance; none is active during an outage."""
    rows, last_s, out = results.rows("roles"), run_end_s(results), outages(results)
    held, active = (
        spans_by(
            (
                (_role_of(row), row["time_s"], row["event"] == opening)
                for row in rows
                if row["event"] in (opening, *ends)
            ),
            last_s,
        )
        for opening, *ends in (("assigned", "left"), ("active", "inactive", "left"))
    )
    groups = list(dict.fromkeys(row["group"] for row in rows))
    own: dict[str, list[Tenure]] = {name: [] for name in vehicle_names(results)}
    for key in sorted(dict.fromkeys(map(_role_of, rows)), key=lambda key: groups.index(key[1])):
        vehicle, group, role = key
        parts = (part for span in active.get(key, ()) for part in outside(*span, out.get(vehicle, ())))
        own[vehicle].append(Tenure(group, role, tuple(held.get(key, ())), tuple(parts)))
    return own


def _role_of(row: Mapping[str, Any]) -> tuple[str, str, str]:
    return row["vehicle"], row["group"], row["role"]


def satisfaction(results: RunResults) -> dict[str, dict[RoleKey, tuple[Floats, Floats]]]:
    """Return times and values of personal satisfaction per vehicle and role."""
    points: defaultdict[tuple[str, str, str], list[tuple[float, float]]] = defaultdict(list)
    for row in results.rows("satisfaction"):
        points[_role_of(row)].append((row["time_s"], row["value"]))
    series: dict[str, dict[RoleKey, tuple[Floats, Floats]]] = {name: {} for name in vehicle_names(results)}
    for (vehicle, *key), own in points.items():
        times_s, values = np.array(own).T
        series[vehicle][key[0], key[1]] = times_s, values
    return series


def marker_step_s(length_s: float) -> float:
    """Return a round interval for at most ten track markers in ``length_s``, such as 300 s for 2062 s."""
    steps_s = (1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 14400, 43200, 86400)
    return float(next((step for step in steps_s if length_s / step <= 10), length_s))


UNREACHED, LOST, HEARD, COLLIDED, REFUSED = range(5)
"""Packet outcome at a vehicle; unreached also without energy, collided also with an own transmission."""


def packet_outcomes(packets: Any, refusals: Iterable[Mapping[str, Any]], vehicles: Sequence[str]) -> Ints:
    """Return the outcome of each packet (row of the Arrow table) at each vehicle (column)."""
    number = {name: index for index, name in enumerate(vehicles)}
    outcome = np.full((packets.num_rows, len(vehicles)), UNREACHED)
    for column, code in (("lost_by", LOST), ("collided_at", COLLIDED), ("receivers", HEARD)):
        for row, names in enumerate(packets[column].to_pylist()):
            outcome[row, [number[name] for name in names if name in number]] = code
    # A packet counts as received in its table even if the receiver refused it.
    for row, receiver in packets_refused(packets.select(["slot", "receivers", "arrivals_s"]).to_pylist(), refusals):
        if receiver in number:
            outcome[row, number[receiver]] = REFUSED
    return outcome


def packets_refused(
    packets: Sequence[Mapping[str, Any]], refusals: Iterable[Mapping[str, Any]]
) -> Iterator[tuple[int, str]]:
    """Yield the index of each refused packet and the refusing vehicle; refusals of foreign packets are skipped."""
    arrived: dict[tuple[str, float], int] = {}
    slots: dict[tuple[str, int], int] = {}
    for index, row in enumerate(packets):
        for receiver, time_s in zip(row["receivers"], row["arrivals_s"], strict=True):
            slots[receiver, row["slot"]] = index
            arrived[receiver, time_s] = index
    for row in refusals:
        vehicle = row["vehicle"]
        # Fields of a refused packet may be wrong: the arrival time decides, else the slot.
        packet = arrived.get((vehicle, row["time_s"]), slots.get((vehicle, row["slot"])))
        if packet is not None:
            yield packet, vehicle
