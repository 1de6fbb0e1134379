"""Verification of results folders: form of tables, checks of runs, sweep against ledger."""

from __future__ import annotations

import json
import math
import tomllib
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from missions.verification.ending import check_ending, check_roles
from missions.verification.mapping import check_ground
from missions.verification.motion import check_tracks
from missions.verification.packets import check_knowledge, check_packets
from missions.verification.record import TIME_STEP_S, CheckReport, NoResults, Record, TableColumns, shown
from missions.verification.relations import check_relations
from missions.verification.summary import check_figures

DECLARED = tomllib.loads((Path(__file__).parent / "tables.toml.txt").read_text(encoding="utf-8"))
"""Tables with their columns, values and units, and what makes a run have them."""
OF_EVERY_RUN, MISSIONS = DECLARED["every_run"], DECLARED["missions"]
COLUMNS = OF_EVERY_RUN | DECLARED["others"]
WITHOUT_VEHICLE = ("packets", "items", "goal", "fleet_maps")
REPEATING = ("decisions", "activities", "organisation", "faults", "refused", "roles", "items", "clocks")
"""Tables that may repeat a row."""
UNSAID, OF_RADIO = "queued items of a slot are in no other table", "it follows rules of the radio"
NOT_DERIVED = {
    "rows of unsaid": UNSAID, "unsaid.reason": UNSAID, "unsaid.candidates": UNSAID,
    "rows of links": OF_RADIO, "links.time_s": OF_RADIO, "links.peer": OF_RADIO, "links.direction": OF_RADIO,
    "links.p_loss": OF_RADIO, "links.n": OF_RADIO,
    "rows of peers": OF_RADIO, "peers.time_s": OF_RADIO, "peers.peer": OF_RADIO, "peers.event": OF_RADIO,
}  # fmt: skip
"""Columns of every run that no other table determines, with the reason."""
OWN = "a table of a mission, sensor or feature: only its form, times, vehicles and ranges are looked at"


def columns_of(name: str) -> dict[str, str]:
    """Return the columns of a table with their allowed values."""
    own = dict(column.partition("=")[::2] for column in COLUMNS[name].split())
    return {"time_s": ".."} | ({} if name in WITHOUT_VEHICLE else {"vehicle": "vehicle"}) | own


def check_tables(record: Record, report: CheckReport) -> bool:
    """Check presence, columns and units of tables; False if further checks are impossible."""
    mission = str(record.of("scenario").get("mission", "")).removeprefix("missions.").removesuffix("Mission")
    due = {*OF_EVERY_RUN, *MISSIONS.get(mission, ())}
    carried = {sensor.get("type") for data in record.vehicles.values() for sensor in data.get("sensor", [])}
    due |= {name for kind, name in DECLARED["sensors"].get(mission, {}).items() if kind in carried}
    due |= {name for name, (section, key) in DECLARED["features"].items() if key in record.of(section)}
    if mission not in MISSIONS:
        report.skip("tables of the mission", "it is not shipped with the program")
    is_whole = True
    for name in sorted(due | (record.tables.keys() & COLUMNS.keys())):
        report.look("columns")
        present = _names(record[name]) if name in record.tables else set()
        if missing := sorted(columns_of(name).keys() - present):
            is_whole = is_whole and name not in due
            stated = "no such table" if not present else f"no column {', '.join(missing)}"
            report.add("columns", name, None, "", stated, "a run of this scenario has it")
    for name, table in record.tables.items():
        for column in table.arrow.schema:
            unit = next((unit for end, unit in DECLARED["units"].items() if column.name.endswith(end)), None)
            recorded = (column.metadata or {}).get(b"unit", b"").decode()
            report.look("units")
            if unit is not None and recorded != unit and column.name != "key":
                report.add("units", name, None, "", f"unit of {column.name} is {recorded!r}", repr(unit))
        if name not in (*OF_EVERY_RUN, "coverage", "goal"):
            columns = [f"{name}.{column}" for column in _names(table)]
            report.not_checked |= dict.fromkeys([*columns, f"rows of {name}"], OWN)
    report.not_checked |= NOT_DERIVED
    return is_whole


def _names(table: TableColumns) -> set[str]:
    return set(table.arrow.column_names)


def check_rows(record: Record, report: CheckReport) -> bool:
    """Check times, values and repeated rows of all tables; False if vehicle names are unknown."""
    n_before = report.n_findings["vehicles"]
    end_s = record.end_s + float(record.of("scenario").get("settle_s", 0.0))
    for name, table in record.tables.items():
        if "time_s" in _names(table) and name not in ("trajectories", "settling"):
            column = "recorded_s" if name == "items" else "time_s"
            _check_times(name, np.asarray(table[column], dtype=float), end_s, table, report)
        for column, values in columns_of(name).items() if name in COLUMNS else ():
            if values and column in _names(table):
                _check_values(record, name, column, values, report)
        if name not in REPEATING:
            _check_once(name, table, report)
    return report.n_findings["vehicles"] == n_before


