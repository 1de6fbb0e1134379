"""Form of the tables: columns, units, order in time, names of vehicles, rows that cannot come twice."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pyarrow as pa

from stress.verify.findings import CheckReport
from stress.verify.record import TIME_STEP_S, Record, TableColumns

COLUMNS = {
    "trajectories": "time_s vehicle x_m y_m heading_rad speed_mps energy_j depth_m",
    "roles": "time_s vehicle group role event",
    "organisation": "time_s vehicle peer group role event issuer act objective argument outcome",
    "membership": "time_s vehicle peer event",
    "activities": "time_s vehicle type name role motivation",
    "decisions": "time_s vehicle group role objective argument activities stimulus own external source slot "
    "chosen best_mean",
    "satisfaction": "time_s vehicle group role value",
    "packets": "slot time_s sender size_bits items acks receivers lost_by end_s arrivals_s item_uids status_uids "
    "signal_roles signal_addressed signal_values collided_at",
    "items": "uid origin time_s recorded_s subject attribute value kind uncertainty",
    "knowledge": "time_s vehicle item origin event",
    "refused": "time_s vehicle sender slot reason",
    "peers": "time_s vehicle peer event",
    "links": "time_s vehicle peer direction p_loss n",
    "faults": "time_s vehicle kind detail",
}
"""Tables that every run has, and columns that they have at least."""
UNITS = {"_s": "s", "_m": "m", "_rad": "rad", "_mps": "m/s", "_j": "J", "_bits": "bit"}
"""Unit of a column by the end of its name."""
ONCE = (
    "trajectories",
    "packets",
    "knowledge",
    "coverage",
    "goal",
    "satisfaction",
    "peers",
)
"""Tables of which no row comes twice."""
EVENTS = {
    "roles": {"assigned", "active", "inactive", "left"},
    "knowledge": {"observed", "received", "set aside", "acknowledged"},
    "organisation": {"assigned", "left", "given", "refused", "formed", "dissolved"},
    "membership": {"absent", "present"},
}
"""Words of the column ``event``."""


def check_tables(tables: Mapping[str, TableColumns], report: CheckReport) -> bool:
    """Look at what is there, its columns and its units; False if the other checks have nothing to go by."""
    is_whole = True
    for name, columns in COLUMNS.items():
        report.look("columns")
        missing = columns.split() if name not in tables else sorted(set(columns.split()) - _names(tables[name]))
        if missing:
            is_whole = False
            stated = "no such table" if name not in tables else f"no column {', '.join(missing)}"
            report.add("columns", name, None, "", stated, "every run has it")
    for name, table in tables.items():
        for column in table.arrow.schema:
            due = next((unit for end, unit in UNITS.items() if column.name.endswith(end)), None)
            given = (column.metadata or {}).get(b"unit", b"").decode()
            report.look("units")
            if due is not None and given != due and column.name != "key":
                report.add("units", name, None, "", f"unit of {column.name} is {given!r}", repr(due))
    return is_whole


def _names(table: TableColumns) -> set[str]:
    return set(table.arrow.column_names)


def check_rows(record: Record, report: CheckReport) -> bool:
    """Look at times, names and repeated rows of every table; False if names are not those of the fleet."""
    n_before = report.n_findings["vehicles"]
    end_s = record.end_s + float(record.of("scenario").get("settle_s", 0.0))
    for name, table in record.tables.items():
        if "time_s" in _names(table) and name not in ("trajectories", "items", "settling"):
            _check_times(name, np.asarray(table["time_s"], dtype=float), end_s, table, report)
        if "vehicle" in _names(table) and (name in COLUMNS or name == "coverage"):
            report.look("vehicles", len(table))
            for at, vehicle in enumerate(table["vehicle"]):
                if vehicle not in record.vehicles:
                    report.add(
                        "vehicles", name, None, str(vehicle), f"row {at}", "none: the scenario has no such vehicle"
                    )
        if name in EVENTS:
            for at, event in enumerate(table["event"]):
                if event not in EVENTS[name]:
                    allowed = f"one of {', '.join(sorted(EVENTS[name]))}"
                    report.add("events", name, table["time_s"][at], table["vehicle"][at], f"event {event!r}", allowed)
        if name in ONCE:
            _check_once(name, table, report)
    _check_numbers(record, report)
    return report.n_findings["vehicles"] == n_before


def _check_times(name: str, times_s: Any, end_s: float, table: TableColumns, report: CheckReport) -> None:
    report.look("order", len(times_s))
    vehicles = table["vehicle"] if "vehicle" in _names(table) else [""] * len(times_s)
    wrong = np.flatnonzero(np.diff(times_s) < -TIME_STEP_S) + 1
    for at in wrong:
        stated = f"row {at} behind one of {times_s[at - 1]:g} s"
        report.add("order", name, times_s[at], vehicles[at], stated, "rows in the order of time")
    for at in np.flatnonzero(~((times_s >= 0.0) & (times_s <= end_s + TIME_STEP_S))):
        report.add("order", name, times_s[at], vehicles[at], f"row {at}", f"none: the run is from 0 to {end_s:g} s")


def _check_once(name: str, table: TableColumns, report: CheckReport) -> None:
    report.look("once", len(table))
    seen: set[Any] = set()
    columns = [column.name for column in table.arrow.schema]
    single = [column.name for column in table.arrow.schema if not pa.types.is_list(column.type)]
    if len(set(table.rows(*single))) == len(table):
        return
    for at, row in enumerate(table.rows(*single)):
        if row in seen:
            vehicle = table["vehicle"][at] if "vehicle" in columns else ""
            time_s = table["time_s"][at] if "time_s" in columns else None
            report.add("once", name, time_s, vehicle, f"row {at} again", "one row alone")
        seen.add(row)


def _check_numbers(record: Record, report: CheckReport) -> None:
    """Numbers of tracks are finite."""
    for column in ("time_s", "x_m", "y_m", "heading_rad", "speed_mps", "energy_j", "depth_m"):
        values = np.asarray(record["trajectories"][column], dtype=float)
        report.look("finite", len(values))
        for at in np.flatnonzero(~np.isfinite(values)):
            vehicle, time_s = record["trajectories"]["vehicle"][at], record["trajectories"]["time_s"][at]
            report.add("finite", "trajectories", time_s, vehicle, f"{column} {values[at]}", "a number")
