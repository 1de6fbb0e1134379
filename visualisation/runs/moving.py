"""The tracks of a run as an animated GIF for slides: vehicles that move, and beside the map what drives them.

The background is drawn once; for each picture only what moves is drawn anew. All pictures share one palette.
"""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.text import Text
from PIL import Image

from missions.figure import Place, RunResults
from visualisation import output, style, words
from visualisation.page import Box, Page
from visualisation.runs import captions, reading
from visualisation.runs.declared import Kit
from visualisation.runs.reading import PlanTrack, Tenure
from visualisation.runs.trajectories import frame_of, points_of

WIDTH_IN, DPI = 6.4, 100
"""A slide of 640 by 360 pixels, if nothing else is asked for."""
SHAPE = 9 / 16
PICTURES, PICTURE_MS, LAST_MS = 120, 80, 2000
"""How many there are, how long each is seen, and the last one: 12 s in all."""
TRAIL = 0.15
"""Part of the mission that the strong part of a trail shows."""
STATE_IN, LINE_IN = 1.9, 0.17
LEFT_IN, TOP_IN, BOTTOM_IN, GAP_IN = 0.5, 0.26, 0.4, 0.14
MOST_NAMED = 12
"""Larger fleets have counts of vehicles by their states, not a line for each."""
TINTS = 12
"""Shades of each colour, from pale to full, for the edges of lines and letters."""
WAITING = "waiting"


class Mover(NamedTuple):
    """What moves of a vehicle: its whole way, the newest part of it, and itself."""

    way: Line2D
    trail: Line2D
    head: Line2D


def film(results: RunResults, places: Sequence[Place], width_in: float | None = None) -> tuple[bytes, bytes]:
    """The GIF, and the text of its caption.

    Args:
        results: of the run.
        places: what the map shows.
        width_in: of the pictures; each inch has 100 pixels.
    """
    tracks = reading.tracks(results)
    end_s = reading.end_s(results)
    tenures = reading.tenures(results) if results.has("roles") else {}
    with style.paper():
        stage = _Stage(results, tracks, places, width_in or WIDTH_IN)
        times_s = np.linspace(0.0, end_s, PICTURES if tracks else 1)
        pictures = [stage.at(float(time_s), tenures) for time_s in times_s]
    said = output.about_run(results)
    text = words.joined(
        "Vehicles over mission time; a strong line is where a vehicle went last.",
        captions.faults(results),
        captions.run_conditions(results),
    )
    return _gif(pictures, "; ".join(f"{name} {value}" for name, value in said.items())), f"{text}\n".encode()


class _Stage:
    """A page with a map, and a list of states beside it, at a time of the mission."""

    def __init__(
        self, results: RunResults, tracks: Mapping[str, PlanTrack], places: Sequence[Place], width_in: float
    ) -> None:
        self.tracks = tracks
        self.names = reading.vehicle_names(results)
        self.end_s = reading.end_s(results)
        height_in = width_in * SHAPE
        self.page = Page(width_in, height_in)
        self.page.figure.set_dpi(DPI)
        canvas: Any = self.page.figure.canvas
        self.canvas = canvas
        map_in = width_in - LEFT_IN - STATE_IN - 2 * GAP_IN
        box = Box(LEFT_IN, TOP_IN, map_in, height_in - TOP_IN - BOTTOM_IN)
        self.axes = self.page.panel(box)
        _frame(self.axes, box, tracks, places)
        looks = Kit(results).looks
        self.movers = {name: _mover(self.axes, looks[name]) for name in tracks}
        self.clock = self.page.figure.text(LEFT_IN / width_in, 1 - 0.13 / height_in, "", va="center", fontsize=9)
        left = (LEFT_IN + map_in + GAP_IN) / width_in
        n_lines = len(self.names) if len(self.names) <= MOST_NAMED else MOST_NAMED
        self.lines = [
            self.page.figure.text(left, 1 - (TOP_IN + LINE_IN * (at + 0.5)) / height_in, "", va="center", fontsize=8)
            for at in range(n_lines)
        ]
        if len(self.names) <= MOST_NAMED:
            for line, name in zip(self.lines, self.names, strict=True):
                line.set_color(looks[name].colour)
        self.moving = [*(artist for mover in self.movers.values() for artist in mover), self.clock, *self.lines]
        for artist in self.moving:
            artist.set_animated(True)
        self.canvas.draw()
        self.background = self.canvas.copy_from_bbox(self.page.figure.bbox)

    def at(self, time_s: float, tenures: Mapping[str, Sequence[Tenure]]) -> Image.Image:
        """The picture of a time."""
        for name, track in self.tracks.items():
            mover = self.movers[name]
            x_m, y_m = track.at(time_s)
            for line, start_s in ((mover.way, 0.0), (mover.trail, time_s - TRAIL * self.end_s)):
                part = track.between(start_s, time_s)
                line.set_data([*part.x_m, x_m], [*part.y_m, y_m])
            mover.head.set_data([x_m], [y_m])
        self.clock.set_text(words.time(time_s))
        _say(self.lines, self.names, tenures, time_s)
        canvas = self.canvas
        canvas.restore_region(self.background)
        for artist in self.moving:
            self.page.figure.draw_artist(artist)
        return Image.frombuffer("RGBA", canvas.get_width_height(), canvas.buffer_rgba()).convert("RGB")