def _check_values(record: Record, name: str, column: str, allowed: str, report: CheckReport) -> None:
    values = record[name][column]
    check = "vehicles" if column == "vehicle" else "values"
    report.look(check, len(values))
    if ".." in allowed:
        low, high = (float(end or "inf") for end in allowed.split(".."))
        low = -math.inf if allowed.startswith("..") else low
        # Nulls are allowed, so they stand for the lower bound.
        numbers = np.array([low if v is None else v for v in values], dtype=float)
        wrong = np.flatnonzero(~(np.isfinite(numbers) | (numbers == low)) | (numbers < low) | (numbers > high)).tolist()
    else:
        words = {"vehicle": record.vehicles, "vehicle?": {*record.vehicles, ""}, "name": record.names}.get(
            allowed, allowed.replace("+", " ").split("|")
        )
        unknown = set(values) - set(words)
        wrong = [row for row, value in enumerate(values) if value in unknown] if unknown else []
    for row in wrong:
        times_s = record[name]["time_s"]
        stated = f"{column} {shown(values[row])} in row {row}"
        report.add(check, name, times_s[row], "", stated, allowed.replace("+", " "))


def _check_times(name: str, times_s: Any, end_s: float, table: TableColumns, report: CheckReport) -> None:
    report.look("order", len(times_s))
    vehicles = table["vehicle"] if "vehicle" in _names(table) else [""] * len(times_s)
    wrong = np.flatnonzero(np.diff(times_s) < -TIME_STEP_S) + 1
    for row in wrong:
        stated = f"row {row} behind one of {times_s[row - 1]:g} s"
        report.add("order", name, times_s[row], vehicles[row], stated, "rows in the order of time")
    for row in np.flatnonzero(~((times_s >= 0.0) & (times_s <= end_s + TIME_STEP_S))):
        report.add("order", name, times_s[row], vehicles[row], f"row {row}", f"none: the run is from 0 to {end_s:g} s")


def _check_once(name: str, table: TableColumns, report: CheckReport) -> None:
    report.look("once", len(table))
    # Without lists, which cannot be hashed.
    single = [column.name for column in table.arrow.schema if not pa.types.is_list(column.type)]
    seen = set[Any]()
    for number, row in enumerate(table.rows(*single)):
        if row in seen:
            values = dict(zip(single, row, strict=True))
            report.add("once", name, values.get("time_s"), values.get("vehicle", ""), f"row {number} again", "one row")
        seen.add(row)


THEMES: dict[str, Callable[[Record, CheckReport], None]] = {
    "motion": check_tracks,
    "packets": check_packets,
    "knowledge": check_knowledge,
    "roles": check_roles,
    "relations": check_relations,
    "ending": check_ending,
    "ground": check_ground,
    "figures": check_figures,
}
"""Checks of a run, by theme."""
BROKEN = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
"""Exceptions raised by values that no run writes."""


def verify_run(record: Record, report: CheckReport) -> None:
    """Run all checks of a run; ``report`` collects the findings."""
    if not check_tables(record, report) or not check_rows(record, report):
        report.skip("the rest of the run", "tables, columns or vehicles are missing or unknown")
        return
    report.strange = record.strange
    for theme, check in THEMES.items():
        if theme == "ground" and not ("coverage" in record.tables and "area" in record.scenario):
            continue
        try:
            check(record, report)
        # Altered tables may break any assumption of a check, and the other themes are still of use.
        except BROKEN as error:
            report.add("readable", theme, None, "", f"{type(error).__name__}: {error}", "values that can be read")


SEAL = '{"crc": "'  # prefix of a ledger line with checksum; eight digits, ``", `` and the covered text follow


SECTIONS = ("scenario", "vehicle", "group", "world", "channel", "communication", "strategy", "decision")
"""Tables of every scenario."""


def verify_sweep(folder: Path) -> CheckReport:
    """Verify the folder of a sweep: ledger, table of runs, and each run whose tables were kept."""
    report = CheckReport()
    lines = _ledger(folder / "ledger.jsonl", report)
    _check_table(folder / "runs.parquet", lines, report)
    for key in sorted(key for key, line in lines.items() if line.get("tables")):
        report.key = key
        try:
            record = _record(folder / "runs" / f"key={key}", report)
        except NoResults as error:
            report.add("readable", "runs", None, "", str(error), "the results of a run whose tables were kept")
            continue
        for name, follows in record.summary.items():
            if name != "run_id":
                report.same("runs", "ledger", name, lines[key]["summary"].get(name), follows)
        verify_run(record, report)
    report.key = ""
    return report


