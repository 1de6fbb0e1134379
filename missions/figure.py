"""Figures of missions, declared independently of the drawing package.

A ``Figure`` has its own page, a ``Layer`` is drawn into the map of tracks, a ``Mark`` shows milestones on tracks. Their
functions receive axes, the results of a run and the common ``Style``. The caller lays out the page and lists labelled
artists in the legend. A figure therefore needs no page, colours or file::

    def draw(axes, results, style):
        rows = results.table("trajectories").to_pylist()
        for vehicle, look in style.looks.items():
            own = [(row["time_s"], row["speed_mps"]) for row in rows if row["vehicle"] == vehicle]
            axes.plot(*zip(*own), color=look.colour, linestyle=look.line, label=vehicle)
        axes.set_xlabel(style.axis("time", "s"))
        axes.set_ylabel(style.axis("speed", "m/s"))
        return "Speed through the water as each vehicle measures it."

    SPEED = Figure("speed", "Speed of the vehicles over mission time", draw, needs=("trajectories",))

``draw`` works with any axes and with any objects that have the interfaces of results and style:

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
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from missions.errors import takes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PointM = tuple[float, float]
"""x east and y north, in metres."""


class RunResults(Protocol):
    """Results of a run for figures, in a folder or in memory."""

    @property
    def summary(self) -> dict[str, Any]:
        """Metrics of the run, as in ``summary.json``."""

    @property
    def manifest(self) -> dict[str, Any]:
        """Data to repeat the run, as in ``manifest.json``; ``scenario`` is the resolved TOML text."""

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the available tables."""

    @property
    def scenario_tables(self) -> dict[str, Any]:
        """Resolved scenario as parsed TOML."""

    @property
    def ended_s(self) -> float:
        """Time (s) at which the run ended, even if early without success; of one under way, its time."""

    def has(self, name: str) -> bool:
        """Return True if the table exists."""

    def table(self, name: str) -> Any:
        """Return an Arrow table."""

    def rows(self, name: str) -> list[dict[str, Any]]:
        """Return rows as dictionaries; empty for a missing table."""


class VehicleLook(Protocol):
    """Appearance of a vehicle in all figures of a run."""

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
    """Common style of all figures of a run."""

    @property
    def looks(self) -> Mapping[str, VehicleLook]:
        """Appearance of every vehicle, in scenario order."""

    @property
    def black(self) -> str:
        """Colour for the whole fleet."""

    @property
    def grey(self) -> str:
        """Colour for the background."""

    def tint(self, colour: str, strength: float) -> tuple[float, float, float]:
        """Mix the colour with white: strength 1 is the colour, 0 is white."""

    def axis(self, label: str, unit: str = "") -> str:
        """Axis text: ``mission time (s)``; the label alone without a unit."""

    def time(self, time_s: float) -> str:
        """Format a time with its unit for captions."""


STEPS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
"""Round numbers for the end of a scale."""


def round_up(value: float) -> float:
    """Round up to a round number, such as 2500 for 2053; 1 for values up to 0."""
    if value <= 0.0:
        return 1.0
    # The greatest step is a whole decade, so one always suffices.
    size = 10.0 ** math.floor(math.log10(value))
    return next(step * size for step in STEPS if value <= step * size)


def run_end_s(results: RunResults) -> float:
    """Return the end of the run, at least 1 s, so that it can be an axis."""
    return max(results.ended_s, 1.0)


def draw_counts(
    axes: Axes, results: RunResults, style: Style, curves: Iterable[tuple[str, Iterable[float], str, str]], label: str
) -> None:
    """Draw cumulative counts over time: label, times (s), line style and colour of each curve."""
    end_s = run_end_s(results)
    for name, times_s, line, colour in curves:
        ordered = sorted(times_s)
        axes.step([0.0, *ordered, end_s], [*range(len(ordered) + 1), len(ordered)], where="post", linestyle=line,
                  color=colour, label=name)  # fmt: skip
    axes.set_xlim(0.0, end_s)
    axes.set_xlabel(style.axis("time", "s"))
    axes.set_ylabel(style.axis(label))


Draw = Callable[["Axes", RunResults, Style], str]
"""Draw on axes and return the sentences of the caption; labelled artists appear in the legend.

Called once per written figure with the settings of all figures. It must not open, save or resize figures.
"""


@dataclass(frozen=True)
class Figure:
    """A figure with one panel on its own page, omitted without the tables that it ``needs``.

    ``name`` is kind and file name; ``title`` starts the caption, without a full stop.

    >>> Figure("speed", "Speed over time", lambda axes, results, style: "").needs
    ()
    """

    name: str
    title: str
    draw: Draw
    needs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Layer:
    """A layer below the tracks of the map, drawn once per panel; it must not change limits. ``needs`` as in Figure.

    >>> Layer("wrecks", lambda axes, results, style: "", needs=("finds",)).needs
    ('finds',)
    """

    name: str
    draw: Draw
    needs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Tiles:
    """Squares of work at a place, each done separately, which a replay fills in.

    ``squares`` are (column, row) by number; ``attribute`` is that of facts about a done square, with the place as
    subject and the number as value; ``columns`` name column and row in the ``table`` of squares truly done.
    """

    size_m: float
    squares: tuple[tuple[int, int], ...]
    attribute: str
    table: str
    columns: tuple[str, str]


@dataclass(frozen=True)
class Place:
    """A named place of the map, one point or the corners of a polygon; ValueError without a point.

    ``kind`` is the legend text, common to all places of a kind. The name of a job marks the job's place.

    >>> Place("buoy", "mooring", ((0.0, 50.0),)).tiles is None
    True
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
    """Milestones of single vehicles shown on their tracks; ``label`` is for legend and caption.

    >>> Mark("found", "first sight of a wreck").milestone
    'found'
    """

    milestone: str
    label: str


Declared = Figure | Layer | Mark


def faults_of_figure(declared: Any) -> Iterator[str]:
    """Yield the faults of a declared figure, layer or mark, in words."""
    if not isinstance(declared, Figure | Layer | Mark):
        actual = f"the class {declared.__name__}" if isinstance(declared, type) else f"a {type(declared).__name__}"
        yield f"it is {actual}; expected a remoras.Figure, Layer or Mark, such as Figure(name, title, draw)"
        return
    if isinstance(declared, Mark):
        texts = {"milestone": declared.milestone, "label": declared.label}
    else:
        texts = {"name": declared.name}
    texts |= {"title": declared.title} if isinstance(declared, Figure) else {}
    for part, value in texts.items():
        if not isinstance(value, str) or not value.strip():
            yield f"{part} = {value!r}: allowed: a text"
    if isinstance(declared, Figure) and isinstance(declared.name, str) and not _is_file_name(declared.name):
        yield f"name = {declared.name!r}: it is no name of a file: rename it, without / and without a dot in front"
    if isinstance(declared, Mark):
        return
    if not callable(declared.draw):
        yield f"draw = {declared.draw!r}: allowed: a function draw(axes, results, style) that returns the caption"
    elif not takes(declared.draw, 3):
        yield "draw cannot be called as draw(axes, results, style)"
    if isinstance(declared.needs, str) or not all(isinstance(need, str) for need in declared.needs):
        yield f"needs = {declared.needs!r}: allowed: a tuple of names of tables"


def _is_file_name(name: str) -> bool:
    return bool(name) and not name.startswith(".") and not {"/", "\\"} & {*name}
