"""What a mission adds to the figures of its runs: values, which name nothing of the package that draws them.

A mission declares places, and figures of three kinds: a ``Figure`` has a page of its own, a ``Layer`` is drawn into the
map of the tracks, a ``Mark`` shows milestones on the tracks. Their functions are handed axes to draw on, the results of
the run and the ``Style`` of all figures. The caller lays out the page, and lists the labelled artists in the legend. So
a figure of a mission needs no page, no colours and no file of its own::

    def draw(axes, results, style):
        rows = results.table("trajectories").to_pylist()
        for vehicle, look in style.looks.items():
            own = [(row["time_s"], row["speed_mps"]) for row in rows if row["vehicle"] == vehicle]
            axes.plot(*zip(*own), color=look.colour, linestyle=look.line, label=vehicle)
        axes.set_xlabel(style.axis("time", "s"))
        axes.set_ylabel(style.axis("speed", "m/s"))
        return "Speed through the water as each vehicle measures it."

    SPEED = Figure("speed", "Speed of the vehicles over mission time", draw, needs=("trajectories",))

``draw`` may be tried on any axes, with anything that answers as results and style do:

>>> from types import SimpleNamespace
>>> from matplotlib.figure import Figure as Sheet
>>> def draw(axes, results, style):
...     times_s = [row["time_s"] for row in results.table("packets")]
...     axes.step(times_s, range(1, len(times_s) + 1), color=style.black, label="packets")
...     axes.set_xlabel(style.axis("time", "s"))
...     return "All packets count, lost or not."
>>> packets = Figure("packets", "Packets sent over mission time", draw, needs=("packets",))
>>> results = SimpleNamespace(table=lambda name: [{"time_s": 4.0}, {"time_s": 9.0}])
>>> style = SimpleNamespace(black="#000000", axis=lambda label, unit: f"{label} ({unit})")
>>> axes = Sheet().subplots()
>>> packets.draw(axes, results, style)
'All packets count, lost or not.'
>>> axes.get_xlabel()
'time (s)'
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from missions.errors import takes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PointM = tuple[float, float]
"""x east and y north, in metres."""


class RunResults(Protocol):
    """What figures read of a run, be it written to a folder or still in memory."""

    @property
    def summary(self) -> dict[str, Any]:
        """The figures of the run, as in ``summary.json``."""

    @property
    def manifest(self) -> dict[str, Any]:
        """What is needed to repeat the run, as in ``manifest.json``; ``scenario`` is its resolved scenario as TOML."""

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables that are there."""

    @property
    def scenario_tables(self) -> dict[str, Any]:
        """The resolved scenario as TOML has it."""

    def has(self, name: str) -> bool:
        """True if there is a table of that name."""

    def table(self, name: str) -> Any:
        """An Arrow table."""

    def rows(self, name: str) -> list[dict[str, Any]]:
        """Rows of a table by the names of its columns; none of a table that is not there."""


class VehicleLook(Protocol):
    """How one vehicle is drawn in all figures of a run."""

    @property
    def colour(self) -> str:
        """Colour, as ``#rrggbb``."""

    @property
    def line(self) -> Any:
        """Line style of matplotlib."""

    @property
    def marker(self) -> str:
        """Marker of matplotlib."""


class Style(Protocol):
    """What ``draw`` gets to draw with, so that all figures of a run look alike."""

    @property
    def looks(self) -> Mapping[str, VehicleLook]:
        """The look of every vehicle by its name, in the order of the scenario."""

    @property
    def black(self) -> str:
        """Colour of what is about the whole fleet."""

    @property
    def grey(self) -> str:
        """Colour of what stands behind."""

    def tint(self, colour: str, strength: float) -> tuple[float, float, float]:
        """The colour mixed with white: strength 1 is the colour, 0 is white."""

    def axis(self, label: str, unit: str = "") -> str:
        """Text of an axis: ``mission time (s)``; the label alone without a unit."""

    def time(self, time_s: float) -> str:
        """A time with its unit, for captions."""


STEPS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
"""Round numbers for the end of a scale."""


def round_up(value: float) -> float:
    """A round number that is not below the value; 1 for 0.

    >>> round_up(2053.0), round_up(130.0)
    (2500.0, 150.0)
    """
    if value <= 0.0:
        return 1.0
    size = 10.0 ** math.floor(math.log10(value))
    return next(step * size for step in STEPS if value <= step * size)


