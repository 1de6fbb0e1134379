"""Scales of colour depend on the scenario, so that runs are comparable; time axes end with the run."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import remoras
from missions.figure import round_up
from visualisation import DrawingError

END_S, AUVS = 317.0, ("AUV00", "AUV01", "AUV02")


@pytest.fixture(scope="module")
def two_runs(tmp_path_factory: pytest.TempPathFactory) -> list[Any]:
    """A lossless run and a lossy one of one scenario, cut at one time."""
    set_to = {"scenario.duration_s": 400.0}
    folder: Path = tmp_path_factory.mktemp("runs")
    for name, per in (("calm", 0.0), ("rough", 0.6)):
        remoras.run("mapping-rendezvous", per=per, seed=3, set=set_to).save(folder / name)
    return [remoras.open(folder / name) for name in ("calm", "rough")]


def shades(figure: Any) -> list[Any]:
    """Images of matrices and strips, without the keys of the shades."""
    return [image for axes in figure.axes for image in axes.images if np.asarray(image.get_array()).shape[0] > 1]


@pytest.mark.parametrize("kind", ["delivery", "knowledge", "tdma"])
def test_runs_of_one_scenario_share_the_colour_scale(two_runs: list[Any], kind: str) -> None:
    figures = [run.plot(kind) for run in two_runs]
    calm, rough = ([image.get_clim() for image in shades(figure)] for figure in figures)
    assert calm
    assert calm == rough


def test_lossless_run_has_no_figure_of_losses(two_runs: list[Any]) -> None:
    calm, rough = two_runs
    assert rough.plot("links").axes
    with pytest.raises(DrawingError, match=r"^links: no vehicle estimated a loss or declared another one absent$"):
        calm.plot("links")


@pytest.mark.parametrize(
    "given",
    [
        {"scenario.duration_s": END_S},
        {"fault": [{"vehicle": name, "kind": "lost", "at_s": END_S} for name in ("ASV00", *AUVS)]},
    ],
    ids=["out of time", "all vehicles lost"],
)
def test_time_axes_end_with_the_run(given: Any) -> None:
    """At a time that is not round; the mission time of the run that loses all vehicles is its whole duration."""
    run = remoras.run("mapping-rendezvous", per=0.3, seed=3, set=given)
    end_s = END_S
    for kind in ("roles", "satisfaction", "organisation", "htn", "knowledge", "coverage", "links"):
        ends = [axes.get_xlim() for axes in run.plot(kind).axes if axes.get_xlabel() == "time (s)"]
        assert ends
        assert set(ends) == {(0.0, end_s)}, kind
    for axes in run.plot("tdma").axes:
        assert axes.get_xlim()[1] <= end_s or axes.get_xlabel() != "time (s)"


def test_motivation_fills_the_axis_of_its_panel() -> None:
    """Of every panel at least nine tenths; the rest is a margin."""
    run = remoras.run("mapping-rendezvous", per=0.3, seed=3, set={"scenario.duration_s": 400.0})
    for axes in run.plot("motivation").axes:
        ends = [bar.get_x() + bar.get_width() for bar in axes.patches]
        ends += [x for line in axes.lines for x in line.get_xdata()]
        assert 0.9 * axes.get_xlim()[1] <= max(ends) <= axes.get_xlim()[1]


def test_full_reception_is_drawn_white(two_runs: list[Any]) -> None:
    """A tenth of the way to black at most: news are half a frame old in the mean, black is ten."""
    for image in shades(two_runs[0].plot("delivery")):
        assert np.nanmax(np.ma.filled(image.get_array(), np.nan)) <= 0.1 * image.get_clim()[1]


@pytest.mark.parametrize(("value", "expected"), [(2053.0, 2500.0), (2141.0, 2500.0), (80.0, 80.0), (0.0, 1.0)])
def test_an_axis_ends_at_a_round_number(value: float, expected: float) -> None:
    assert round_up(value) == expected
