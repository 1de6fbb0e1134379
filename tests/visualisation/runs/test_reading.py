"""What is read out of results: tenures of roles, tracks."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from synthetic_runs import FICTIONS, Fiction

from visualisation.runs import reading
from visualisation.runs.reading import PlanTrack, Tenure, VehicleFault
from visualisation.spans import Span


@pytest.mark.parametrize(
    ("events", "held", "active"),
    [
        ([(10.0, "assigned"), (20.0, "active"), (30.0, "left")], [Span(10.0, 30.0)], [Span(20.0, 30.0)]),
        (  # never left: it lasts to the end
            [(10.0, "assigned"), (20.0, "active"), (30.0, "inactive"), (40.0, "active")],
            [Span(10.0, 1000.0)], [Span(20.0, 30.0), Span(40.0, 1000.0)],
        ),  # without a beginning, or told twice: nothing changes
        ([(5.0, "inactive"), (10.0, "assigned"), (15.0, "assigned"), (50.0, "left")], [Span(10.0, 50.0)], []),
    ],
)  # fmt: skip
def test_a_role_is_held_and_drives_from_event_to_event(
    tmp_path: Path, events: list[tuple[float, str]], held: list[Span], active: list[Span]
) -> None:
    rows = [(time_s, "A", "Team", "Diver", event) for time_s, event in events]
    run = Fiction(roles=(), extra_roles=rows).write(tmp_path / "run")  # type: ignore[arg-type]
    assert reading.tenures(run) == {"A": [Tenure("Team", "Diver", tuple(held), tuple(active))], "B": []}


def test_no_role_drives_a_vehicle_that_is_out_of_the_mission(tmp_path: Path) -> None:
    """It holds the role all the time; lost from 30 s to 50 s and for good at 70 s."""
    rows = [(10.0, "A", "Team", "Diver", "assigned"), (20.0, "A", "Team", "Diver", "active")]
    run = Fiction(vehicles=("A", "B"), roles=(), extra_roles=rows).write(tmp_path / "run")
    faults = [(30.0, "lost", "until 50 s"), (50.0, "lost", "over"), (70.0, "energy", "for good")]
    table = pa.Table.from_pylist(
        [{"time_s": at_s, "vehicle": "A", "kind": kind, "detail": detail} for at_s, kind, detail in faults]
    )
    pq.write_table(table.replace_schema_metadata(run.table("roles").schema.metadata), run.folder / "faults.parquet")
    (found,) = reading.tenures(run)["A"]
    assert found.held == (Span(10.0, 1000.0),)
    assert found.active == (Span(20.0, 30.0), Span(50.0, 70.0))


def test_roles_of_one_group_stay_together(tmp_path: Path) -> None:
    rows = [
        (float(at), "A", group, role, "assigned")
        for at, (group, role) in enumerate([("One", "p"), ("Two", "q"), ("One", "r")])
    ]
    run = Fiction(roles=(), extra_roles=rows).write(tmp_path / "run")
    assert [(own.group, own.role) for own in reading.tenures(run)["A"]] == [("One", "p"), ("One", "r"), ("Two", "q")]


def test_a_position_between_two_records_is_between_them() -> None:
    track = PlanTrack(np.array([0.0, 10.0]), np.array([0.0, 20.0]), np.array([5.0, 5.0]))
    assert track.at(2.5) == pytest.approx((5.0, 5.0))
    assert track.between(5.0, 10.0).x_m.tolist() == [20.0]


def test_faults_of_vehicles_last_until_they_are_over(tmp_path: Path) -> None:
    """An empty battery is none that the scenario declares."""
    run = FICTIONS["faults"].write(tmp_path / "run")
    assert reading.vehicle_faults(run) == [
        VehicleFault("B", "joins", "away until 200 s", Span(0.0, 200.0)),
        VehicleFault("A", "mute", "until 600 s", Span(300.0, 600.0)),
        VehicleFault("B", "lost", "for good", Span(500.0, 1000.0)),
    ]
    (run.folder / "faults.parquet").unlink()  # as an older version wrote it
    assert reading.vehicle_faults(run) == []
