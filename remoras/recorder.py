"""Recorder: tables of a run, as compact columns of rows.

Whoever writes appends tuples, to a list, as fast as to any list. ``pack`` brings what has come since into the columns:
of floats and of whole numbers as machine words, as narrow as they may be, of texts and floats that come again and again
as numbers of a list of them, of lists as what is in them, one behind the other. A column that holds anything else stays
a list of the very objects, so a row reads back as it was given: the same types and the same bits. Lists within the last
rows may still change.

Whoever writes a table declares it, with units: the vehicle and its layers those below, a sensor or a mission its own.
Rows are appended as tuples in the order of the columns, in time order; ``remoras.recorder`` keeps them.
"""

from __future__ import annotations

from array import array
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import accumulate, chain, count
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, overload

from remoras.errors import PluginError

if TYPE_CHECKING:
    from remoras.contents import Content


Row = tuple[Any, ...]
MOST_TEXTS = 2**16
"""Different texts of a column that has numbers for them."""
WIDTHS = "bhiq"
"""Type codes of whole numbers of 8, 16, 32 and 64 bits."""
CHANGING = 1024
"""Lists of so many rows, the last of a table, may still change, if its maker does not say how many."""
SETTLED = 64
"""Lists that are put together at once, or more."""
BLOCK = 256
"""Rows whose different floats are kept once; a byte says which of them a row has."""


class Texts:
    """A column of texts that come again: for each row the number of one of them.

    Attributes:
        numbers: of the rows, 8 or 16 bits each; names: the texts, in the order in which they first came.

    Args:
        values: of the first rows.
    """

    __slots__ = ("_number_of", "names", "numbers")

    def __init__(self, values: Iterable[str]) -> None:
        self.numbers = array("B")
        self.names: list[str] = []
        self._number_of: dict[str, int] = {}
        self.extend(values)

    def extend(self, values: Iterable[str]) -> bool:
        """Take further rows; False, and nothing is taken, if there would be too many different texts."""
        values = tuple(values)
        new = [text for text in dict.fromkeys(values) if text not in self._number_of]
        if len(self.names) + len(new) > MOST_TEXTS:
            return False
        self._number_of.update(zip(new, range(len(self.names), len(self.names) + len(new)), strict=True))
        self.names += new
        if len(self.names) > 256 and self.numbers.typecode == "B":
            self.numbers = array("H", self.numbers)
        self.numbers.extend(map(self._number_of.__getitem__, values))
        return True

    def __len__(self) -> int:
        return len(self.numbers)

    def __iter__(self) -> Iterator[str]:
        return map(self.names.__getitem__, self.numbers)

    def __getitem__(self, place: Any) -> Any:
        found = self.numbers[place]
        return self.names[found] if isinstance(place, int) else [self.names[number] for number in found]


