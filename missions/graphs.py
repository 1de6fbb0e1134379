"""Graphs of a run for networkx: communication, knowledge, organisation, structure.

They are networkx graphs of what the tables say, made when they are asked for; no step of a mission makes one. Names of
attributes end with their unit; ``graph.graph["units"]`` has them, too. Nodes have a ``kind``, and so have edges.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from missions.errors import OutputError
from worldmodel import suggestion

if TYPE_CHECKING:
    import networkx as nx

    from missions.figure import RunResults


RoleKey = tuple[str, str]
"""Group and role."""


class RoleDemand(NamedTuple):
    """What a role demands: from ``minimum`` to ``maximum`` holders, any number if that is None."""

    name: str
    minimum: int = 0
    maximum: int | None = None
    is_head: bool = False

    @property
    def cardinality(self) -> str:
        """How many may hold it, in short.

        >>> tuple(RoleDemand("a", *bounds).cardinality for bounds in ((1, 1), (0, 2), (1,), ()))
        ('(1)', '(0\u20132)', '(\u2265 1)', '')
        """
        if self.maximum is None:
            return f"(\u2265 {self.minimum})" if self.minimum else ""
        return f"({self.minimum})" if self.minimum == self.maximum else f"({self.minimum}\u2013{self.maximum})"


class GroupNode(NamedTuple):
    """A group: the one whose heads supervise it (empty if none does), and whether it is there from the start."""

    name: str
    above: str
    roles: tuple[RoleDemand, ...]
    is_founded: bool = True


def group_nodes(scenario: Mapping[str, Any], met: Iterable[RoleKey] = ()) -> list[GroupNode]:
    """Groups in the order of the scenario, then those that a table alone names.

    A group is supervised by the one that it is ``within``, or whose head forms it at sea (``formed_by``); one that has
    neither, nor a mission from the start, by the first that has a mission.

    Args:
        scenario: resolved.
        met: groups and roles that stand in the tables of the run.
    """
    declared = list(scenario.get("group", ()))
    leading = next((group["name"] for group in declared if group.get("mission")), "")
    found: dict[str, GroupNode] = {}
    for group in declared:
        flat = "" if group.get("mission") else leading
        above = group.get("formed_by") or group.get("within") or flat
        roles = tuple(_role(role) for role in group.get("role", ()))
        found[group["name"]] = GroupNode(group["name"], above, roles, not group.get("formed_by"))
    for name, role in met:
        group = found.get(name, GroupNode(name, "", ()))
        if role and all(role != other.name for other in group.roles):
            group = group._replace(roles=(*group.roles, RoleDemand(role)))
        found[name] = group
    return [group._replace(above=group.above if group.above in found else "") for group in found.values()]


def _role(role: Mapping[str, Any]) -> RoleDemand:
    return RoleDemand(role["name"], role.get("minimum", 0), role.get("maximum"), role.get("head", False))


TAKES: Mapping[str, tuple[str, ...]] = {
    "organisation": ("at_s", "viewer"), "heard": ("from_s", "until_s"), "plan": ("at_s", "viewer"), "jobs": (),
}  # fmt: skip
"""Graphs that a run has, and what each goes by."""
VEHICLE, GROUP, ROLE, TASK, JOB, NODE = "vehicle", "group", "role", "task", "job", "node"
"""Kinds of nodes."""
UNITS = {
    "s": "s", "m": "m", "bits": "bit", "j": "J", "fraction": "1", "per": "1",
}  # fmt: skip
"""Units by the last part of the name of an attribute."""


class GraphJob(Protocol):
    """What a graph needs of a job, see ``remoras.work``."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def place_m(self) -> tuple[float, float]:
        """Where it is."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Jobs that must be done before."""

    def is_able(self, data: Any) -> bool:
        """True if a vehicle has what it takes."""


class GraphNetwork(Protocol):
    """What a graph needs of a network that was measured."""

    @property
    def node(self) -> Sequence[Any]:
        """Its nodes."""

    @property
    def per(self) -> Mapping[tuple[str, str], float]:
        """Share lost by (sender, receiver)."""


