"""Who heard whom: shares of packets that were lost, and mean ages of news, as matrices."""

from __future__ import annotations

from missions.figure import RunResults
from visualisation import style, words
from visualisation.page import Box, DrawnPage, Page
from visualisation.runs import captions, news, shades
from visualisation.runs.reading import Floats

TITLE_IN, LABEL_IN, RIGHT_IN, GAP_IN = 0.24, 0.2, 0.1, 0.3
LARGEST_IN, LEAST_FOR_TWO_IN = 3.0, 5.0


def picture(results: RunResults, width_in: float = style.PAGE_IN) -> DrawnPage:
    """Two matrices, receivers down and senders across.

    Args:
        results: of the run.
        width_in: of the page; on a narrow one the matrices stand one above the other.
    """
    traffic = news.traffic(results)
    names = traffic.vehicles
    beside_in = LABEL_IN + shades.names_in(names) + 0.06
    columns = 2 if width_in >= LEAST_FOR_TWO_IN else 1
    side_in = min(LARGEST_IN, (width_in - columns * beside_in - RIGHT_IN - (columns - 1) * GAP_IN) / columns)
    each_in = TITLE_IN + side_in + shades.names_in(names) + 0.06 + LABEL_IN + shades.KEY_IN + 0.1
    ages_s = traffic.mean_ages_s
    panels: list[tuple[str, Floats, float, str, bool]] = [
        ("(a) packets lost", traffic.lost_shares, 1.0, "share of the sender's packets that were lost", True),
        ("(b) age of news", ages_s, news.worst_age_s(traffic), "mean age of the news of the sender (s)", False),
    ]
    with style.paper():
        page = Page(width_in, each_in * (2 // columns) + 0.05)
        for number, (title, values, top, label, percent) in enumerate(panels):
            row, column = divmod(number, columns)
            left_in = beside_in + column * (beside_in + side_in + GAP_IN)
            down_in = row * each_in + TITLE_IN
            box = Box(left_in, down_in, side_in, side_in)
            below_in = shades.matrix_panel(page, box, title, names, values, top, percent, beside_in)
            shades.key(page, Box(left_in, below_in + LABEL_IN + 0.03, side_in, 0.0), top, label, percent)
    heard, lost = traffic.outcome.heard.sum(), traffic.outcome.lost.sum()
    text = words.joined(
        "Who heard whom: rows are receivers, columns senders, darker is worse.",
        f"(a) Share of the sender's packets that the receiver lost: {lost} of {heard + lost} in all.",
        "(b) Time since the sender sent what the receiver heard last, as a mean while both were in the mission.",
        f"Black is {news.WORST_FRAMES} TDMA frames or more, whatever the run.",
        "Crossed: nothing was sent that could be heard.",
        captions.faults(results),
        captions.run_conditions(results),
    )
    return DrawnPage(page.figure, text)
