"""Folders of sweeps: the table of runs says what the ledger does, and kept tables follow as those of single runs do."""

from __future__ import annotations

import json
import zlib
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from stress.verify.findings import CheckReport, NoResults
from stress.verify.record import Record, TableColumns
from stress.verify.run import modem_of, verify_run

SEAL = '{"crc": "'
"""How a line of the ledger with a checksum begins; its eight digits and ``", `` follow, then what they are of."""


MAKING = ("fleet", "finds", "organisation", "object")
"""Settings from which other parts of a scenario are made: vehicles, roles, groups."""


def verify_sweep(folder: Path) -> CheckReport:
    """Say what in the folder of a sweep does not follow.

    Raises:
        NoResults: its study cannot be read.
    """
    report = CheckReport()
    try:
        study = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise NoResults(f"{folder / 'study.json'}: cannot be read: {error}") from None
    lines = _ledger(folder / "ledger.jsonl", report)
    _check_table(folder / "runs.parquet", lines, report)
    tables = _tables(folder, report)
    kept = {key for key, line in lines.items() if line.get("tables") and line.get("status") != "failed"}
    for key in sorted(kept):
        scenario = scenario_of(study, lines[key])
        if scenario is None:
            report.skip(f"tables of run {key}", "its scenario cannot be made of study.json and its settings alone")
            continue
        own = {
            name: TableColumns(table.filter(pc.equal(table["key"], key)).drop_columns(["key"]))
            for name, table in tables.items()
        }
        report.key = key
        seed = lines[key]["summary"].get("seed")
        verify_run(Record(scenario, seed, lines[key]["summary"], own, modem_of(scenario, {})), report)
        report.key = ""
    return report


def _ledger(path: Path, report: CheckReport) -> dict[str, dict[str, Any]]:
    """Lines of the ledger by key; a line whose checksum is another is told and left out."""
    found: dict[str, dict[str, Any]] = {}
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
        found.setdefault(key, line)
    return found


def _check_table(path: Path, lines: dict[str, dict[str, Any]], report: CheckReport) -> None:
    """Every run of the ledger has one row, with the figures of its line."""
    if not path.is_file():
        report.skip("runs.parquet", "the sweep has not ended: there is none yet")
        return
    try:
        rows = pq.read_table(path).to_pylist()
    except (OSError, ValueError, pa.ArrowException) as error:
        report.add("readable", "runs", None, "", f"cannot be read: {str(error).splitlines()[0]}", "a table")
        return
    given = [row["key"] for row in rows]
    for key in sorted({key for key in given if given.count(key) > 1}):
        report.add("runs", "runs", None, "", f"run {key} {given.count(key)} times", "one row")
    for key in sorted(set(given) ^ set(lines)):
        what = ("no row", "one of the ledger") if key in lines else ("a row", "none: the ledger has no such run")
        report.add("runs", "runs", None, "", f"{what[0]} of run {key}", what[1])
    for row in rows:
        if row["key"] not in lines:
            continue
        for name, follows in lines[row["key"]]["summary"].items():
            if name in row and not isinstance(follows, list):
                report.key = row["key"]
                report.same("runs", "runs", name, row[name], follows, 1e-9)
    report.key = ""


def _tables(folder: Path, report: CheckReport) -> dict[str, pa.Table]:
    found = {}
    for path in sorted((folder / "tables").glob("*.parquet")):
        try:
            found[path.stem] = pq.read_table(path)
        except (OSError, ValueError, pa.ArrowException) as error:
            report.add("readable", path.stem, None, "", f"cannot be read: {str(error).splitlines()[0]}", "a table")
    return found


def scenario_of(study: dict[str, Any], line: dict[str, Any]) -> dict[str, Any] | None:
    """The scenario of a run: that of the study with the settings of its line; None where a setting makes others."""
    settings = line.get("settings", {})
    scenarios = study.get("scenario", {})
    base = scenarios.get(line["summary"].get("scenario"))
    if base is None or any(path.startswith(MAKING) for path in settings):
        return None
    made: dict[str, Any] = _without_none(base)
    for path, value in settings.items():
        if path == "channel.name":
            made["channel"] = {"name": value}
    for path, value in settings.items():
        at: Any = made
        *above, last = path.split(".")
        for part in above:
            at = (
                next((table for table in at if table.get("name") == part), None)
                if isinstance(at, list)
                else at.setdefault(part, {})
            )
            if at is None:
                return None
        at[last] = value
    return made


def _without_none(value: Any) -> Any:
    """Tables as TOML would have them: what is absent is left out."""
    if isinstance(value, dict):
        return {key: _without_none(one) for key, one in value.items() if one is not None}
    return [_without_none(item) for item in value] if isinstance(value, list) else value