def checked_name(name: str) -> str:
    """The name of a graph; raises OutputError if there is none."""
    if name not in TAKES:
        raise OutputError(f"graph {name!r}: allowed are {', '.join(TAKES)}{suggestion(str(name), TAKES)}")
    return name


def library() -> Any:
    """The library networkx; raises OutputError where it is not installed."""
    try:
        import networkx
    except ImportError:
        raise OutputError("graphs need networkx; install it with: python -m pip install networkx") from None
    return networkx


def _time_s(name: str, value: float | None, default_s: float, end_s: float) -> float:
    """A time of the run; raises OutputError if it has no such time."""
    if value is None:
        return default_s
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= end_s:
        raise OutputError(f"{name} is {value!r}; allowed: 0 to {end_s}, the end of the run")
    return float(value)


def _vehicles(results: RunResults) -> list[str]:
    return list(dict.fromkeys(results.table("trajectories").column("vehicle").to_pylist()))


def _moment_s(results: RunResults, at_s: float | None, viewer: str) -> float:
    """The time that is asked for, by default the end of the run; raises OutputError without such a time or vehicle."""
    vehicles, end_s = _vehicles(results), results.summary["mission_time_s"]
    if viewer and viewer not in vehicles:
        raise OutputError(f"viewer {viewer!r}: there are {', '.join(vehicles)}{suggestion(str(viewer), vehicles)}")
    return _time_s("at_s", at_s, end_s, end_s)


def organisation_graph(results: RunResults, at_s: float | None = None, viewer: str = "") -> nx.DiGraph:
    """Who plays what: vehicle to role ("plays"), role to group ("of"), group to the one that supervises it ("within").

    Args:
        results: of the run.
        at_s: when; the end of the run if None.
        viewer: in whose view; empty for what every vehicle takes itself to hold.

    Raises:
        OutputError: the run has no such time or vehicle.
    """
    nx = library()
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
    """Who heard whom: an edge from each sender to each vehicle that heard or lost a packet of it.

    An edge counts packets: ``n_heard``, ``n_lost`` on the way, ``n_collided``; ``heard_fraction`` of them all, and
    ``heard_bits``. A node has what the vehicle itself sent.

    Args:
        results: of the run.
        from_s: of packets that began then or later, from the start if None; until_s: and before then, else to the end.

    Raises:
        OutputError: the run has no such time, or they are in the wrong order.
    """
    end_s = results.summary["mission_time_s"]
    first_s, last_s = _time_s("from_s", from_s, 0.0, end_s), _time_s("until_s", until_s, math.inf, end_s)
    if not first_s < last_s:
        raise OutputError(f"from_s is {first_s:g}; allowed: below until_s, {last_s:g}")
    rows = (row for row in results.table("packets").to_pylist() if first_s <= row["time_s"] < last_s)
    graph = heard_among(_vehicles(results), rows)
    graph.graph.update(name="heard", from_s=first_s, until_s=min(last_s, end_s))
    return _with_units(graph)


def heard_among(vehicles: Iterable[str], packets: Iterable[Mapping[str, Any]]) -> nx.DiGraph:
    """Who of these vehicles heard whom, by rows of the table of packets; see ``heard_graph``."""
    nx = library()
    graph = nx.DiGraph()
    for vehicle in vehicles:
        graph.add_node(vehicle, kind=VEHICLE, n_sent=0, sent_bits=0)
    for row in packets:
        sender = row["sender"]
        graph.nodes[sender]["n_sent"] += 1
        graph.nodes[sender]["sent_bits"] += row["size_bits"]
        for what, column in (("n_heard", "receivers"), ("n_lost", "lost_by"), ("n_collided", "collided_at")):
            for receiver in row.get(column) or ():
                if not graph.has_edge(sender, receiver):
                    graph.add_edge(sender, receiver, kind="heard", n_heard=0, n_lost=0, n_collided=0, heard_bits=0)
                edge = graph.edges[sender, receiver]
                edge[what] += 1
                edge["heard_bits"] += row["size_bits"] * (what == "n_heard")
    for _, _, edge in graph.edges(data=True):
        edge["heard_fraction"] = edge["n_heard"] / (edge["n_heard"] + edge["n_lost"] + edge["n_collided"])
    return graph