def _ledger(path: Path, report: CheckReport) -> dict[str, dict[str, Any]]:
    lines: dict[str, dict[str, Any]] = {}
    for number, text in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
        report.look("ledger")
        try:
            line = json.loads(text)
            key = line["key"]
        except (ValueError, KeyError, TypeError):
            report.add("ledger", "ledger.jsonl", None, "", f"line {number}", "none: it is no line of a run")
            continue
        if "crc" in line and f"{zlib.crc32(text[len(SEAL) + 11 :].encode()):08x}" != line["crc"]:
            stated = f"line {number}, run {key}"
            report.add("ledger", "ledger.jsonl", None, "", stated, "another checksum: it was altered")
            continue
        lines[key] = line  # the last of a repeated run
    return lines


def _check_table(path: Path, lines: dict[str, dict[str, Any]], report: CheckReport) -> None:
    if not path.is_file():
        report.skip("runs.parquet", "the sweep has not ended: there is none yet")
        return
    table = _table(path, report)
    if table is None:
        return
    rows = table.to_pylist()
    keys = [row["key"] for row in rows]
    for key in sorted({key for key in keys if keys.count(key) > 1}):
        report.add("runs", "runs", None, "", f"run {key} {keys.count(key)} times", "one row")
    for key in sorted(set(keys) ^ set(lines)):
        texts = ("no row", "one of the ledger") if key in lines else ("a row", "none: the ledger has no such run")
        report.add("runs", "runs", None, "", f"{texts[0]} of run {key}", texts[1])
    for row in rows:
        if row["key"] not in lines:
            continue
        for name, follows in lines[row["key"]]["summary"].items():
            if name in row and not isinstance(follows, list):
                report.key = row["key"]
                report.same("runs", "runs", name, row[name], follows, 1e-9)
    report.key = ""


def _table(path: Path, report: CheckReport) -> pa.Table | None:
    try:
        with pq.ParquetFile(path) as file:  # pq.read_table adds columns derived from folder names
            return file.read()
    except (OSError, ValueError, pa.ArrowException) as error:
        report.add("readable", path.stem, None, "", f"cannot be read: {str(error).splitlines()[0]}", "a table")
        return None


def verify(folder: Path) -> CheckReport:
    """Verify the results folder of a run or a sweep; raises NoResults for any other folder."""
    if (folder / "ledger.jsonl").is_file():
        return verify_sweep(folder)
    report = CheckReport()
    verify_run(_record(folder, report), report)
    return report


def _record(folder: Path, report: CheckReport) -> Record:
    missing = [name for name in ("summary.json", "manifest.json") if not (folder / name).is_file()]
    if missing:
        raise NoResults(f"{folder}: no results of a run or a sweep, missing: {', '.join(missing)}")
    summary, manifest = _json(folder / "summary.json", "milestones"), _json(folder / "manifest.json", "scenario")
    tables: dict[str, TableColumns] = {}
    own = summary.get("run_id")
    for path in sorted(folder.glob("*.parquet")):
        if (table := _table(path, report)) is not None:
            tables[path.stem] = TableColumns(table)
            _check_id(report, path.stem, (table.schema.metadata or {}).get(b"run_id", b"").decode(), own)
    _check_id(report, "manifest", manifest.get("run_id"), own)
    try:
        scenario = tomllib.loads(manifest["scenario"])
    except (tomllib.TOMLDecodeError, TypeError, AttributeError, RecursionError) as error:
        raise NoResults(f"{folder / 'manifest.json'}: its scenario is no TOML: {error}") from None
    if missing := [name for name in SECTIONS if not scenario.get(name)]:
        raise NoResults(f"{folder / 'manifest.json'}: its scenario has no [{missing[0]}]")
    modem = manifest.get("modem")
    is_whole = isinstance(modem, dict) and {"rate_bps", "head_s", "payload_bytes"} <= set(modem)
    return Record(scenario, manifest.get("seed"), summary, tables, modem if is_whole else None)


def _check_id(report: CheckReport, table: str, stated: Any, own: Any) -> None:
    report.look("run_id")
    if stated != own:
        report.add("run_id", table, None, "", f"of run {stated}", f"run {own}, as in summary.json")


def _json(path: Path, needed: str) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise NoResults(f"{path}: cannot be read: {error}") from None
    if not isinstance(content, dict) or needed not in content:
        raise NoResults(f"{path}: damaged: {needed!r} is missing")
    return content
