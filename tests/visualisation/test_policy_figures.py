"""Figures of the policy study: the files, the numbers behind them, and what is refused."""

import csv
from dataclasses import replace
from pathlib import Path

import pytest

from exchange.study.study import ExchangeStudy, StudyLoad, StudyRow, loaded_studies, run
from visualisation import policies
from visualisation.output import DrawingError, write_folder
from visualisation.policies import caption, contents, loaded_figure, unloaded_figure


def write_figure(rows: list[StudyRow], kind: str, folder: Path, name: str, format: str = "png") -> list[Path]:
    return write_folder(folder, contents(rows, kind, name, format))


@pytest.fixture(scope="module")
def rows() -> list[StudyRow]:
    return run(ExchangeStudy(per=(0.1, 0.4, 0.7), trials=20, seed=3))


@pytest.fixture(scope="module")
def loaded() -> list[StudyRow]:
    return [row for study in loaded_studies(trials=2)[::8] for row in run(study)]


@pytest.mark.parametrize("kind", ["delivered", "source", "senders"])
def test_a_figure_comes_with_caption_and_numbers(rows: list[StudyRow], kind: str, tmp_path: Path) -> None:
    picture, text, table = write_figure(rows, kind, tmp_path / "new", "figure-3", "svg")
    assert picture.name == "figure-3.svg"
    assert picture.stat().st_size > 5000
    assert "n = 20 trials per point, seed 3" in text.read_text(encoding="utf-8")
    with table.open(encoding="utf-8") as file:
        read = list(csv.DictReader(file))
    assert [(line["policy"], float(line["per"])) for line in read] == [(row.policy, row.per) for row in rows]
    for line, row in zip(read, rows, strict=True):
        assert row.senders_acked_slots is not None
        assert float(line["senders_acked_slots_mean"]) == row.senders_acked_slots.mean
    assert "cpu_s" not in read[0]


def test_the_loaded_case_has_its_own_figure(loaded: list[StudyRow], tmp_path: Path) -> None:
    picture, text, _ = write_figure(loaded, "loaded", tmp_path, "loaded")
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert "packets of 256 bits" in text.read_text(encoding="utf-8")
    assert "Poisson" in caption(loaded, "loaded")


def test_the_same_rows_give_the_same_bytes(rows: list[StudyRow], tmp_path: Path) -> None:
    files = [write_figure(rows, "source", tmp_path / name, "figure") for name in ("one", "other")]
    assert [path.read_bytes() for path in files[0]] == [path.read_bytes() for path in files[1]]


def test_every_policy_has_a_look_of_its_own(rows: list[StudyRow]) -> None:
    axes = unloaded_figure(rows, "source").axes[0]
    lines = [line for line in axes.get_lines() if len(line.get_xdata()) == 3]
    looks = {(line.get_color(), line.get_linestyle(), str(line.get_markerfacecolor())) for line in lines}
    assert len(lines) == len(looks) == 6
    assert {str(label.get_text()) for label in axes.figure.legends[0].get_texts()} == {row.policy for row in rows}


def test_axes_name_quantity_and_unit(rows: list[StudyRow], loaded: list[StudyRow]) -> None:
    labels = [axes.get_ylabel() for axes in (*unloaded_figure(rows, "source").axes, *loaded_figure(loaded).axes)]
    assert labels == [
        "time relative to ACK", "time (slots)", "delivery latency (slots)", "acknowledgement latency (slots)",
        "items in flight", "goodput (items per slot)",
    ]  # fmt: skip


def test_a_figure_stands_with_a_single_point_and_with_none(tmp_path: Path) -> None:
    write_figure(run(ExchangeStudy(per=(0.2,), trials=1, policies=("ack",))), "source", tmp_path, "one")
    censored = run(ExchangeStudy(per=(0.9,), trials=3, max_slots=2, load=StudyLoad()))
    _, text, _ = write_figure(censored, "senders", tmp_path, "none")
    assert "Censored, and not in the means: 18" in text.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("kind", "format", "message"),
    [
        ("sorce", "png", r"unknown kind of figure 'sorce'.*nearest: 'source'"), ("source", "bmp", "format 'bmp'"),
        ("loaded", "png", "needs rows of Poisson load"), ("none", "png", "there are none"),
    ],
)  # fmt: skip
def test_what_cannot_be_drawn_is_refused(rows: list[StudyRow], kind: str, format: str, message: str) -> None:
    with pytest.raises(DrawingError, match=message):
        contents([], "source", "x", format) if kind == "none" else contents(rows, kind, "x", format)


def test_a_policy_from_outside_is_drawn_with_a_look_of_its_own(rows: list[StudyRow], tmp_path: Path) -> None:
    """Its acknowledgement has a colour that no shipped one has; nothing has to be told to the figures."""
    outside = [replace(row, policy="sparse", acknowledgement="sparse", repeats=False) for row in rows[:1]]
    write_figure([*rows, *outside], "source", tmp_path, "outside")
    looks = policies._looks([*rows, *outside])
    assert looks["sparse"]["color"] not in {look["color"] for name, look in looks.items() if name != "sparse"}
    assert looks["sparse"]["label"] == "sparse"
