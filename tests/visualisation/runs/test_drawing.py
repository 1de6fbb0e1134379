"""Every figure of every synthetic run: legible, reproducible, with a caption."""

from pathlib import Path
from typing import Any

import matplotlib
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from legibility import check_texts
from synthetic_runs import DECLARED, FICTIONS, FINDS, LONG, Fiction

import remoras
from missions.runs.results import Results
from visualisation import KINDS, DrawingError, style
from visualisation.page import DrawnPage
from visualisation.runs import draw_run_figures, motivation, run_picture
from visualisation.runs.sheet import TALLEST_IN

ALL_KINDS = [*KINDS, FINDS.name]


ALONE = {
    "no places": ["trajectories"], "nobody moves": ["trajectories"], "wide sea": ["trajectories"],
    "not completed": ["trajectories", "roles"], "everything at the end": ["trajectories", "roles", "organisation"],
    "faults": ["trajectories", "roles"], "collisions": ["knowledge", "delivery", "tdma", "links"],
    "nested": ["organisation", "roles"], "two vehicles": [], "empty tables": [],
    "thirty-two vehicles": ["trajectories", "roles", "delivery", "tdma", "links"],
}  # fmt: skip
"""Figures that what is odd in a run shows in, if it does not show in all; nothing is odd in the usual run."""
IN_A_COLUMN = ("sixteen vehicles", "long names", "nested")
"""Runs with many or long words, which a column of a paper has least room for."""
LOSSLESS = ("one vehicle", "at once")
CASES = [
    (name, 3.5 if name in IN_A_COLUMN else None, kind)
    for name in FICTIONS
    for kind in ALONE.get(name, ALL_KINDS)
    if kind != "links" or name not in LOSSLESS
]


def drawn(runs: dict[str, Results], name: str, kind: str, width_in: float | None = None) -> DrawnPage:
    return run_picture(runs[name], kind, DECLARED, FICTIONS[name].places, width_in)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "width_in", "kind"), CASES)
