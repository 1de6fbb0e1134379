"""The figure of runs of lost and received packets: its dots and lines, its words, its numbers."""

import csv
import io

import pytest
from legibility import check_texts

from visualisation import DrawingError
from visualisation.bursts import (
    BurstsDrawn,
    FittedRuns,
    RunLengths,
    bursts_caption,
    bursts_contents,
    bursts_csv,
    bursts_figure,
)

DRAWN = BurstsDrawn(
    1234,
    2,
    RunLengths([1, 1, 2, 3], [2]),
    RunLengths([5, 40, 300], []),
    [FittedRuns("independent", [1.0, 0.3, 0.09], [0.7**n for n in range(300)])],
)


def test_runs_that_are_cut_count_while_they_were_seen():
    """By hand: of 5 runs 2 end at 1; of 3 at risk 1 ends at 2; the one left ends at 3."""
    assert dict(DRAWN.lost.points) == pytest.approx({1: 1.0, 2: 0.6, 3: 0.4, 4: 0.0})


def test_dots_are_measured_and_lines_fitted():
    lost, _ = bursts_figure(DRAWN).axes
    line, dots = lost.lines
    assert line.get_xydata().tolist() == [[1.0, 1.0], [2.0, 0.3], [3.0, 0.09]]
    assert dots.get_ydata() == pytest.approx([1.0, 0.6, 0.4])
    assert (lost.get_xscale(), lost.get_yscale()) == ("log", "log")


@pytest.mark.parametrize("n_models", [1, 4])
@pytest.mark.parametrize("longest", [1, 3, 30, 3000])
def test_it_can_be_read(n_models: int, longest: int, monkeypatch: pytest.MonkeyPatch):
    models = [FittedRuns(f"gilbert-elliott {n}", [0.5**k for k in range(9)], [0.9**k for k in range(longest + 1)])
              for n in range(n_models)]  # fmt: skip
    drawn = DRAWN._replace(received=RunLengths([1, longest], []), models=models)
    check_texts(bursts_figure(drawn), monkeypatch)


def test_the_caption_says_of_how_many():
    said = bursts_caption(DRAWN, "trial.csv")
    assert "n = 1234 packets on 2 links, 5 runs of lost and 3 of received ones" in said
    assert "Kaplan, Meier" in said
    assert "Kaplan" not in bursts_caption(DRAWN._replace(lost=RunLengths([1, 2], [])), "trial.csv")


def test_numbers_are_those_of_the_figure():
    rows = list(csv.DictReader(io.StringIO(bursts_csv(DRAWN).decode())))
    assert [(row["outcome"], row["k"], row["measured"], row["independent"]) for row in rows][:4] == [
        ("lost", "1", "1", "1"), ("lost", "2", "0.6", "0.3"), ("lost", "3", "0.4", "0.09"), ("lost", "4", "0", ""),
    ]  # fmt: skip


def test_there_is_something_to_draw():
    with pytest.raises(DrawingError, match="needs runs of lost and of received packets"):
        bursts_figure(DRAWN._replace(lost=RunLengths([], [])))
    with pytest.raises(DrawingError, match="format"):
        bursts_contents(DRAWN, "trial.csv", "bmp")
