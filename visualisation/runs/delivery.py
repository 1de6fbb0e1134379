"""Figure ``delivery``: packet loss and age of information by link, as matrices."""

from __future__ import annotations

from missions.figure import RunResults
from visualisation import page, style
from visualisation.page import DrawnPage
from visualisation.run_records import Floats
from visualisation.runs import captions, news, shades

LEAST_FOR_TWO_IN = 5.0
"""Minimum page width for two matrices side by side."""


def picture(results: RunResults, width_in: float = style.PAGE_IN) -> DrawnPage:
    """Draw two matrices, receivers down and senders across, stacked on a narrow page."""
    traffic = news.traffic(results)
    worst_s = news.worst_age_s(traffic)
    panels: list[tuple[str, Floats, float, str, bool]] = [
        ("packets lost", traffic.lost_shares, 1.0, "share of the sender's packets that were lost", True),
        ("age of news", traffic.mean_ages_s, worst_s, "mean age of the news of the sender (s)", False),
    ]
    columns = 2 if width_in >= LEAST_FOR_TWO_IN else 1
    side_in = width_in / columns - 0.7
    with style.paper():
        figure = page.opened(width_in, 2 * side_in)
        squares = page.panels(figure, 2, columns, [title for title, *_ in panels], framed=True)
        for axes, (_, values, top, label, percent) in zip(squares, panels, strict=True):
            shades.matrix(axes, traffic.vehicles, values, top, percent, side_in)
            shades.key(figure, axes, side_in, top, label, percent)
        first = squares[::columns]
        page.lay_out(figure, first, lambda: [page.panel_in(axes)[0] for axes in first])
    heard, lost = traffic.outcome.heard.sum(), traffic.outcome.lost.sum()
    text = captions.of_run(
        results,
        "Who heard whom: rows are receivers, columns senders, darker is worse.",
        f"(a) Share of the sender's packets that the receiver lost: {lost} of {heard + lost} in all.",
        "(b) Time since the sender sent what the receiver heard last, as a mean while both were in the mission.",
        f"Black is {news.WORST_FRAMES} TDMA frames or more, whatever the run.",
        "Crossed: nothing was sent that could be heard.",
    )
    return DrawnPage(figure, text)
