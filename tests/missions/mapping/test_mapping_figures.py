"""Figures of the mapping mission: drawn on any axes, from the rows of its own table."""

from types import SimpleNamespace
from typing import Any

import pyarrow as pa
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure as Sheet

from missions.figure import Figure, Layer, Mark
from missions.mapping.metrics import FIGURES, draw_coverage, draw_mapped_cells, draw_objects, first_mapped, places

ROWS = [(10.0, "A", 0, 0), (20.0, "B", 0, 0), (30.0, "B", 1, 0), (40.0, "A", 2, 1)]
"""B maps again what A has mapped: time (s), vehicle, column and row of the cell."""


class Style:
    """As the package that draws hands it in; the colours are those of this test."""

    black, grey = "#000000", "#666666"

    @property
    def looks(self) -> dict[str, SimpleNamespace]:
        return {name: SimpleNamespace(colour=colour, line="-") for name, colour in (("A", "red"), ("B", "blue"))}

    def tint(self, colour: str, strength: float) -> tuple[float, float, float]:
        return {"red": (1.0, 0.8, 0.8), "blue": (0.8, 0.8, 1.0)}.get(colour, (0.8, 0.8, 0.8))

    def axis(self, label: str, unit: str = "") -> str:
        return f"{label} in {unit}"

    def time(self, time_s: float) -> str:
        return f"{time_s} s"


def results(rows: list[tuple[Any, ...]] = ROWS) -> Any:
    names = ["time_s", "vehicle", "cell_x", "cell_y"]
    table = pa.table({name: [row[at] for row in rows] for at, name in enumerate(names)})
    return SimpleNamespace(
        summary={"mission_time_s": 100.0, "coverage_fraction": 0.75 if rows else 0.0},
        manifest={"scenario": "[world]\ncell_m = 25.0"},
        table=lambda name: {"coverage": table}[name],
    )


@pytest.fixture
def axes() -> Axes:
    return Sheet().subplots()


def test_a_cell_belongs_to_who_mapped_it_first() -> None:
    assert first_mapped(results()) == {(0, 0): (10.0, "A"), (1, 0): (30.0, "B"), (2, 1): (40.0, "A")}


def test_the_steps_end_at_the_share_of_the_summary(axes: Axes) -> None:
    draw_coverage(axes, results(), Style())
    steps = {line.get_label(): list(line.get_ydata()) for line in axes.get_lines()}
    assert steps["fleet"] == pytest.approx([0, 25, 50, 75, 75])  # three of four cells
    assert steps["A"] == pytest.approx([0, 25, 50, 50])
    assert steps["B"] == pytest.approx([0, 25, 25])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time in s", "mapped in %")


def test_without_rows_nobody_has_mapped_anything(axes: Axes) -> None:
    draw_coverage(axes, results([]), Style())
    assert {max(line.get_ydata()) for line in axes.get_lines()} == {0.0}
    assert draw_mapped_cells(Sheet().subplots(), results([]), Style()) == ""


def test_mapped_cells_are_squares_in_the_tint_of_who_came_first(axes: Axes) -> None:
    assert draw_mapped_cells(axes, results(), Style()).startswith("Cells are shaded in the colour")
    (cells,) = [one for one in axes.collections if isinstance(one, PolyCollection)]
    boxes = [path.get_extents().extents.tolist() for path in cells.get_paths()]
    assert boxes == [[0, 0, 25, 25], [25, 0, 50, 25], [50, 25, 75, 50]]
    red, blue = (1.0, 0.8, 0.8), (0.8, 0.8, 1.0)
    assert [tuple(colour[:3]) for colour in cells.get_facecolors()] == [red, blue, red]
    assert axes.get_legend_handles_labels()[1] == ["mapped cells"]


def test_places_are_points_to_meet_at_and_areas() -> None:
    scenario: Any = SimpleNamespace(
        area=[SimpleNamespace(name="bay", corners_m=((0, 0), (0, 9), (9, 9)))],
        rally_point=[SimpleNamespace(name="buoy", position_m=(1.0, 2.0))],
        world=SimpleNamespace(cell_m=5.0),
    )
    found = {place.name: (place.kind, place.outline_m) for place in places(scenario)}
    assert found == {
        "buoy": ("rally point", ((1.0, 2.0),)), "bay": ("area to map", ((0.0, 0.0), (0.0, 9.0), (9.0, 9.0))),
    }  # fmt: skip


def test_the_mission_declares_a_figure_a_layer_and_marks() -> None:
    assert [(type(one), getattr(one, "name", None) or one.milestone) for one in FIGURES] == [
        (Figure, "coverage"), (Layer, "mapped cells"), (Layer, "objects"), (Mark, "mapping_stopped"),
        (Mark, "found"), (Mark, "inspected"),
    ]  # fmt: skip


def test_objects_stand_where_they_lie_and_a_cross_where_each_was_seen(axes: Axes) -> None:
    sightings = pa.table({"x_m": [11.0, 9.0, 41.0], "y_m": [20.0, 21.0, 52.0]})
    objects = "[[object]]\nposition_m = [10.0, 20.0]\nclassification = 'wreck'\n"
    tables = {"sightings": sightings}
    seen = SimpleNamespace(manifest={"scenario": objects}, has=tables.__contains__, table=tables.__getitem__)
    assert draw_objects(axes, seen, Style()).endswith("n = 3 sightings.")
    drawn = [one.get_offsets().tolist() for one in axes.collections]
    assert drawn == [[[11.0, 20.0], [9.0, 21.0], [41.0, 52.0]], [], [[10.0, 20.0]]]
    assert [one.get_text() for one in axes.texts] == ["wreck"]
    assert axes.get_legend_handles_labels()[1] == ["seen there", "object"]
    blind = SimpleNamespace(manifest=seen.manifest, has=lambda name: False)
    assert draw_objects(Sheet().subplots(), blind, Style()).endswith("n = 0 sightings.")
    none = SimpleNamespace(manifest={"scenario": ""})
    assert draw_objects(Sheet().subplots(), none, Style()) == ""
