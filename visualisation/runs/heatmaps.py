"""Figures of shares and ages, ``delivery``, ``knowledge``, ``links``: darker is worse; vehicles have colours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from missions import words
from missions.figure import RunResults, run_end_s
from missions.spans import Span, spans_by
from visualisation import page, run_records, style
from visualisation.page import DrawnPage, panel_in
from visualisation.run_records import HEARD, UNREACHED, Floats, outages
from visualisation.runs import captions, news
from visualisation.shades import SHADES, draw_shades, matrix, name_rows

KEY_IN, KEY_BAR_IN = 2.0, 0.07  # length and height of a key
MOST_NUMBERS = 8  # maximum fleet size for numbers in matrices


class Shades(NamedTuple):
    """Panel of shades: ``top`` is the value of black, ``label`` that of the key (empty for none)."""

    title: str
    values: Floats
    top: float
    label: str
    percent: bool = False

    def number(self, value: float) -> str:
        """Return a value as written in a matrix."""
        return f"{100 * value if self.percent else value:.0f}"


def row_in(n: int, least_in: float, most_in: float, all_in: float) -> float:
    """Return the height of one of ``n`` rows with ``all_in`` as target for their sum."""
    return min(most_in, max(least_in, all_in / max(1, n)))


def strip(
    axes: Axes, results: RunResults, values: Floats, top: float, row_in: float, out: Mapping[str, Sequence[Span]]
) -> None:
    """Draw a row of shades per vehicle over mission time, hatched while ``out`` of the mission."""
    names, end_s = run_records.vehicle_names(results), run_end_s(results)
    n = max(1, len(names))
    if values.size:
        draw_shades(axes, values, top, (0.0, end_s, n - 0.5, -0.5))
    axes.set_xlim(0.0, end_s)
    name_rows(axes, names, row_in)
    for edge in range(1, n):
        axes.axhline(edge - 0.5, color="white", linewidth=min(1.0, 6.0 * row_in))
    for row, name in enumerate(names):
        for gap in out.get(name, ()):
            axes.barh(
                row, min(gap.end_s, end_s) - gap.start_s, 1.0, gap.start_s, facecolor="none", edgecolor=style.GREY,
                hatch="////", linewidth=0,
            )  # fmt: skip
    axes.set_xlabel(words.axis("time", "s"))


def key(figure: Figure, below: Axes, body_in: float, top: float, label: str, percent: bool = False) -> None:
    """Draw the scale of shades from 0 to ``top`` below a panel of height ``body_in``."""
    # Matplotlib takes distance and thickness of a key as shares of the panel.
    share = min(1.0, KEY_IN / panel_in(below)[0])
    bar = figure.colorbar(
        ScalarMappable(Normalize(0.0, top), SHADES), ax=below, location="bottom", shrink=share, pad=0.05 / body_in,
        fraction=KEY_BAR_IN / body_in, aspect=share * panel_in(below)[0] / KEY_BAR_IN,
    )  # fmt: skip
    ends = [0.0, top / 2, top]
    bar.set_ticks(ends, labels=[f"{100 * end:.0f} %" if percent else f"{end:.0f}" for end in ends])
    bar.ax.tick_params(length=1.5, labelsize=style.TINY_PT, pad=1)
    bar.set_label(label, fontsize=style.TINY_PT, labelpad=1)


LEAST_FOR_TWO_IN = 5.0  # minimum page width for two matrices side by side
POINTS = 400


def _sampled(end_s: float) -> Floats:
    # Middles of equal intervals, each a column of the image.
    times_s: Floats = (np.arange(POINTS) + 0.5) * end_s / POINTS
    return times_s


def _drawn(
    results: RunResults, strips: Sequence[Shades], squares: Sequence[Shades], high_in: float, width_in: float
) -> Figure:
    names, out = run_records.vehicle_names(results), outages(results)
    columns = 2 if squares and width_in >= LEAST_FOR_TWO_IN else 1
    side_in, strip_in, n = width_in / columns - 0.7, high_in * max(1, len(names)), len(strips)
    letters = page.LETTERS[: n + len(squares)]
    rows = [[letter] * columns for letter in letters[:n]]
    rows += [list(letters[first : first + columns]) for first in range(n, len(letters), columns)]
    with style.paper():
        figure = page.opened(width_in, n * strip_in + 2 * side_in)
        panels = figure.subplot_mosaic(rows)  # type: ignore[arg-type]
        for (letter, axes), shown in zip(panels.items(), (*strips, *squares), strict=True):
            axes.set_title(f"({letter}) {shown.title}")
            if letter in letters[:n]:
                strip(axes, results, shown.values, shown.top, high_in, out)
            else:
                matrix(axes, names, shown.values, shown.top, shown.number, side_in, MOST_NUMBERS)
            if shown.label:
                key(figure, axes, strip_in if n else side_in, shown.top, shown.label, shown.percent)
        column = [panels[letter] for letter, *_ in rows]
        page.lay_out(figure, column, lambda: [strip_in] * n + [page.panel_in(axes)[0] for axes in column[n:]])
    return figure


def delivery(results: RunResults, width_in: float = style.PAGE_IN) -> DrawnPage:
    """Draw two matrices, senders down and receivers across, stacked on a narrow page."""
    traffic = news.traffic(results)
    ages_s = _mean(traffic.ages_s(_sampled(traffic.end_s)), 2)
    squares = (
        Shades("packets lost", traffic.lost_shares, 1.0, "share of the sender's packets that were lost", percent=True),
        Shades("age of information", ages_s, news.worst_age_s(traffic), "mean age of information (s)"),
    )
    n_received, n_sent = (traffic.outcome == HEARD).sum(), (traffic.outcome != UNREACHED).sum()
    text = captions.of_run(
        results,
        "Reception between vehicles: rows send, columns receive, darker is worse.",
        f"(a) Share of the sender's packets that the receiver lost: {n_sent - n_received} of {n_sent} in all.",
        "(b) Age of the last packet received from the sender, mean over the time that both are in the mission.",
        f"Black is {news.WORST_FRAMES} TDMA frames or more in every run.",
        "Crossed: no packet was sent that could be received.",
    )
    return DrawnPage(_drawn(results, (), squares, 0.0, width_in), text)


AGE_ROWS_IN = 0.065, 0.3, 2.9  # minimum and maximum height of a row, and target height of a panel
WORST_ITEMS = 5.0  # missing items per vehicle of the fleet that are drawn black


def knowledge(results: RunResults, width_in: float = style.PAGE_IN) -> DrawnPage:
    """Draw strips per vehicle: mean age of information on peers, and missing items of peers."""
    traffic = news.traffic(results)
    n, at_s = len(traffic.vehicles), _sampled(traffic.end_s)
    ages_s = _mean(traffic.ages_s(at_s))
    lacking, most = news.items_lacking(results, at_s), WORST_ITEMS * max(1.0, n)
    strips = (
        Shades("mean age of information on other vehicles", ages_s, news.worst_age_s(traffic), words.axis("age", "s")),
        Shades("items of other vehicles not received", lacking, most, "items"),
    )
    text = captions.of_run(
        results,
        "Knowledge of the vehicles over mission time, darker is worse.",
        "(a) Age of the last packet received from a peer, mean over all peers.",
        "(b) Items that other vehicles recorded and this vehicle has not received.",
        f"Black is {news.WORST_FRAMES} TDMA frames or more in (a), {WORST_ITEMS:g} items per vehicle or more in (b).",
        "Hatched: the vehicle is out of the mission." if traffic.out else "",
    )
    return DrawnPage(_drawn(results, strips, (), row_in(n, *AGE_ROWS_IN), width_in), text)


LOSS_ROWS_IN = 0.055, 0.18, 1.8  # minimum and maximum height of a row, and target height of a panel
INCOMING = "incoming"
THERE, SLOT_CONFLICT = (
    ("heard again", "begins anew"),
    "slot conflict",
)  # events of table ``peers``; others declare absence


class LinkEstimates(NamedTuple):
    """Contents of table ``links``, sampled.

    ``incoming``: loss estimated by the receiver, as receiver x sender x time; ``outgoing``: last loss estimated by the
    sender, as receiver x sender; ``without``: share of peers that declare a vehicle (row) absent at a time (column).
    """

    at_s: Floats
    incoming: Floats
    outgoing: Floats
    without: Floats


def link_estimates(results: RunResults) -> LinkEstimates:
    """Return estimates of a run at evenly spaced times; NaN before the first one."""
    number = {name: index for index, name in enumerate(run_records.vehicle_names(results))}
    n, end_s = len(number), run_end_s(results)
    at_s = _sampled(end_s)
    rows = [row for row in results.rows("links") if {row["vehicle"], row["peer"]} <= number.keys()]
    incoming, outgoing = np.full((n, n, POINTS), np.nan), np.full((n, n), np.nan)
    for row in rows:  # in time order
        vehicle, peer = number[row["vehicle"]], number[row["peer"]]
        estimate = np.nan if row["p_loss"] is None else row["p_loss"]
        if row["direction"] == INCOMING:
            incoming[vehicle, peer, np.searchsorted(at_s, row["time_s"]) :] = estimate
        else:
            outgoing[peer, vehicle] = estimate
    without = np.zeros((n, POINTS))
    for (_, name), without_it in spans_without(results, end_s).items():
        if name in number:
            without[number[name]] += news.is_out(without_it, at_s)
    return LinkEstimates(at_s, incoming, outgoing, without / max(1, n - 1))


def spans_without(results: RunResults, end_s: float) -> dict[tuple[str, str], list[Span]]:
    """Return spans in which a vehicle declared a peer absent, by vehicle and peer."""
    rows = [row for row in results.rows("peers") if row["event"] != SLOT_CONFLICT]
    return spans_by((((row["vehicle"], row["peer"]), row["time_s"], row["event"] not in THERE) for row in rows), end_s)


def links(results: RunResults, width_in: float = style.PAGE_IN) -> DrawnPage:
    """Draw strips of estimated loss and absent peers, above matrices of last estimates."""
    estimates = link_estimates(results)
    n, last = len(estimates.without), (estimates.incoming[:, :, -1], estimates.outgoing)
    label = "estimated loss; share"
    strips = (
        Shades("receivers: estimated packet loss", _mean(estimates.incoming), 1.0, ""),
        Shades("share of vehicles that declare the vehicle absent", estimates.without, 1.0, label, percent=True),
    )
    squares = (
        Shades("final estimates of the receivers", last[0], 1.0, "", percent=True),
        Shades("final estimates of the senders", last[1], 1.0, "", percent=True),
    )
    text = captions.of_run(
        results,
        "Packet loss of links as estimated by the vehicles, darker is worse.",
        "(a) Estimates of a receiver from missed packets, mean over the senders.",
        "(b) Share of the other vehicles that declare the vehicle absent after a long silence.",
        "(c) Final estimates of the receivers by link, in percent.",
        "(d) Final estimates of the senders from received acknowledgements, in percent.",
        # The diagonals of both matrices never have an estimate.
        "Crossed: no estimate." if np.isnan(last).sum() > 2 * n else "",
        "Hatched: the vehicle is out of the mission." if outages(results) else "",
    )
    return DrawnPage(_drawn(results, strips, squares, row_in(n, *LOSS_ROWS_IN), width_in), text)


def _mean(values: Floats, axis: int = 1) -> Floats:
    means: Floats = np.ma.masked_invalid(values).mean(axis=axis).filled(np.nan)
    return means
