"""Metrics on axes: all from their declarations."""

from dataclasses import replace
from pathlib import Path

import pytest
from synthetic_sweeps import Sweep, rows_of

from missions.comparison import Comparison
from missions.metric import Better, MetricRecord
from visualisation.output import DrawingError
from visualisation.sweeps.arrangement import by_kind, figure_kind, measure

ENERGY = MetricRecord("energy_j", "J", Better.LOWER, "energy")


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
def test_large_values_take_a_prefix_where_the_unit_has_one(
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
def test_a_share_is_what_lies_between_0_and_1(row: Comparison, means: list[float], unit: str, share: bool) -> None:
    assert measure(replace(ENERGY, unit=unit), [replace(row, mean=mean) for mean in means]).share is share


def test_where_an_interval_is_missing_the_spread_is_drawn(row: Comparison) -> None:
    bare = replace(row, mean=2000.0, least=1500.0, largest=2500.0, ci95_low=None, ci95_high=None)
    assert measure(ENERGY, [bare]).bounds(bare) == (1.5, 2.5)


def test_the_kind_is_the_label_with_hyphens() -> None:
    assert figure_kind(replace(ENERGY, label="Time to the 95 % mark")) == "time-to-the-95-mark"


def test_two_metrics_of_one_label_are_refused() -> None:
    with pytest.raises(DrawingError, match="metric other_j: its label 'energy' is also that of the metric energy_j"):
        by_kind([ENERGY, replace(ENERGY, name="other_j")])
    with pytest.raises(DrawingError, match="'Trade off' is also that of the figure trade-off; give it another label"):
        by_kind([replace(ENERGY, label="Trade off")])
