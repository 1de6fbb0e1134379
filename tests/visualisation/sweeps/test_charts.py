"""Charts of sweeps: looks of series, scales of axes, positions of points."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from legibility import check_texts
from matplotlib.axes import Axes
from synthetic_sweeps import FEW, HORIZON_S, SEVEN, Sweep, law, rows_of

from missions.comparison import Comparison
from missions.metric import Better, Metric
from visualisation import style
from visualisation.output import DrawingError
from visualisation.sweeps import charts, sweep_picture
from visualisation.sweeps.arrangement import Measure, Series, arranged, by_kind, measure

TIME = Metric("mission_time_s", "s", Better.LOWER, "mission time", lambda run: run.end_s)


def chart(rows: list[Comparison]) -> Axes:
    arrangement = arranged(rows)
    (axes,) = charts.metric(arrangement, list(arrangement.titles), rows, measure(TIME, rows)).axes
    return axes


def test_a_strategy_looks_the_same_in_every_study(tmp_path: Path) -> None:
    whole = arranged(rows_of(tmp_path, Sweep([*SEVEN, "own"], repeats=1)))
    part = arranged(rows_of(tmp_path, Sweep(["own", "rendezvous-sync", "contract-net"], repeats=1)))
    assert [series.strategy for series in part.series] == ["contract-net", "rendezvous-sync", "own"]
    of_whole = {series.strategy: look for series, look in charts.looks(whole.series).items()}
    of_part = {series.strategy: look for series, look in charts.looks(part.series).items()}
    for name in ("contract-net", "rendezvous-sync"):
        assert of_part[name] == of_whole[name]
    assert of_part["own"] not in [of_part["contract-net"], of_part["rendezvous-sync"]]


def test_strategy_and_policy_pairs_have_distinct_colours_and_lines(tmp_path: Path) -> None:
    policies = ["ack", "ack-repeat", "m-ack", "mps-ack-repeat"]
    looks = charts.looks(
        arranged(rows_of(tmp_path, Sweep(SEVEN, policies, channels=[("perfect", [0.0], {})], repeats=1))).series
    )
    assert len({(look["color"], str(look["linestyle"])) for look in looks.values()}) == len(looks) == 28


@given(st.integers(1, 16))
def test_series_and_vehicles_differ_without_colour(n: int) -> None:
    """In line and marker, so that no colour repeats without another mark; a hollow marker is another one."""
    vehicles = [style.vehicle_look(number) for number in range(n)]
    assert len({(str(look.line), look.marker) for look in vehicles}) == n
    assert len({(look.colour, str(look.line)) for look in vehicles}) == n
    series = charts.looks([Series(f"own {number}", "ack", "") for number in range(n)]).values()
    marks = {(str(look["linestyle"]), look["marker"], look["markerfacecolor"] == "white") for look in series}
    assert len(marks) == len(series) == n
    assert len({(look["color"], look["marker"]) for look in series}) == n


def never(strategy: str, policy: str, per: float, repeat: int, settings: dict[str, Any]) -> dict[str, Any]:
    """The law, but `fixed-partition` completes no run, or one of nine without loss."""
    own = law(strategy, policy, per, repeat, settings)
    if strategy != "fixed-partition" or (repeat == per == 0):
        return {**own, "completed": True, "mission_time_s": min(own["mission_time_s"], 3000.0)}
    return {**own, "completed": False, "mission_time_s": HORIZON_S}


@pytest.mark.parametrize("kind", ["mission-time", "differences", "overview", "trade-off"])
def test_series_that_does_not_complete_is_at_the_rim(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The others fill the axis below; with the runs that did not complete it would end at the horizon of 7200 s."""
    sweep = Sweep(SEVEN[:3], channels=[("bernoulli", (0.0, *FEW), {})], repeats=9, summary=never)
    drawn = sweep_picture(sweep.write(tmp_path / "sweep"), kind, width_in=3.5)
    check_texts(drawn.figure, monkeypatch)
    shown = drawn.figure.axes[0]
    texts = {text.get_text() for text in shown.texts}
    assert texts - {""} == (set() if kind == "trade-off" else {"1/9", "0/9"})
    assert sum(text.get_text() == "" for text in shown.texts) == 4  # the arrows
    assert shown.get_ylim()[1] < HORIZON_S / 2
    assert shown.spines["left"].get_bounds()[1] < shown.get_ylim()[1]
    assert "fewer than half of the runs completed" in drawn.caption


def test_series_keep_the_axis_if_none_completes(tmp_path: Path) -> None:
    none = rows_of(tmp_path, Sweep(["fixed-partition"], channels=[("bernoulli", FEW, {})], repeats=9, summary=never))
    assert max(y for line in chart(none).get_lines() for y in line.get_ydata()) == HORIZON_S


def test_points_at_one_value_are_side_by_side_in_legend_order(tmp_path: Path) -> None:
    axes = chart(rows_of(tmp_path, Sweep(SEVEN, channels=[("bernoulli", FEW, {})], repeats=3)))
    assert [label.get_text() for label in axes.get_xticklabels()] == [f"{per:g}" for per in FEW]
    curves = [line for line in axes.get_lines() if len(line.get_xdata()) == len(FEW)]
    at_first = [line.get_xdata()[0] for line in curves]
    assert len(curves) == len(SEVEN)
    assert at_first == sorted(set(at_first))
    assert sum(at_first) / len(at_first) == pytest.approx(FEW[0])
    assert at_first[-1] - at_first[0] < 0.5 * (FEW[1] - FEW[0])


