"""The figure of delivery against range: its lines, its files, its words."""

import csv
import io

import pytest

from visualisation import DrawingError
from visualisation.reach import Point, Reach, caption, contents, figure


def reach(modem: str, n_frames: int = 1, nominal_m: float = 2000.0) -> Reach:
    points = tuple(Point(1000.0 * n, 60.0 + n, 30.0 - n, 40.0 - n, 1.0 / n, 1.0 / n**0.5) for n in range(1, 9))
    return Reach(modem, nominal_m, n_frames, points)


def test_a_modem_is_a_line_and_its_frames_another():
    (axes,) = figure([reach("a"), reach("b", n_frames=3)]).axes
    whole, star, whole_b, by_frame, star_b = axes.lines
    assert whole.get_xydata().tolist() == [[float(n), 1.0 / n] for n in range(1, 9)]
    assert by_frame.get_ydata().tolist() == [1.0 / n**0.5 for n in range(1, 9)]
    assert (star.get_xdata(), star.get_ydata()) == ([2.0], [0.5])
    assert whole.get_color() != whole_b.get_color() == by_frame.get_color() == star_b.get_color()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("range (km)", "delivery ratio")


def test_a_nominal_range_beyond_the_ranges_has_no_star():
    (axes,) = figure([reach("a", nominal_m=9000.0)]).axes
    assert len(axes.lines) == 1


def test_frames_are_named_only_where_there_are_some():
    assert "frames" not in caption([reach("a")], "Calm.")
    assert "Dashed: share of frames" in caption([reach("a"), reach("b", 2)], "Calm.")


@pytest.mark.parametrize(("format", "begins"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")])
def test_the_files_are_figure_caption_and_numbers(format: str, begins: bytes):
    made = dict(contents([reach("a"), reach("b")], "Calm.", format))
    assert list(made) == [f"delivery-against-range.{end}" for end in (format, "txt", "csv")]
    assert made[f"delivery-against-range.{format}"].startswith(begins)
    assert b"a and b" in made["delivery-against-range.txt"]
    rows = list(csv.DictReader(io.StringIO(made["delivery-against-range.csv"].decode())))
    assert len(rows) == 16
    assert rows[8]["modem"] == "b"
    assert (rows[8]["range_m"], rows[9]["delivered"], rows[9]["snr_db"]) == ("1000", "0.5", "28")


def test_what_cannot_be_drawn_is_said():
    with pytest.raises(DrawingError, match="needs a modem"):
        figure([])
    with pytest.raises(DrawingError, match="gif"):
        contents([reach("a")], "", "gif")
