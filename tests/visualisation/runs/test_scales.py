"""Scales depend on the scenario, not on the run, so that runs are comparable."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import remoras
from missions.figure import round_up


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


@pytest.mark.parametrize("kind", ["delivery", "knowledge", "tdma", "links", "roles", "satisfaction", "coverage"])
def test_runs_of_one_scenario_share_colour_scale_and_time_axis(two_runs: list[Any], kind: str) -> None:
    figures = [run.plot(kind) for run in two_runs]
    calm, rough = ([image.get_clim() for image in shades(figure)] for figure in figures)
    assert calm == rough
    assert bool(calm) == (kind in ("delivery", "knowledge", "tdma", "links"))
    if kind in ("roles", "satisfaction", "knowledge", "coverage"):
        ends = [{axes.get_xlim() for axes in figure.axes if axes.get_xlim()[1] > 100.0} for figure in figures]
        assert ends == [{(0.0, 400.0)}] * 2


def test_axis_is_drawn_only_up_to_the_end_of_the_run() -> None:
    """Its scale ends at a round time, 400 s, so that two runs compare; its line, numbers and bands end with the run."""
    end_s = 330.0
    run = remoras.run("mapping-rendezvous", per=0.3, seed=3, set={"scenario.duration_s": end_s})
    for kind in ("roles", "satisfaction", "organisation"):
        axes = next(axes for axes in run.plot(kind).axes if axes.get_xlim() == (0.0, 400.0))
        assert axes.spines["bottom"].get_bounds() == (0.0, end_s)
        assert max(axes.get_xticks()) <= end_s
        ends_s = [
            vertex[0]
            for bars in axes.collections
            for path in bars.get_paths()
            for vertex in bars.get_transform().transform_path(path).transformed(axes.transData.inverted()).vertices
        ]
        assert max(ends_s) == pytest.approx(end_s)


def test_full_reception_is_drawn_white(two_runs: list[Any]) -> None:
    """A tenth of the way to black at most: news are half a frame old in the mean, black is ten."""
    for image in shades(two_runs[0].plot("delivery")):
        assert np.nanmax(np.ma.filled(image.get_array(), np.nan)) <= 0.1 * image.get_clim()[1]


@pytest.mark.parametrize(("value", "expected"), [(2053.0, 2500.0), (2141.0, 2500.0), (80.0, 80.0), (0.0, 1.0)])
def test_an_axis_ends_at_a_round_number(value: float, expected: float) -> None:
    assert round_up(value) == expected
