"""Typed rows of a run, in memory; ``missions.runs.results`` writes them.

Whoever writes a table declares it, with units: the vehicle and its layers those below, a sensor or a mission its own.
Rows are appended as tuples in the order of the columns, in time order.
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
KINDS = ("float", "int", "str", "list")
"""Kinds of columns."""
KEY = "key"
"""Column that the tables of a sweep have in front."""
UNFIT = frozenset("/\\\0")
"""Characters that a name of a file cannot have everywhere."""


class Column(NamedTuple):
    """A column: its name, its kind (``float``, ``int``, ``str``, ``list`` of texts) and its unit (empty if none)."""

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
        for name, count in Counter(self.column_names).items():
            if count > 1 or name == KEY:
                why = f"listed {count} times" if count > 1 else "the column by which sweeps tell runs apart"
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
))  # fmt: skip
ROLES = Table("roles", (TIME, VEHICLE, Column("group", "str"), Column("role", "str"), Column("event", "str")))
ACTIVITIES = Table("activities", (
    TIME, VEHICLE, Column("type", "str"), Column("name", "str"), Column("role", "str"),
    Column("motivation", "float", "1"),
))  # fmt: skip
SATISFACTION = Table("satisfaction", (
    TIME, VEHICLE, Column("group", "str"), Column("role", "str"), Column("value", "int", "-128..127"),
))  # fmt: skip
PACKETS = Table("packets", (
    Column("slot", "int"), TIME, Column("sender", "str"), Column("size_bits", "int", "bit"),
    Column("items", "int"), Column("acks", "int"), Column("receivers", "list"), Column("lost_by", "list"),
))  # fmt: skip
KNOWLEDGE = Table("knowledge", (
    TIME, VEHICLE, Column("item", "str"), Column("origin", "str"), Column("event", "str"),
))  # fmt: skip
MEMBERSHIP = Table("membership", (TIME, VEHICLE, Column("peer", "str"), Column("event", "str")))
FAULTS = Table("faults", (TIME, VEHICLE, Column("kind", "str"), Column("detail", "str")))

TABLES = (TRAJECTORIES, ROLES, MEMBERSHIP, ACTIVITIES, SATISFACTION, PACKETS, KNOWLEDGE, FAULTS)
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
        self.activities = self._rows["activities"]
        self.satisfaction = self._rows["satisfaction"]
        self.packets = self._rows["packets"]
        self.knowledge = self._rows["knowledge"]
        self.faults = self._rows["faults"]

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
