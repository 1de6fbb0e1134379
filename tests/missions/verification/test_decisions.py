"""When the checker of results takes a vehicle to have decided anew."""

from typing import Any

import pyarrow as pa
import pytest

from missions.verification.ending import check_ending
from missions.verification.record import CheckReport, Record, TableColumns

EMPTY = TableColumns(pa.table({name: [] for name in ("time_s", "vehicle", "kind", "detail")}))


def record_of(decided_s: float, period_s: float, **communication: Any) -> Record:
    """A run of 600 s in which a vehicle stops mapping at 441 s and decides anew at another time."""
    scenario = {
        "scenario": {"tick_s": 1.0, "duration_s": 600.0}, "decision": {"period_s": period_s}, "vehicle": [],
        "group": [], "communication": communication,
    }  # fmt: skip
    stone = {"name": "mapping_stopped", "vehicle": "AUV01", "group": "", "time_s": 441.0}
    summary = {"milestones": [stone], "completed": False, "reason": "time", "mission_time_s": 600.0}
    tables = {
        "faults": EMPTY,
        "trajectories": TableColumns(pa.table({"time_s": [600.0], "vehicle": ["AUV01"]})),
        "decisions": TableColumns(pa.table({"time_s": [decided_s], "vehicle": ["AUV01"]})),
    }
    return Record(scenario, 1, summary, tables)


@pytest.mark.parametrize(
    ("decided_s", "period_s", "communication", "follows"),
    [
        (444.0, 4.0, {}, True),
        (445.0, 4.0, {}, True),
        (446.0, 4.0, {}, False),
        (444.0, 2.5, {}, True),
        (445.0, 2.5, {}, False),
        (450.0, 4.0, {"clocks": {}}, True),
        (451.0, 4.0, {"clocks": {}}, False),
        (440.0, 4.0, {}, True),
        (439.0, 4.0, {}, False),
    ],
)
def test_who_stops_mapping_has_decided_so_or_does_within_its_period(
    decided_s: float, period_s: float, communication: dict[str, Any], follows: bool
) -> None:
    """A period of no whole ticks ends at the next one; a clock that is set back makes it longer."""
    report = CheckReport()
    check_ending(record_of(decided_s, period_s, **communication), report)
    assert list(report.n_findings) == ([] if follows else ["milestones"])
