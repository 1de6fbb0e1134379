"""Figures of sweeps: legible, the same each time, with the numbers behind them and what they rest on."""

import csv
import json
import re
import warnings
from dataclasses import asdict
from pathlib import Path

import pytest
from legibility import check_texts
from matplotlib.figure import Figure
from synthetic_sweeps import SEVEN, TEN, Sweep, flat
from visualisation.runs.arrangement import arranged

from missions.comparison.baseline import compare
from missions.comparison.ranking import ranks
from missions.comparison.rows import Comparison
from missions.errors import OutputError
from missions.metric import Better
from missions.sweeps.folder import SweepResults
from visualisation import style
from visualisation.errors import DrawingError
from visualisation.sweeps import charts, comparison, ranking
from visualisation.sweeps.measures import COMPARISON_KINDS, MEASURES, OVERVIEW

LONG = "mypackage.organisations.strategies:AN_EXTRAORDINARILY_LONG_NAME_OF_A_STRATEGY"
FEW = (0.1, 0.5, 0.8)
BURSTS = [("gilbert-elliott", FEW, {"channel.mean_burst": burst}) for burst in (2.0, 4.0, 8.0)]
SWEEPS = {
    "seven strategies": Sweep(repeats=5, consistency=True),
    "one strategy": Sweep(["remoras"], ["ack", "ack-repeat", "m-ack", "mps-ack", "knowledge", "adaptive"], repeats=3),
    "strategies and policies": Sweep(["remoras", "cbba", LONG], ["ack", "mps-ack-repeat"], repeats=3),
    "three channels": Sweep(SEVEN[:3], channels=[("perfect", [0.0], {}), *BURSTS], repeats=3),
    "vehicles": Sweep(SEVEN, channels=[("bernoulli", [0.4], {})], grid={"fleet.size": [2, 4, 8, 16]}, repeats=3),
    "one point": Sweep(["remoras"], channels=[("perfect", [0.0], {})], repeats=1),
    "all the same": Sweep(SEVEN, channels=[("bernoulli", FEW, {})], repeats=3, summary=flat),
}  # fmt: skip


@pytest.fixture(scope="module")
def sweeps(tmp_path_factory: pytest.TempPathFactory) -> dict[str, SweepResults]:
    folder = tmp_path_factory.mktemp("sweeps")
    return {name: sweep.write(folder / name) for name, sweep in SWEEPS.items()}


@pytest.fixture(scope="module")
def seven(sweeps: dict[str, SweepResults]) -> SweepResults:
    return sweeps["seven strategies"]


@pytest.fixture(autouse=True)
def no_warnings() -> "object":
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def figures(results: SweepResults) -> dict[str, Figure]:
    """Every figure of a sweep, by the name of its file."""
    rows = {measure.metric: compare(results, [measure.metric]) for measure in MEASURES.values()}
    arrangement = arranged(rows["mission_time_s"])
    found = {}
    for kind in COMPARISON_KINDS:
        ranked = ranks(results, "mission_time_s")
        if not comparison._nothing(kind, arrangement, rows, ranked):
            for sheet in comparison._sheets(kind, arrangement, rows, ranked, "mission_time_s", Better.LOWER):
                found[f"{kind} {sheet.title}"] = sheet.figure()
    return found


