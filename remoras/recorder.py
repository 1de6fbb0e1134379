"""Typed rows of a run, in memory; ``missions.runs.results`` writes them.

Every table has its columns here, with units in their names. Rows are appended as tuples, in time order.
"""

from __future__ import annotations

from typing import Any, NamedTuple


class Column(NamedTuple):
    """A column: its name, its kind (``float``, ``int``, ``str``, ``list``) and its unit (empty if none)."""

    name: str
    kind: str
    unit: str = ""


TIME = Column("time_s", "float", "s")
VEHICLE = Column("vehicle", "str")

TABLES: dict[str, tuple[Column, ...]] = {
    "trajectories": (
        TIME, VEHICLE, Column("x_m", "float", "m"), Column("y_m", "float", "m"),
        Column("heading_rad", "float", "rad"), Column("speed_mps", "float", "m/s"),
        Column("energy_j", "float", "J"),
    ),
    "roles": (TIME, VEHICLE, Column("group", "str"), Column("role", "str"), Column("event", "str")),
    "activities": (
        TIME, VEHICLE, Column("type", "str"), Column("name", "str"), Column("role", "str"),
        Column("motivation", "float", "1"),
    ),
    "satisfaction": (
        TIME, VEHICLE, Column("group", "str"), Column("role", "str"), Column("value", "int", "-128..127"),
    ),
    "coverage": (TIME, VEHICLE, Column("cell_x", "int", "cell"), Column("cell_y", "int", "cell")),
    "packets": (
        Column("slot", "int"), TIME, Column("sender", "str"), Column("size_bits", "int", "bit"),
        Column("items", "int"), Column("acks", "int"), Column("receivers", "list"), Column("lost_by", "list"),
    ),
    "knowledge": (
        TIME, VEHICLE, Column("item", "str"), Column("origin", "str"), Column("event", "str"),
    ),
    "faults": (TIME, VEHICLE, Column("kind", "str"), Column("detail", "str")),
}  # fmt: skip


class Recorder:
    """Rows of every table, as tuples in the order of its columns."""

    def __init__(self) -> None:
        self.trajectories: list[tuple[Any, ...]] = []
        self.roles: list[tuple[Any, ...]] = []
        self.activities: list[tuple[Any, ...]] = []
        self.satisfaction: list[tuple[Any, ...]] = []
        self.coverage: list[tuple[Any, ...]] = []
        self.packets: list[tuple[Any, ...]] = []
        self.knowledge: list[tuple[Any, ...]] = []
        self.faults: list[tuple[Any, ...]] = []

    def rows(self, table: str) -> list[tuple[Any, ...]]:
        rows: list[tuple[Any, ...]] = getattr(self, table)
        return rows
