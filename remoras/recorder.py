"""Recorder: tables of a run as lists of rows.

Each table declares columns and units once; sensors and missions add their own. Writers append a tuple per row, in
column and time order. Lists within the newest rows may change while packets are under way.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, NamedTuple

from remoras.errors import PluginError

if TYPE_CHECKING:
    from worldmodel import Attribute

ASSIGNING = frozenset({"playsRole", "leftRole", "hasMission"})
"""Core attributes about roles and missions; objectives count with them."""
DONE = "jobDone"
"""Attribute that reports a completed job."""
OBJECTIVES = "objective"
"""Prefix of attributes that give a role an objective."""


class Content(Enum):
    """Purpose of a bit; every transmitted bit has exactly one."""

    HEADERS = "headers"
    ASSIGNMENTS = "assignments"
    CLAIMS = "claims"
    STATUS = "status"
    SIGNALS = "signals"
    OBSERVATIONS = "observations"

    __hash__ = object.__hash__  # much faster than that of enumerations; called in each slot


def content_of(attribute: Attribute, messages: Collection[str]) -> Content:
    """Return the purpose of facts of an attribute; ``messages`` are those of the strategy."""
    if attribute.name in ASSIGNING or attribute.name.startswith(OBJECTIVES):
        return Content.ASSIGNMENTS
    if attribute.name in messages and attribute.name != DONE:
        return Content.CLAIMS
    return Content.STATUS if attribute.latest_only else Content.OBSERVATIONS


Row = tuple[Any, ...]
KINDS = ("float", "int", "str", "bool", "list", "floats", "ints")
"""Kinds of columns; ``list`` holds texts, ``floats`` and ``ints`` hold numbers."""
KEY = "key"
"""First column of the tables of a sweep."""
UNFIT = frozenset("/\\\0")
"""Characters that are invalid in file names."""


class Column(NamedTuple):
    """Column: name, kind (one of ``KINDS``) and unit (empty if none).

    >>> Column("depth_m", "float", "m").unit
    'm'
    """

    name: str
    kind: str
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Table:
    """Table of results; PluginError for a name unfit for files, or contradictory columns.

    >>> Table("looks", (TIME, VEHICLE, Column("n_seen", "int"))).column_names
    ('time_s', 'vehicle', 'n_seen')
    """

    name: str
    columns: tuple[Column, ...]

    def __post_init__(self) -> None:
        if not self.name or self.name.startswith(".") or not UNFIT.isdisjoint(self.name):
            raise PluginError(f"table {self.name!r}: its name becomes a file name; allowed: no / and no dot in front")
        if not (isinstance(self.columns, tuple) and all(isinstance(column, Column) for column in self.columns)):
            raise PluginError(f"table {self.name!r}: columns is {self.columns!r}; expected a tuple of Column")
        for name, n_times in Counter(self.column_names).items():
            if n_times > 1 or name == KEY:
                why = f"listed {n_times} times" if n_times > 1 else "the column by which sweeps tell runs apart"
                raise PluginError(f"table {self.name!r}, column {name!r}: {why}; rename it")
        for column in self.columns:
            if column.kind not in KINDS:
                allowed = ", ".join(KINDS)
                where = f"table {self.name!r}, column {column.name!r}"
                raise PluginError(f"{where}: kind is {column.kind!r}; allowed: {allowed}")

    @property
    def column_names(self) -> tuple[str, ...]:
        """Names of the columns, in the order of the rows."""
        return tuple(column.name for column in self.columns)


TIME = Column("time_s", "float", "s")
VEHICLE = Column("vehicle", "str")

TRAJECTORIES = Table("trajectories", (
    TIME, VEHICLE, Column("x_m", "float", "m"), Column("y_m", "float", "m"),
    Column("heading_rad", "float", "rad"), Column("speed_mps", "float", "m/s"), Column("energy_j", "float", "J"),
    Column("depth_m", "float", "m"),
))  # fmt: skip
"""True state of every vehicle at every motion tick."""
ROLES = Table("roles", (TIME, VEHICLE, Column("group", "str"), Column("role", "str"), Column("event", "str")))
"""Roles of every vehicle in its own view: assigned, active (it drives), inactive, left."""
ORGANISATION = Table("organisation", (
    TIME, VEHICLE, Column("peer", "str"), Column("group", "str"), Column("role", "str"), Column("event", "str"),
    Column("issuer", "str"), Column("act", "str"), Column("objective", "str"), Column("argument", "str"),
    Column("outcome", "str"),
))  # fmt: skip
"""Changes of the organisation in the view of every vehicle, and refused requests.