def plan_graph(results: RunResults, at_s: float | None = None, viewer: str = "") -> nx.DiGraph:
    """Plans as trees: from each task to those that it was divided into ("divided").

    A task has its vehicle, group, name, method and status, since when it has this status (``since_s``), and when it
    was expected to end (``expected_end_s``) where somebody can tell.

    Args:
        results: of the run.
        at_s: when; the end of the run if None.
        viewer: whose plans; those of all if empty.

    Raises:
        OutputError: the run has no such time or vehicle.
    """
    nx = library()
    moment_s = _moment_s(results, at_s, viewer)
    graph = nx.DiGraph(name="plan", at_s=moment_s, viewer=viewer)
    for row in results.rows("plans"):
        if row["time_s"] > moment_s or (viewer and row["vehicle"] != viewer):
            continue
        plan = (row["vehicle"], row["group"], row["role"], row["objective"], row["argument"])
        node = "/".join([*filter(None, plan), str(row["node"])])
        about = {"vehicle": row["vehicle"], "group": row["group"], "task": row["task"], "method": row["method"]}
        expected_s = row["expected_time_s"]
        expected = {} if expected_s is None else {"expected_end_s": row["time_s"] + expected_s}
        graph.add_node(node, kind=TASK, status=row["status"], since_s=row["time_s"], **about, **expected)
        graph.remove_edges_from(list(graph.in_edges(node)))
        if row["parent"] >= 0:
            graph.add_edge("/".join([*filter(None, plan), str(row["parent"])]), node, kind="divided")
    return _with_units(graph)


def jobs_graph(jobs: Iterable[GraphJob], vehicles: Mapping[str, Any]) -> nx.DiGraph:
    """Jobs and what they need: from a job to those that come after it ("before"), and from who is able ("able").

    Args:
        jobs: of the mission.
        vehicles: data of the vehicles by name.
    """
    nx = library()
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


def network_graph(network: GraphNetwork) -> nx.DiGraph:
    """What the links of a network lose: an edge from each sender to each receiver, with the share lost (``per``)."""
    nx = library()
    graph = nx.DiGraph(name="network")
    for node in network.node:
        place = {} if node.position_m is None else dict(zip(("x_m", "y_m"), node.position_m, strict=True))
        depth = {} if node.depth_m is None else {"depth_m": node.depth_m}
        graph.add_node(node.name, kind=NODE, **place, **depth)
    for (sender, receiver), per in network.per.items():
        graph.add_edge(sender, receiver, kind="link", per=per)
    return _with_units(graph)


def _with_units(graph: nx.DiGraph) -> nx.DiGraph:
    """The graph with the units of its attributes, by their names."""
    values = [*(data for _, data in graph.nodes(data=True)), *(data for _, _, data in graph.edges(data=True))]
    names = sorted({name for data in values for name in data})
    graph.graph["units"] = {name: UNITS[name.rpartition("_")[2]] for name in names if name.rpartition("_")[2] in UNITS}
    return graph


def mutual(graph: nx.DiGraph) -> nx.Graph:
    """The links that were used both ways: each of the two heard the other."""
    nx = library()
    both = nx.Graph()
    both.add_nodes_from(graph.nodes(data=True))
    heard = {(sender, receiver) for sender, receiver, edge in graph.edges(data=True) if edge["n_heard"]}
    both.add_edges_from((one, two) for one, two in heard if (two, one) in heard)
    return both


def cutting(graph: nx.DiGraph) -> frozenset[str]:
    """Vehicles without which the others would fall apart: the articulation points of the links used both ways."""
    nx = library()
    return frozenset(nx.articulation_points(mutual(graph)))


def n_parts(graph: nx.DiGraph) -> int:
    """Parts of the fleet that are tied by links used both ways."""
    return int(library().number_connected_components(mutual(graph)))


def is_connected(graph: nx.DiGraph) -> bool:
    """True if what any vehicle said could reach every other, directly or passed on."""
    nx = library()
    heard = nx.DiGraph()
    heard.add_nodes_from(graph.nodes)
    heard.add_edges_from((one, two) for one, two, edge in graph.edges(data=True) if edge["n_heard"])
    return bool(nx.is_strongly_connected(heard))
