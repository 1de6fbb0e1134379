"""Exploration of an area: row by row over the cells not known to be mapped, by one or two vehicles."""

import math
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from surveying import CORNERS_M, JOB, Surveyor, cells_known, mapper, survey
from watched import Facts

from missions.mapping.behaviours import WORTH_FINISHING, MappingAlong, WorkLeft, ZigzagExploring, due
from missions.meeting.survey import rows, to_and_fro
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.activities import Objective
from remoras.behaviours import CAPTURE_M, DONE, Reference
from remoras.htn import Task
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.work import Point

ALL = range(100)


def at(x_m: float, y_m: float = 0.0) -> Motion:
    return Motion(x_m, y_m)


def exploring(facts: Facts | None = None) -> tuple[ZigzagExploring, Picture]:
    picture = Picture(facts=facts or cells_known())
    picture.body.sensors_on = ("mapping",)
    return ZigzagExploring(JOB, mapper(), WorkLeft([JOB], 0.0)), picture


# One vehicle, nothing known -----------------------------------------------------------------------


def test_a_survey_of_an_untouched_area_runs_the_waypoints_of_the_paper() -> None:
    """Twenty of them; transit to the first, 159.1 m at 2 m/s, then 2475 m at 1.25 m/s: 2060 s, and turns."""
    one = Surveyor(mapper(), cells_known())
    done_s = survey(one)
    assert one.rows == to_and_fro(rows(CORNERS_M, 25.0, 12.5), (0.0, 0.0))
    assert one.last == DONE
    assert one.covered == set(ALL)
    assert 2040.0 < done_s < 2060.0 * 1.03  # the last cell is mapped 12.5 m, 10 s, before the last waypoint


def test_transit_speed_to_the_first_point_then_mapping_speed() -> None:
    zigzagging, picture = exploring()
    assert zigzagging.perceive(at(0.0), picture, False).stimulus > 0.95
    assert zigzagging.reference(at(0.0), picture) == Reference((112.5, 112.5), 2.0, CAPTURE_M)
    along = Reference((337.5, 112.5), 1.25, CAPTURE_M, is_over_ground=True)
    assert zigzagging.reference(at(112.0, 112.5), picture) == along
    picture.body.now_s = 2.0
    assert zigzagging.perceive(at(114.5, 112.5), picture, True).progress(at(114.5, 112.5), picture) is None
    picture.body.now_s = 4.0
    perceived = zigzagging.perceive(at(117.0, 112.5), picture, True)
    assert perceived.stimulus == 1.0
    assert perceived.progress(at(117.0, 112.5), picture) == 1.0  # 2.5 m in 2 s are 1.25 m/s
    picture.body.now_s = 6.0
    assert perceived.progress(at(118.25, 112.5), picture) == pytest.approx(0.5)


# What is left -------------------------------------------------------------------------------------


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.001, 1.0))
def test_stimulus_falls_with_the_remaining_work(less: float, more: float, half: float) -> None:
    less, more = sorted((less, more))
    assert 0.0 <= due(less, half) <= due(more, half) <= 1.0
    assert due(half, half) == pytest.approx((WORTH_FINISHING + 1.0) / 2.0)
    assert due(0.0, half) == 0.0


def test_stimulus_is_that_of_the_least_finished_area() -> None:
    facts = cells_known(range(80))
    work = WorkLeft([JOB], 0.2)
    assert work.stimulus(facts) == due(0.2, 0.2) == pytest.approx(0.71)
    mapping = MappingAlong(60.0, WorkLeft([JOB], 0.2), "mapping")
    assert mapping.perceive(at(0.0), Picture(facts=facts), False).stimulus == pytest.approx(0.71)
    facts.cells["area"] |= set(map(float, ALL))
    assert work.stimulus(facts) == 0.0
    assert mapping.perceive(at(0.0), Picture(facts=facts), False).stimulus == 0.0
    assert work.stimulus(cells_known(range(80))) == due(0.2, 0.2)  # cells of an excluded vehicle are open again


def test_rows_mapped_by_others_are_skipped_also_in_part() -> None:
    """At 300 s the vehicle is in its first or second row; then the rows from the fourth to the ninth come in, and the
    far half of each of the others."""
    one = Surveyor(mapper(), cells_known())
    known = {*range(30, 90), *(10 * row + column for row in (0, 1, 2, 9) for column in range(5, 10))}
    now_s = 0.0
    one.last = one.exploring.perceive(one.motion, one.picture, False)
    while not one.last.done:
        now_s += 1.0
        if now_s == 120.0:
            one.facts.cells["area"] |= set(map(float, known))
            before = set(one.covered)
        one.step(now_s)
    again = (one.covered - before) & known
    assert len(again) <= 1  # the one that it was just reaching
    assert one.covered | known == set(ALL)