def test_bars_span_the_confidence_intervals(tmp_path: Path) -> None:
    rows = rows_of(tmp_path, Sweep(["remoras"], channels=[("bernoulli", FEW, {})], repeats=9))
    axes = chart(rows)
    ys = [y for bar in axes.collections for y in bar.get_paths()[0].vertices[:, 1]]
    intervals = [measure(TIME, rows).bounds(row) for row in rows]
    assert min(ys) == pytest.approx(min(low for low, _ in intervals))
    assert max(ys) == pytest.approx(max(high for _, high in intervals))
    assert any(high > low for low, high in intervals)


def test_values_far_apart_are_spaced_evenly(tmp_path: Path) -> None:
    sizes = [2, 8, 64]
    sweep = Sweep(["remoras"], channels=[("bernoulli", [0.4], {})], grid={"fleet.size": sizes}, repeats=2)
    axes = chart(rows_of(tmp_path, sweep))
    assert list(axes.get_xticks()) == [0.0, 1.0, 2.0]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["2", "8", "64"]


def test_a_large_spread_has_a_logarithmic_axis(tmp_path: Path) -> None:
    def steep(strategy: str, policy: str, per: float, *more: object) -> dict[str, object]:
        return {**law(strategy, policy, per, *more), "mission_time_s": 100.0 * 50.0 ** (per / 0.8), "completed": True}

    axes = chart(rows_of(tmp_path, Sweep(["remoras"], channels=[("bernoulli", FEW, {})], repeats=2, summary=steep)))
    assert axes.get_yscale() == "log"
    assert axes.get_ylabel() == "mission time (s)"
    assert axes.figure.get_figwidth() == style.COLUMN_IN


def test_long_label_is_shortened_but_keeps_its_unit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = rows_of(tmp_path, Sweep(["remoras"], channels=[("bernoulli", FEW, {})], repeats=2))
    long = measure(replace(TIME, label="mean time that a vehicle waits for those that it has to meet"), rows)
    arrangement = arranged(rows)
    figure = charts.metric(arrangement, list(arrangement.titles), rows, long)
    assert {axes.get_ylabel()[-5:] for axes in figure.axes} == {"\u2026 (s)"}
    check_texts(figure, monkeypatch)


# Metrics on axes: all from their declarations


ENERGY = Metric("energy_j", "J", Better.LOWER, "energy", lambda run: 0.0)


@pytest.fixture
def row(tmp_path: Path) -> Comparison:
    (row,) = rows_of(tmp_path, Sweep(["remoras"], channels=[("perfect", [0.0], {})], repeats=2))
    return row


@pytest.mark.parametrize(
    ("mean", "unit", "label", "scale"),
    [
        (999.0, "J", "energy (J)", 1.0),
        (1000.0, "J", "energy (kJ)", 1e-3),
        (-2.5e6, "J", "energy (MJ)", 1e-6),
        (5000.0, "s", "energy (s)", 1.0),  # nobody reads ks
        (5000.0, "", "energy", 1.0),
        (5000.0, "1", "energy", 1.0),
    ],
)
def test_large_values_use_a_unit_prefix_where_allowed(
    row: Comparison, mean: float, unit: str, label: str, scale: float
) -> None:
    found = measure(replace(ENERGY, unit=unit), [replace(row, mean=1.0), replace(row, mean=mean)])
    assert (found.label, found.scale) == (label, scale)


@pytest.mark.parametrize(
    ("means", "unit", "share"),
    [
        ([0.0, 1.0], "1", True), ([0.2, 0.3], "", True), ([0.2, 1.1], "", False), ([-0.1], "", False),
        ([0.5], "s", False),
    ],
)  # fmt: skip
def test_unitless_values_between_0_and_1_are_a_share(
    row: Comparison, means: list[float], unit: str, share: bool
) -> None:
    assert measure(replace(ENERGY, unit=unit), [replace(row, mean=mean) for mean in means]).share is share


def test_spread_is_drawn_if_the_interval_is_missing(row: Comparison) -> None:
    bare = replace(row, mean=2000.0, least=1500.0, largest=2500.0, ci95_low=None, ci95_high=None)
    assert measure(ENERGY, [bare]).bounds(bare) == (1.5, 2.5)


def test_metrics_with_equal_labels_are_refused() -> None:
    with pytest.raises(DrawingError, match="metric other_j: its label 'energy' is also that of the metric energy_j"):
        by_kind([ENERGY, replace(ENERGY, name="other_j")])
    with pytest.raises(DrawingError, match="'Trade off' is also that of the figure trade-off; give it another label"):
        by_kind([replace(ENERGY, label="Trade off")])


@pytest.mark.parametrize(("least", "bottom"), [(1500.0, 1475.0), (300.0, 0.0), (0.0, -100.0)])
def test_axis_begins_at_or_just_below_0_if_values_are_near_it(least: float, bottom: float) -> None:
    assert charts._limits([least, 2000.0], measure(ENERGY, ()))[0] == bottom


@given(st.lists(st.floats(0.0, 1.0), min_size=1))
def test_axis_of_a_share_ends_at_1_and_holds_all_values(ends: list[float]) -> None:
    low, high = charts._limits(ends, Measure(ENERGY, "", 1.0, share=True))
    assert low <= min(ends) <= max(ends) <= high <= 1.0
    assert low < high
