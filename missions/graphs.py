"""Networkx graphs of a run; ``graph.graph["units"]`` lists the unit suffixes of attributes. All have a ``kind``."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from missions.errors import OutputError
from worldmodel import suggestion

if TYPE_CHECKING:
    import networkx as nx

    from exchange.channel.network import Network
    from missions.figure import RunResults
    from remoras.database import AUVDatabase
    from remoras.organisation import RoleKey
    from remoras.work import Job


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


TAKES: Mapping[str, tuple[str, ...]] = {
    "organisation": ("at_s", "viewer"), "heard": ("from_s", "until_s"), "plan": ("at_s", "viewer"), "jobs": (),
}  # fmt: skip
VEHICLE, GROUP, ROLE, TASK, JOB, NODE = "vehicle", "group", "role", "task", "job", "node"
UNITS = {
    "s": "s", "m": "m", "bits": "bit", "j": "J", "fraction": "1", "per": "1",
}  # fmt: skip


def checked_name(name: str) -> str:
    """Return the name of a graph; raise OutputError if unknown."""
    if name not in TAKES:
        raise OutputError(f"graph {name!r}: allowed are {', '.join(TAKES)}{suggestion(str(name), TAKES)}")
    return name


def _time_s(name: str, value: float | None, default_s: float, end_s: float) -> float:
    if value is None:
        return default_s
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= end_s:
        raise OutputError(f"{name} is {value!r}; allowed: 0 to {end_s}, the end of the run")
    return float(value)


def _vehicles(results: RunResults) -> list[str]:
    return list(dict.fromkeys(results.table("trajectories").column("vehicle").to_pylist()))


def _moment_s(results: RunResults, at_s: float | None, viewer: str) -> float:
    vehicles, end_s = _vehicles(results), results.summary["mission_time_s"]
    if viewer and viewer not in vehicles:
        raise OutputError(f"viewer {viewer!r}: there are {', '.join(vehicles)}{suggestion(str(viewer), vehicles)}")
    return _time_s("at_s", at_s, end_s, end_s)


def organisation_graph(results: RunResults, at_s: float | None = None, viewer: str = "") -> nx.DiGraph:
    """Graph of vehicle to role ("plays"), role to group ("of"), group to supervisor ("within").

    ``at_s`` None is the end of the run; ``viewer`` "" means each vehicle's own roles. Raises OutputError for unknown
    ones.
    """
    import networkx as nx  # slow to load, and checking a scenario loads the metrics that use graphs

    moment_s = _moment_s(results, at_s, viewer)
    graph = nx.DiGraph(name="organisation", at_s=moment_s, viewer=viewer)
    for vehicle in _vehicles(results):
        graph.add_node(vehicle, kind=VEHICLE)
    held: dict[tuple[str, str, str], float] = {}
    for row in results.table("organisation").to_pylist():
        if row["vehicle"] != (viewer or row["peer"]) or row["time_s"] > moment_s or not row["role"]:
            continue
        key = row["peer"], row["group"], row["role"]
        if row["event"] == "assigned":
            # A repeated event does not restart a role.
            held.setdefault(key, row["time_s"])
        elif row["event"] == "left":
            held.pop(key, None)
    groups = group_nodes(results.scenario_tables, [(group, role) for _, group, role in held])
    graph.add_nodes_from((group.name, {"kind": GROUP}) for group in groups)
    graph.add_edges_from((group.name, group.above, {"kind": "within"}) for group in groups if group.above)
    for (vehicle, group, role), since_s in held.items():
        graph.add_node(f"{group}.{role}", kind=ROLE)
        graph.add_edge(vehicle, f"{group}.{role}", kind="plays", since_s=since_s)
        graph.add_edge(f"{group}.{role}", group, kind="of")
    if viewer:
        _mark_absent(graph, results, viewer, moment_s)
    return _with_units(graph)


def _mark_absent(graph: nx.DiGraph, results: RunResults, viewer: str, moment_s: float) -> None:
    for row in results.rows("membership"):
        if row["vehicle"] == viewer and row["time_s"] <= moment_s:
            graph.nodes[row["peer"]]["is_absent"] = row["event"] == "absent"


def heard_graph(results: RunResults, from_s: float | None = None, until_s: float | None = None) -> nx.DiGraph:
    """Graph of reception: edge from each sender to each vehicle that received or lost packets.

    Edges have ``n_heard``, ``n_lost``, ``n_collided``, ``heard_fraction`` of these, and ``heard_bits``. Packets start
    from ``from_s`` (None: 0) to before ``until_s`` (None: end). Raises OutputError for other times.
    """
    import networkx as nx

    end_s = results.summary["mission_time_s"]
    first_s, last_s = _time_s("from_s", from_s, 0.0, end_s), _time_s("until_s", until_s, math.inf, end_s)
    if not first_s < last_s:
        raise OutputError(f"from_s is {first_s:g}; allowed: below until_s, {last_s:g}")
    graph = nx.DiGraph(name="heard", from_s=first_s, until_s=min(last_s, end_s))
    for vehicle in _vehicles(results):
        graph.add_node(vehicle, kind=VEHICLE, n_sent=0, sent_bits=0)
    for row in (row for row in results.table("packets").to_pylist() if first_s <= row["time_s"] < last_s):
        sender = row["sender"]
        graph.nodes[sender]["n_sent"] += 1
        graph.nodes[sender]["sent_bits"] += row["size_bits"]
        for count, column in (("n_heard", "receivers"), ("n_lost", "lost_by"), ("n_collided", "collided_at")):
            for receiver in row[column]:
                if not graph.has_edge(sender, receiver):
                    graph.add_edge(sender, receiver, kind="heard", n_heard=0, n_lost=0, n_collided=0, heard_bits=0)
                edge = graph.edges[sender, receiver]
                edge[count] += 1
                edge["heard_bits"] += row["size_bits"] * (count == "n_heard")
    for _, _, edge in graph.edges(data=True):
        edge["heard_fraction"] = edge["n_heard"] / (edge["n_heard"] + edge["n_lost"] + edge["n_collided"])
    return _with_units(graph)


def plan_graph(results: RunResults, at_s: float | None = None, viewer: str = "") -> nx.DiGraph:
    """Graph of plan trees: edges ("divided") from each task to its subtasks; ``viewer`` "" means all vehicles.

    Tasks have vehicle, group, name, method, status, ``since_s`` and, if known, ``expected_end_s``.
    """
    import networkx as nx

    moment_s = _moment_s(results, at_s, viewer)
    graph = nx.DiGraph(name="plan", at_s=moment_s, viewer=viewer)
    for row in results.rows("plans"):
        if row["time_s"] > moment_s or (viewer and row["vehicle"] != viewer):
            continue
        plan = (row["vehicle"], row["group"], row["role"], row["objective"], row["argument"])
        node = "/".join([*filter(None, plan), str(row["node"])])
        labels = {"vehicle": row["vehicle"], "group": row["group"], "task": row["task"], "method": row["method"]}
        expected_s = row["expected_time_s"]
        expected = {} if expected_s is None else {"expected_end_s": row["time_s"] + expected_s}
        graph.add_node(node, kind=TASK, status=row["status"], since_s=row["time_s"], **labels, **expected)
        # A row replaces the earlier one of its node, edge included.
        graph.remove_edges_from(list(graph.in_edges(node)))
        if row["parent"] >= 0:
            graph.add_edge("/".join([*filter(None, plan), str(row["parent"])]), node, kind="divided")
    return _with_units(graph)


def jobs_graph(jobs: Iterable[Job], vehicles: AUVDatabase) -> nx.DiGraph:
    """Graph of jobs: edges to later jobs ("before") and from able vehicles ("able")."""
    import networkx as nx

    graph = nx.DiGraph(name="jobs")
    for vehicle in vehicles:
        graph.add_node(vehicle, kind=VEHICLE)
    listed = list(jobs)
    for job in listed:
        graph.add_node(job.name, kind=JOB, x_m=float(job.place_m[0]), y_m=float(job.place_m[1]))
    for job in listed:
        graph.add_edges_from((needed, job.name, {"kind": "before"}) for needed in job.needs)
        able = [name for name, data in vehicles.items() if job.is_able(data)]
        graph.add_edges_from((name, job.name, {"kind": "able"}) for name in able)
    return _with_units(graph)


def network_graph(network: Network) -> nx.DiGraph:
    """Graph of links with their packet loss (``per``)."""
    import networkx as nx

    graph = nx.DiGraph(name="network")
    for node in network.node:
        place = {} if node.position_m is None else dict(zip(("x_m", "y_m"), node.position_m, strict=True))
        depth = {} if node.depth_m is None else {"depth_m": node.depth_m}
        graph.add_node(node.name, kind=NODE, **place, **depth)
    for (sender, receiver), per in network.per.items():
        graph.add_edge(sender, receiver, kind="link", per=per)
    return _with_units(graph)


def _with_units(graph: nx.DiGraph) -> nx.DiGraph:
    values = [*(data for _, data in graph.nodes(data=True)), *(data for _, _, data in graph.edges(data=True))]
    names = sorted({name for data in values for name in data})
    graph.graph["units"] = {name: UNITS[name.rpartition("_")[2]] for name in names if name.rpartition("_")[2] in UNITS}
    return graph
