"""Figure ``links``: loss estimates of links, and peers declared absent."""

from __future__ import annotations

from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np

from missions.figure import RunResults, axis_end_s
from visualisation import page, run_records, style
from visualisation.page import DrawnPage
from visualisation.run_records import Floats, Span, outages, spans
from visualisation.runs import captions, shades
from visualisation.runs.shades import Timespan

ROWS_IN = 0.055, 0.18, 1.8
"""Minimum and maximum height of a row, and target height of a panel."""
LEAST_FOR_TWO_IN = 5.0
"""Minimum page width for two matrices side by side."""
POINTS = 400
"""Number of sampling times."""
INCOMING, OUTGOING = "incoming", "outgoing"
"""Directions of a link in table ``links``: from the peer to the vehicle, and the reverse."""
THERE, SLOT_CONFLICT = ("heard again", "begins anew"), "slot conflict"
"""Events in table ``peers``: peer present, duplicate slot. All others declare absence."""


class LinkEstimates(NamedTuple):
    """Contents of table ``links``, sampled.

    Attributes:
        incoming: loss estimated by the receiver, as receiver x sender x time.
        outgoing: last loss estimated by the sender, as receiver x sender.
        without: share of peers that declare a vehicle (row) absent at each time (column).
    """

    vehicles: tuple[str, ...]
    at_s: Floats
    incoming: Floats
    outgoing: Floats
    without: Floats


def link_estimates(results: RunResults) -> LinkEstimates:
    """Return estimates of a run at evenly spaced times; NaN before the first one."""
    vehicles = tuple(run_records.vehicle_names(results))
    number = {name: at for at, name in enumerate(vehicles)}
    n, end_s = len(vehicles), run_records.end_s(results)
    at_s = (np.arange(POINTS) + 0.5) * end_s / POINTS
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
        for span in without_it if name in number else ():
            without[number[name]] += (span.start_s <= at_s) & (at_s < span.end_s)
    return LinkEstimates(vehicles, at_s, incoming, outgoing, without / max(1, n - 1))


def spans_without(results: RunResults, end_s: float) -> dict[tuple[str, str], list[Span]]:
    """Return spans in which a vehicle declared a peer absent, by vehicle and peer."""
    told: dict[tuple[str, str], list[tuple[float, bool]]] = defaultdict(list)
    for row in results.rows("peers"):
        if row["event"] != SLOT_CONFLICT:
            told[row["vehicle"], row["peer"]].append((row["time_s"], row["event"] not in THERE))
    return {pair: spans(events, end_s) for pair, events in told.items()}


def picture(results: RunResults, width_in: float = style.PAGE_IN) -> DrawnPage:
    """Draw strips of estimated loss and absent peers, above matrices of last estimates."""
    found = link_estimates(results)
    names, n, end_s = found.vehicles, max(1, len(found.vehicles)), run_records.end_s(results)
    row_in = shades.row_in(n, *ROWS_IN)
    columns = 2 if width_in >= LEAST_FOR_TWO_IN else 1
    side_in = width_in / columns - 0.7
    strips = (
        ("(a) receivers: estimated loss of what is sent to them", _mean(found.incoming)),
        ("(b) peers: share of the others that do without them", found.without),
    )
    squares = (
        ("(c) last estimates of the receivers", found.incoming[:, :, -1]),
        ("(d) last estimates of the senders", found.outgoing),
    )
    span = Timespan(end_s, axis_end_s(results), outages(results))
    rows: list[Any] = [["a"] * columns, ["b"] * columns, *([["c", "d"]] if columns == 2 else [["c"], ["d"]])]
    with style.paper():
        figure = page.opened(width_in, 2 * row_in * n + 2 * side_in)
        panels = figure.subplot_mosaic(rows)
        for axes, (title, values) in zip(panels.values(), strips, strict=False):
            axes.set_title(title)
            shades.strip(axes, names, values, 1.0, span, row_in)
        shades.key(figure, panels["b"], row_in * n, 1.0, "estimated loss; share", percent=True)
        for letter, (title, values) in zip("cd", squares, strict=True):
            panels[letter].set_title(title)
            shades.matrix(panels[letter], names, values, 1.0, True, side_in)
        column = [panels[letter] for letter, *_ in rows]
        page.lay_out(figure, column, lambda: [row_in * n] * 2 + [page.panel_in(axes)[0] for axes in column[2:]])
    text = captions.of_run(
        results,
        "What the vehicles take the links to lose, darker is worse.",
        "(a) Estimates of a receiver, from the packets that it missed, as a mean over the senders.",
        "(b) Share of the others that wait for nothing that the vehicle lacks, since it is silent for too long.",
        "(c) The same estimates by link, in percent, as they were last.",
        "(d) Those of the senders, from the acknowledgements that they heard.",
        "Crossed: no estimate." if np.isnan(squares[0][1]).sum() + np.isnan(squares[1][1]).sum() > 2 * n else "",
        "Hatched: the vehicle is out of the mission." if span.out else "",
    )
    return DrawnPage(figure, text)


def _mean(estimates: Floats) -> Floats:
    """Return the mean over senders; NaN without estimates."""
    found: Floats = np.ma.masked_invalid(estimates).mean(axis=1).filled(np.nan)
    return found
