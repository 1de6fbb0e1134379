"""Figures and layers declared by a mission, with errors of their functions reported."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.axes import Axes

from missions import words
from missions.figure import Figure, Layer, RunResults
from visualisation import page, run_records, style
from visualisation.output import DrawingError
from visualisation.page import DrawnPage
from visualisation.runs import captions

BODY_IN = 1.9


class Kit:
    """Implement ``missions.figure.Style`` for the drawing functions of a mission."""

    black, grey = style.BLACK, style.GREY
    tint = staticmethod(style.tint)
    axis = staticmethod(words.axis)
    time = staticmethod(words.time)

    def __init__(self, results: RunResults) -> None:
        self.looks: Mapping[str, style.Look] = {
            name: style.vehicle_look(number) for number, name in enumerate(run_records.vehicle_names(results))
        }


def draw_declared(what: Figure | Layer, axes: Axes, results: RunResults) -> str:
    """Call a mission's drawing function; return its sentences for the caption, DrawingError if it failed."""
    try:
        # User code may raise anything and return anything.
        text: object = what.draw(axes, results, Kit(results))
    except (Exception, SystemExit) as error:
        raise _failed(what, error) from error
    if not isinstance(text, str):
        raise DrawingError(
            f"{_named(what)}: its draw returned {text!r}, a {type(text).__name__}; it has to return the sentences of "
            "the caption as text, which may be empty"
        )
    return text


def declared_picture(
    figure: Figure, results: RunResults, width_in: float | None = None, ax: Axes | None = None
) -> DrawnPage:
    """Draw a mission's figure on a page, or in a user's ``ax``, with a legend of all labelled artists."""
    with style.paper():
        (axes,) = [ax] if ax else page.panels(page.opened(width_in or style.COLUMN_IN, BODY_IN), 1, 1)
        drawn, text = page.figure_of(axes), draw_declared(figure, axes, results)
        handles, names = axes.get_legend_handles_labels()
        for handle, name in zip(handles, names, strict=True):
            handle.set_label(name)
        try:
            page.legend(ax or drawn, handles)
            if not ax:
                page.lay_out(drawn, [axes], BODY_IN)
        except Exception as error:  # such as a text that is no formula
            raise _failed(figure, error) from error
    heading = f"{figure.title.rstrip('.')}."
    return DrawnPage(drawn, words.joined(heading, text, captions.run_conditions(results)))


def _failed(part: Figure | Layer, error: BaseException) -> DrawingError:
    return DrawingError(f"{_named(part)}: its draw raised {type(error).__name__}: {error}")


def _named(part: Figure | Layer) -> str:
    return f"the mission's {type(part).__name__.lower()} {part.name!r}"
