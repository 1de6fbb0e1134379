"""Figure ``tdma``: packet outcomes by slot and receiver, for the whole run and slot by slot."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from missions import words
from missions.figure import RunResults
from missions.spans import Span
from visualisation import page, style
from visualisation.page import DrawnPage
from visualisation.run_records import COLLIDED, HEARD, LOST, REFUSED, Floats
from visualisation.runs import captions, heatmaps, news
from visualisation.runs.news import RunPackets
from visualisation.shades import name_rows

ROWS_IN, LANES_IN = (0.055, 0.18, 1.8), (0.075, 0.24, 2.4)
"""Minimum and maximum row height, target panel height: of overviews, of single slots."""
SLOTS = 36  # approximate number of slots shown one by one, in whole frames
UNHEARD = style.tint(style.BLACK, 0.08)


def picture(results: RunResults, width_in: float = style.PAGE_IN) -> DrawnPage:
    """Draw loss shares by sender and by receiver over all frames, and one stretch slot by slot."""
    traffic = news.traffic(results)
    n = max(1, len(traffic.vehicles))
    row_in, lane_in = heatmaps.row_in(n, *ROWS_IN), heatmaps.row_in(n, *LANES_IN)
    stretch = worst_stretch(traffic)
    by_sender, by_receiver = _by_frame(traffic)
    titles = (
        f"{'slots' if traffic.is_tdma else 'senders'}: share of receivers that lost the packet",
        f"receivers: share of packets lost{' per frame' * traffic.is_tdma}",
        f"{_each(traffic)} by {_each(traffic)}, {words.time(stretch.start_s)} to {words.time(stretch.end_s)}",
    )
    bodies_in = row_in * n, row_in * n, lane_in * n
    with style.paper():
        figure = page.opened(width_in, sum(bodies_in))
        strips = page.panels(figure, 3, 1, titles, framed=True)
        for axes, values in zip(strips, (by_sender, by_receiver), strict=False):
            heatmaps.strip(axes, results, values, 1.0, row_in, {})
            if values.size:
                # Missing values are transparent, and differ by this from a loss of 0.
                axes.set_facecolor(UNHEARD)
        heatmaps.key(figure, strips[1], bodies_in[1], 1.0, "share lost", percent=True)
        _slots(strips[2], traffic, stretch, lane_in, width_in)
        page.legend(figure, _legend(traffic))
        page.lay_out(figure, strips, bodies_in)
    return DrawnPage(figure, _caption(results, traffic))


def _each(traffic: RunPackets) -> str:
    return "slot" if traffic.is_tdma else "packet"


def _by_frame(traffic: RunPackets) -> tuple[Floats, Floats]:
    n = len(traffic.vehicles)
    n_frames = (int(traffic.frames.max()) + 1 if traffic.is_tdma else news.HUNDREDTHS) if traffic.frames.size else 0
    by_sender = traffic.shares_lost(lambda packet, _: (traffic.sender[packet], traffic.frames[packet]), (n, n_frames))
    by_receiver = traffic.shares_lost(lambda packet, receiver: (receiver, traffic.frames[packet]), (n, n_frames))
    return by_sender, by_receiver


def worst_stretch(traffic: RunPackets) -> Span:
    """Return the earliest stretch of whole frames, about ``SLOTS`` slots, with the highest loss."""
    if not traffic.time_s.size:
        return Span(0.0, traffic.end_s)
    n = max(1, len(traffic.vehicles))
    n_frames = max(1, round(SLOTS / n))
    last = int(traffic.frames.max())
    shares = np.nan_to_num(traffic.shares_lost(lambda packet, _: (traffic.frames[packet],), (last + 1,)))
    sums = np.convolve(shares, np.ones(min(n_frames, last + 1)), mode="valid")
    # Rounded, so that of equal sums the first is chosen on every machine.
    first = int(np.argmax(np.round(sums, 9)))
    inside = (traffic.frames >= first) & (traffic.frames < first + n_frames)
    times_s = traffic.time_s[inside]
    return Span(float(times_s.min()), float(times_s.max()) + traffic.slot_s)


class Tick(NamedTuple):
    """Look of a packet outcome at a vehicle: above or below its lane, filled or hollow."""

    label: str
    is_up: bool
    face: str
    edge: str


TICKS = {
    HEARD: Tick("received (up)", True, style.BLACK, "none"),
    REFUSED: Tick("refused (up, hollow)", True, "white", style.BLACK),
    LOST: Tick("lost (down)", False, "white", style.BLACK),
    COLLIDED: Tick("collided (down, grey)", False, "#8C8C8C", style.BLACK),
}
ALWAYS = (HEARD, LOST)


def _slots(axes: Axes, traffic: RunPackets, stretch: Span, lane_in: float, width_in: float) -> None:
    n = max(1, len(traffic.vehicles))
    inside = np.flatnonzero((traffic.time_s >= stretch.start_s) & (traffic.time_s < stretch.end_s))
    slot_s = traffic.slot_s
    axes.set_xlim(stretch.start_s, stretch.end_s)
    axes.set_ylim(n - 0.5, -0.5)
    for line in range(n):
        axes.axhline(line, color=style.tint(style.BLACK, 0.3), linewidth=0.3, zorder=1)
    for code, tick in TICKS.items():
        reach = (-0.42, 0.42) if code == HEARD else (-0.4, 0.36) if tick.is_up else (0.04, 0.36)
        for packet, lane in zip(*np.nonzero(traffic.outcome[inside] == code), strict=True):
            from_s = float(traffic.time_s[inside[packet]]) + 0.3 * slot_s
            axes.broken_barh(
                [(from_s, 0.4 * slot_s)], (lane + reach[0], reach[1]), facecolor=tick.face, edgecolor=tick.edge,
                linewidth=0.0 if code == HEARD else 0.4, zorder=2,
            )  # fmt: skip
    size_pt = min(4.0, 0.5 * 72 * lane_in, 0.4 * 72 * width_in / max(1, inside.size))
    axes.plot(
        traffic.time_s[inside] + 0.5 * slot_s, traffic.sender[inside], marker="D", linestyle="none", color=style.GREY,
        markersize=size_pt, zorder=3,
    )  # fmt: skip
    name_rows(axes, traffic.vehicles, lane_in)
    axes.set_xlabel(words.axis("time", "s"))


def _legend(traffic: RunPackets) -> tuple[Line2D | Patch, ...]:
    shown = [tick for code, tick in TICKS.items() if code in ALWAYS or code in traffic.outcome]
    return (
        Line2D([], [], marker="D", linestyle="none", color=style.GREY, markersize=3.5, label="sent"),
        *(Patch(facecolor=mark.face, edgecolor=mark.edge, linewidth=0.5, label=mark.label) for mark in shown),
    )


def _caption(results: RunResults, traffic: RunPackets) -> str:
    n_collided, n_refused = ((traffic.outcome == code).sum() for code in (COLLIDED, REFUSED))
    return captions.of_run(
        results,
        "Packets on the acoustic channel, darker is worse, pale where no packet could be received.",
        f"(a) A row for each sender, a column for each {'TDMA frame' if traffic.is_tdma else 'hundredth of the run'}. "
        "(b) A row for each receiver.",
        f"(c) The columns with the highest loss, {_each(traffic)} by {_each(traffic)}, with a lane for each vehicle.",
        f"{traffic.time_s.size} packets.",
        f"Lost by collision: {n_collided} receptions." if n_collided else "",
        f"Refused on arrival and counted as lost: {n_refused} receptions." if n_refused else "",
    )
