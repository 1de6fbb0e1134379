"""Figures of sweeps: legible, reproducible, with data and conditions."""

import csv
import json
import math
import re
import warnings
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest
from legibility import check_texts
from matplotlib.text import Text
from PIL import Image
from sampling import sampled
from synthetic_sweeps import FEW, METRICS, SEVEN, SWEEPS, TEN, Sweep, law

from missions.comparison import compare, ranks
from missions.errors import OutputError
from missions.metric import Better, Metric
from missions.statistics import INTERVALS_OF_DIFFERENCES, INTERVALS_OF_MEANS
from missions.sweeps.folder import SweepResults
from visualisation import SWEEP_KINDS, style
from visualisation.output import DrawingError
from visualisation.sweeps import draw_sweep_figures, ranking, sweep_picture
from visualisation.sweeps.arrangement import RANKED, arranged, by_kind
from visualisation.sweeps.comparison import Numbers, _charts

CHARTS = by_kind(METRICS)
DRAWN = ("mission-time", "success-rate", "coverage", "double-work", "bytes", "energy", "latency", "consistency-time")
"""Charts of metrics that the made-up runs have."""
COUNTING_FAILURES = ("mission-time", "success-rate", "differences", "ranking")
"""Figures of metrics of which a failed run has a value."""
OVERVIEW = ("mission_time_s", "completed", "energy_j", "n_bytes", "coverage_fraction", "duplicate_fraction")
"""Headline metrics, which a study that names none has, in the order of their declaration."""


OF_EVERY_METRIC = (("seven strategies", None), ("all the same", None))
"""Sweeps, and widths, of which each metric is drawn: usual values, and equal ones."""


@pytest.fixture(autouse=True)
def no_warnings() -> "object":
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def few(*strategies: str, repeats: int = 2, **given: Any) -> Sweep:
    """A small sweep over three loss rates."""
    return Sweep(strategies, **{"channels": [("bernoulli", FEW, {})], "repeats": repeats, **given})


def captions(results: SweepResults, kinds: Sequence[str], folder: Path, ranked: str = RANKED) -> list[str]:
    """Captions of the figures that are written, in their order."""
    files = draw_sweep_figures(results, kinds, folder, "svg", ranked=ranked).files
    return [path.read_text(encoding="utf-8") for path in files if path.suffix == ".txt"]


