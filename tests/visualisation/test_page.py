"""A page has the lengths that it was told, in inches."""

import pytest
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from visualisation import style
from visualisation.page import Box, Legend, Page, PanelGrid


def box_of(page: Page, axes: Axes) -> Box:
    """Where axes are, from what Matplotlib says in shares of the figure from its bottom left corner."""
    place = axes.get_position()
    width_in, height_in = page.figure.get_size_inches()
    return Box(
        place.x0 * width_in, (1 - place.y1) * height_in, (place.x1 - place.x0) * width_in,
        (place.y1 - place.y0) * height_in,
    )  # fmt: skip


def test_a_panel_is_where_its_box_is() -> None:
    page = Page(7.2, 3.0)
    box = Box(0.5, 0.25, 2.0, 1.5)
    assert box_of(page, page.panel(box)) == pytest.approx(box)


def test_panels_of_a_grid_stand_in_rows_and_fill_the_page() -> None:
    grid = PanelGrid(5, 3, 7.2, 0.6, 0.1, 0.25, 1.5, gap_in=0.7, row_gap_in=0.3)
    boxes = grid.boxes
    assert [round(box.left_in, 9) for box in boxes[:3]] == [
        0.6, round(0.6 + grid.panel_in + 0.7, 9), round(0.6 + 2 * (grid.panel_in + 0.7), 9)
    ]  # fmt: skip
    assert boxes[2].left_in + boxes[2].width_in == pytest.approx(7.2 - 0.1)
    assert [box.top_in for box in boxes] == pytest.approx([0.25] * 3 + [0.25 + 1.5 + 0.3 + 0.25] * 2)
    assert grid.height_in == pytest.approx(boxes[-1].top_in + 1.5)


def test_a_longer_page_keeps_its_panels_in_inches() -> None:
    page = Page(3.5, 2.0)
    boxes = [Box(0.4, 0.1, 1.0, 1.2), Box(2.0, 0.3, 1.0, 0.5)]
    panels = [page.panel(box) for box in boxes]
    page.extend(0.7)
    assert page.height_in == pytest.approx(2.7)
    for axes, box in zip(panels, boxes, strict=True):
        assert box_of(page, axes) == pytest.approx(box)


def test_a_legend_has_as_many_columns_as_have_room_and_its_height_counts_lines() -> None:
    entries = tuple(Line2D([], [], label=name) for name in ("one", "two", "three", "four", "five"))
    wide, narrow = Legend(entries, 7.0), Legend(entries, 0.5)
    assert wide.columns == 5
    assert narrow.columns == 1
    assert Legend(entries, 7.0, most=3).columns == 3
    assert narrow.height_in == pytest.approx(5 * style.LEGEND_LINE_IN)
    assert Legend((), 7.0).height_in == 0.0


def test_open_panels_have_letters_and_titles_that_fit() -> None:
    grid = PanelGrid(2, 2, 3.5, 0.5, 0.1, 0.2, 1.0, gap_in=0.5)
    with style.paper():
        page = Page(3.5, 1.5)
        titles = [axes.get_title(loc="left") for axes in page.open_panels(grid, ["short", "far too long for a panel"])]
    assert titles[0] == "(a) short"
    assert titles[1].startswith("(b) far")
    assert titles[1].endswith("\u2026")
