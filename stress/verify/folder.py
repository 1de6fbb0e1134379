"""Results folders of runs and of sweeps, read with nothing but the standard library, numpy and pyarrow."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from stress.verify.ending import check_ending
from stress.verify.figures import check_figures
from stress.verify.findings import Report
from stress.verify.ground import check_ground
from stress.verify.knowledge import check_knowledge
from stress.verify.motion import check_tracks
from stress.verify.packets import check_packets
from stress.verify.record import Columns, Record
from stress.verify.roles import check_roles
from stress.verify.tables import check_form, check_rows


class NoResults(Exception):
    """A folder holds no results that can be read."""


THEMES: dict[str, Callable[[Record, Report], None]] = {
    "motion": check_tracks,
    "packets": check_packets,
    "knowledge": check_knowledge,
    "roles": check_roles,
    "ending": check_ending,
    "ground": check_ground,
    "figures": check_figures,
}
"""Checks of a run by theme."""


def verify(folder: Path) -> Report:
    """Read a results folder of a run or a sweep, and say what in it does not follow.

    Raises:
        NoResults: it holds neither.
    """
    if (folder / "ledger.jsonl").is_file():
        from stress.verify.sweep import verify_sweep

        return verify_sweep(folder)
    missing = [name for name in ("summary.json", "manifest.json") if not (folder / name).is_file()]
    if missing:
        raise NoResults(f"{folder}: no results of a run or a sweep, missing: {', '.join(missing)}")
    report = Report()
    summary, manifest = _json(folder / "summary.json", "milestones"), _json(folder / "manifest.json", "scenario")
    tables: dict[str, Columns] = {}
    own = summary.get("run_id")
    for path in sorted(folder.glob("*.parquet")):
        try:
            with pq.ParquetFile(path) as file:
                table = file.read()
        except (OSError, ValueError, pa.ArrowException) as error:
            report.add("readable", path.stem, None, "", f"cannot be read: {str(error).splitlines()[0]}", "a table")
            continue
        tables[path.stem] = Columns(table)
        _check_id(report, path.stem, (table.schema.metadata or {}).get(b"run_id", b"").decode(), own)
    _check_id(report, "manifest", manifest.get("run_id"), own)
    try:
        scenario = tomllib.loads(manifest["scenario"])
    except (tomllib.TOMLDecodeError, TypeError) as error:
        raise NoResults(f"{folder / 'manifest.json'}: its scenario is no TOML: {error}") from None
    verify_run(Record(scenario, manifest.get("seed"), summary, tables, modem_of(scenario, manifest)), report)
    return report


def modem_of(scenario: dict[str, Any], manifest: dict[str, Any]) -> dict[str, Any] | None:
    """Profile of the modem of a run: as the manifest has it, or the scenario; None where neither does."""
    found = manifest.get("modem") or scenario.get("modem", {}).get(scenario["communication"]["modem"])
    is_whole = isinstance(found, dict) and {"rate_bps", "head_s", "payload_bytes"} <= set(found)
    return found if is_whole else None


def verify_run(record: Record, report: Report, themes: frozenset[str] = frozenset(THEMES)) -> None:
    """Run the checks of a run.

    Args:
        record: of the run.
        report: takes what they find.
        themes: names of those that are to be run.
    """
    if not check_form(record.tables, report) or not check_rows(record, report):
        report.skip("the rest of the run", "tables, columns or vehicles are missing or unknown")
        return
    for theme, check in THEMES.items():
        if theme == "ground" and not ("coverage" in record.tables and "area" in record.scenario):
            continue
        if theme in themes:
            check(record, report)


def _check_id(report: Report, table: str, given: Any, own: Any) -> None:
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
