"""Figure ``trajectories``: tracks on the map, and beside it the final positions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import cycle
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox

from missions import words
from missions.figure import Layer, Mark, Place, PointM, RunResults, run_end_s
from visualisation import page, run_records, style
from visualisation.output import DrawingError
from visualisation.page import DrawnPage, Label
from visualisation.run_records import Track, outages
from visualisation.runs import captions, declared

WIDTHS = (3.55, 2.25)  # width ratio of the whole-mission panel to that beside it
LEAST_FOR_TWO_IN = 5.5  # minimum page width for panels side by side
TALLEST, LOWEST = 1.25, 0.6
LEAST_EXTENT_M = 20.0
MARGIN_OF_MAP = 0.075  # space around the contents of a map, as a share of their extent
WHOLE = "whole mission"
CLOSE = 0.4  # maximum extent of end positions in their own panel, relative to the whole mission
MOST_NAMED = 16  # maximum number of vehicles in the legend, limited by distinguishable lines and markers
OTHERS = style.Look(style.GREY, "-", "")
BELOW = 0.1  # factor on the z-order of layers: keeps their order, below places and tracks


class Symbol(NamedTuple):
    """Mark with a black edge."""

    marker: str
    meaning: str
    size_pt: float
    face: str

    def at(self, *where: float) -> Line2D:
        """Return the mark at x, y; without coordinates, its legend entry."""
        x, y = where or ((), ())
        return Line2D(
            np.atleast_1d(x), np.atleast_1d(y), linestyle="none", marker=self.marker, markersize=self.size_pt,
            markerfacecolor=self.face, markeredgecolor=style.BLACK, markeredgewidth=0.6, zorder=5,
            label=self.meaning,
        )  # fmt: skip


START = Symbol("o", "start", 5.5, "white")
END = Symbol("s", "end", 4.5, style.GREY)
FAULT = Symbol("D", "fault", 4.5, style.BLACK)
MARKS = (("X", 4.8), ("d", 5.2), ("p", 4.8), ("v", 4.8))
"""Markers of milestones on tracks, in the order of their declaration; white, since they often lie on yellow places."""
POINTS = (("*", 10.0, "Stars"), ("P", 8.0, "Crosses"), ("^", 8.0, "Triangles"), ("H", 8.0, "Hexagons"))
"""Markers of point places by order of kind, with their names in captions."""
MOST_LISTED = 4  # maximum number of places of a kind, or events, that a caption lists
OUTLINES = (("-", "Outlines"), (style.LINES[1], "Dashed outlines"), (style.LINES[2], "Dotted outlines"))


class TrackEvent(NamedTuple):
    """Milestone or start of a fault, marked on the track of its vehicle."""

    vehicle: str
    time_s: float
    symbol: Symbol


class PlacesOfKind(NamedTuple):
    """Places of one kind, all points or all outlines: their name in captions, and symbol or line style."""

    kind: str
    places: list[Place]
    shape: str
    look: Any


class MapContents(NamedTuple):
    """Contents of the map."""

    tracks: dict[str, Track]
    looks: Mapping[str, style.Look]
    points: list[PlacesOfKind]
    outlines: list[PlacesOfKind]
    layers: list[Layer]
    events: list[TrackEvent]
    end_s: float
    out: frozenset[str] = frozenset()
    """Vehicles lost or without energy at the end; their last position is no end point."""


def picture(
    results: RunResults,
    places: Sequence[Place],
    layers: Sequence[Layer],
    marks: Sequence[Mark],
    width_in: float | None = None,
    panel: str = "",
    ax: Axes | None = None,
) -> DrawnPage:
    """Draw the whole mission; beside it the final positions if they are close together.

    ``layers`` lie below the tracks, those with missing tables are omitted with a note; ``marks`` are milestones on
    tracks. A ``width_in`` of None is a column of a paper, or a page with several panels. A ``panel`` is the letter of
    the only panel to draw; DrawingError for another one. A user's ``ax`` has one panel, the first by default.
    """
    shown = [layer for layer in layers if all(map(results.has, layer.needs))]
    notes = [
        f"{layer.name} are not shown in trajectories: these results have no table {', '.join(layer.needs)}"
        for layer in layers
        if layer not in shown
    ]
    scene = _scene(results, places, shown, marks)
    frames = _frames(scene)
    if panel := panel or page.LETTERS[: bool(ax)]:
        lettered = dict(zip(page.LETTERS, frames, strict=False))
        if panel not in lettered:
            known = ", ".join(f"{letter} ({title})" for letter, title in lettered.items())
            raise DrawingError(f"panel {panel!r}: the trajectories of this run have {known}")
        frames = {lettered[panel]: frames[lettered[panel]]}
    width_in = width_in or (style.PAGE_IN if len(frames) > 1 else style.COLUMN_IN)
    beside = len(frames) > 1 and width_in >= LEAST_FOR_TWO_IN
    letters = page.LETTERS[: len(frames)]
    rows = [list(letters)] if beside else [[letter] for letter in letters]
    with style.paper():
        figure = page.figure_of(ax) if ax else page.opened(width_in, width_in)
        columns = WIDTHS[: len(rows[0])]
        maps = [ax] if ax else list(figure.subplot_mosaic(rows, width_ratios=columns).values())  # type: ignore[arg-type]
        sentences, entries = "", []
        for letter, axes, title in zip(letters, maps, frames, strict=True):
            axes.set_title(f"({letter}) {title}" if len(frames) > 1 else title)
            sentences = _layers(axes, results, scene.layers)
            entries = axes.get_legend_handles_labels()[0]
            _draw(axes, scene)
        page.legend(ax or figure, (*_legend(scene), *entries))

        def bodies_in() -> list[float]:
            whole, widths_in = next(iter(frames.values())), [page.panel_in(axes)[0] for axes in maps]
            shape = (whole.height + LEAST_EXTENT_M) / (whole.width + LEAST_EXTENT_M)
            whole_in = widths_in[0] * min(TALLEST, max(LOWEST, shape))
            highs_in = [whole_in, *(whole_in if beside else LOWEST * wide_in for wide_in in widths_in[1:])]
            for axes, frame, wide_in, high_in in zip(maps, frames.values(), widths_in, highs_in, strict=True):
                shown = frame.padded(max(MARGIN_OF_MAP * _size_m(frame), LEAST_EXTENT_M / 2))
                # One scale for both directions, the larger of those that the panel needs.
                m_per_in = max(shown.width / wide_in, shown.height / high_in)
                shown = shown.expanded(m_per_in * wide_in / shown.width, m_per_in * high_in / shown.height)
                axes.set(xlim=shown.intervalx, ylim=shown.intervaly)
            return highs_in[: len(rows)]

        if ax:
            bodies_in()
            ax.set_aspect("equal")
            ax.apply_aspect()
        else:
            page.lay_out(figure, maps[: len(rows)], bodies_in)
        for axes in maps:
            # After the layout, since labels avoid each other by the final limits.
            _name_places(axes, scene)
    return DrawnPage(figure, _caption(results, scene, sentences), tuple(notes))


def _scene(results: RunResults, places: Sequence[Place], layers: Sequence[Layer], marks: Sequence[Mark]) -> MapContents:
    points: dict[str, list[Place]] = {}
    outlines: dict[str, list[Place]] = {}
    for place in places:
        (points if len(place.outline_m) == 1 else outlines).setdefault(place.kind, []).append(place)
    marked = zip(points.items(), cycle(POINTS), strict=False)
    lined = zip(outlines.items(), cycle(OUTLINES), strict=False)
    symbols = {
        mark.milestone: Symbol(marker, mark.label, size_pt, START.face)
        for mark, (marker, size_pt) in zip(marks, cycle(MARKS), strict=False)
    }
    tracks, end_s = run_records.tracks(results), run_end_s(results)
    faults = [TrackEvent(fault.vehicle, fault.span.start_s, FAULT) for fault in run_records.vehicle_faults(results)]
    return MapContents(
        tracks=tracks,
        looks=_looks(declared.Kit(results).looks, tracks),
        points=[
            PlacesOfKind(*of, name, Symbol(marker, of[0], size_pt, style.YELLOW))
            for of, (marker, size_pt, name) in marked
        ],
        outlines=[PlacesOfKind(*of, name, line) for of, (line, name) in lined],
        layers=list(layers),
        events=[
            TrackEvent(milestone.vehicle, milestone.time_s, symbols[milestone.name])
            for milestone in run_records.milestones(results)
            if milestone.name in symbols and milestone.vehicle in tracks
        ]
        + [event for event in faults if event.vehicle in tracks],
        end_s=end_s,
        out=frozenset(
            vehicle
            for vehicle, gaps in outages(results).items()
            if any(gap.start_s <= end_s < gap.end_s for gap in gaps)
        ),
    )


def _looks(looks: Mapping[str, style.Look], tracks: Mapping[str, Track]) -> Mapping[str, style.Look]:
    if len(looks) <= MOST_NAMED:
        return looks
    length_m = {name: float(np.hypot(np.diff(t.x_m), np.diff(t.y_m)).sum()) for name, t in tracks.items()}
    # One entry of the legend is for all others.
    named = sorted(looks, key=lambda name: -length_m.get(name, 0.0))[: MOST_NAMED - 1]
    return {name: look if name in named else OTHERS for name, look in looks.items()}


def _frames(scene: MapContents) -> dict[str, Bbox]:
    points = [place.outline_m[0] for of_kind in scene.points for place in of_kind.places]
    corners = [corner for of_kind in scene.outlines for place in of_kind.places for corner in place.outline_m]
    frames = {WHOLE: frame_of([*points_of(scene.tracks.values()), *points, *corners])}
    most_m = CLOSE * _size_m(frames[WHOLE])
    at_end = [_at(track, scene.end_s) for name, track in scene.tracks.items() if name not in scene.out]
    # Preferably with the points, such as a rally point, if the panel stays small.
    near = [frame for frame in (frame_of([*at_end, *points]), frame_of(at_end)) if _size_m(frame) < most_m]
    if near and len(at_end) > 1 and _size_m(frames[WHOLE]) >= LEAST_EXTENT_M:
        frames["final positions"] = near[0]
    return frames


def points_of(tracks: Iterable[Track]) -> list[PointM]:
    """Return the corners of the bounding boxes of tracks."""
    return [
        (float(x_m), float(y_m))
        for track in tracks
        if track.time_s.size
        for x_m in (track.x_m.min(), track.x_m.max())
        for y_m in (track.y_m.min(), track.y_m.max())
    ]


def frame_of(points: Sequence[PointM]) -> Bbox:
    """Return the bounding box of points."""
    xs, ys = zip(*points or [(0.0, 0.0)], strict=True)
    return Bbox.from_extents(min(xs), min(ys), max(xs), max(ys))


def _size_m(frame: Bbox) -> float:
    return float(max(frame.width, frame.height))


def _layers(axes: Axes, results: RunResults, layers: Sequence[Layer]) -> str:
    sentences = [declared.draw_declared(layer, axes, results) for layer in layers]
    for artist in (*axes.collections, *axes.lines, *axes.patches, *axes.texts, *axes.images):
        artist.set_zorder(BELOW * artist.get_zorder())
    return words.joined(*sentences)


def _draw(axes: Axes, scene: MapContents) -> None:
    axes.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 5, 10]))
    axes.set_ylabel(words.axis("y north", "m"))
    axes.set_xlabel(words.axis("x east", "m"))
    for of_kind in scene.outlines:
        for place in of_kind.places:
            line = {"linestyle": of_kind.look, "linewidth": 0.8, "zorder": 1}
            axes.add_patch(Polygon(place.outline_m, fill=False, edgecolor=style.GREY, **line))
    for name, track in scene.tracks.items():
        look, step_s = scene.looks[name], run_records.marker_step_s(scene.end_s)
        axes.plot(track.x_m, track.y_m, color=look.colour, linestyle=look.line, linewidth=0.9, zorder=3)
        points = track.at(*np.arange(step_s, min(scene.end_s, track.time_s[-1]), step_s))
        axes.plot(
            [x for x, _, _ in points], [y for _, y, _ in points], color=look.colour, linestyle="none",
            marker=look.marker, markeredgecolor="white", markeredgewidth=0.3, zorder=4,
        )  # fmt: skip
    for (x_m, y_m), symbol in _marks(scene):
        axes.add_line(symbol.at(x_m, y_m))


def _marks(scene: MapContents) -> list[tuple[PointM, Symbol]]:
    marks = [(place.outline_m[0], of_kind.look) for of_kind in scene.points for place in of_kind.places]
    for name, track in scene.tracks.items():
        marks += [(_at(track, 0.0), START), (_at(track, scene.end_s), END._replace(face=scene.looks[name].colour))]
    return marks + [(_at(scene.tracks[event.vehicle], event.time_s), event.symbol) for event in scene.events]


def _at(track: Track, time_s: float) -> PointM:
    ((x_m, y_m, _),) = track.at(time_s)
    return x_m, y_m


def _name_places(axes: Axes, scene: MapContents) -> None:
    names = [Label(place.name, *place.outline_m[0]) for of_kind in scene.points for place in of_kind.places]
    for place in (place for of_kind in scene.outlines for place in of_kind.places):
        frame = frame_of(place.outline_m)
        ends = place.outline_m if len(place.outline_m) == 2 else ()
        names.append(Label(place.name, (frame.x0 + frame.x1) / 2, (frame.y0 + frame.y1) / 2, frame.width, ends))
    of_layers = [
        np.asarray(one.get_offsets(), dtype=float) for one in axes.collections if isinstance(one, PathCollection)
    ]
    keep_clear = [point_m for point_m, _ in _marks(scene)] + [(x_m, y_m) for own in of_layers for x_m, y_m in own]
    page.place_labels(axes, [name for name in names if axes.viewLim.contains(name.x, name.y)], keep_clear)


def _legend(scene: MapContents) -> list[Artist]:
    entries: list[Artist] = [
        Line2D(
            [], [], color=look.colour, linestyle=look.line, marker=look.marker, markeredgecolor="white",
            markeredgewidth=0.3, label=name, linewidth=0.9,
        )
        for name, look in scene.looks.items() if look != OTHERS
    ]  # fmt: skip
    n_others = sum(look == OTHERS for look in scene.looks.values())
    entries += [Line2D([], [], color=OTHERS.colour, linewidth=0.9, label=f"{n_others} others")] if n_others else []
    entries += [START.at(), END.at()] if scene.tracks else []
    entries += [symbol.at() for symbol in dict.fromkeys(event.symbol for event in scene.events)]
    entries += [of_kind.look.at() for of_kind in scene.points]
    outline: dict[str, Any] = {"facecolor": "none", "edgecolor": style.GREY, "linewidth": 0.8}
    return entries + [Patch(linestyle=of_kind.look, label=of_kind.kind, **outline) for of_kind in scene.outlines]


def _caption(results: RunResults, scene: MapContents, of_layers: str) -> str:
    step_s = run_records.marker_step_s(scene.end_s)
    sentences = [
        "Trajectories of the vehicles, x east and y north.",
        f"Markers on a track are {step_s:g} s apart.",
    ]
    for of_kind in (*scene.outlines, *scene.points):
        names = [place.name for place in of_kind.places]
        shown = words.listed(names) if len(names) <= MOST_LISTED else f"{len(names)} in all"
        sentences.append(f"{of_kind.shape} ({of_kind.kind}): {shown}.")
    sentences.append(of_layers)
    others = [name for name, look in scene.looks.items() if look == OTHERS]
    if others:
        sentences.append(f"The vehicles with the longest paths are named, the others are grey: {words.listed(others)}.")
    by_symbol: dict[Symbol, list[TrackEvent]] = {}
    for event in scene.events:
        if event.symbol is not FAULT:
            by_symbol.setdefault(event.symbol, []).append(event)
    for symbol, events in by_symbol.items():
        if len(events) > MOST_LISTED:
            span = f"{words.time(events[0].time_s)} to {words.time(events[-1].time_s)}"
            sentences.append(f"{words.capital(symbol.meaning)} {len(events)} times, at {span}.")
        else:
            sentences += [f"{event.vehicle}: {symbol.meaning} at {words.time(event.time_s)}." for event in events]
    return captions.of_run(results, *sentences)
