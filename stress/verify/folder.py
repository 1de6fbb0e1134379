"""Results folders of runs and of sweeps, read with nothing but the standard library, numpy and pyarrow."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from stress.verify.findings import CheckReport, NoResults
from stress.verify.record import Record, TableColumns
from stress.verify.run import modem_of, verify_run
from stress.verify.sweep import verify_sweep

__all__ = ["NoResults", "verify"]


def verify(folder: Path) -> CheckReport:
    """Read a results folder of a run or a sweep, and say what in it does not follow.

    Raises:
        NoResults: it holds neither.
    """
    if (folder / "ledger.jsonl").is_file():
        return verify_sweep(folder)
    missing = [name for name in ("summary.json", "manifest.json") if not (folder / name).is_file()]
    if missing:
        raise NoResults(f"{folder}: no results of a run or a sweep, missing: {', '.join(missing)}")
    report = CheckReport()
    summary, manifest = _json(folder / "summary.json", "milestones"), _json(folder / "manifest.json", "scenario")
    tables: dict[str, TableColumns] = {}
    own = summary.get("run_id")
    for path in sorted(folder.glob("*.parquet")):
        try:
            with pq.ParquetFile(path) as file:
                table = file.read()
        except (OSError, ValueError, pa.ArrowException) as error:
            report.add("readable", path.stem, None, "", f"cannot be read: {str(error).splitlines()[0]}", "a table")
            continue
        tables[path.stem] = TableColumns(table)
        _check_id(report, path.stem, (table.schema.metadata or {}).get(b"run_id", b"").decode(), own)
    _check_id(report, "manifest", manifest.get("run_id"), own)
    try:
        scenario = tomllib.loads(manifest["scenario"])
    except (tomllib.TOMLDecodeError, TypeError) as error:
        raise NoResults(f"{folder / 'manifest.json'}: its scenario is no TOML: {error}") from None
    verify_run(Record(scenario, manifest.get("seed"), summary, tables, modem_of(scenario, manifest)), report)
    return report


def _check_id(report: CheckReport, table: str, given: Any, own: Any) -> None:
    report.look("run_id")
    if given != own:
        report.add("run_id", table, None, "", f"of run {given}", f"run {own}, as in summary.json")


def _json(path: Path, needed: str) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise NoResults(f"{path}: cannot be read: {error}") from None
    if not isinstance(found, dict) or needed not in found:
        raise NoResults(f"{path}: damaged: {needed!r} is missing")
    return found
