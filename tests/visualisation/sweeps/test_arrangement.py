"""Arrangement of sweep figures: axis, series and panels follow from the varied factors."""

from pathlib import Path

import pytest
from synthetic_sweeps import FEW, SWEEPS, Sweep, flat, rows_of

from visualisation.output import DrawingError
from visualisation.sweeps.arrangement import arranged


def test_varying_channel_gives_panels(tmp_path: Path) -> None:
    rows = rows_of(tmp_path, SWEEPS["three channels"])
    arrangement = arranged(rows)
    assert arrangement.axis_label == "packet error rate"
    bursts = [f"gilbert-elliott, mean_burst = {burst}" for burst in (2.0, 4.0, 8.0)]
    assert list(arrangement.titles.values()) == [*bursts, "perfect"]
    for combination in arrangement.titles:
        (curve, *_) = arrangement.curves(arrangement.of(combination, rows)).values()
        assert [arrangement.x(row) for row in curve] == ([0.0] if combination.channel == "perfect" else list(FEW))


def test_setting_is_the_axis_if_the_loss_rate_is_constant(tmp_path: Path) -> None:
    grid = {"decision.weight_external": [0.0, 0.5, 1.0], "fleet.size": [2, 4], "mission.mode": ["a", "b", "c", "d"]}
    sweep = Sweep(["remoras"], channels=[("bernoulli", [0.4], {})], repeats=1, grid=grid)
    sweep.summary = flat
    arrangement = arranged(rows_of(tmp_path, sweep))
    assert arrangement.axis_label == "decision.weight_external"
    assert len(arrangement.titles) == 8
    assert "number of vehicles = 2, mode = a" in arrangement.titles.values()


def test_points_without_an_axis_are_refused(tmp_path: Path) -> None:
    keys = [{"decision.weight_external": at / 7, "decision.fade_per_s": at * 5 % 7 / 3} for at in range(6)]
    channels = [("bernoulli", [0.1 * at], point) for at, point in enumerate(keys)]
    with pytest.raises(DrawingError, match="6 combinations of settings, each with a single point"):
        arranged(rows_of(tmp_path, Sweep(["remoras"], channels=channels, repeats=1)))


def test_setting_that_rises_with_the_axis_gives_no_panels(tmp_path: Path) -> None:
    """As the two rates of a Gilbert-Elliott channel whose mean loss stays the same."""
    keys = [{"decision.weight_external": at / 7, "decision.fade_per_s": at / 3} for at in range(6)]
    channels = [("bernoulli", [0.5], point) for point in keys]
    arrangement = arranged(rows_of(tmp_path, Sweep(["remoras"], channels=channels, repeats=1)))
    assert arrangement.axis in keys[0]
    assert len(arrangement.titles) == 1


MODEMS = {"communication.modem": ["whoi-fsk-0", "atm-900", "nanomodem-v3"]}


def test_setting_with_text_values_is_the_axis_if_no_number_varies(tmp_path: Path) -> None:
    """The rate of the channel acoustic is an estimate that follows from the modem: it is no axis."""
    channels = [("acoustic", [0.1], {}), ("acoustic", [0.4], {"channel.source_level_db": 125.0})]
    sweep = Sweep(["remoras"], channels=channels, repeats=1, grid=MODEMS)
    sweep.summary = flat
    arrangement = arranged(rows_of(tmp_path, sweep))
    assert (arrangement.axis, arrangement.axis_label) == ("communication.modem", "modem")
    assert arrangement.cases == ("atm-900", "nanomodem-v3", "whoi-fsk-0")
    assert list(arrangement.titles.values()) == ["source_level_db not set", "source_level_db = 125.0"]
    assert arrangement.tick_labels([1.0, 3.0], width_in=2.0) == ["atm-900", "whoi-fsk-0"]
    assert arrangement.tick_labels([1.0, 3.0], width_in=0.6) == ["1", "3"]


@pytest.mark.parametrize("channel", ["bernoulli", "acoustic"])
def test_numeric_setting_is_preferred_as_axis(tmp_path: Path, channel: str) -> None:
    channels = [(channel, [0.1, 0.4], {})]
    sweep = Sweep(["remoras"], channels=channels, repeats=1, grid={**MODEMS, "fleet.size": [2, 4]})
    sweep.summary = flat
    arrangement = arranged(rows_of(tmp_path, sweep))
    assert arrangement.axis == ("per" if channel == "bernoulli" else "fleet.size")
    assert arrangement.cases == ()


def test_legend_names_plugins_by_their_objects(tmp_path: Path) -> None:
    """With the module where two objects have one name."""
    short = {
        "remoras": "remoras",
        "lab.turns:Turns": "Turns",
        "lab.first:MINE": "first:MINE",
        "other:MINE": "other:MINE",
    }
    sweep = Sweep(tuple(short), ("ack", "own:Policy"), repeats=2)
    for series in arranged(rows_of(tmp_path, sweep)).series:
        assert series.label == f"{short[series.strategy]}, {series.policy.removeprefix('own:')}"