@settings(max_examples=25, deadline=None)
@given(st.sets(st.integers(0, 99), max_size=99), st.sampled_from([25.0, 30.0, 50.0, 60.0]))
def test_all_remaining_cells_are_mapped(known: set[int], swath_m: float) -> None:
    one = Surveyor(mapper(swath_m=swath_m), cells_known(sorted(known)))
    survey(one)
    assert one.last == DONE
    assert one.covered | known == set(ALL)


# Two at one area ----------------------------------------------------------------------------------


def test_two_vehicles_at_one_area_map_a_half_each() -> None:
    """The second begins at the far end; each takes about half, and together they map next to nothing twice."""
    facts = cells_known()
    alone_s = survey(Surveyor(mapper(), cells_known()))
    first = Surveyor(mapper("AUV00"), facts)
    second = Surveyor(mapper("AUV01"), facts, others=("AUV00",))
    both_s = survey(first, second)
    assert first.covered | second.covered == set(ALL)
    assert second.rows[0][1] == 337.5
    assert min(len(first.covered), len(second.covered)) >= 40
    assert len(first.covered & second.covered) <= 3
    assert both_s < 0.6 * alone_s


@pytest.mark.parametrize(("name", "positions_m", "before"), [
    ("AUV00", {}, ()), ("AUV01", {}, ("AUV00",)), ("AUV00", {"AUV01": (99.0, 50.0)}, ("AUV01",)),
    ("AUV01", {"AUV00": (0.0, -50.0), "AUV01": (100.0, 50.0)}, ()),
])  # fmt: skip
def test_order_at_an_area_is_by_presence_then_by_list(
    name: str, positions_m: dict[str, Point], before: tuple[str, ...]
) -> None:
    """The first section of the corridor is 50 to 250 m east; both hold its role."""
    setup = resolved(load("mapping-corridor"))
    facts: Any = {("position", one): at_m for one, at_m in positions_m.items()}
    facts["members", "Operational.Section1"] = ("AUV00", "AUV01")
    aim = Objective("Operational", "Section1", "Exploring", "section 1")
    step, at_m = Task("ZigzagExploring"), positions_m.get(name, (0.0, 0.0))
    ((chosen,), _) = setup.mission.activities([[step]], aim, setup.database[name], facts, at_m)
    assert chosen.activities[0].parameters == ("section 1", "Operational", before)


# Sensors that do not work -------------------------------------------------------------------------


def test_a_dead_sensor_is_noticed_within_two_rows() -> None:
    """Two rows of 225 m and a step of 25 m at 1.25 m/s are 380 s, after 80 s of transit."""
    one = Surveyor(mapper(), cells_known(), dead=True)
    failed_s = survey(one)
    assert one.last.failed
    assert one.last.stimulus == 0.0
    assert failed_s <= 1.05 * (475.0 / 1.25 + 159.1 / 2.0)


def test_cells_still_unknown_after_a_second_try_are_given_up() -> None:
    """The sensor always misses cells 5 and 47: all others are mapped, and the vehicle reports failure."""
    one = Surveyor(mapper(), cells_known())
    blind = {5.0, 47.0}

    class Blind(set[float]):
        def add(self, index: float) -> None:
            if index not in blind:
                super().add(index)

    one.facts.cells["area"] = Blind()
    survey(one)
    assert one.last.failed
    assert one.facts.cells["area"] == set(map(float, ALL)) - blind
    for centre_m in ((237.5, 112.5), (287.5, 212.5)):
        near = [math.dist(point, centre_m) <= 2.0 for point in one.track]
        assert sum(now and not before for before, now in pairwise(near)) == 2


def test_uncertain_vehicle_requests_a_fix_before_it_retries_a_cell() -> None:
    """Right over the cell a row of one point begins and ends at once, again and again: nothing would ever be sure."""
    centre_m, unsure_m = JOB.on.centre_m(37), 40.0
    zigzagging, picture = exploring(cells_known([index for index in ALL if index != 37]))
    picture.body.uncertainty_m = unsure_m
    for now_s in range(4):
        picture.body.now_s = float(now_s)
        assert not zigzagging.perceive(at(*centre_m), picture, now_s > 0).done
        zigzagging.reference(at(*centre_m), picture)
    assert zigzagging.accuracy_m(at(*centre_m), picture) < 12.5 < unsure_m
    assert zigzagging.accuracy_m(at(centre_m[0] + 100.0, centre_m[1]), picture) == math.inf
