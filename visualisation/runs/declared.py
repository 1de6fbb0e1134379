"""Figures and layers that a mission declares: its functions are called here, and answer for what they return."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.axes import Axes

from missions.figure import Figure, Layer, RunResults
from visualisation import style, words
from visualisation.output import DrawingError
from visualisation.page import LEGEND_UP_IN, Box, DrawnPage, Legend, Page
from visualisation.runs import captions, reading

LEFT_IN, RIGHT_IN, TOP_IN, BODY_IN, BOTTOM_IN = 0.5, 0.14, 0.08, 1.9, 0.36
"""Least room on each side of the panel, and its height."""
EDGE_IN = 0.03
NAME_ROOM_IN = 1.2
LEAST_IN = 1.0
"""Least width of the panel."""


class Kit:
    """The ``missions.figure.Style`` of a run: what its mission's functions draw with."""

    black, grey = style.BLACK, style.GREY

    def __init__(self, results: RunResults) -> None:
        self.looks: Mapping[str, style.Look] = {
            name: style.vehicle_look(number) for number, name in enumerate(reading.vehicle_names(results))
        }

    def tint(self, colour: str, strength: float) -> tuple[float, float, float]:
        """The colour mixed with white: strength 1 is the colour, 0 is white."""
        return style.tint(colour, strength)

    def axis(self, label: str, unit: str = "") -> str:
        """Text of an axis."""
        return words.axis(label, unit)

    def time(self, time_s: float) -> str:
        """A time with its unit, for captions."""
        return words.time(time_s)


def draw_declared(what: Figure | Layer, axes: Axes, results: RunResults) -> str:
    """Let a mission draw on axes, and return the sentences for the caption.

    Raises:
        DrawingError: its function raised, or returned something else than text.
    """
    try:
        text: object = what.draw(axes, results, Kit(results))
    except Exception as error:
        raise _failed(what, error) from error
    if not isinstance(text, str):
        raise DrawingError(
            f"{_named(what)}: its draw returned {text!r}, a {type(text).__name__}; it has to return the sentences of "
            "the caption as text, which may be empty"
        )
    return text


def declared_picture(figure: Figure, results: RunResults, width_in: float = style.COLUMN_IN) -> DrawnPage:
    """A mission's figure on a page of that width, with the legend of all labelled artists below."""
    with style.paper():
        page = Page(width_in, TOP_IN + BODY_IN + BOTTOM_IN)
        axes = page.panel(Box(LEFT_IN, TOP_IN, width_in - LEFT_IN - RIGHT_IN, BODY_IN))
        axes.spines[["top", "right"]].set_visible(False)
        text = draw_declared(figure, axes, results)
        try:
            _fit(page, axes)
            page.figure.draw_without_rendering()
        except Exception as error:  # such as a text that is no formula
            raise _failed(figure, error) from error
    heading = f"{figure.title.rstrip('.')}."
    return DrawnPage(page.figure, words.joined(heading, text, captions.run_conditions(results)))


def _fit(page: Page, axes: Axes) -> None:
    """Give labels the room that they take, and the legend its place."""
    handles, names = axes.get_legend_handles_labels()
    for handle, name in zip(handles, names, strict=True):
        handle.set_label(style.fitted(name, NAME_ROOM_IN, style.SMALL_PT))
    legend = Legend(tuple(handles), page.width_in - 0.1)
    needed = page.overhang(axes)
    left_in, right_in = max(LEFT_IN, needed.left_in + EDGE_IN), max(RIGHT_IN, needed.right_in + EDGE_IN)
    top_in, bottom_in = max(TOP_IN, needed.top_in + EDGE_IN), max(BOTTOM_IN, needed.bottom_in + EDGE_IN)
    legend_in = legend.height_in + LEGEND_UP_IN + 0.02 if legend.entries else 0.0
    box = Box(left_in, top_in, max(LEAST_IN, page.width_in - left_in - right_in), BODY_IN)
    page.refit(top_in + BODY_IN + bottom_in + legend_in, axes, box)
    page.legend(legend)


def _failed(what: Figure | Layer, error: Exception) -> DrawingError:
    return DrawingError(f"{_named(what)}: its draw raised {type(error).__name__}: {error}")


def _named(what: Figure | Layer) -> str:
    return f"the mission's {type(what).__name__.lower()} {what.name!r}"
