"""The checks of one run, theme after theme."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from stress.verify.ending import check_ending
from stress.verify.figures import check_figures
from stress.verify.findings import CheckReport
from stress.verify.ground import check_ground
from stress.verify.knowledge import check_knowledge
from stress.verify.motion import check_tracks
from stress.verify.packets import check_packets
from stress.verify.record import Record
from stress.verify.roles import check_roles
from stress.verify.tables import check_rows, check_tables

THEMES: dict[str, Callable[[Record, CheckReport], None]] = {
    "motion": check_tracks,
    "packets": check_packets,
    "knowledge": check_knowledge,
    "roles": check_roles,
    "ending": check_ending,
    "ground": check_ground,
    "figures": check_figures,
}
"""Checks of a run by theme."""
BROKEN = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
"""What values raise that no run can have written."""


def modem_of(scenario: dict[str, Any], manifest: dict[str, Any]) -> dict[str, Any] | None:
    """Profile of the modem of a run: as the manifest has it, or the scenario; None where neither does."""
    found = manifest.get("modem") or scenario.get("modem", {}).get(scenario["communication"]["modem"])
    is_whole = isinstance(found, dict) and {"rate_bps", "head_s", "payload_bytes"} <= set(found)
    return found if is_whole else None


def verify_run(record: Record, report: CheckReport) -> None:
    """Run the checks of a run.

    Args:
        record: of the run.
        report: takes what they find.
    """
    if not check_tables(record.tables, report) or not check_rows(record, report):
        report.skip("the rest of the run", "tables, columns or vehicles are missing or unknown")
        return
    report.strange = record.strange
    for theme, check in THEMES.items():
        if theme == "ground" and not ("coverage" in record.tables and "area" in record.scenario):
            continue
        try:
            check(record, report)
        except BROKEN as error:
            report.add("readable", theme, None, "", f"{type(error).__name__}: {error}", "values that can be read")