def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("name", SWEEPS)
def test_texts_overlap_nothing_and_are_not_cut_off(
    sweeps: dict[str, SweepResults], name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for title, figure in figures(sweeps[name]).items():
        wide = title.startswith("overview") or len(figure.axes) > 1
        assert figure.get_figwidth() in ({style.PAGE_IN} if wide else {style.COLUMN_IN, style.PAGE_IN}), title
        check_texts(figure, monkeypatch)


@pytest.mark.parametrize("name", SWEEPS)
def test_every_mean_is_inside_the_frame(sweeps: dict[str, SweepResults], name: str) -> None:
    for title, figure in figures(sweeps[name]).items():
        for axes in figure.axes:
            (left, right), (bottom, top) = axes.get_xlim(), sorted(axes.get_ylim())
            for line in axes.get_lines():
                assert all(left <= x <= right for x in line.get_xdata()), title
                assert all(bottom <= y <= top for y in line.get_ydata()), title


@pytest.mark.parametrize("file_format", ["png", "svg", "pdf"])
def test_the_same_sweep_gives_the_same_bytes(tmp_path: Path, seven: SweepResults, file_format: str) -> None:
    first, again = (comparison.draw(seven, (), tmp_path / name, file_format) for name in ("first", "again"))
    assert [path.name for path in first.files] == [
        f"{kind}.{suffix}" for kind in COMPARISON_KINDS for suffix in (file_format, "csv", "txt")
    ]
    assert first.notes == []
    assert [path.read_bytes() for path in first.files] == [path.read_bytes() for path in again.files]


@pytest.mark.parametrize("kind", MEASURES)
def test_the_numbers_are_the_rows_of_compare(tmp_path: Path, seven: SweepResults, kind: str) -> None:
    comparison.draw(seven, [kind], tmp_path)
    rows = [{**asdict(row), "settings": json.dumps(row.settings)} for row in compare(seven, [MEASURES[kind].metric])]
    wanted = [{key: "" if value is None else str(value) for key, value in row.items()} for row in rows]
    assert table(tmp_path / f"{kind}.csv") == wanted
    assert len(wanted) == len(SEVEN) * len(TEN)


def test_the_numbers_of_several_metrics_and_of_the_ranking(tmp_path: Path, seven: SweepResults) -> None:
    comparison.draw(seven, ["overview", "ranking"], tmp_path, metric="n_bytes")
    metrics = dict.fromkeys(row["metric"] for row in table(tmp_path / "overview.csv"))
    assert list(metrics) == [MEASURES[kind].metric for kind in OVERVIEW]
    wanted = [(row.strategy, str(row.rank), str(row.among_best)) for row in ranks(seven, "n_bytes")]
    found = table(tmp_path / "ranking-n_bytes.csv")
    assert [(row["strategy"], row["rank"], row["among_best"]) for row in found] == wanted


@pytest.mark.parametrize("kind", COMPARISON_KINDS)
def test_captions_say_what_the_figure_rests_on(tmp_path: Path, kind: str) -> None:
    results = Sweep(SEVEN[:2], channels=[("bernoulli", FEW, {})], repeats=4, n_failed=1, consistency=True)
    comparison.draw(results.write(tmp_path / "sweep"), [kind], tmp_path / "out")
    text = (tmp_path / "out" / f"{kind}.txt").read_text(encoding="utf-8")
    for part in (
        "n = 2 to 3" if kind == "consistency-time" else "n = 3 to 4",
        "master seed 11", "strategies remoras, fixed-partition", "policy m-ack",
        "channel bernoulli", "Scenario mapping-rendezvous", "23 of 24 runs done", "1 failed", "remoras 9.8.7",
    ):  # fmt: skip
        assert part in text
    assert re.search(r"\d+ of them not completed \(censored\)", text)
    intervals = {"ranking": "Holm-corrected", "success-rate": "Wilson's 95 % intervals"}
    assert intervals.get(kind, "95 % intervals of the mean (bootstrap; Student's t below 8 runs)") in text


def test_a_metric_without_values_is_left_out_or_refused(tmp_path: Path, sweeps: dict[str, SweepResults]) -> None:
    results = sweeps["one strategy"]
    drawn = comparison.draw(results, (), tmp_path / "all", "svg")
    assert drawn.notes == ["consistency-time is left out: no run has a value of consistency_time_s"]
    assert "consistency-time.svg" not in {path.name for path in drawn.files}
    with pytest.raises(DrawingError, match="consistency-time: no run has a value of consistency_time_s"):
        comparison.draw(results, ["bytes", "consistency-time"], tmp_path / "named")
    assert not (tmp_path / "named").exists()


def test_one_series_has_no_ranking(tmp_path: Path, sweeps: dict[str, SweepResults]) -> None:
    with pytest.raises(DrawingError, match="ranking: needs two strategies or policies"):
        comparison.draw(sweeps["one point"], ["ranking"], tmp_path)


def test_an_unfinished_sweep_is_drawn_and_said_to_be(tmp_path: Path) -> None:
    results = Sweep(SEVEN[:2], channels=[("bernoulli", FEW, {})], repeats=2, n_remaining=3).write(tmp_path / "sweep")
    drawn = comparison.draw(results, ["bytes", "ranking"], tmp_path / "out", "svg")
    assert drawn.notes == ["the sweep is not finished, 3 runs are missing in the figures"]
    assert "3 not made yet" in (tmp_path / "out" / "bytes.txt").read_text(encoding="utf-8")


def test_what_cannot_be_drawn_is_refused(tmp_path: Path, seven: SweepResults) -> None:
    with pytest.raises(DrawingError, match=r"unknown kind of figure of a sweep 'misson-time'.*nearest: 'mission-time'"):
        comparison.draw(seven, ["misson-time"], tmp_path / "out")
    with pytest.raises(DrawingError, match="'roles' is a figure of a single run"):
        comparison.draw(seven, ["roles"], tmp_path / "out")
    with pytest.raises(DrawingError, match="unknown format 'bmp'"):
        comparison.draw(seven, ["bytes"], tmp_path / "out", "bmp")
    with pytest.raises(OutputError, match=r"'n_byte'.*did you mean 'n_bytes'"):
        comparison.draw(seven, ["ranking"], tmp_path / "out", metric="n_byte")
    empty = Sweep(["remoras"], repeats=1, n_remaining=len(TEN)).write(tmp_path / "empty")
    with pytest.raises(OutputError, match="no run has finished"):
        comparison.draw(empty, (), tmp_path / "out")
    assert not (tmp_path / "out").exists()


# Looks and arrangement ----------------------------------------------------------------------------


def rows_of(tmp_path: Path, sweep: Sweep) -> list[Comparison]:
    return compare(sweep.write(tmp_path / str(len(list(tmp_path.iterdir())))), ["mission_time_s"])


def test_seven_strategies_differ_in_colour_and_marker_and_in_line_or_fill(tmp_path: Path) -> None:
    looks = charts.looks(arranged(rows_of(tmp_path, Sweep(repeats=1))).series).values()
    assert len({look["color"] for look in looks}) == len({look["marker"] for look in looks}) == len(SEVEN)


def test_a_strategy_looks_the_same_in_every_study(tmp_path: Path) -> None:
    whole = arranged(rows_of(tmp_path, Sweep([*SEVEN, "own"], repeats=1)))
    part = arranged(rows_of(tmp_path, Sweep(["own", "rendezvous-sync", "contract-net"], repeats=1)))
    assert [series.strategy for series in part.series] == ["contract-net", "rendezvous-sync", "own"]
    of_whole = {series.strategy: look for series, look in charts.looks(whole.series).items()}
    of_part = {series.strategy: look for series, look in charts.looks(part.series).items()}
    for name in ("contract-net", "rendezvous-sync"):
        assert of_part[name] == of_whole[name]
    assert of_part["own"] not in [of_part["contract-net"], of_part["rendezvous-sync"]]


def test_every_pair_of_strategy_and_policy_has_a_look_of_its_own(tmp_path: Path) -> None:
    policies = ["ack", "ack-repeat", "m-ack", "mps-ack-repeat"]
    looks = charts.looks(
        arranged(rows_of(tmp_path, Sweep(SEVEN, policies, channels=[("perfect", [0.0], {})], repeats=1))).series
    )
    assert len({(look["color"], str(look["linestyle"])) for look in looks.values()}) == len(looks) == 28


def test_the_perfect_channel_is_the_rate_0_of_the_others(tmp_path: Path) -> None:
    rows = rows_of(tmp_path, SWEEPS["three channels"])
    arrangement = arranged(rows)
    assert arrangement.axis_label == "packet error rate"
    assert list(arrangement.titles.values()) == [f"channel.mean_burst = {burst}" for burst in (2.0, 4.0, 8.0)]
    for combination in arrangement.titles:
        (curve, *_) = arrangement.curves(arrangement.of(combination, rows)).values()
        assert [(arrangement.x(row), row.channel) for row in curve] == [
            (0.0, "perfect"), *((per, "gilbert-elliott") for per in FEW)
        ]  # fmt: skip


def test_a_rate_0_of_its_own_comes_before_the_perfect_channel(tmp_path: Path) -> None:
    rows = rows_of(
        tmp_path, Sweep(SEVEN[:2], channels=[("perfect", [0.0], {}), ("bernoulli", [0.0, 0.5], {})], repeats=1)
    )
    arrangement = arranged(rows)
    (combination,) = arrangement.titles
    assert {row.channel for row in arrangement.of(combination, rows)} == {"bernoulli"}


def test_a_setting_is_the_axis_where_the_rate_does_not_vary(tmp_path: Path) -> None:
    grid = {"decision.weight_external": [0.0, 0.5, 1.0], "fleet.size": [2, 4], "mission.mode": ["a", "b", "c", "d"]}
    sweep = Sweep(["remoras"], channels=[("bernoulli", [0.4], {})], repeats=1, grid=grid)
    sweep.summary = flat
    arrangement = arranged(rows_of(tmp_path, sweep))
    assert arrangement.axis_label == "decision.weight_external"
    assert len(arrangement.titles) == 8
    assert "number of vehicles = 2, mission.mode = a" in arrangement.titles.values()


def test_up_to_four_combinations_share_a_figure_and_more_have_one_each(tmp_path: Path) -> None:
    for n, names in (
        (4, {"bytes.svg", "bytes.csv", "bytes.txt"}),
        (5, {f"bytes-mission.mode={at}.{suffix}" for at in range(5) for suffix in ("svg", "csv", "txt")}),
    ):
        sweep = Sweep(
            ["remoras"], channels=[("bernoulli", [0.1, 0.2], {})], repeats=1, grid={"mission.mode": list(range(n))}
        )
        drawn = comparison.draw(sweep.write(tmp_path / f"sweep{n}"), ["bytes"], tmp_path / f"out{n}", "svg")
        assert {path.name for path in drawn.files} == names
    rows = table(tmp_path / "out5" / "bytes-mission.mode=3.csv")
    assert [json.loads(row["settings"]) for row in rows] == [{"mission.mode": "3"}] * 2
    assert (tmp_path / "out5" / "bytes-mission.mode=3.txt").read_text().startswith("mission.mode = 3: ")


def test_names_of_files_are_safe_and_differ() -> None:
    taken: set[str] = set()
    names = [comparison._file_name("bytes", title, taken) for title in ("a/b = 1", "a b = 1", "", "x" * 300)]
    assert names[:3] == ["bytes-a-b=1", "bytes-a-b=1-2", "bytes"]
    assert len(names[3]) < 100


def test_points_without_an_axis_are_refused(tmp_path: Path) -> None:
    keys = [{"decision.weight_external": at / 7, "decision.fade_per_s": at * 5 % 7 / 3} for at in range(6)]
    channels = [("bernoulli", [0.1 * at], point) for at, point in enumerate(keys)]
    with pytest.raises(DrawingError, match="6 combinations of settings, each with a single point"):
        arranged(rows_of(tmp_path, Sweep(["remoras"], channels=channels, repeats=1)))


def test_a_setting_that_rises_with_the_axis_makes_no_panels(tmp_path: Path) -> None:
    """As the two rates of a Gilbert-Elliott channel whose mean loss stays the same."""
    keys = [{"decision.weight_external": at / 7, "decision.fade_per_s": at / 3} for at in range(6)]
    channels = [("bernoulli", [0.5], point) for point in keys]
    arrangement = arranged(rows_of(tmp_path, Sweep(["remoras"], channels=channels, repeats=1)))
    assert arrangement.axis in keys[0]
    assert len(arrangement.titles) == 1


def test_the_trade_off_grows_its_markers_along_the_axis(sweeps: dict[str, SweepResults]) -> None:
    figure = figures(sweeps["three channels"])["trade-off "]
    points = [line for line in figure.axes[0].get_lines() if len(line.get_xdata()) == 1]
    sizes = [point.get_markersize() for point in points[:4]]
    assert sizes == sorted(sizes)
    assert len(set(sizes)) == 4


def test_the_ranking_is_ordered_by_mean_rank_and_marks_the_best(seven: SweepResults) -> None:
    arrangement = arranged(compare(seven, ["n_bytes"]))
    ranked = ranks(seven, "n_bytes")
    means = [mean for _, mean in ranking.ordered(arrangement, ranked)]
    assert means == sorted(means)
    figure = ranking.figure(arrangement, ranked, "bytes sent")
    assert len(figure.axes[0].patches) == sum(rank.among_best for rank in ranked)
