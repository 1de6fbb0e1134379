"""Footprints: a map of instances for each strategy that shows on which it does well, and the numbers behind it."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from visualisation import style
from visualisation.output import DrawingError, check_format
from visualisation.page import Legend, Page, PanelGrid

NAME = "footprints"
"""Name of the files, without suffix."""
COLUMNS = 3
LEFT_IN, RIGHT_IN, TOP_IN, BODY_IN, GAP_IN, ROW_GAP_IN, AXIS_IN = 0.4, 0.1, 0.2, 1.5, 0.15, 0.12, 0.42
ELSEWHERE = "longer"
WELL = "within 3 % of the best"


class InstancePoint(NamedTuple):
    """One instance: its number, its place in the plane, and for each strategy whether it does well there."""

    number: int
    x: float
    y: float
    well: tuple[bool, ...]


class Footprints(NamedTuple):
    """Instances in a plane.

    Attributes:
        strategies: in the order of ``well``.
        instances: with their places.
        axes: what each axis is.
    """

    strategies: tuple[str, ...]
    instances: tuple[InstancePoint, ...]
    axes: tuple[str, str]


def footprint_contents(found: Footprints, caption: str, format: str) -> list[tuple[str, bytes]]:
    """Names and contents of the files: figure, caption, numbers.

    Args:
        found: what is drawn.
        caption: of the figure.
        format: png, svg or pdf.

    Raises:
        DrawingError: the format is not known, or there is nothing to draw.
    """
    check_format(format)
    return [
        (f"{NAME}.{format}", style.rendered(footprint_figure(found), format)),
        (f"{NAME}.txt", f"{caption}\n".encode()),
        (f"{NAME}.csv", _csv(found)),
    ]


def footprint_figure(found: Footprints) -> Figure:
    """A panel for each strategy, the one that does well most often first; filled where it does, hollow elsewhere.

    Raises:
        DrawingError: there is nothing to draw.
    """
    if not found.instances or not found.strategies:
        raise DrawingError("footprints need instances and strategies, and there are none")
    n = len(found.instances)
    counts = [sum(instance.well[at] for instance in found.instances) for at in range(len(found.strategies))]
    order = sorted(range(len(counts)), key=lambda at: (-counts[at], found.strategies[at]))
    with style.paper():
        entries = tuple(
            Line2D([], [], linestyle="", marker="o", color=style.BLACK, markerfacecolor=face, label=label)
            for face, label in ((style.BLACK, WELL), ("none", ELSEWHERE))
        )
        legend = Legend(entries, style.PAGE_IN)
        grid = PanelGrid(len(order), COLUMNS, style.PAGE_IN, LEFT_IN, RIGHT_IN, TOP_IN, BODY_IN, GAP_IN, ROW_GAP_IN)
        page = Page(style.PAGE_IN, grid.height_in + AXIS_IN + legend.height_in + 0.08)
        panels = page.open_panels(grid, [f"{found.strategies[at]}, {counts[at] / n:.0%}" for at in order])
        for number, (axes, at) in enumerate(zip(panels, order, strict=True)):
            for well, face in ((False, "none"), (True, style.BLACK)):
                drawn = [instance for instance in found.instances if instance.well[at] == well]
                axes.plot(
                    [instance.x for instance in drawn],
                    [instance.y for instance in drawn],
                    linestyle="",
                    marker="o",
                    color=style.BLACK,
                    markerfacecolor=face,
                    markeredgewidth=0.5,
                )
            axes.tick_params(labelleft=number % COLUMNS == 0, labelbottom=number >= len(order) - COLUMNS)
            _share_limits(axes, found.instances)
        panels[(len(order) - 1) // COLUMNS // 2 * COLUMNS].set_ylabel(found.axes[1], labelpad=2)
        panels[min(len(order) - 1, len(order) - COLUMNS + 1)].set_xlabel(found.axes[0], labelpad=2)
        page.legend(legend)
    return page.figure


def _share_limits(axes: object, instances: Sequence[InstancePoint]) -> None:
    """All panels show the same part of the plane."""
    for values, limit in (([one.x for one in instances], "set_xlim"), ([one.y for one in instances], "set_ylim")):
        room = 0.06 * (max(values) - min(values)) or 1.0
        getattr(axes, limit)(min(values) - room, max(values) + room)


def _csv(found: Footprints) -> bytes:
    """A line for each instance."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(("instance", "x", "y", *found.strategies))
    lines.writerows(
        (instance.number, f"{instance.x:.6g}", f"{instance.y:.6g}", *map(int, instance.well))
        for instance in found.instances
    )
    return text.getvalue().encode()
