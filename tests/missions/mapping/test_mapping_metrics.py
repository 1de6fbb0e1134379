"""Metrics and figures of mapping, from rows written by hand."""

from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any

import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure as Sheet
from plain_style import PlainStyle

from missions.mapping.metrics import (
    coverage_fraction,
    draw_coverage,
    draw_mapped_cells,
    draw_objects,
    duplicate_fraction,
    given_up_s,
    least_mapped_fraction,
    left_when_given_up,
    time_to_s,
)
from missions.mapping.sensors import COVERAGE
from missions.mapping.truth import GOAL
from missions.metric import NOT_APPLICABLE
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


ROWS = [(10.0, "A", 0, 0), (20.0, "B", 0, 0), (30.0, "B", 1, 0), (40.0, "A", 2, 1)]
"""B maps again what A has mapped: time (s), vehicle, column and row of the cell."""


STYLE = PlainStyle(A="red", B="blue")


def results(rows: list[tuple[Any, ...]] = ROWS) -> Any:
    names = ["time_s", "vehicle", "cell_x", "cell_y"]
    table = pa.table({name: [row[at] for row in rows] for at, name in enumerate(names)})
    return SimpleNamespace(
        summary={"mission_time_s": 100.0, "coverage_fraction": 0.75 if rows else 0.0},
        scenario_tables={"world": {"cell_m": 25.0}},
        table=lambda name: {"coverage": table}[name],
    )


@pytest.fixture
def axes() -> Axes:
    return Sheet().subplots()


def test_the_steps_end_at_the_share_of_the_summary(axes: Axes) -> None:
    draw_coverage(axes, results(), STYLE)
    steps = {line.get_label(): list(line.get_ydata()) for line in axes.get_lines()}
    assert steps["fleet"] == pytest.approx([0, 25, 50, 75, 75])  # three of four cells
    assert steps["A"] == pytest.approx([0, 25, 50, 50])
    assert steps["B"] == pytest.approx([0, 25, 25])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time in s", "mapped in %")


def test_mapped_cells_are_squares_in_the_tint_of_who_came_first(axes: Axes) -> None:
    assert draw_mapped_cells(axes, results(), STYLE).startswith("Cells are shaded in the colour")
    (cells,) = [one for one in axes.collections if isinstance(one, PolyCollection)]
    boxes = [path.get_extents().extents.tolist() for path in cells.get_paths()]
    assert boxes == [[0, 0, 25, 25], [25, 0, 50, 25], [50, 25, 75, 50]]
    red, blue = (1.0, 0.8, 0.8), (0.8, 0.8, 1.0)
    assert [tuple(colour[:3]) for colour in cells.get_facecolors()] == [red, blue, red]
    assert axes.get_legend_handles_labels()[1] == ["mapped cells"]


def test_objects_stand_where_they_lie_and_a_cross_where_each_was_seen(axes: Axes) -> None:
    sightings = [{"x_m": x_m, "y_m": y_m} for x_m, y_m in ((11.0, 20.0), (9.0, 21.0), (41.0, 52.0))]
    objects = {"object": [{"position_m": [10.0, 20.0], "classification": "wreck"}]}
    seen = SimpleNamespace(scenario_tables=objects, rows={"sightings": sightings}.__getitem__)
    assert draw_objects(axes, seen, STYLE).endswith("n = 3 sightings.")
    drawn = [one.get_offsets().tolist() for one in axes.collections]
    assert drawn == [[[11.0, 20.0], [9.0, 21.0], [41.0, 52.0]], [], [[10.0, 20.0]]]
    assert [one.get_text() for one in axes.texts] == ["wreck"]
    assert axes.get_legend_handles_labels()[1] == ["seen there", "object"]
    blind = SimpleNamespace(scenario_tables=objects, rows=lambda name: [])
    assert draw_objects(Sheet().subplots(), blind, STYLE).endswith("n = 0 sightings.")
    none = SimpleNamespace(scenario_tables={})
    assert draw_objects(Sheet().subplots(), none, STYLE) == ""