class Floats:
    """A column of floats that come again among the rows near by, such as times, headings and speeds of a fleet.

    Attributes:
        values: the different floats of each block of rows, to the bit, one block behind the other.
        starts: where those of each block begin; numbers: of the rows, counted from there, a byte each.
        newest: the floats of the rows behind the last block.

    Args:
        values: of the first rows.
    """

    __slots__ = ("newest", "numbers", "starts", "values")

    def __init__(self, values: Iterable[float]) -> None:
        self.values, self.newest = array("d"), array("d")
        self.starts, self.numbers = array("Q"), bytearray()
        self.extend(values)

    def extend(self, values: Iterable[float]) -> None:
        """Take further rows."""
        self.newest.extend(values)
        n_whole = len(self.newest) // BLOCK * BLOCK
        bits = array("q", self.newest[:n_whole].tobytes())  # -0.0 equals 0.0, and a NaN nothing; their bits do not
        for first in range(0, n_whole, BLOCK):
            number_of: defaultdict[int, int] = defaultdict(count().__next__)
            self.numbers.extend(map(number_of.__getitem__, bits[first : first + BLOCK]))
            self.starts.append(len(self.values))
            self.values.frombytes(array("q", number_of).tobytes())
        del self.newest[:n_whole]

    def __len__(self) -> int:
        return len(self.numbers) + len(self.newest)

    def __iter__(self) -> Iterator[float]:
        return chain(chain.from_iterable(map(self._of, count(), self.starts)), self.newest)

    def _of(self, block: int, start: int) -> Iterator[float]:
        """The floats of the rows of a block."""
        values = self.values[start : start + BLOCK]
        return map(values.__getitem__, self.numbers[block * BLOCK : (block + 1) * BLOCK])

    def __getitem__(self, place: Any) -> Any:
        if isinstance(place, slice):
            return [self[number] for number in range(*place.indices(len(self)))]
        if place >= len(self.numbers):
            return self.newest[place - len(self.numbers)]
        return self.values[self.starts[place // BLOCK] + self.numbers[place]]


class Lists:
    """A column of lists: what is in them lies one behind the other, but for the newest, which may still change.

    Args:
        values: of the first rows.
        changing: so many, the last, may still change.
    """

    __slots__ = ("_changing", "_ends", "_entries", "_newest")

    def __init__(self, values: Iterable[list[Any]], changing: int = CHANGING) -> None:
        self._changing = changing
        self._entries: Packed = []
        self._ends = array("Q")  # of each list that lies in the entries
        self._newest: list[list[Any]] = []
        self.extend(values)

    def extend(self, values: Iterable[list[Any]]) -> None:
        """Take further rows; some at the end stay the very lists."""
        self._newest += values
        n_settled = len(self._newest) - self._changing
        if n_settled < SETTLED:
            return
        settled = self._newest[:n_settled]
        del self._newest[:n_settled]
        first = len(self._entries)
        self._ends.extend(accumulate(map(len, settled[1:]), initial=first + len(settled[0])))
        entries = list(chain.from_iterable(settled))
        self._entries = _together(self._entries, entries) if first else _packed(entries)

    def __len__(self) -> int:
        return len(self._ends) + len(self._newest)

    def __iter__(self) -> Iterator[list[Any]]:
        entries, ends = list(self._entries), self._ends
        return chain((entries[begin:end] for begin, end in zip(chain((0,), ends), ends, strict=False)), self._newest)

    def __getitem__(self, place: Any) -> Any:
        if isinstance(place, slice):
            return [self[number] for number in range(*place.indices(len(self)))]
        if place >= len(self._ends):
            return self._newest[place - len(self._ends)]
        return list(self._entries[self._ends[place - 1] if place else 0 : self._ends[place]])


Packed: TypeAlias = "array[float] | array[int] | Floats | Texts | Lists | list[Any]"
"""A column."""


def _packed(values: Sequence[Any], changing: int = CHANGING) -> Packed:
    """A column of these values, as small as it gives them back as they are; for ``changing`` see ``Lists``."""
    kinds = set(map(type, values))
    if kinds == {float}:
        return Floats(values) if _come_again(values) else array("d", values)
    if kinds == {int}:
        for width in WIDTHS:
            with suppress(OverflowError):
                return array(width, values)
        return list(values)
    if kinds == {str} and _come_again(values):
        return Texts(values)
    if kinds == {list}:
        return Lists(values, changing)
    return list(values)


def _come_again(values: Sequence[Any]) -> bool:
    return 2 * len(set(values)) <= len(values)


def _together(column: Packed, values: Sequence[Any]) -> Packed:
    """A column with further values, in place where they are of its kind."""
    if isinstance(column, list):
        column.extend(values)
        return column
    if isinstance(column, Texts):
        if set(map(type, values)) == {str} and column.extend(values):
            return column
    elif isinstance(column, Floats):
        if set(map(type, values)) == {float}:
            column.extend(values)
            return column
    elif isinstance(column, Lists):
        if set(map(type, values)) == {list}:
            column.extend(values)
            return column
    elif set(map(type, values)) == {float if column.typecode == "d" else int}:
        for width in "d" if column.typecode == "d" else WIDTHS[WIDTHS.index(column.typecode) :]:
            with suppress(OverflowError):
                more = array(width, values)
                column = column if width == column.typecode else array(width, column)
                column.extend(more)
                return column
    return [*column, *values]


class Rows(Sequence[Row]):
    """Rows of a table in the order in which they were written, to be read or appended to.

    Args:
        rows: the first ones.
        changing: lists of so many rows, the last, may still change.

    Attributes:
        append: takes a row; extend: takes several.
        new: rows that have come since they were packed last; n_packed: rows before them. Who follows what is written
            asks by these two, which takes no call, whether there is more.

    >>> rows = Rows([(0.5, "AUV00"), (1.0, "AUV00")])
    >>> rows.pack()
    True
    >>> rows.append((1.5, "AUV01"))
    >>> len(rows), rows[-1], rows[:2]
    (3, (1.5, 'AUV01'), [(0.5, 'AUV00'), (1.0, 'AUV00')])
    """

    __slots__ = ("_changing", "_columns", "append", "extend", "n_packed", "new")
    append: Callable[[Row], None]
    extend: Callable[[Iterable[Row]], None]

    def __init__(self, rows: Iterable[Row] = (), changing: int = CHANGING) -> None:
        self._changing = changing
        self.new: list[Row] = list(rows)
        self._columns: list[Packed] = []
        self.n_packed = 0
        self.append = self.new.append  # the list's own: no call of ours for a row
        self.extend = self.new.extend

    def pack(self) -> bool:
        """Bring the new rows into columns; False, and they stay, if they are not all as wide as those before."""
        if not self.new:
            return True
        widths = set(map(len, self.new))
        if len(widths) > 1 or (self.n_packed and widths != {len(self._columns)}):
            return False
        values = list(zip(*self.new, strict=True))
        if self.n_packed:
            self._columns = [_together(column, more) for column, more in zip(self._columns, values, strict=True)]
        else:
            self._columns = [_packed(column, self._changing) for column in values]
        self.n_packed += len(self.new)
        self.new.clear()
        return True

    def columns(self) -> list[Packed] | None:
        """All rows as columns, which are not to be changed; None if rows are not equally wide."""
        return self._columns if self.pack() else None

    def __len__(self) -> int:
        return self.n_packed + len(self.new)

    def __iter__(self) -> Iterator[Row]:
        return chain(zip(*self._columns, strict=True), self.new)

    @overload
    def __getitem__(self, place: int) -> Row: ...

    @overload
    def __getitem__(self, place: slice) -> list[Row]: ...

    def __getitem__(self, place: int | slice) -> Row | list[Row]:
        if isinstance(place, slice):
            begin, end, step = place.indices(len(self))
            if step != 1:
                return [self[number] for number in range(begin, end, step)]
            n = self.n_packed
            packed = zip(*(column[begin : min(end, n)] for column in self._columns), strict=True) if begin < n else ()
            return [*packed, *self.new[max(begin - n, 0) : max(end - n, 0)]]
        number = place + len(self) if place < 0 else place
        if number >= self.n_packed:
            return self.new[number - self.n_packed]
        if number < 0:
            raise IndexError(f"row {place} of {len(self)}")
        return tuple(column[number] for column in self._columns)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Rows | list):
            return NotImplemented
        return len(self) == len(other) and all(own == its for own, its in zip(self, other, strict=True))

    __hash__ = None  # type: ignore[assignment]  # as lists have none

    def __iadd__(self, rows: Iterable[Row]) -> Rows:
        self.extend(rows)
        return self

    def __repr__(self) -> str:
        return f"Rows({list(self)!r})"

    def __reduce__(self) -> tuple[type[Rows], tuple[list[Row]]]:
        return Rows, (list(self),)


KINDS = ("float", "int", "str", "bool", "list", "floats", "ints")
"""Kinds of columns; ``list`` is one of texts, ``floats`` and ``ints`` are lists of numbers."""
KEY = "key"
"""Column that the tables of a sweep have in front."""
MANY = 256
"""New rows of a table from which on they are packed."""
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

ADDED = {
    "trajectories": frozenset({"depth_m"}),
    "organisation": frozenset({"issuer", "act", "objective", "argument", "outcome"}),
    "packets": frozenset({
        "end_s", "arrivals_s", "item_uids", "status_uids", "signal_roles", "signal_addressed", "signal_values",
        "collided_at",
    }),
}  # fmt: skip
"""Columns that older tables lack, by table."""


class Recorder:
    """Rows of every table, and counts that need no rows.

    Attributes:
        bits: sent by the whole fleet, by what they are for.

    Args:
        tables: of the mission and its sensors, beside those of every run; declared alike by several is declared once.
        changing: lists of so many rows, the last of a table, may still change: those of packets that are on their way.

    Raises:
        PluginError: two declare a table of one name with other columns.
    """

    def __init__(self, tables: Iterable[Table] = (), changing: int = CHANGING) -> None:
        self._changing = changing
        self.bits: Counter[Content] = Counter()
        self.tables: dict[str, Table] = {}
        self._rows: dict[str, Rows] = {}
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
        self._rows.setdefault(table.name, Rows(changing=self._changing))

    def rows(self, table: str) -> Rows:
        """Rows of a table, to be read or appended to; empty for a table that nobody declared."""
        found = self._rows.get(table)
        return Rows() if found is None else found

    def pack(self) -> None:
        """Bring the rows of long tables into columns, once there are many of where vehicles are; called every tick."""
        if len(self.trajectories.new) >= MANY:
            for rows in self._rows.values():
                if len(rows.new) >= MANY:
                    rows.pack()