For ``vehicle``, ``peer`` takes the role (assigned) or leaves it (left), or a role gets an objective, a group a mission
(given), as requested by ``issuer``; ``outcome`` gives the reason of a refusal. Rows at 0 s, without issuer, were agreed
before the mission. Later rows are at ends of TDMA frames, when requests take effect; missions take effect at once. A
later argument of an objective replaces an earlier one. Absent peers keep their roles here, see ``MEMBERSHIP``.
"""
ACTIVITIES = Table("activities", (
    TIME, VEHICLE, Column("type", "str"), Column("name", "str"), Column("role", "str"),
    Column("motivation", "float", "1"),
))  # fmt: skip
"""Activities of a vehicle from then on, written when its choice changes."""
DECISIONS = Table("decisions", (
    TIME, VEHICLE, Column("group", "str"), Column("role", "str"), Column("objective", "str"),
    Column("argument", "str"), Column("activities", "list"), Column("stimulus", "float", "1"),
    Column("own", "float", "1"), Column("external", "float", "1"), Column("source", "str"), Column("slot", "int"),
    Column("chosen", "bool"), Column("best_mean", "float", "1"),
))  # fmt: skip
"""Candidate activity sets of a vehicle, written when its choice or the sets change.

The motivation is the sum of ``own`` and ``external``, the latter due to the influence signal that ``source`` sent in
``slot``. Group, role and objective are empty for permanent activities; without a signal source is empty and slot null.
``best_mean`` is the mean motivation of the best combination with the set; the choice has the highest. It is null for
vital sets, which come first, and for sets without a valid combination.
"""
SATISFACTION = Table("satisfaction", (
    TIME, VEHICLE, Column("group", "str"), Column("role", "str"), Column("value", "int", "-128..127"),
))  # fmt: skip
"""Satisfaction of a vehicle in each role as its slot opens."""
PACKETS = Table("packets", (
    Column("slot", "int"), TIME, Column("sender", "str"), Column("size_bits", "int", "bit"),
    Column("items", "int"), Column("acks", "int"), Column("receivers", "list"), Column("lost_by", "list"),
    Column("end_s", "float", "s"), Column("arrivals_s", "floats", "s"), Column("item_uids", "list"),
    Column("status_uids", "list"), Column("signal_roles", "list"), Column("signal_addressed", "list"),
    Column("signal_values", "ints", "-128..127"), Column("collided_at", "list"),
))  # fmt: skip
"""Packets sent from ``time_s`` to ``end_s``.

``arrivals_s`` has the reception end at each of ``receivers``. ``lost_by`` lost it on the channel, ``collided_at`` to
another packet or to their own transmission. Uids are those of ``ITEMS``. An influence signal has an entry in the last
three columns for every role that it addresses (``Group.Role``; empty if none).
"""
KNOWLEDGE = Table("knowledge", (
    TIME, VEHICLE, Column("item", "str"), Column("origin", "str"), Column("event", "str"),
))  # fmt: skip
"""Observation, reception and acknowledgement (by all interested nodes) of items.

Items received without need are set aside; they count as received once needed.
"""
SETTLING = Table("settling", KNOWLEDGE.columns)
"""Receptions after the mission (``scenario.settle_s``): as ``KNOWLEDGE``, with statuses."""
ITEMS = Table("items", (
    Column("uid", "str"), Column("origin", "str"), TIME, Column("recorded_s", "float", "s"), Column("subject", "str"),
    Column("attribute", "str"), Column("value", "str"), Column("kind", "str"), Column("uncertainty", "str"),
))  # fmt: skip
"""Facts that vehicles recorded, in the order of their item.

``kind`` is told (repeated until acknowledged), status (sent once, newest value valid) or kept (private). Uids: told
``origin-sequence``, with ``.part`` for later fragments of an item larger than a packet; items are numbered without
gaps, per epoch (``origin.eEPOCH-sequence``, except the first); status ``origin@time:subject.attribute``, from its first
fact; kept ``origin-pN``. ``time_s`` is the quantised time of observation, ``recorded_s`` that of entry into the world
model. The value is text: names of instances, classes and symbols, numbers, true or false, ``POINT (east north)``; so is
the uncertainty: standard deviation of numbers and points, else probability, empty if none.
"""
MEMBERSHIP = Table("membership", (TIME, VEHICLE, Column("peer", "str"), Column("event", "str")))
"""Peers that become absent, or present again, in the view of a vehicle."""
PEERS = Table("peers", (TIME, VEHICLE, Column("peer", "str"), Column("event", "str")))
"""Radio events of a peer: suspended, heard again, restarted (new epoch), slot conflict."""
LINKS = Table("links", (
    TIME, VEHICLE, Column("peer", "str"), Column("direction", "str"), Column("p_loss", "float", "1"),
    Column("n", "int"),
))  # fmt: skip
"""Estimated loss of the links from and to each peer, every few TDMA frames.

