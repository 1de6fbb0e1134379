"""Figures of the policy study and of delivery over range; files of figures; colours of vehicles."""

import csv
import io
import itertools
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from legibility import check_texts
from matplotlib.colors import to_hex
from numpy.typing import NDArray
from synthetic_runs import Fiction

from exchange.study.parameters import ExchangeStudy, StudyLoad
from exchange.study.study import StudyRow, loaded_studies, run
from missions.errors import OutputError
from missions.figure import Mark, Place
from visualisation import policies, style
from visualisation.output import DrawingError, write_folder
from visualisation.policies import contents, unloaded_figure
from visualisation.reach import ModemReach, Point, reach_contents, reach_figure
from visualisation.runs import run_picture


def write_figure(rows: list[StudyRow], kind: str, folder: Path, name: str, format: str = "png") -> list[Path]:
    return write_folder(folder, contents(rows, kind, name, format))


@pytest.fixture(scope="module")
def rows() -> list[StudyRow]:
    return run(ExchangeStudy(per=(0.1, 0.4, 0.7), trials=20, seed=3))


@pytest.fixture(scope="module")
def loaded() -> list[StudyRow]:
    return [row for study in loaded_studies(trials=2)[::8] for row in run(study)]


@pytest.mark.parametrize("kind", ["delivered", "source", "senders", "loaded"])
def test_figure_has_caption_and_numbers_and_is_reproducible(
    rows: list[StudyRow], loaded: list[StudyRow], kind: str, tmp_path: Path
) -> None:
    rows = loaded if kind == "loaded" else rows
    made, again = (write_figure(rows, kind, tmp_path / name, "figure-3", "svg") for name in ("new", "again"))
    assert [path.name for path in made] == [f"figure-3.{end}" for end in ("svg", "txt", "csv")]
    assert [path.read_bytes() for path in made] == [path.read_bytes() for path in again]
    said = "n = 2 trials" if kind == "loaded" else "n = 20 trials per point, seed 3"
    assert said in made[1].read_text(encoding="utf-8")
    with made[2].open(encoding="utf-8") as file:
        read = list(csv.DictReader(file))
    assert [(line["policy"], float(line["per"])) for line in read] == [(row.policy, row.per) for row in rows]
    for line, row in zip(read, rows, strict=True):
        if row.senders_acked_slots is not None:
            assert float(line["senders_acked_slots_mean"]) == row.senders_acked_slots.mean
    assert "cpu_s" not in read[0]


def test_policies_have_distinct_looks(rows: list[StudyRow]) -> None:
    axes = unloaded_figure(rows, "source").axes[0]
    lines = [line for line in axes.get_lines() if len(line.get_xdata()) == 3]
    looks = {(line.get_color(), line.get_linestyle(), str(line.get_markerfacecolor())) for line in lines}
    assert len(lines) == len(looks) == 6
    assert {str(label.get_text()) for label in axes.figure.legends[0].get_texts()} == {row.policy for row in rows}


def test_figure_is_drawn_with_one_point_and_with_none(tmp_path: Path) -> None:
    write_figure(run(ExchangeStudy(per=(0.2,), trials=1, policies=("ack",))), "source", tmp_path, "one")
    censored = run(ExchangeStudy(per=(0.9,), trials=3, max_slots=2, load=StudyLoad()))
    _, text, _ = write_figure(censored, "senders", tmp_path, "none")
    assert "Censored trials, not in the means: 18" in text.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("kind", "format", "message"),
    [
        ("sorce", "png", r"unknown kind of figure 'sorce'.*nearest: 'source'"), ("source", "bmp", "format 'bmp'"),
        ("loaded", "png", "needs rows of Poisson load"), ("none", "png", "there are none"),
    ],
)  # fmt: skip
def test_invalid_rows_kind_or_format_are_refused(rows: list[StudyRow], kind: str, format: str, message: str) -> None:
    with pytest.raises(DrawingError, match=message):
        contents([], "source", "x", format) if kind == "none" else contents(rows, kind, "x", format)


def test_user_policy_has_a_distinct_colour(rows: list[StudyRow], tmp_path: Path) -> None:
    """Its acknowledgement gets a colour of no shipped one, without any declaration."""
    outside = [replace(row, policy="sparse") for row in rows[:1]]
    write_figure([*rows, *outside], "source", tmp_path, "outside")
    looks = policies._looks([*rows, *outside])
    assert looks["sparse"]["color"] not in {look["color"] for name, look in looks.items() if name != "sparse"}
    assert looks["sparse"]["label"] == "sparse"


# The figure of delivery against range: its lines, its files, its words