def axis_end_s(results: RunResults) -> float:
    """End of a time axis: a round time, so that runs of a scenario that end at about the same time share it."""
    return round_up(max(float(results.summary["mission_time_s"]), 1.0))


Draw = Callable[["Axes", RunResults, Style], str]
"""Draws on axes, and returns the sentences of the caption.

Called under the settings of all figures, once for each figure written. It must not open, save or resize a figure.
Artists with a label are listed in the legend.
"""


@dataclass(frozen=True)
class Figure:
    """A figure of a mission's own, one panel on a page.

    Args:
        name: kind of the figure, as a user types it; also the name of its file.
        title: begins the caption, without a full stop.
        draw: see ``Draw``.
        needs: tables without which there is nothing to draw; the figure is left out of results that lack one.
    """

    name: str
    title: str
    draw: Draw
    needs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Layer:
    """What a mission draws into the map of the tracks, below them; x east and y north in metres.

    Args:
        name: for messages.
        draw: see ``Draw``; called for each panel of the map. It leaves limits and labels of the axes alone.
        needs: tables without which there is nothing to draw; the layer is left out of results that lack one.
    """

    name: str
    draw: Draw
    needs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Tiles:
    """Squares that the work at a place consists of, each done on its own: a replay fills them in.

    Args:
        size_m: side of a square.
        squares: (column, row) of each by its number; its south-west corner is at column and row times ``size_m``.
        attribute: of the facts by which vehicles tell each other of one that is done: the subject is the place, the
            value the number of the square.
        table: of those that are done in truth, with the time.
        columns: of that table, which have column and row.
    """

    size_m: float
    squares: tuple[tuple[int, int], ...]
    attribute: str
    table: str
    columns: tuple[str, str]


@dataclass(frozen=True)
class Place:
    """A named place of the map; one that is called like a job of the mission is where that job is done.

    Args:
        name: written beside it.
        kind: word for the legend, the same for all places of a kind: ``rally point``.
        outline_m: one point, drawn as a mark, or the corners of a polygon; metres.
        tiles: what its work consists of; None where it is done as a whole, or where there is none.

    >>> Place("dock", "docking station", ())
    Traceback (most recent call last):
    ...
    ValueError: place 'dock' has no point: outline_m needs one point, or the corners of a polygon
    """

    name: str
    kind: str
    outline_m: tuple[PointM, ...]
    tiles: Tiles | None = None

    def __post_init__(self) -> None:
        if not self.outline_m:
            raise ValueError(
                f"place {self.name!r} has no point: outline_m needs one point, or the corners of a polygon"
            )


@dataclass(frozen=True)
class Mark:
    """Milestones of single vehicles that are marked on their tracks.

    Args:
        milestone: name of the milestones.
        label: what legend and caption call them: ``inspection broken off``.
    """

    milestone: str
    label: str


Declared = Figure | Layer | Mark
"""What a mission lists as its figures."""


def faults_of_figure(found: Any) -> Iterator[str]:
    """What is wrong with a figure, a layer or a mark as it is declared, in words.

    Args:
        found: what should be one of them.
    """
    if not isinstance(found, Figure | Layer | Mark):
        what = f"the class {found.__name__}" if isinstance(found, type) else f"a {type(found).__name__}"
        yield f"it is {what}; expected a remoras.Figure, Layer or Mark, such as Figure(name, title, draw)"
        return
    texts = {"milestone": found.milestone, "label": found.label} if isinstance(found, Mark) else {"name": found.name}
    texts |= {"title": found.title} if isinstance(found, Figure) else {}
    for part, given in texts.items():
        if not isinstance(given, str) or not given.strip():
            yield f"{part} = {given!r}: allowed: a text"
    if isinstance(found, Figure) and isinstance(found.name, str) and not _is_file_name(found.name):
        yield f"name = {found.name!r}: it is no name of a file: rename it, without / and without a dot in front"
    if isinstance(found, Mark):
        return
    if not callable(found.draw):
        yield f"draw = {found.draw!r}: allowed: a function draw(axes, results, style) that returns the caption"
    elif not takes(found.draw, 3):
        yield "draw cannot be called as draw(axes, results, style)"
    if isinstance(found.needs, str) or not all(isinstance(need, str) for need in found.needs):
        yield f"needs = {found.needs!r}: allowed: a tuple of names of tables"


def _is_file_name(name: str) -> bool:
    return bool(name) and not name.startswith(".") and not {"/", "\\"} & {*name}