Incoming by missed packets, outgoing by received acknowledgements; ``n`` packets, recent ones weighted most.
"""
PLANS = Table("plans", (
    TIME, VEHICLE, Column("group", "str"), Column("role", "str"), Column("objective", "str"),
    Column("argument", "str"), Column("node", "int"), Column("parent", "int"), Column("task", "str"),
    Column("method", "str"), Column("status", "str"), Column("expected_time_s", "float", "s"),
    Column("expected_energy_j", "float", "J"),
))  # fmt: skip
"""Tasks of the plans that a vehicle executes, written when they change.

A plan belongs to a group's mission (role, objective and argument empty) or to an objective of the vehicle. ``node``
numbers its tasks, ``parent`` is the task above, or -1. ``method`` is empty for elementary tasks. ``status`` is waiting,
running, done, failed or dropped (removed from the plan). The expected remaining time and energy of an elementary task
are null if unknown.
"""
CANNOT = "cannot"
"""Kind of a row of ``FAULTS`` for infeasible work."""
NO_HEADWAY = "no headway"
"""End of its detail if the vehicle withdraws because it cannot move on."""
FAULTS = Table("faults", (TIME, VEHICLE, Column("kind", "str"), Column("detail", "str")))
"""Faults of vehicles, and errors that they noticed."""
REFUSED = Table("refused", (TIME, VEHICLE, Column("sender", "str"), Column("slot", "int"), Column("reason", "str")))
"""Packets refused by a receiver; sender and slot as in the packet if readable, else by time."""

TABLES = (
    TRAJECTORIES, ROLES, MEMBERSHIP, ORGANISATION, ACTIVITIES, DECISIONS, SATISFACTION, PACKETS, KNOWLEDGE,
    ITEMS, PLANS, PEERS, LINKS, FAULTS, REFUSED,
)  # fmt: skip
"""Tables of every run."""


class Unread:
    """Rows of a table that were appended since the last iteration."""

    def __init__(self, rows: Sequence[Row]) -> None:
        self._rows, self._n_read = rows, 0

    def __iter__(self) -> Iterator[Row]:
        since, self._n_read = self._n_read, len(self._rows)
        return iter(self._rows[since:]) if since < self._n_read else iter(())


class Recorder:
    """Rows of every table, and bits by purpose; PluginError for two tables of one name.

    >>> recorder = Recorder([Table("looks", (TIME, VEHICLE))])
    >>> recorder.rows("looks").append((1.0, "AUV01"))
    >>> recorder.rows("looks")
    [(1.0, 'AUV01')]
    """

    def __init__(self, tables: Iterable[Table] = ()) -> None:
        self.bits: Counter[Content] = Counter()
        self.tables: dict[str, Table] = {}
        self._rows: dict[str, list[Row]] = {}
        for table in (*TABLES, *tables):
            self.declare(table)
        self.trajectories = self._rows["trajectories"]
        self.roles = self._rows["roles"]
        self.membership = self._rows["membership"]
        self.organisation = self._rows["organisation"]
        self.activities = self._rows["activities"]
        self.decisions = self._rows["decisions"]
        self.satisfaction = self._rows["satisfaction"]
        self.packets = self._rows["packets"]
        self.knowledge = self._rows["knowledge"]
        self.items = self._rows["items"]
        self.plans = self._rows["plans"]
        self.peers = self._rows["peers"]
        self.links = self._rows["links"]
        self.faults = self._rows["faults"]
        self.refused = self._rows["refused"]

    def declare(self, table: Table) -> None:
        """Add a table; raise PluginError if its name exists with other columns."""
        if self.tables.setdefault(table.name, table) != table:
            known = ", ".join(self.tables[table.name].column_names)
            raise PluginError(f"table {table.name!r} is declared twice, once with the columns {known}: rename one")
        self._rows.setdefault(table.name, [])

    def rows(self, table: str) -> list[Row]:
        """Return the mutable rows of a table; empty for an unknown one."""
        return self._rows.get(table, [])