def _frame(axes: Axes, box: Box, tracks: Mapping[str, PlanTrack], places: Sequence[Place]) -> None:
    """Draw the places, and show all of them and of the tracks, to scale."""
    corners = [corner for place in places for corner in place.outline_m]
    for place in places:
        if len(place.outline_m) == 1:
            axes.plot(*place.outline_m[0], marker="*", color=style.YELLOW, markeredgecolor=style.BLACK, markersize=8)
        else:
            axes.add_patch(Polygon(place.outline_m, fill=False, edgecolor=style.GREY, linewidth=0.8))
    frame = frame_of([*points_of(tracks.values()), *corners]).filling(box.height_in / box.width_in)
    axes.set_xlim(frame.west_m, frame.east_m)
    axes.set_ylim(frame.south_m, frame.north_m)
    axes.set_xlabel(words.axis("x east", "m"), labelpad=2)
    axes.set_ylabel(words.axis("y north", "m"), labelpad=2)


def _mover(axes: Axes, look: style.Look) -> Mover:
    (way,) = axes.plot([], [], color=style.tint(look.colour, 0.35), linewidth=0.8)
    (trail,) = axes.plot([], [], color=look.colour, linewidth=2.0)
    (head,) = axes.plot([], [], color=look.colour, marker=look.marker, markersize=6, markeredgecolor="white")
    return Mover(way, trail, head)


def _say(lines: Sequence[Text], names: Sequence[str], tenures: Mapping[str, Sequence[Tenure]], time_s: float) -> None:
    """Write what drives the vehicles at a time."""
    states = {name: _state(tenures.get(name, ()), time_s) for name in names}
    if len(names) <= MOST_NAMED:
        said = [f"{name}  {state}" for name, state in states.items()]
    else:
        said = [f"{count}  {state}" for state, count in Counter(states.values()).most_common(len(lines))]
    for at, line in enumerate(lines):
        line.set_text(style.fitted(said[at], STATE_IN, 8) if at < len(said) else "")


def _state(own: Sequence[Tenure], time_s: float) -> str:
    driving = [
        tenure.role
        for tenure in own
        if any(span.start_s <= time_s < span.end_s or time_s == span.end_s for span in tenure.active)
    ]
    return ", ".join(dict.fromkeys(driving)) or (WAITING if own else "")


def _gif(pictures: Sequence[Image.Image], comment: str) -> bytes:
    """All pictures in one palette, which has our colours and their tints: one taken from a picture would mix them."""
    known = (style.BLACK, style.GREY, style.YELLOW, *style.VEHICLES)
    tints = [style.tint(colour, (step + 1) / TINTS) for colour in known for step in range(TINTS)]
    palette = Image.new("P", (1, 1))
    palette.putpalette([round(255 * part) for tint in ((1.0, 1.0, 1.0), *tints) for part in tint])
    reduced = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    file = io.BytesIO()
    reduced[0].save(
        file, format="GIF", save_all=True, append_images=reduced[1:], loop=0, optimize=True, comment=comment.encode(),
        duration=[PICTURE_MS] * (len(reduced) - 1) + [LAST_MS],
    )  # fmt: skip
    return file.getvalue()
