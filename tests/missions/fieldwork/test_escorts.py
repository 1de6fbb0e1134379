"""Escorts: vehicles interrupt their own work to follow; each mechanism has an effect."""

import pytest
from sample_vehicles import AUV
from varied import Varied

from exchange.arithmetic import distance
from missions.fieldwork.jobs import SurveyingLine, SurveyLine
from missions.fieldwork.truth import PASSED_M
from remoras.motion import Motion
from remoras.picture import Picture

flown = Varied("escort-lines", "lines.toml").flown


def test_calls_move_vehicles_only_to_following() -> None:
    """At least one vehicle interrupts its own line to follow, and resumes it later."""
    runs = [flown(seed) for seed in (1, 2)]
    moved = {row[4] for one in runs for row in one.recorder.decisions if row[9] > 0.0}
    assert moved == {"Helping"}
    for one in runs:
        rows = [row for row in one.recorder.rows("activities") if row[2] == "guidance"]
        by_vehicle = {name: [row[3] for row in rows if row[1] == name] for name in {row[1] for row in rows}}
        assert any(
            names[place : place + 3] == ["Surveying", "Following", "Surveying"]
            for names in by_vehicle.values()
            for place in range(len(names) - 2)
        )


def test_line_is_reported_as_surveyed_only_after_it_was() -> None:
    for seed in (1, 2):
        done = flown(seed)
        surveyed_s = {row[2]: row[0] for row in done.recorder.rows("escorting") if row[3] == "surveyed"}
        said_s = {row[2]: row[0] for row in done.recorder.rows("jobs") if row[2] in surveyed_s}
        assert len(said_s) == 4
        assert all(said_s[name] >= surveyed_s[name] for name in said_s)


@pytest.mark.parametrize("aside_m", [0.0, 2.0, 2.9])
@pytest.mark.parametrize("ahead_m", [0.0, 2.0, 2.9, 4.4, 6.0])
def test_survey_of_a_line_begins_at_its_first_mark(ahead_m: float, aside_m: float) -> None:
    """Before, a vehicle that another one kept off began 4.5 m along the line, and the run ended without its goal."""
    line = SurveyLine(name="line 1", from_m=(0.0, 0.0), to_m=(100.0, 0.0))
    at = Motion(ahead_m, aside_m)
    reference = SurveyingLine(line, 20.0, 900.0, AUV).reference(at, Picture())
    assert reference is not None
    assert reference.target_m == (line.to_m if ahead_m < 3.0 else line.place_m)
    assert reference.target_m != line.to_m or distance(at.position_m, line.place_m) <= PASSED_M


def test_line_of_a_lost_leader_or_follower_is_completed_by_others() -> None:
    """AUV04 has the first escorted line of seed 1, and AUV02 follows it from 138 s on."""
    for vehicle in ("AUV02", "AUV04"):
        done = flown(1, f'fault=[{{kind="lost",vehicle="{vehicle}",at_s=250}}]')
        assert done.completed, done.reason
        assert len({row[2] for row in done.recorder.rows("jobs")}) == 14
