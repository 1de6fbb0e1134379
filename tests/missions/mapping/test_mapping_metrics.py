"""Metrics of mapping, each against rows written by hand: what was mapped, how soon, how often twice, by whom."""

from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.mapping.metrics import (
    METRICS,
    area_roles,
    coverage_fraction,
    duplicate_fraction,
    given_up_s,
    least_mapped_fraction,
    left_when_given_up,
    time_to_s,
)
from missions.mapping.sensors import COVERAGE
from missions.mapping.truth import GOAL
from missions.metric import NOT_APPLICABLE, Better
from missions.scenarios import load
from remoras.mission import Milestone
from remoras.recorder import Recorder

GROUP = SimpleNamespace(
    name="G",
    role=[SimpleNamespace(name=name, job=job) for name, job in (("Left", "west"), ("Right", "east"), ("Leader", None))],
)
SCENARIO = SimpleNamespace(group=[GROUP], area=[SimpleNamespace(name=name) for name in ("west", "east")])


def run(coverage: list[tuple[float, str, int]], roles: Iterable[tuple[str, str]] = (), n_cells: int = 20) -> Any:
    """(time, vehicle, cell) that were mapped; (vehicle, role) that were assigned; cells there are."""
    recorder = Recorder([COVERAGE, GOAL])
    recorder.rows("coverage").extend((time_s, vehicle, cell, 0) for time_s, vehicle, cell in coverage)
    recorder.roles.extend((0.0, vehicle, "G", role, "assigned") for vehicle, role in roles)
    world = SimpleNamespace(cells=dict.fromkeys((x, 0) for x in range(n_cells)))
    mission = SimpleNamespace(world=lambda seed: world)
    return SimpleNamespace(recorder=recorder, scenario=SCENARIO, mission=mission, seed=1)


def mapping(roles: list[tuple[str, str]], coverage: list[tuple[str, int]]) -> Any:
    return run([(float(number), vehicle, cell) for number, (vehicle, cell) in enumerate(coverage)], roles)


# How much, how soon, how often --------------------------------------------------------------------


def test_a_share_of_the_goal_is_reached_when_the_truth_first_says_so() -> None:
    """Half of the goal from 20 s on; the whole never."""
    done = run([])
    done.recorder.rows("goal").extend([(10.0, 0.4), (20.0, 0.5), (30.0, 0.95)])
    assert [time_to_s(share)(done) for share in (0.5, 0.8, 0.95, 1.0)] == [20.0, 30.0, 30.0, None]
    assert time_to_s(0.5)(run([])) is None


def test_a_cell_that_two_have_mapped_is_covered_once_and_duplicated_once() -> None:
    """Three cells of 20 in four rows: one row of the four is work done again."""
    done = run([(1.0, "A", 0), (2.0, "A", 1), (3.0, "B", 1), (4.0, "B", 2)])
    assert coverage_fraction(done) == 3 / 20
    assert duplicate_fraction(done) == 1 / 4


def test_where_nothing_is_to_be_mapped_nothing_is_divided_by_nothing() -> None:
    assert (coverage_fraction(run([], n_cells=0)), duplicate_fraction(run([]))) == (0.0, 0.0)


@given(st.lists(st.tuples(st.sampled_from("AB"), st.integers(0, 19)), unique=True))
def test_cells_and_rows_add_up(rows: list[tuple[str, int]]) -> None:
    """n rows of c cells: coverage c/20 and duplicates 1 - c/n, from the definitions."""
    done = mapping([], rows)
    assert coverage_fraction(done) == len({cell for _, cell in rows}) / 20
    assert duplicate_fraction(done) * len(rows) == pytest.approx(len(rows) - len({cell for _, cell in rows}))


# The worst mapper ---------------------------------------------------------------------------------


def test_the_first_to_map_a_cell_has_the_credit() -> None:
    done = mapping([("A", "Left"), ("B", "Right")], [("A", 0), ("A", 1), ("A", 2), ("B", 2), ("B", 3)])
    assert least_mapped_fraction(done) == 1 / 4


def test_only_vehicles_that_were_given_an_area_count() -> None:
    coverage = [("A", 0), ("B", 1), ("C", 2)]
    assert least_mapped_fraction(mapping([("A", "Left"), ("C", "Leader")], coverage)) == 1 / 3
    assert least_mapped_fraction(mapping([("A", "Left"), ("D", "Right")], coverage)) == 0.0
    assert least_mapped_fraction(mapping([("C", "Leader")], coverage)) is None
    assert least_mapped_fraction(mapping([("A", "Left")], [])) is None


@given(st.lists(st.tuples(st.sampled_from("ABC"), st.integers(0, 9)), min_size=1))
def test_the_worst_of_n_does_at_most_an_equal_share(coverage: list[tuple[str, int]]) -> None:
    found = least_mapped_fraction(mapping([("A", "Left"), ("B", "Right"), ("C", "Left")], coverage))
    assert found is not None
    assert 0.0 <= found <= 1 / 3


def test_areas_are_explored_by_the_roles_that_name_them() -> None:
    assert {role for _, role in area_roles(load("mapping-rendezvous"))} == {"LeftWinger", "Midfield", "RightWinger"}


# Giving up ----------------------------------------------------------------------------------------


def test_what_was_left_is_what_nobody_had_covered_of_the_areas_that_were_held_then() -> None:
    """West has four cells: A covered one, B another before 10 s; A had left the east; what comes later counts not."""
    done = run([(1.0, "A", 0), (2.0, "B", 1), (11.0, "B", 2)], [("A", "Left"), ("A", "Right"), ("B", "Right")])
    done.recorder.roles.append((5.0, "A", "G", "Right", "left"))
    done.mission = SimpleNamespace(
        world=lambda seed: SimpleNamespace(cells={(x, 0): ("west" if x < 4 else "east", x) for x in range(8)})
    )
    done.milestones = [Milestone(9.0, "mapping_done", "B"), Milestone(10.0, "mapping_stopped", "A")]
    assert (given_up_s(done), left_when_given_up(done)) == (10.0, 0.5)


def test_without_anybody_who_gives_up_nothing_is_said() -> None:
    done = run([])
    done.milestones = [Milestone(9.0, "mapping_done", "B")]
    assert (given_up_s(done), left_when_given_up(done)) == (NOT_APPLICABLE, NOT_APPLICABLE)


# The declaration ----------------------------------------------------------------------------------


def test_each_is_ranked_in_its_own_direction() -> None:
    """More mapped is better, sooner is better, twice is worse, an idle vehicle is worse."""
    assert {metric.name: metric.better for metric in METRICS} == {
        "coverage_fraction": Better.HIGHER,
        "believed_fraction": Better.HIGHER,
        **{f"time_to_{share}_s": Better.LOWER for share in (50, 80, 95, 100)},
        "duplicate_fraction": Better.LOWER,
        "finds_inspected_fraction": Better.HIGHER,
        "least_mapped_fraction": Better.HIGHER,
        "given_up_s": Better.NEITHER,
        "left_when_given_up": Better.NEITHER,
    }
