"""The record of one run: its scenario, its summary and its tables, as plain values and arrays."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from stress.verify.cells import Cells
from stress.verify.kinds import AWAY, KINDS

Array = npt.NDArray[Any]
TIME_STEP_S, PLACE_STEP_M, ANGLE_STEP_RAD, SPEED_STEP_MPS = 2.0**-12, 2.0**-7, 2.0**-10, 2.0**-10
"""Steps to which numbers of the tables are kept (docs/howto/results.md)."""


class TableColumns:
    """The columns of a table: numbers as arrays, all else as lists."""

    def __init__(self, table: pa.Table) -> None:
        self.arrow = table
        self._made: dict[str, Any] = {}

    def __len__(self) -> int:
        return int(self.arrow.num_rows)

    def __getitem__(self, name: str) -> Any:
        if name not in self._made:
            column = self.arrow[name]
            is_number = pa.types.is_floating(column.type) or pa.types.is_integer(column.type)
            self._made[name] = column.to_numpy() if is_number else column.to_pylist()
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

    @cached_property
    def vehicles(self) -> dict[str, dict[str, Any]]:
        """Vehicles of the scenario by name, in its order."""
        return {vehicle["name"]: vehicle for vehicle in self.scenario["vehicle"]}

    @cached_property
    def by_slot(self) -> list[str]:
        """Names of the vehicles by their numbers, which are their places in a TDMA frame."""
        return sorted(self.vehicles, key=lambda name: int(self.vehicles[name]["slot"]))

    @cached_property
    def cells(self) -> Cells:
        """Who shares a schedule with whom."""
        return Cells(self.scenario, self.by_slot)

    @property
    def n_bodies(self) -> int:
        """Vehicles, each counted once, however many addresses it has."""
        return len(self.vehicles) - len(self.cells.first_of)

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
        is_limited = self.scenario.get("need") or self.scenario.get("covert") or communication.get("on_demand")
        return communication.get("needs_follow", "all") == "all" and not is_limited
