"""Where the vehicles went: areas, mapped cells, tracks, rally points (figure 6 of the REMORAS paper)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from matplotlib.ticker import MaxNLocator

from missions.runs.results import Results
from visualisation import labels, style
from visualisation.labels import Label
from visualisation.runs import reading, windows
from visualisation.runs.reading import Place, PointM, Span, Track

TOP_IN, BOTTOM_IN = 0.2, 0.4
BESIDE_IN = 0.26
"""Room for a y label; the room for tick labels comes on top."""
LARGE_IN = 3.55
"""Width of the panel of the whole mission where others stand beside it."""
TALLEST, LOWEST = 1.25, 0.6
NAME_ROOM_IN = 1.4
LEAST_EXTENT_M = 20.0
CLOSE = 0.4
"""Ends this near together, relative to the panel before, get a panel of their own."""
SHADE = 0.16


class Frame(NamedTuple):
    """A rectangle of the sea."""

    west_m: float
    south_m: float
    east_m: float
    north_m: float

    def filling(self, shape: float) -> Frame:
        """Widened with a margin until height over width is ``shape``."""
        width_m = max(1.15 * (self.east_m - self.west_m), LEAST_EXTENT_M)
        height_m = max(1.15 * (self.north_m - self.south_m), LEAST_EXTENT_M)
        width_m, height_m = max(width_m, height_m / shape), max(height_m, width_m * shape)
        x_m, y_m = (self.west_m + self.east_m) / 2, (self.south_m + self.north_m) / 2
        return Frame(x_m - width_m / 2, y_m - height_m / 2, x_m + width_m / 2, y_m + height_m / 2)

    def holds(self, point_m: PointM) -> bool:
        """Whether a point lies in it."""
        return self.west_m <= point_m[0] <= self.east_m and self.south_m <= point_m[1] <= self.north_m

    @property
    def shape(self) -> float:
        """Height over width; 1 for a point."""
        high_m, wide_m = self.north_m - self.south_m, self.east_m - self.west_m
        return (high_m + LEAST_EXTENT_M) / (wide_m + LEAST_EXTENT_M)

    @property
    def size_m(self) -> float:
        """The longer side."""
        return max(self.east_m - self.west_m, self.north_m - self.south_m)


class Symbol(NamedTuple):
    """A mark with black edge."""

    marker: str
    meaning: str
    size_pt: float
    face: str

    def at(self, *where: float) -> Line2D:
        """The mark at x, y; without them, its entry in the legend."""
        x, y = where or ((), ())
        return Line2D(
            np.atleast_1d(x), np.atleast_1d(y), linestyle="none", marker=self.marker, markersize=self.size_pt,
            markerfacecolor=self.face, markeredgecolor=style.BLACK, markeredgewidth=0.6, zorder=5,
            label=self.meaning,
        )  # fmt: skip


START = Symbol("o", "start", 5.5, "white")
END = Symbol("s", "end", 4.5, style.GREY)
GIVEN_UP = Symbol("X", "mapping given up", 6.5, style.YELLOW)
RALLY = Symbol("*", "rally point", 8.0, style.YELLOW)


class Scene(NamedTuple):
    """All that there is to draw."""

    tracks: dict[str, Track]
    looks: dict[str, style.Look]
    areas: list[Place]
    rally_points: list[Place]
    cells: dict[tuple[int, int], tuple[float, str]]
    cell_m: float
    given_up: dict[str, float]
    end_s: float


class Panel(NamedTuple):
    """One map: what it is called, which part of the sea and of the mission it shows."""

    title: str
    frame: Frame
    span: Span


def figure(results: Results) -> Figure:
    """The whole mission; beside it its eventful stretch, and where the vehicles end, if these say more."""
    scene = _scene(results)
    panels = _panels(scene, windows.eventful(reading.eventful_times_s(results), scene.end_s))
    with style.paper():
        whole = panels[0].frame
        digits_in = max(style.width_in(f"{bound:.0f}", style.SMALL_PT) for bound in (*whole, 1000.0))
        left_in, right_in = BESIDE_IN + digits_in, digits_in / 2 + 0.02
        if len(panels) == 1:
            width_in, large_in = style.COLUMN_IN, style.COLUMN_IN - left_in - right_in
        else:
            width_in, large_in = style.PAGE_IN, LARGE_IN
        body_in = large_in * min(TALLEST, max(LOWEST, whole.shape))
        legend = _legend(scene)
        n_columns = style.legend_columns([str(entry.get_label()) for entry in legend], width_in - 0.1)
        legend_in = style.legend_height_in(len(legend), n_columns) + 0.05
        height_in = TOP_IN + body_in + BOTTOM_IN + legend_in
        drawn = style.blank(width_in, height_in)
        floor_in = legend_in + BOTTOM_IN
        boxes = [(left_in, floor_in, large_in, body_in)]
        n_small = len(panels) - 1
        small_in = width_in - 2 * left_in - large_in - right_in
        each_in = (body_in - BOTTOM_IN * (n_small - 1)) / max(1, n_small)
        for number in range(n_small):
            up_in = floor_in + (n_small - 1 - number) * (each_in + BOTTOM_IN)
            boxes.append((2 * left_in + large_in, up_in, small_in, each_in))
        for number, (panel, box) in enumerate(zip(panels, boxes, strict=True)):
            x_in, y_in, wide_in, high_in = box
            axes = drawn.add_axes((x_in / width_in, y_in / height_in, wide_in / width_in, high_in / height_in))
            title = f"({'abc'[number]}) {panel.title}" if n_small else panel.title
            axes.set_title(title, loc="left", pad=3)
            _draw(axes, scene, panel, (wide_in, high_in), lowest=number in (0, n_small))
        drawn.legend(handles=legend, loc="lower center", bbox_to_anchor=(0.5, 0.02 / height_in), ncols=n_columns)
    return drawn


def _scene(results: Results) -> Scene:
    names = reading.vehicles(results)
    return Scene(
        tracks=reading.tracks(results),
        looks={name: style.look(number) for number, name in enumerate(names)},
        areas=reading.areas(results),
        rally_points=reading.rally_points(results),
        cells=reading.first_mapped(results),
        cell_m=float(reading.scenario(results)["world"]["cell_m"]),
        given_up={m.vehicle: m.time_s for m in reading.milestones(results) if m.name == "mapping_stopped"},
        end_s=reading.end_s(results),
    )


def _panels(scene: Scene, eventful: Span | None) -> list[Panel]:
    corners = [corner for place in (*scene.areas, *scene.rally_points) for corner in place.corners_m]
    everything = _frame([*_points(scene.tracks.values()), *corners])
    mission = Span(0.0, scene.end_s)
    panels = [Panel(f"whole mission, 0 to {scene.end_s:.0f} s", everything, mission)]
    if not scene.tracks or everything.size_m < LEAST_EXTENT_M:
        return panels
    if eventful is not None:
        moves = [track.between(*eventful) for track in scene.tracks.values()]
        title = f"{eventful.start_s:.0f} to {eventful.end_s:.0f} s"
        panels.append(Panel(title, _frame(_points(moves)), eventful))
    at_end = [track.at(scene.end_s) for track in scene.tracks.values()]
    ends = _frame([*at_end, *(point.corners_m[0] for point in scene.rally_points)])
    if ends.size_m >= CLOSE * panels[-1].frame.size_m:
        ends = _frame(at_end)
    if ends.size_m < CLOSE * panels[-1].frame.size_m and len(at_end) > 1:
        panels.append(Panel("where the vehicles end", ends, eventful or mission))
    return panels


def _points(tracks: Iterable[Track]) -> list[PointM]:
    return [
        (float(x_m), float(y_m))
        for track in tracks
        if track.time_s.size
        for x_m in (track.x_m.min(), track.x_m.max())
        for y_m in (track.y_m.min(), track.y_m.max())
    ]


def _frame(points: Sequence[PointM]) -> Frame:
    xs, ys = [x for x, _ in points] or [0.0], [y for _, y in points] or [0.0]
    return Frame(min(xs), min(ys), max(xs), max(ys))


def _draw(axes: Axes, scene: Scene, panel: Panel, size_in: tuple[float, float], lowest: bool) -> None:
    frame = panel.frame.filling(size_in[1] / size_in[0])
    axes.set_xlim(frame.west_m, frame.east_m)
    axes.set_ylim(frame.south_m, frame.north_m)
    axes.xaxis.set_major_locator(MaxNLocator(max(2, int(size_in[0] / 0.55)), steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_locator(MaxNLocator(max(2, int(size_in[1] / 0.3)), steps=[1, 2, 5, 10]))
    axes.set_ylabel("y north / m", labelpad=2)
    if lowest:
        axes.set_xlabel("x east / m", labelpad=2)
    _ground(axes, scene)
    step_s = reading.marker_step_s(panel.span.end_s - panel.span.start_s)
    for name, track in scene.tracks.items():
        look = scene.looks[name]
        if panel.span.start_s > 0:
            axes.plot(track.x_m, track.y_m, color=style.tint(look.colour, 0.25), linewidth=0.5, zorder=2)
        part = track.between(*panel.span)
        axes.plot(part.x_m, part.y_m, color=look.colour, linestyle=look.line, linewidth=0.9, zorder=3)
        _time_marks(axes, track, look, panel.span, step_s)
    keep_clear = _marks(axes, scene, panel.span)
    names = [Label(place.name, *place.corners_m[0]) for place in scene.rally_points]
    names += [_area_label(area) for area in scene.areas]
    labels.place(axes, [name for name in names if frame.holds((name.x, name.y))], keep_clear)


def _area_label(area: Place) -> Label:
    frame = _frame(area.corners_m)
    x_m, y_m = (frame.west_m + frame.east_m) / 2, (frame.south_m + frame.north_m) / 2
    return Label(area.name, x_m, y_m, frame.east_m - frame.west_m)


def _ground(axes: Axes, scene: Scene) -> None:
    size_m = scene.cell_m
    squares = [
        [(c * size_m, r * size_m), ((c + 1) * size_m, r * size_m),
         ((c + 1) * size_m, (r + 1) * size_m), (c * size_m, (r + 1) * size_m)]
        for c, r in scene.cells
    ]  # fmt: skip
    colours = [style.tint(scene.looks[vehicle].colour, SHADE) for _, vehicle in scene.cells.values()]
    cells = PolyCollection(squares, facecolors=colours, edgecolors="face", linewidths=0.3, zorder=0)
    axes.add_collection(cells, autolim=False)
    for area in scene.areas:
        axes.add_patch(Polygon(area.corners_m, fill=False, edgecolor=style.GREY, linewidth=0.8, zorder=1))


def _time_marks(axes: Axes, track: Track, look: style.Look, span: Span, step_s: float) -> None:
    count = int(span.end_s / step_s)
    times_s = [n * step_s for n in range(1, count + 1) if span.start_s < n * step_s < span.end_s]
    points = [track.at(time_s) for time_s in times_s if time_s <= track.time_s[-1]]
    axes.plot(
        [x for x, _ in points], [y for _, y in points], color=look.colour, linestyle="none",
        marker=look.marker, markeredgecolor="white", markeredgewidth=0.3, zorder=4,
    )  # fmt: skip


def _marks(axes: Axes, scene: Scene, span: Span) -> list[PointM]:
    marks = [(place.corners_m[0], RALLY) for place in scene.rally_points]
    for name, track in scene.tracks.items():
        if span.start_s == 0:
            marks.append((track.at(0.0), START))
        if span.end_s == scene.end_s:
            marks.append((track.at(scene.end_s), END._replace(face=scene.looks[name].colour)))
        if name in scene.given_up and span.start_s <= scene.given_up[name] <= span.end_s:
            marks.append((track.at(scene.given_up[name]), GIVEN_UP))
    for (x_m, y_m), symbol in marks:
        axes.add_line(symbol.at(x_m, y_m))
    return [point_m for point_m, _ in marks]


def _legend(scene: Scene) -> list[Artist]:
    entries: list[Artist] = [
        Line2D(
            [], [], color=look.colour, linestyle=look.line, marker=look.marker, markeredgecolor="white",
            markeredgewidth=0.3, label=style.fitted(name, NAME_ROOM_IN, style.SMALL_PT), linewidth=0.9,
        )
        for name, look in scene.looks.items()
    ]  # fmt: skip
    entries += [START.at(), END.at()] if scene.tracks else []
    entries += [GIVEN_UP.at()] if scene.given_up else []
    entries += [RALLY.at()] if scene.rally_points else []
    if scene.areas:
        entries.append(Patch(facecolor="none", edgecolor=style.GREY, linewidth=0.8, label="area to map"))
    if scene.cells:
        entries.append(Patch(facecolor=style.tint(style.BLACK, SHADE), edgecolor="none", label="mapped cells"))
    return entries
