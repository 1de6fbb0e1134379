"""The figure of delivery against range: its lines, its files, its words."""

import csv
import io
from collections import Counter

import pytest
from legibility import check_texts

from visualisation import DrawingError
from visualisation.reach import DrawnPackets, ModemReach, Point, reach_caption, reach_contents, reach_figure


def reach(modem: str, n_frames: int = 1, nominal_m: float = 2000.0) -> ModemReach:
    points = tuple(Point(1000.0 * n, 60.0 + n, 30.0 - n, 40.0 - n, 1.0 / n, 1.0 / n**0.5) for n in range(1, 9))
    return ModemReach(modem, nominal_m, n_frames, points)


def test_a_modem_is_a_line_and_its_frames_another():
    (axes,) = reach_figure([reach("a"), reach("b", n_frames=3)]).axes
    whole, star, whole_b, by_frame, star_b = axes.lines
    assert whole.get_xydata().tolist() == [[float(n), 1.0 / n] for n in range(1, 9)]
    assert by_frame.get_ydata().tolist() == [1.0 / n**0.5 for n in range(1, 9)]
    assert (star.get_xdata(), star.get_ydata()) == ([2.0], [0.5])
    assert whole.get_color() != whole_b.get_color() == by_frame.get_color() == star_b.get_color()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("range (km)", "delivery ratio")


def test_what_was_drawn_is_a_bar_with_its_interval():
    """Of 100 packets 50 arrived: 0.4038 to 0.5962 by Wilson."""
    (axes,) = reach_figure([reach("a")._replace(drawn=(DrawnPackets(2000.0, 100, 50),))]).axes
    _, bar, _ = axes.lines
    assert (bar.get_xdata().tolist(), bar.get_ydata().tolist()) == ([2.0], [0.5])
    (interval,) = axes.collections[0].get_segments()
    assert interval[:, 1] == pytest.approx([0.4038, 0.5962], abs=1e-4)


def test_a_nominal_range_beyond_the_ranges_has_no_star():
    (axes,) = reach_figure([reach("a", nominal_m=9000.0)]).axes
    assert len(axes.lines) == 1


@pytest.mark.parametrize("n_modems", range(1, 8))
def test_the_legend_fills_its_rows(n_modems: int, monkeypatch: pytest.MonkeyPatch):
    """The last entry stands alone nowhere; that of four modems, their frames and the nominal range is one row."""
    drawn = reach_figure([reach(f"whoi-psk-{n}", n_frames=2) for n in range(n_modems)])
    check_texts(drawn, monkeypatch)
    (legend,) = drawn.legends
    heights = Counter(round(text.get_window_extent().y0) for text in legend.get_texts())
    assert min(heights.values()) >= max(heights.values()) - 1
    assert n_modems > 4 or len(heights) == 1


def test_frames_are_named_only_where_there_are_some():
    assert "frames" not in reach_caption([reach("a")], "Calm.")
    assert "Dashed: share of frames" in reach_caption([reach("a"), reach("b", 2)], "Calm.")


@pytest.mark.parametrize(("format", "begins"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")])
def test_the_files_are_figure_caption_and_numbers(format: str, begins: bytes):
    made = dict(reach_contents([reach("a"), reach("b")], "Calm.", format))
    assert list(made) == [f"delivery-against-range.{end}" for end in (format, "txt", "csv")]
    assert made[f"delivery-against-range.{format}"].startswith(begins)
    assert b"a and b" in made["delivery-against-range.txt"]
    rows = list(csv.DictReader(io.StringIO(made["delivery-against-range.csv"].decode())))
    assert len(rows) == 16
    assert rows[8]["modem"] == "b"
    assert (rows[8]["range_m"], rows[9]["delivered"], rows[9]["snr_db"]) == ("1000", "0.5", "28")


def test_what_cannot_be_drawn_is_said():
    with pytest.raises(DrawingError, match="needs a modem"):
        reach_figure([])
    with pytest.raises(DrawingError, match="gif"):
        reach_contents([reach("a")], "", "gif")