def reach(modem: str, nominal_m: float = 2000.0) -> ModemReach:
    points = tuple(Point(1000.0 * n, 60.0 + n, 30.0 - n, 40.0 - n, 1.0 / n) for n in range(1, 9))
    return ModemReach(modem, nominal_m, points)


def test_modem_is_drawn_as_a_line_with_its_nominal_range():
    (axes,) = reach_figure([reach("a"), reach("b")]).axes
    whole, star, whole_b, star_b = axes.lines
    assert whole.get_xydata().tolist() == [[float(n), 1.0 / n] for n in range(1, 9)]
    assert (star.get_xdata(), star.get_ydata()) == ([2.0], [0.5])
    assert whole.get_color() != whole_b.get_color() == star_b.get_color()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("range (km)", "delivery ratio")


def test_nominal_range_outside_the_axis_has_no_star():
    (axes,) = reach_figure([reach("a", nominal_m=9000.0)]).axes
    assert len(axes.lines) == 1


@pytest.mark.parametrize("n_modems", [1, 4, 7])
def test_texts_overlap_nothing(n_modems: int, monkeypatch: pytest.MonkeyPatch):
    check_texts(reach_figure([reach(f"whoi-psk-{n}") for n in range(n_modems)]), monkeypatch)


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


def test_no_modem_or_unknown_format_is_refused():
    with pytest.raises(DrawingError, match="needs a modem"):
        reach_figure([])
    with pytest.raises(DrawingError, match="gif"):
        reach_contents([reach("a")], "", "gif")


# Files of figures are there whole or not at all


PICTURE = b"x" * 70_000


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """Limit the size of files, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_full_disk_leaves_no_partial_file_and_keeps_old_ones(tmp_path: Path) -> None:
    (tmp_path / "roles.txt").write_text("older", encoding="utf-8")
    with room_for(65_536), pytest.raises(DrawingError, match=r"roles\.png: cannot be written: File too large"):
        write_folder(tmp_path, [("roles.txt", b"newer"), ("roles.png", PICTURE)])
    assert {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()} == {"roles.txt": "older"}


def test_file_that_blocks_a_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("precious", encoding="utf-8")
    with pytest.raises(OutputError, match="file: names a file; allowed: a folder"):
        write_folder(tmp_path / "file", [("roles.png", PICTURE)])
    assert (tmp_path / "file").read_text(encoding="utf-8") == "precious"


# Colours of vehicles stay apart, also for readers who do not see all of them. Colour-blindness is simulated as by
# Machado, Oliveira and Fernandes (2009), severity 1, in linear RGB; distances are those of CIE 1976 L*a*b*, in which
# 2.3 is just noticeable.


SIMULATIONS = {
    "all colours": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = np.array([0.95047, 1.0, 1.08883])
LEAST = 15.0
"""More than six times what is just noticeable."""


def seen(colour: str, simulation: str) -> NDArray[np.float64]:
    """A colour in L*a*b* as such a reader sees it."""
    share = np.array([int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)])
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    xyz = TO_XYZ @ np.clip(np.array(SIMULATIONS[simulation]) @ linear, 0.0, 1.0) / WHITE
    x, y, z = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def nearest(colours: tuple[str, ...], simulation: str) -> float:
    """Least distance between two of the colours."""
    points = [seen(colour, simulation) for colour in colours]
    return min(float(np.linalg.norm(a - b)) for a, b in itertools.combinations(points, 2))


@pytest.mark.parametrize("simulation", SIMULATIONS)
def test_colours_of_eight_vehicles_are_distinguishable(simulation: str) -> None:
    fills = tuple(style.vehicle_look(number).colour for number in range(8))
    assert len(set(fills)) == 8
    assert nearest(fills, simulation) > LEAST
    assert nearest((*fills, style.YELLOW, style.BLACK), simulation) > 14.0  # places, and the fleet


@pytest.mark.parametrize("simulation", SIMULATIONS)
def test_a_milestone_stands_out_from_the_place_below_it(simulation: str, tmp_path: Path) -> None:
    """By its colour, and smaller, so that the place shows around it."""
    run = Fiction(milestones=[("work_done", "A", "", 900.0)]).write(tmp_path / "run")
    figures = (Mark("work_done", "done"),), (Place("home", "dock", ((5.0, 5.0),)),)
    shown = run_picture(run, "trajectories", *figures).figure.legends[0].legend_handles
    done, dock = (next(entry for entry in shown if entry.get_label() == label) for label in ("done", "dock"))
    assert nearest((to_hex(done.get_markerfacecolor()), to_hex(dock.get_markerfacecolor())), simulation) > LEAST
    assert done.get_markersize() < dock.get_markersize()
