"""Obligations: how they are judged from what a head knows, and what is put down of them in a run."""

from pathlib import Path

import pytest

from missions.errors import ConfigurationError
from missions.features.obligation import State, judged, reached_by
from missions.runs.run import Run, run
from missions.runs.summary import summary
from missions.scenarios import load, shipped
from remoras.activities import Objective

OWED = "group.Operational.obligation"
EXPLORING = '{role="LeftWinger", objective="Exploring", deadline_s=2000}'
HASTY = '{role="Midfield", objective="Exploring", deadline_s=300}'
LATE = '{role="Cartographer", objective="Mapping", deadline_s=1800}'


def finished(*settings: str) -> Run:
    return run(load("mapping-rendezvous", [("--set", one) for one in settings]), 1)


@pytest.fixture(scope="module")
def made() -> Run:
    return finished(f"{OWED}=[{EXPLORING}, {HASTY}, {LATE}]", "channel.per=0.4")


def states(of: Run, role: str) -> list[tuple[str, str]]:
    """Vehicle and state, in order."""
    return [(row[1], row[5]) for row in of.recorder.rows("obligations") if row[3] == role]


@pytest.mark.parametrize(
    ("reached_s", "now_s", "expected"),
    [
        (None, 99.0, State.PENDING),
        (None, 100.0, State.PENDING),
        (None, 100.5, State.VIOLATED),
        (99.0, 99.5, State.FULFILLED),
        (100.0, 500.0, State.FULFILLED),
        (100.5, 101.0, State.LATE),
    ],
)
def test_the_state_follows_from_what_is_known_and_the_deadline_is_in_time(
    reached_s: float | None, now_s: float, expected: State
) -> None:
    assert judged(100.0, reached_s, now_s) is expected


@pytest.mark.slow
def test_a_job_has_to_be_done_and_anything_else_ends_as_the_group_gathers(made: Run) -> None:
    jobs = made.mission.jobs
    assert reached_by(Objective("Operational", "LeftWinger", "Exploring", "left"), jobs) == ("areaDone", "left")
    meeting = Objective("Operational", "Performer", "RendezVous", "operational rally")
    assert reached_by(meeting, jobs) == ("gatheredAt", "Operational")


def test_what_is_reached_in_time_is_fulfilled_by_who_observed_it(made: Run) -> None:
    """The head hears of it later: what counts is when the area was done."""
    assert states(made, "LeftWinger") == [("AUV00", "pending"), ("AUV00", "fulfilled")]
    row = next(row for row in made.recorder.rows("obligations") if row[3] == "LeftWinger" and row[5] == "fulfilled")
    done_s = next(item[2] for item in made.recorder.items if item[4:6] == ("left", "areaDone"))
    assert row[7] == done_s <= row[0]
    assert row[8] == ["AUV01"]


def test_what_is_not_is_violated_as_the_deadline_is_over_and_late_when_it_is_reached(made: Run) -> None:
    assert states(made, "Cartographer") == [("AUV00", "pending"), ("AUV00", "violated"), ("AUV00", "fulfilled late")]
    violated = next(row for row in made.recorder.rows("obligations") if row[3:6:2] == ("Midfield", "violated"))
    assert 300.0 < violated[0] <= 301.0  # judged at every motion tick
    assert violated[7] is None


def test_what_was_late_or_never_reached_counts_as_violated(made: Run) -> None:
    assert summary(made)["n_violated_obligations"] == 2


def test_a_new_head_judges_anew_by_what_it_knows_itself() -> None:
    lost = 'fault=[{kind="lost", vehicle="AUV00", at_s=200.0}]'
    of = finished(f"{OWED}=[{HASTY}]", lost, "communication.lease_frames=10", "scenario.duration_s=600")
    assert states(of, "Midfield") == [("AUV00", "pending"), ("AUV01", "pending"), ("AUV01", "violated")]


def test_an_obligation_that_no_head_is_left_to_judge_counts_as_violated() -> None:
    lost = 'fault=[{kind="lost", vehicle="AUV00", at_s=200.0}]'
    of = finished(f"{OWED}=[{HASTY}]", lost, "scenario.duration_s=400", "group.Operational.succession=[]")
    assert states(of, "Midfield") == [("AUV00", "pending")]
    assert summary(of)["n_violated_obligations"] == 1


def test_a_run_that_ends_before_the_deadline_leaves_it_open() -> None:
    of = finished(f"{OWED}=[{EXPLORING}]", "scenario.duration_s=60")
    assert states(of, "LeftWinger") == [("AUV00", "pending")]
    assert summary(of)["n_violated_obligations"] == 0


def test_a_mission_without_obligations_has_neither_table_nor_figure() -> None:
    of = finished("scenario.duration_s=60")
    assert "obligations" not in of.recorder.tables
    assert "n_violated_obligations" not in summary(of)


@pytest.mark.parametrize(
    ("table", "key", "allowed"),
    [
        ('role = "LeftWing"\nobjective = "Exploring"', "role", "did you mean 'LeftWinger'"),
        ('role = "LeftWinger"\nobjective = "Exploringg"', "objective", "did you mean 'Exploring'"),
    ],
)
def test_one_for_what_there_is_not_is_refused_with_its_place_and_the_nearest_name(
    tmp_path: Path, table: str, key: str, allowed: str
) -> None:
    lines = shipped()["mapping-rendezvous"].read_text(encoding="utf-8").splitlines()
    at = next(number for number, line in enumerate(lines) if 'name = "Coordinator"' in line) - 1
    lines[at:at] = ["[[group.obligation]]", *table.split("\n"), "deadline_s = 1800", ""]
    path = tmp_path / "owed.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(ConfigurationError) as caught:
        load(str(path))
    (fault,) = caught.value.faults
    assert fault.key == f"{OWED}.1.{key}"
    assert fault.line == at + 2 + (key == "objective")
    assert allowed in fault.allowed


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        (f"{EXPLORING}, {EXPLORING}", "an obligation for Exploring already, number 1"),
        ('{role="LeftWinger", objective="Exploring", deadline_s=0}', "greater than 0"),
    ],
)
def test_one_that_says_nothing_is_refused(tables: str, message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        load("mapping-rendezvous", [("--set", f"{OWED}=[{tables}]")])