def test_texts_overlap_nothing_and_captions_hold_the_conditions_of_the_run(
    runs: dict[str, Results], name: str, width_in: float | None, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor are texts cut off; a figure is as wide as it is wanted, and no taller than a page of a paper."""
    figure, text = (page := drawn(runs, name, kind, width_in)).figure, page.caption
    vehicles = len(FICTIONS[name].vehicles)
    ending = "ended at" if "not completed" in text else "mission time"
    for part in (f"n = {vehicles} vehicles", "seed 77", "policy m-ack", "PER 25 %", ending):
        assert part in text
    assert figure.get_figwidth() in ({style.COLUMN_IN, style.PAGE_IN} if width_in is None else {width_in})
    assert figure.get_figheight() <= TALLEST_IN or (kind, width_in) == ("links", 3.5)  # its panels stand in a column
    check_texts(figure, monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file_format", "kinds"),
    [("png", ["trajectories"]), ("svg", ["trajectories", "organisation", "links", FINDS.name]), ("pdf", ["roles"])],
)
def test_the_same_results_give_the_same_bytes(
    tmp_path: Path, runs: dict[str, Results], file_format: str, kinds: list[str]
) -> None:
    run = runs["two vehicles"]
    first, again = (
        draw_run_figures(run, kinds, tmp_path / name, file_format, DECLARED).files for name in ("first", "again")
    )
    assert [path.name for path in first] == [
        name for kind in kinds for name in (f"{kind}.{file_format}", f"{kind}.txt")
    ]
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in again]


def test_matplotlib_settings_of_the_user_change_no_figure(tmp_path: Path, runs: dict[str, Results]) -> None:
    plain, _ = draw_run_figures(runs["two vehicles"], ["roles"], tmp_path / "plain").files
    with matplotlib.rc_context({"font.size": 20, "lines.linewidth": 9, "savefig.bbox": "tight"}):
        draw_run_figures(runs["two vehicles"], ["roles"], tmp_path / "own")
        assert matplotlib.rcParams["font.size"] == 20
    assert (tmp_path / "own" / "roles.png").read_bytes() == plain.read_bytes()


FAULTS = "Faults: B joins (from 0.0 s on, away until 200 s); A mute (from 300 s on, until 600 s); B"


@pytest.mark.parametrize(
    ("name", "kind", "part"),
    [
        ("not completed", "roles", "not completed (out of time)"), ("long names", "trajectories", LONG),
        ("faults", "trajectories", FAULTS), ("faults", "roles", FAULTS),
    ],
)  # fmt: skip
def test_caption_names_faults_and_other_specifics_of_a_run(
    runs: dict[str, Results], name: str, kind: str, part: str
) -> None:
    found = drawn(runs, name, kind)
    assert part in found.caption
    assert part not in drawn(runs, "two vehicles", kind).caption
    legend = [text.get_text() for box in found.figure.legends for text in box.get_texts()]
    assert ("fault" in legend) == (name == "faults")


@pytest.mark.parametrize(("channel", "said"), [("bernoulli", "channel, PER 25 %"), ("acoustic", ", expected PER ")])
def test_caption_calls_a_rate_expected_that_is_computed_before_the_run(channel: str, said: str) -> None:
    given = {"scenario.duration_s": 10.0} | ({"channel.per": 0.25} if channel == "bernoulli" else {})
    assert said in remoras.run("mapping-rendezvous", channel=channel, set=given).plot("roles").caption


@pytest.mark.parametrize(
    ("kinds", "given", "message"),
    [
        (["roles", "trajectory"], {}, r"'trajectory'.*roles.*nearest: 'trajectories'"),
        (["roles"], {"format": "jpg"}, "'jpg'; known: png, svg, pdf"),
        (["roles"], {"width_in": 90.0}, "width 90 in: allowed are 3 to 20 inches"),
        (["organisation"], {"at_s": 1200.0}, "at 1200 s: this run lasts from 0 to 1000 s"),
        (["organisation"], {"viewer": "a"}, "unknown vehicle 'a'; known: A, B; nearest: '[AB]'"),
        (["roles"], {"panel": "a"}, "panel a: applies to the figure trajectories only; name it too"),
        (["roles"], {"at_s": 9.0, "viewer": "A"}, "at 9 s: applies to the figure organisation only; name it too"),
    ],
)
def test_invalid_kind_or_option_is_refused(
    tmp_path: Path, runs: dict[str, Results], kinds: list[str], given: dict[str, Any], message: str
) -> None:
    with pytest.raises(DrawingError, match=message):
        draw_run_figures(runs["two vehicles"], kinds, tmp_path / "out", **given)
    assert not (tmp_path / "out").exists()


def test_figure_without_its_table_is_omitted_or_refused_if_requested(tmp_path: Path) -> None:
    fiction = Fiction()
    run = fiction.write(tmp_path / "run")
    (run.folder / "satisfaction.parquet").unlink()
    (run.folder / "finds.parquet").unlink()
    written = draw_run_figures(run, [], tmp_path / "all", "svg", DECLARED, fiction.places)
    assert [path.stem for path in written.files[::2]] == [
        "trajectories", "roles", "organisation", "motivation", "htn", "knowledge", "delivery", "tdma", "links",
    ]  # fmt: skip
    assert written.notes == [
        "satisfaction is left out: these results have no table satisfaction",
        "finds is left out: these results have no table finds",
        "wrecks are not shown in trajectories: these results have no table finds",
    ]
    with pytest.raises(DrawingError, match=r"^finds: these results have no table finds$"):
        draw_run_figures(run, ["roles", "finds"], tmp_path / "named", "svg", DECLARED)
    assert not (tmp_path / "named").exists()


def test_tracks_are_drawn_without_roles(tmp_path: Path) -> None:
    run = Fiction().write(tmp_path / "run")
    (run.folder / "roles.parquet").unlink()
    assert run_picture(run, "trajectories").notes == ()


def test_closest_decisions_are_drawn_with_rejected_options(tmp_path: Path) -> None:
    """A and B leave homing aside, by 0.4 against 0.3; the evasion has no mean, and half of B's motives are signals.

    Of two choices at one time the later counts.
    """
    run = Fiction().write(tmp_path / "run")
    found = motivation.contested(run)
    assert [(one.vehicle, one.time_s, len(one.rows)) for one in found] == [("A", 100.0, 3), ("B", 200.0, 3)]
    assert [one.margin for one in found] == pytest.approx([0.1, 0.1])
    figure = run_picture(run, "motivation").figure
    hatched = [[bar.get_width() for bar in axes.patches if bar.get_hatch()] for axes in figure.axes]
    assert hatched == [[], pytest.approx([0.25] * 3)]
    assert "All such decisions" in run_picture(run, "motivation").caption
    path = run.folder / "decisions.parquet"
    table = pq.read_table(path)
    pq.write_table(pa.concat_tables([table] * 2), path)
    assert motivation.contested(Results(run.folder)) == found
    later = table.set_column(0, "time_s", pa.array([time_s + 1000.0 for time_s in table["time_s"].to_pylist()]))
    pq.write_table(pa.concat_tables([table, later]), path)
    again = Results(run.folder)
    assert len(motivation.contested(again)) == 4
    drawn = run_picture(again, "motivation")
    assert len(drawn.figure.axes) == 2
    assert "The 2 most closely contested, one per choice of a vehicle, of 4 such decisions" in drawn.caption


def test_decision_with_two_equal_candidates_is_drawn_whole(tmp_path: Path) -> None:
    """As of two surveys of a role that differ in no column; only its first candidate begins a decision anew."""
    run = Fiction().write(tmp_path / "run")
    single = motivation.contested(run)
    path = run.folder / "decisions.parquet"
    table = pq.read_table(path)
    twice = [number for number in range(table.num_rows) for _ in range(1 + (not table["chosen"][number].as_py()))]
    pq.write_table(table.take(twice), path)
    double = motivation.contested(Results(run.folder))
    assert [one[:2] for one in double] == [one[:2] for one in single]
    assert [one.margin for one in double] == [one.margin for one in single]
    assert [len(one.rows) for one in double] == [len(one.rows) + 1 for one in single]
