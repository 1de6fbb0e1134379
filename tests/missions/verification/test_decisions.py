"""Times at which the checker of results infers a new decision."""

from typing import Any

import pyarrow as pa
import pytest

from missions.verification.ending import check_ending
from missions.verification.record import CheckReport, Record, TableColumns
from missions.verification.relations import check_weights

EMPTY = TableColumns(pa.table({name: [] for name in ("time_s", "vehicle", "kind", "detail")}))


def record_of(decided_s: float, period_s: float, **communication: Any) -> Record:
    """Run of 600 s in which a vehicle stops mapping at 441 s and decides again at another time."""
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
def test_stop_of_mapping_needs_a_decision_within_its_period(
    decided_s: float, period_s: float, communication: dict[str, Any], follows: bool
) -> None:
    """A period of no whole ticks ends at the next one; a clock that is set back makes it longer."""
    report = CheckReport()
    check_ending(record_of(decided_s, period_s, **communication), report)
    assert list(report.n_findings) == ([] if follows else ["milestones"])


FADING = {"time_s": 10.0, "vehicle": "A", "group": "Team", "role": "Hand", "objective": "", "argument": "",
          "activities": ["Homing"], "stimulus": 1.0, "own": 0.2, "external": 0.0, "source": "B", "slot": 1,
          "chosen": True, "best_mean": 0.2}  # fmt: skip


@pytest.mark.parametrize(("age_s", "follows"), [(400.0, True), (100.0, False)])
def test_faded_call_is_written_as_0_and_keeps_its_source(age_s: float, follows: bool) -> None:
    """Slots of 0.5 s and a guard as long make frames of 2 s: kept for 8.5, a call of 2 is below 5e-6 after 219 s."""
    scenario = {
        "scenario": {"tick_s": 1.0, "duration_s": 600.0}, "strategy": {"name": "remoras"},
        "decision": {"signal_memory_frames": 8.5, "weight_external": 2.0}, "group": [],
        "channel": {"name": "perfect"}, "world": {"sound_speed_mps": 1500.0}, "communication": {"range_m": 750.0},
        "vehicle": [{"name": "A", "slot": 0}, {"name": "B", "slot": 1}],
    }  # fmt: skip
    row = FADING | {"time_s": 10.0 + age_s}
    packet = {"slot": [1], "sender": ["B"], "receivers": [["A"]], "arrivals_s": [[10.0]]}
    tables = {"decisions": {name: [value] for name, value in row.items()}, "packets": packet}
    of = {name: TableColumns(pa.table(columns)) for name, columns in tables.items()}
    record = Record(scenario, 1, {}, of, modem={"head_s": 0.0, "rate_bps": 160.0, "payload_bytes": 10})
    report = CheckReport()
    check_weights(record, report, record.decisions[0][2], set(), {})
    assert list(report.n_findings) == ([] if follows else ["weights"])
