"""How long runs of lost, and of received, packets are: measured against fitted, and the numbers as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from visualisation import style, words
from visualisation.output import DrawingError, check_format
from visualisation.page import Legend, Page, PanelGrid

NAME = "bursts"
"""Name of the files, without suffix."""
LEFT_IN, RIGHT_IN, TOP_IN, BODY_IN, AXIS_IN, GAP_IN = 0.55, 0.1, 0.2, 2.0, 0.42, 0.35
TITLES = ("packets lost in a row", "packets received in a row")
DOTS: dict[str, Any] = {"color": style.BLACK, "marker": "o", "markersize": 2.5, "linestyle": ""}


class RunLengths(NamedTuple):
    """Runs of one outcome: lengths of those that ended, and of those that the end of the record cut."""

    ended: Sequence[int]
    cut: Sequence[int]

    @property
    def n(self) -> int:
        """How many there are."""
        return len(self.ended) + len(self.cut)

    @property
    def points(self) -> list[tuple[int, float]]:
        """(k, share of the runs that have k packets at least), where it falls; cut ones count while they were seen.

        The estimator of Kaplan and Meier (1958).

        >>> RunLengths([1, 1, 3], [2]).points
        [(1, 1.0), (2, 0.5), (4, 0.0)]
        """
        found, share = [(1, 1.0)], 1.0
        for length in sorted(set(self.ended)):
            at_risk = sum(other >= length for other in (*self.ended, *self.cut))
            share *= 1.0 - self.ended.count(length) / at_risk
            found.append((length + 1, share))
        return found


class FittedRuns(NamedTuple):
    """A model: its name, and shares of runs of 1, 2, ... lost, and received, packets at least."""

    name: str
    lost: Sequence[float]
    received: Sequence[float]


class BurstsDrawn(NamedTuple):
    """What is drawn: packets and links that were recorded, runs of lost and received ones, models that were fitted."""

    n_packets: int
    n_links: int
    lost: RunLengths
    received: RunLengths
    models: Sequence[FittedRuns]


def bursts_contents(drawn: BurstsDrawn, source: str, format: str) -> list[tuple[str, bytes]]:
    """Names and contents of the files: figure, caption, numbers.

    Args:
        drawn: runs and models.
        source: what the caption calls the trace.
        format: png, svg or pdf.

    Raises:
        DrawingError: the format is not known, or there is no run to draw.
    """
    check_format(format)
    return [
        (f"{NAME}.{format}", style.rendered(bursts_figure(drawn), format)),
        (f"{NAME}.txt", f"{bursts_caption(drawn, source)}\n".encode()),
        (f"{NAME}.csv", bursts_csv(drawn)),
    ]


def bursts_figure(drawn: BurstsDrawn) -> Figure:
    """Share of runs of k packets at least over k: dots as measured, a line for each model.

    Raises:
        DrawingError: there is no run to draw.
    """
    if not drawn.lost.n or not drawn.received.n:
        raise DrawingError("a figure of bursts needs runs of lost and of received packets")
    with style.paper():
        looks = [style.look(number) for number in range(len(drawn.models))]
        entries = (
            Line2D([], [], **DOTS, label="measured"),
            *(
                Line2D([], [], color=look.colour, linestyle=look.line, label=model.name)
                for model, look in zip(drawn.models, looks, strict=True)
            ),
        )
        legend = Legend(entries, style.PAGE_IN)
        grid = PanelGrid(2, 2, style.PAGE_IN, LEFT_IN, RIGHT_IN, TOP_IN, BODY_IN, GAP_IN)
        page = Page(style.PAGE_IN, grid.height_in + AXIS_IN + legend.height_in + 0.08)
        for axes, runs, which in zip(
            page.open_panels(grid, TITLES), (drawn.lost, drawn.received), ("lost", "received"), strict=True
        ):
            _lengths(
                axes, runs, [(getattr(model, which), look) for model, look in zip(drawn.models, looks, strict=True)]
            )
        page.figure.axes[0].set_ylabel("share of runs of k at least", labelpad=3)
        page.legend(legend)
    return page.figure


def _lengths(axes: Axes, runs: RunLengths, models: Sequence[tuple[Sequence[float], style.Look]]) -> None:
    points = [(k, share) for k, share in runs.points if share > 0.0]
    longest = max(max(runs.ended, default=1), 2)
    for shares, look in models:
        axes.plot(range(1, longest + 1), shares[:longest], color=look.colour, linestyle=look.line)
    axes.plot(*zip(*points, strict=True), **DOTS, zorder=4)
    axes.set_xlim(0.9, 1.1 * longest)
    style.logarithmic(axes, "x", (1.0, 2.0, 5.0) if longest < 100 else (1.0,))
    axes.set_ylim(0.4 / runs.n, 1.4)
    style.logarithmic(axes, "y", (1.0,))
    axes.set_xlabel("k (packets)", labelpad=2)


def bursts_caption(drawn: BurstsDrawn, source: str) -> str:
    """What the figure shows, and of how much."""
    links = f" on {drawn.n_links} links" if drawn.n_links > 1 else ""
    cut = drawn.lost.cut or drawn.received.cut
    counted = " Runs that the end of the record cuts count as long as they were seen (Kaplan, Meier)." if cut else ""
    return (
        f"Share of runs of k packets at least, (a) lost, (b) received one after another, in {source}: "
        f"n = {drawn.n_packets} packets{links}, {drawn.lost.n} runs of lost and {drawn.received.n} of received ones. "
        f"Dots: measured, where the share falls. Lines: fitted to the same packets by maximum likelihood, "
        f"{words.listed([model.name for model in drawn.models])}.{counted}"
    )


def bursts_csv(drawn: BurstsDrawn) -> bytes:
    """A line for each outcome and length at which the measured share falls, with the shares by all models."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(("outcome", "k", "measured", *(model.name for model in drawn.models)))
    for which, runs in (("lost", drawn.lost), ("received", drawn.received)):
        for k, share in runs.points:
            fitted = [getattr(model, which) for model in drawn.models]
            shares = (f"{of[k - 1]:.6g}" if k <= len(of) else "" for of in fitted)
            lines.writerow((which, k, f"{share:.6g}", *shares))
    return text.getvalue().encode()
