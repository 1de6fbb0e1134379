"""Recorder: the tables of a run as lists of rows.

Each table declares its columns, their units and their meaning once: the vehicle and its layers declare those below, a
sensor or a mission its own. Writers append a tuple for each row, in the order of the columns and in time order. Lists
within the newest rows may still change: those of packets that are on their way.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from remoras.errors import PluginError

if TYPE_CHECKING:
    from remoras.contents import Content

Row = tuple[Any, ...]
KINDS = ("float", "int", "str", "bool", "list", "floats", "ints")
"""Kinds of columns; ``list`` is one of texts, ``floats`` and ``ints`` are lists of numbers."""
KEY = "key"
"""Column that the tables of a sweep have in front."""
UNFIT = frozenset("/\\\0")
"""Characters that a name of a file cannot have everywhere."""


class Column(NamedTuple):
    """A column: its name, its kind (one of ``KINDS``) and its unit (empty if none)."""

    name: str
    kind: str
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Table:
    """A table of results.

    Raises:
        PluginError: it cannot be written: its name is none for a file, or its columns contradict each other.

    >>> Table("temperatures", (TIME, VEHICLE, Column("temperature_c", "float", "degC"))).column_names
    ('time_s', 'vehicle', 'temperature_c')
    """

    name: str
    columns: tuple[Column, ...]

    def __post_init__(self) -> None:
        if not self.name or self.name.startswith(".") or not UNFIT.isdisjoint(self.name):
            raise PluginError(f"table {self.name!r}: its name is that of a file; allowed: no / and no dot in front")
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
"""Where every vehicle really is at every motion tick."""
ROLES = Table("roles", (TIME, VEHICLE, Column("group", "str"), Column("role", "str"), Column("event", "str")))
"""Roles of every vehicle as it sees itself: assigned, active (it drives the vehicle), inactive, left."""
ORGANISATION = Table("organisation", (
    TIME, VEHICLE, Column("peer", "str"), Column("group", "str"), Column("role", "str"), Column("event", "str"),
    Column("issuer", "str"), Column("act", "str"), Column("objective", "str"), Column("argument", "str"),
    Column("outcome", "str"),
))  # fmt: skip
"""Every change of the organisation in the view of every vehicle, and every one that it refused. From then on, for
``vehicle``, ``peer`` has the role (assigned) or no longer (left), or a role has an objective, a group a mission
(given), by the will of ``issuer``; ``outcome`` says why it was refused. At 0 s stands what was agreed before the
mission, by nobody in particular; later rows are of the ends of TDMA frames, when what was said in them counts, but for
missions, which count at once. A later argument of an objective takes the place of an earlier. Peers that are taken for
absent keep their roles here, see ``MEMBERSHIP``."""
ACTIVITIES = Table("activities", (
    TIME, VEHICLE, Column("type", "str"), Column("name", "str"), Column("role", "str"),
    Column("motivation", "float", "1"),
))  # fmt: skip
"""What a vehicle does from then on, written when its choice changes."""
DECISIONS = Table("decisions", (
    TIME, VEHICLE, Column("group", "str"), Column("role", "str"), Column("objective", "str"),
    Column("argument", "str"), Column("activities", "list"), Column("stimulus", "float", "1"),
    Column("own", "float", "1"), Column("external", "float", "1"), Column("source", "str"), Column("slot", "int"),
    Column("chosen", "bool"), Column("best_mean", "float", "1"),
))  # fmt: skip
"""Every set of activities that a vehicle could choose from, written when its choice or these sets change. Its
motivation is ``own`` and ``external`` together; ``external`` is owed to the influence signal that ``source`` sent in
``slot``. Group, role and objective are empty for what the vehicle does in any case; source is empty and slot null where
no signal is heeded. ``best_mean`` is the mean motivation of the best combination with the set: what is chosen has the
highest. It is null for what is vital, which comes first, and for what goes together with nothing that is needed."""
SATISFACTION = Table("satisfaction", (
    TIME, VEHICLE, Column("group", "str"), Column("role", "str"), Column("value", "int", "-128..127"),
))  # fmt: skip
"""How content a vehicle is in each role as its slot opens."""
PACKETS = Table("packets", (
    Column("slot", "int"), TIME, Column("sender", "str"), Column("size_bits", "int", "bit"),
    Column("items", "int"), Column("acks", "int"), Column("receivers", "list"), Column("lost_by", "list"),
    Column("end_s", "float", "s"), Column("arrivals_s", "floats", "s"), Column("item_uids", "list"),
    Column("status_uids", "list"), Column("signal_roles", "list"), Column("signal_addressed", "list"),
    Column("signal_values", "ints", "-128..127"), Column("collided_at", "list"),
))  # fmt: skip
"""What was sent from ``time_s`` to ``end_s``. ``arrivals_s`` has when each of ``receivers`` had heard all of it. Those
of ``lost_by`` lost it on its way, those of ``collided_at`` to another packet, or to one that they were sending. Item
and status uids are those of ``ITEMS``. An influence signal has one entry in each of the last three columns for every
role that it addresses (``Group.Role``; empty if it addresses none)."""
KNOWLEDGE = Table("knowledge", (
    TIME, VEHICLE, Column("item", "str"), Column("origin", "str"), Column("event", "str"),
))  # fmt: skip
"""When a vehicle observed an item, received it, or took all who need it to hold it (acknowledged). Where needs
follow from groups, one that it heard without need is set aside; if it comes to need it, it has received it then."""
SETTLING = Table("settling", KNOWLEDGE.columns)
"""What vehicles heard after the mission, where the exchange went on (``scenario.settle_s``): as ``KNOWLEDGE``, with the
statuses received."""
ITEMS = Table("items", (
    Column("uid", "str"), Column("origin", "str"), TIME, Column("recorded_s", "float", "s"), Column("subject", "str"),
    Column("attribute", "str"), Column("value", "str"), Column("kind", "str"), Column("uncertainty", "str"),
))  # fmt: skip
"""Every fact that a vehicle recorded, in the order in which its item has them. ``kind`` says what becomes of it: told
(repeated until it is acknowledged), status (said once, the newest value counts) or kept (to itself). The uid of what is
told is ``origin-sequence``, with ``.part`` behind it for the later fragments of what does not fit one packet; items are
numbered without gaps, in each epoch anew (``origin.eEPOCH-sequence``, but for the first). The uid of a status is
``origin@time:subject.attribute``, by the numbers of its first fact; of what is kept it is ``origin-pN``. ``time_s`` is
the time of observation as vehicles hold it, ``recorded_s`` when it went into the origin's world model. The value is
text: names of instances, classes and symbols, numbers, true or false, ``POINT (east north)``; so is the uncertainty,
the standard deviation of numbers and points and the probability of any other value, empty where it carries none."""
MEMBERSHIP = Table("membership", (TIME, VEHICLE, Column("peer", "str"), Column("event", "str")))
"""Peers that a vehicle takes for absent from then on, and for present again."""
PEERS = Table("peers", (TIME, VEHICLE, Column("peer", "str"), Column("event", "str")))
"""What a radio noticed of a peer: that what it needs is not waited for, heard again, begins
anew (it has another epoch), slot conflict (two speak under its name)."""
LINKS = Table("links", (
    TIME, VEHICLE, Column("peer", "str"), Column("direction", "str"), Column("p_loss", "float", "1"),
    Column("n", "int"),
))  # fmt: skip
"""Loss of the links from and to each peer as a vehicle estimates it, every few TDMA frames: incoming by the packets
that it missed, outgoing by the acknowledgements that it heard. ``n`` packets were looked at; the latest count most."""
PLANS = Table("plans", (
    TIME, VEHICLE, Column("group", "str"), Column("role", "str"), Column("objective", "str"),
    Column("argument", "str"), Column("node", "int"), Column("parent", "int"), Column("task", "str"),
    Column("method", "str"), Column("status", "str"), Column("expected_time_s", "float", "s"),
    Column("expected_energy_j", "float", "J"),
))  # fmt: skip
"""Tasks of the plans that a vehicle carries out, each written when it changes. A plan is of the mission of a group
(role, objective and argument are empty) or of an objective of the vehicle. ``node`` numbers its tasks, ``parent`` is
the one above, or -1. ``method`` is empty for an elementary task. ``status`` is waiting, running, done, failed or
dropped (the plan has the task no longer). What an elementary task is expected to take from then on is null where nobody
can tell."""
CANNOT = "cannot"
"""Kind of a row of ``FAULTS`` by which a vehicle gives something up."""
FAULTS = Table("faults", (TIME, VEHICLE, Column("kind", "str"), Column("detail", "str")))
"""What went wrong, and what befell a vehicle."""
REFUSED = Table("refused", (TIME, VEHICLE, Column("sender", "str"), Column("slot", "int"), Column("reason", "str")))
"""Packets that arrived at a vehicle and were refused by it. Sender and slot are as the packet says, if that can be
read; else those by the time of its arrival."""

TABLES = (
    TRAJECTORIES, ROLES, MEMBERSHIP, ORGANISATION, ACTIVITIES, DECISIONS, SATISFACTION, PACKETS, KNOWLEDGE,
    ITEMS, PLANS, PEERS, LINKS, FAULTS, REFUSED,
)  # fmt: skip
"""Tables of every run."""


class Recorder:
    """Rows of every table, and counts that need no rows.

    Attributes:
        bits: sent by the whole fleet, by what they are for.

    Args:
        tables: of the mission and its sensors, beside those of every run; declared alike by several is declared once.

    Raises:
        PluginError: two declare a table of one name with other columns.
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
        """Take rows of another table, too; what is declared alike several times is declared once.

        Raises:
            PluginError: there is a table of that name with other columns.
        """
        if self.tables.setdefault(table.name, table) != table:
            known = ", ".join(self.tables[table.name].column_names)
            raise PluginError(f"table {table.name!r} is declared twice, once with the columns {known}: rename one")
        self._rows.setdefault(table.name, [])

    def rows(self, table: str) -> list[Row]:
        """Rows of a table, to be read or appended to; empty for a table that nobody declared."""
        return self._rows.get(table, [])
