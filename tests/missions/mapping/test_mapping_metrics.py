"""Figures of mapping, from hand-written rows; the checker of results recomputes the metrics."""

from types import SimpleNamespace
from typing import Any

import pyarrow as pa
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure as Sheet
from plain_style import PlainStyle

from missions.mapping.metrics import (
    draw_coverage,
    draw_mapped_cells,
    draw_objects,
)

ROWS = [(10.0, "A", 0, 0), (20.0, "B", 0, 0), (30.0, "B", 1, 0), (40.0, "A", 2, 1)]
"""B maps again what A has mapped: time (s), vehicle, column and row of the cell."""


STYLE = PlainStyle(A="red", B="blue")


def results(rows: list[tuple[Any, ...]] = ROWS) -> Any:
    names = ["time_s", "vehicle", "cell_x", "cell_y"]
    table = pa.table({name: [row[at] for row in rows] for at, name in enumerate(names)})
    return SimpleNamespace(
        summary={"completed": True, "mission_time_s": 100.0, "coverage_fraction": 0.75 if rows else 0.0},
        scenario_tables={"world": {"cell_m": 25.0}},
        ended_s=100.0,
        table=lambda name: {"coverage": table}[name],
    )


@pytest.fixture
def axes() -> Axes:
    return Sheet().subplots()


def test_coverage_steps_end_at_the_share_of_the_summary(axes: Axes) -> None:
    draw_coverage(axes, results(), STYLE)
    steps = {line.get_label(): list(line.get_ydata()) for line in axes.get_lines()}
    assert steps["fleet"] == pytest.approx([0, 25, 50, 75, 75])  # three of four cells
    assert steps["A"] == pytest.approx([0, 25, 50, 50])
    assert steps["B"] == pytest.approx([0, 25, 25])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time in s", "mapped in %")


def test_mapped_cells_have_the_tint_of_the_first_vehicle(axes: Axes) -> None:
    assert draw_mapped_cells(axes, results(), STYLE).startswith("Cells are shaded in the colour")
    (cells,) = [one for one in axes.collections if isinstance(one, PolyCollection)]
    boxes = [path.get_extents().extents.tolist() for path in cells.get_paths()]
    assert boxes == [[0, 0, 25, 25], [25, 0, 50, 25], [50, 25, 75, 50]]
    red, blue = (1.0, 0.8, 0.8), (0.8, 0.8, 1.0)
    assert [tuple(colour[:3]) for colour in cells.get_facecolors()] == [red, blue, red]
    assert axes.get_legend_handles_labels()[1] == ["mapped cells"]


def test_objects_and_sightings_are_drawn_at_their_positions(axes: Axes) -> None:
    sightings = [{"x_m": x_m, "y_m": y_m} for x_m, y_m in ((11.0, 20.0), (9.0, 21.0), (41.0, 52.0))]
    objects = {"object": [{"position_m": [10.0, 20.0], "classification": "wreck"}]}
    seen = SimpleNamespace(scenario_tables=objects, rows={"sightings": sightings}.__getitem__)
    assert draw_objects(axes, seen, STYLE).endswith("n = 3 sightings.")
    drawn = [one.get_offsets().tolist() for one in axes.collections]
    assert drawn == [[[11.0, 20.0], [9.0, 21.0], [41.0, 52.0]], [], [[10.0, 20.0]]]
    assert [one.get_text() for one in axes.texts] == ["wreck"]
    assert axes.get_legend_handles_labels()[1] == ["sighting", "object"]
    blind = SimpleNamespace(scenario_tables=objects, rows=lambda name: [])
    assert draw_objects(Sheet().subplots(), blind, STYLE).endswith("n = 0 sightings.")
    none = SimpleNamespace(scenario_tables={})
    assert draw_objects(Sheet().subplots(), none, STYLE) == ""