def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "width_in"),
    [
        *sampled(((name, 3.5 if name == "unforeseen" else None) for name in SWEEPS), ("unforeseen", 3.5)),
        ("seven strategies", 7.0),
    ],
)
def test_texts_overlap_nothing_and_means_are_inside_the_frame(
    sweeps: dict[str, SweepResults], name: str, width_in: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a column of a paper panels stand one above the other; a table that has no room is refused."""
    kinds = (*(DRAWN if (name, width_in) in OF_EVERY_METRIC else DRAWN[:1]), *SWEEP_KINDS)
    numbers = Numbers(sweeps[name], RANKED)
    charts = {of: [*_charts(of, numbers)] for of in kinds if not numbers.lacking(of)}
    for kind, chart in [(of, one) for of, alike in charts.items() for one in alike[-2:]]:
        if kind == "ranking":
            with pytest.raises(DrawingError, match=r"ranking: needs a width of \d\.\d in for \d+ columns; 1 given"):
                chart.figure(1.0)
        figure = chart.figure(width_in)
        wide = kind == "overview" or len(figure.axes) > 1
        allowed = {style.PAGE_IN} if wide else {style.COLUMN_IN, style.PAGE_IN}
        assert figure.get_figwidth() in (allowed if width_in is None else {width_in}), kind
        check_texts(figure, monkeypatch)
        for axes in figure.axes:
            (left, right), (bottom, top) = axes.get_xlim(), sorted(axes.get_ylim())
            for line in axes.get_lines():
                assert all(left <= x <= right for x in line.get_xdata()), kind
                if line.get_transform() is axes.transData:  # else an arrow at the rim
                    assert all(bottom <= y <= top or math.isnan(y) for y in line.get_ydata()), kind


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file_format", "kinds"),
    [("svg", ["ranking", "differences"]), ("png", ["ranking"]), ("pdf", ["bytes"])],
)
def test_the_same_sweep_gives_the_same_bytes(
    tmp_path: Path, seven: SweepResults, file_format: str, kinds: Sequence[str]
) -> None:
    first, again = (draw_sweep_figures(seven, kinds, tmp_path / name, file_format) for name in ("first", "again"))
    names = [path.name for path in first.files]
    assert set(names) >= {f"{kind}.{suffix}" for kind in kinds for suffix in (file_format, "csv", "txt")}
    assert len(names) == len(set(names))
    assert [path.read_bytes() for path in first.files] == [path.read_bytes() for path in again.files]


def kinds_of(drawn: Sequence[Path]) -> list[str]:
    """Kinds of the figures that were written, in their order."""
    return [path.stem for path in drawn if path.suffix == ".svg"]


def test_default_figures_are_comparisons_and_headline_metrics(tmp_path: Path, seven: SweepResults) -> None:
    """Of strategies: which is best, by how much, and the headline metrics; never more than eight."""
    drawn = draw_sweep_figures(seven, (), tmp_path, "svg")
    kinds = kinds_of(drawn.files)
    assert kinds[:3] == ["overview", "ranking", "differences"]
    assert "trade-off" not in kinds
    assert kinds[3:] == [kind for metric in OVERVIEW for kind in DRAWN if CHARTS[kind].name == metric][:5]
    assert any("--all draws all" in note for note in drawn.notes)


def test_policies_have_a_trade_off_and_a_single_series_no_ranking(tmp_path: Path) -> None:
    policies = few("remoras", policies=("ack", "mps-ack"), repeats=4).write(tmp_path / "two")
    kinds = kinds_of(draw_sweep_figures(policies, (), tmp_path / "of two", "svg").files)
    assert kinds[:4] == ["overview", "ranking", "differences", "trade-off"]
    single = few("remoras", repeats=4).write(tmp_path / "one")
    kinds = kinds_of(draw_sweep_figures(single, (), tmp_path / "of one", "svg").files)
    assert kinds[0] == "overview"
    assert not {"ranking", "differences", "trade-off"} & {*kinds}


def test_full_success_has_its_wilson_interval(tmp_path: Path) -> None:
    """Of 10 runs that all succeed Wilson's interval is [0.72, 1]; it is drawn as every other."""
    results = few("remoras", "central", repeats=10).write(tmp_path / "sweep")
    (axes,) = sweep_picture(results, "success-rate").figure.axes
    ends = [tuple(segment[:, 1]) for lines in axes.collections for segment in lines.get_segments()]  # type: ignore[attr-defined]
    rows = compare(results, ["completed"])
    assert len(ends) == len(rows)
    certain = [row for row in rows if row.mean == 1.0]
    assert certain
    assert sum(end == pytest.approx((0.722, 1.0), abs=0.001) for end in ends) == len(certain)
    assert axes.get_ylim()[0] < 0.722


def test_the_numbers_are_the_rows_of_compare_and_of_the_ranking(tmp_path: Path, seven: SweepResults) -> None:
    draw_sweep_figures(seven, ["bytes", "overview", "ranking"], tmp_path, ranked="n_bytes")
    rows = [{**asdict(row), "settings": json.dumps(row.settings)} for row in compare(seven, ["n_bytes"])]
    wanted = [{key: "" if value is None else str(value) for key, value in row.items()} for row in rows]
    assert table(tmp_path / "bytes.csv") == wanted
    assert len(wanted) == len(SEVEN) * len(TEN)
    assert list(dict.fromkeys(row["metric"] for row in table(tmp_path / "overview.csv"))) == list(OVERVIEW)
    found = [(row["strategy"], row["rank"], row["among_best"]) for row in table(tmp_path / "ranking-n_bytes.csv")]
    assert found == [(row.strategy, str(row.rank), str(row.among_best)) for row in ranks(seven, "n_bytes")]


@pytest.fixture(scope="module")
def texts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Captions of all figures of a sweep in which one run failed, by kind."""
    kinds, folder = [*DRAWN, *SWEEP_KINDS], tmp_path_factory.mktemp("captions")
    results = few(*SEVEN[:2], repeats=4, n_failed=1, consistency=True).write(folder / "sweep")
    return dict(zip(kinds, captions(results, kinds, folder / "out"), strict=True))


@pytest.mark.parametrize("kind", [*DRAWN, *SWEEP_KINDS])
def test_captions_state_runs_seed_factors_and_failures(texts: dict[str, str], kind: str) -> None:
    text = texts[kind]
    for part in (
        {"consistency-time": "n = 2 to 3", **dict.fromkeys(COUNTING_FAILURES, "n = 4 ")}.get(kind, "n = 3 to 4"),
        "master seed 11", "strategies remoras, fixed-partition", "policy m-ack",
        "channel bernoulli", "Scenario mapping-rendezvous", "23 of 24 runs done", "remoras 9.8.7",
        "1 failed (count as not completed)",
    ):  # fmt: skip
        assert part in text
    assert re.search(r"\d+ of them not completed \(censored\)", text)
    intervals = {
        "ranking": "step-down sign-flip test of all pairs",
        "differences": "Fewer than 8 pairs have no interval.",
        "success-rate": "95 % Wilson intervals",
    }
    assert intervals.get(kind, "ranges from least to largest value") in text
    assert INTERVALS_OF_MEANS not in text
    assert INTERVALS_OF_DIFFERENCES not in text


def test_captions_name_the_bars_that_are_drawn(tmp_path: Path) -> None:
    """With 30 repeats means have intervals, pairs too; where runs are incomplete, of the restricted mean."""
    results = few(*SEVEN[:2], repeats=30).write(tmp_path / "sweep")
    of_bytes, times, differences = captions(results, ["bytes", "mission-time", "differences"], tmp_path / "out")
    assert f"Lines show means, bars {INTERVALS_OF_MEANS}. n = 30" in of_bytes
    assert "intervals of the restricted mean where runs are incomplete" in times
    assert "(restricted mean)" in times
    assert f"Bars show {INTERVALS_OF_DIFFERENCES}." in differences
    assert "Missions end at 7200 s at the latest." in differences
    assert " 0 " not in of_bytes.rpartition("Study")[2]
    axes = sweep_picture(results, "differences").figure.axes[0]
    assert axes.get_ylabel() == "mission time,\ndifference to remoras (s)"


def test_a_metric_without_values_is_refused(tmp_path: Path, sweeps: dict[str, SweepResults]) -> None:
    with pytest.raises(DrawingError, match="consistency-time: no run has a value of consistency_time_s"):
        draw_sweep_figures(sweeps["one strategy"], ["bytes", "consistency-time"], tmp_path / "named")
    assert not (tmp_path / "named").exists()


def law_of_bound(*what: object) -> dict[str, object]:
    return {**law(*what), "completed": what[0] == "oracle"}


def test_bound_is_drawn_but_not_ranked(tmp_path: Path) -> None:
    """Though it alone completes, the work of the others is equal; with one strategy beside it there are no ranks."""
    results = few("remoras", "central", "oracle", summary=law_of_bound).write(tmp_path / "three")
    legend = [
        text.get_text() for legend in sweep_picture(results, "bytes").figure.legends for text in legend.get_texts()
    ]
    assert "oracle (bound)" in legend
    texts = captions(results, ["bytes", "ranking"], tmp_path / "out")
    assert all("Not ranked, since a bound: oracle." in text and "Unequal work:" not in text for text in texts)
    assert {row["strategy"] for row in table(tmp_path / "out" / "bytes.csv")} == {"remoras", "central", "oracle"}
    assert {row["strategy"] for row in table(tmp_path / "out" / "ranking.csv")} == {"remoras", "central"}
    two = few("remoras", "oracle").write(tmp_path / "two")
    with pytest.raises(DrawingError, match="ranking: needs two strategies or policies besides bounds"):
        draw_sweep_figures(two, ["ranking"], tmp_path / "out2")


def test_unfinished_sweep_is_drawn_with_the_number_of_missing_runs(tmp_path: Path) -> None:
    results = few(*SEVEN[:2], n_remaining=3).write(tmp_path / "sweep")
    drawn = draw_sweep_figures(results, ["bytes", "ranking"], tmp_path / "out", "svg")
    assert drawn.notes == ["the sweep is not finished, 3 runs are missing in the figures"]
    assert "3 still to run" in (tmp_path / "out" / "bytes.txt").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("kind", "given", "error", "message"),
    [
        ("misson-time", {}, DrawingError, r"unknown kind of figure of a sweep 'misson-time'.*nearest: 'mission-time'"),
        ("roles", {}, DrawingError, "'roles' is a figure of a single run"),
        ("bytes", {"format": "bmp"}, DrawingError, "unknown format 'bmp'"),
        ("ranking", {"ranked": "n_byte"}, OutputError, r"'n_byte'.*did you mean 'n_bytes'"),
    ],
)
def test_invalid_kind_metric_or_format_is_refused(
    tmp_path: Path, seven: SweepResults, kind: str, given: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        draw_sweep_figures(seven, [kind], tmp_path / "out", **given)
    assert not (tmp_path / "out").exists()


def combinations(n: int) -> Sweep:
    channels = [("bernoulli", [0.1, 0.2], {})]
    return Sweep(["remoras"], channels=channels, repeats=1, grid={"mission.mode": list(range(n))})


def test_up_to_six_combinations_share_a_figure(tmp_path: Path) -> None:
    for n, names in (
        (6, {"bytes.svg", "bytes.csv", "bytes.txt"}),
        (7, {f"bytes-mode={at}.{suffix}" for at in range(7) for suffix in ("svg", "csv", "txt")}),
    ):
        results = combinations(n).write(tmp_path / f"sweep{n}")
        drawn = draw_sweep_figures(results, ["bytes"], tmp_path / f"out{n}", "svg")
        assert {path.name for path in drawn.files} == names
    rows = table(tmp_path / "out7" / "bytes-mode=3.csv")
    assert [json.loads(row["settings"]) for row in rows] == [{"mission.mode": "3"}] * 2
    assert (tmp_path / "out7" / "bytes-mode=3.txt").read_text().startswith("mode = 3: ")


def test_cases_of_unforeseen_events_are_panels_or_values_of_the_axis(tmp_path: Path) -> None:
    cases = ("nothing", "speeds within 30 %", "one vehicle lost")
    several = few(*SEVEN[:3], repeats=4, unforeseen=cases).write(tmp_path / "panels")
    for caption in captions(several, ["mission-time", "differences"], tmp_path):
        assert "Panels: (a) nothing; (b) speeds within 30 %; (c) one vehicle lost." in caption
    channels = [("bernoulli", [0.4], {})]
    one = few(*SEVEN[:3], channels=channels, repeats=4, unforeseen=cases).write(tmp_path / "axis")
    caption, _ = captions(one, ["mission-time", "ranking"], tmp_path / "out")
    assert "Mission time over unforeseen events." in caption
    assert "Cases: 1 nothing, 2 speeds within 30 %, 3 one vehicle lost." in caption
    assert {row["unforeseen"] for row in table(tmp_path / "out" / "ranking.csv")} == set(cases)


def half(*what: object) -> dict[str, object]:
    """The usual law, but central never completes: 30 failures in 30 are more than chance (Wilson 0 to 0.11)."""
    found = law(*what)
    return {**found, "completed": what[0] != "central", "mission_time_s": 900.0 if what[0] == "central" else 1000.0}


def test_unequal_work_is_ranked_behind_and_marked(tmp_path: Path) -> None:
    """By time alone central would be the first."""
    results = few(*SEVEN[:3], repeats=30, summary=half).write(tmp_path / "sweep")
    texts = [text.get_text() for text in sweep_picture(results, "ranking").figure.findobj(Text)]
    assert texts.count("3*") == len(FEW)
    assert any(text.endswith("; *: unequal work") for text in texts)
    caption, of_bytes = captions(results, ["ranking", "bytes"], tmp_path / "out")
    assert "Success is the mission's whole goal (goal_fraction = 1), achieved within its duration." in caption
    assert "Unequal work: success rates significantly below the highest: central." in of_bytes


def test_differences_equal_those_of_compare_and_are_0_for_the_baseline(tmp_path: Path) -> None:
    results = few(*SEVEN[:3], repeats=4).write(tmp_path / "sweep")
    figure = sweep_picture(results, "differences").figure
    lines = {len(line.get_ydata()): line.get_ydata() for line in figure.axes[0].get_lines()}
    assert list(lines[2]) == [0.0, 0.0]
    shown = sorted(y for line in figure.axes[0].get_lines() if len(line.get_ydata()) == 3 for y in line.get_ydata())
    found = [row.diff_to_baseline for row in compare(results, [RANKED]) if row.diff_to_baseline is not None]
    assert shown == pytest.approx(sorted(found))
    assert len(found) == 2 * 3
    legend = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert legend == list(SEVEN[1:3])  # the baseline is the line at zero
    [caption] = captions(results, ["differences"], tmp_path / "out", "n_bytes")
    assert caption.startswith("Bytes: mean difference to remoras over packet error rate")
    assert "Below zero is better." in caption


@pytest.mark.parametrize(
    ("kind", "by", "drawn"),
    [
        ("differences", SEVEN[:2], 6), ("differences", SEVEN[:1], 6),
        ("trade-off", SEVEN[:2], 6), ("trade-off", SEVEN[:1], 7),
        ("bytes", SEVEN[:2], 6), ("bytes", SEVEN[:1], 7), ("overview", SEVEN[:2], 7),
    ],
)  # fmt: skip
def test_combination_without_points_has_no_figure(tmp_path: Path, kind: str, by: Sequence[str], drawn: int) -> None:
    """Of seven combinations, each with its own figure, one lacks the values of a metric, of all or of one strategy."""

    def partly(*of: Any) -> dict[str, Any]:
        return law(*of) | ({"n_bytes": None} if of[4]["mission.mode"] == 3 and of[0] in by else {})

    sweep = few(*SEVEN[:2], grid={"mission.mode": list(range(7))}, summary=partly).write(tmp_path / "sweep")
    files = draw_sweep_figures(sweep, [kind], tmp_path / "out", "svg", ranked="n_bytes").files
    assert len({path.stem for path in files}) == drawn


def test_figure_in_memory_equals_the_written_one(tmp_path: Path, seven: SweepResults) -> None:
    drawn = sweep_picture(seven, "differences", "n_bytes", 5.0)
    draw_sweep_figures(seven, ["differences"], tmp_path, ranked="n_bytes", width_in=5.0)
    assert f"{drawn.caption}\n" == (tmp_path / "differences-n_bytes.txt").read_text(encoding="utf-8")
    with Image.open(tmp_path / "differences-n_bytes.png") as written:
        size, dpi, said = written.size, written.info["dpi"][0], written.text  # type: ignore[attr-defined]
    assert (said["seed"], len(said["study"])) == (str(seven.file.study.seed), 20)
    assert said["version"].startswith("remoras ")
    assert size == pytest.approx([side_in * dpi for side_in in drawn.figure.get_size_inches()], abs=1)
    with pytest.raises(DrawingError, match="has 7 of it"):
        sweep_picture(combinations(7).write(tmp_path / "grown"), "bytes")


def depth_law(*what: object) -> dict[str, object]:
    """The usual law, with a metric that a mission brings: deeper is better, and one strategy is best in it."""
    found = law(*what)
    return {**found, "depth_m": {"remoras": 2000.0}.get(str(what[0]), 1500.0) + found["mission_time_s"] / 100}


@pytest.mark.parametrize(("better", "first"), [(Better.HIGHER, "remoras"), (Better.LOWER, "central")])
def test_metric_of_a_mission_is_drawn_and_ranked_as_declared(tmp_path: Path, better: Better, first: str) -> None:
    depth = Metric("depth_m", "m", better, "depth reached", lambda run: 0.0, note="Dives above 10 m are left out.")
    results = few("remoras", "central", repeats=4, summary=depth_law, declared=(*METRICS, depth))
    kinds, swept = ["depth-reached", "ranking"], results.write(tmp_path / "sweep")
    text, caption = captions(swept, kinds, tmp_path / "out", "depth_m")
    assert {path.name for path in (tmp_path / "out").glob("*.svg")} == {"depth-reached.svg", "ranking-depth_m.svg"}
    assert text.startswith("Depth reached over packet error rate.")
    assert "Dives above 10 m are left out." in text
    assert f"Rank 1 is the {'highest' if better is Better.HIGHER else 'lowest'}" in caption
    rows = table(tmp_path / "out" / "ranking-depth_m.csv")
    assert [row["rank"] for row in rows if row["strategy"] == first] == ["1.0"] * len(FEW)


def test_the_overview_shows_the_metrics_of_the_study(tmp_path: Path) -> None:
    results = few(*SEVEN[:2], metrics=("n_packets", "energy_j", "distance_m")).write(tmp_path / "sweep")
    figure = sweep_picture(results, "overview").figure
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == ["(a) packets", "(b) energy", "(c) distance"]


def test_a_metric_without_direction_is_not_ranked(tmp_path: Path) -> None:
    neither = [replace(metric, better=Better.NEITHER) if metric.name == "n_bytes" else metric for metric in METRICS]
    swept = few(*SEVEN[:2], declared=neither).write(tmp_path / "sweep")
    with pytest.raises(DrawingError, match="ranking: n_bytes has no best value"):
        draw_sweep_figures(swept, ["ranking"], tmp_path / "out", ranked="n_bytes")
    assert not (tmp_path / "out").exists()


# The table of ranks


def test_the_ranking_is_ordered_by_mean_rank_and_marks_the_best(seven: SweepResults) -> None:
    arrangement = arranged(compare(seven, ["n_bytes"]))
    ranked = ranks(seven, "n_bytes")
    means = [mean for _, mean in ranking.ordered(arrangement, ranked)]
    assert means == sorted(means)
    figure = ranking.figure(arrangement, ranked, "bytes sent")
    assert len(figure.axes[0].patches) == sum(rank.among_best for rank in ranked)
