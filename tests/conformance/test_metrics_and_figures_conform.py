"""The checks of metrics and figures pass valid ones and name the flaw of others."""

import itertools
from typing import Any

import pytest

from missions.figure import Declared
from missions.mapping import MappingMission
from remoras import Better, Figure, Mark, Metric
from remoras.testing import check_figure, check_metric

COUNTER = itertools.count()


def n_assigned(run: Any) -> int:
    return sum(event == "assigned" for *_, event in run.recorder.rows("roles"))


def metric(name: str = "n_assigned", label: str = "roles assigned", of: Any = n_assigned, **others: Any) -> Metric:
    return Metric(name, others.pop("unit", ""), others.pop("better", Better.LOWER), label, of, **others)


def test_a_valid_metric_conforms() -> None:
    check_metric(metric())


@pytest.mark.parametrize("one", MappingMission.metrics, ids=lambda one: one.name)
def test_metrics_of_the_mapping_mission_conform(one: Metric) -> None:
    """What they read is what results keep, so they may be asked of a folder too."""
    check_metric(one)


@pytest.mark.parametrize(
    ("faulty", "said"),
    [
        ("closest", "it is a str; expected a remoras.Metric"),
        (metric(name="no name"), "name = 'no name'"),
        (metric(unit=None), "unit = None"),
        (metric(better="lower"), "better = 'lower': allowed: Better.HIGHER"),
        (metric(label=""), "label = ''"),
        (metric(of=3), "of = 3: allowed: a function of a finished run"),
        (metric(of=lambda: 1.0), r"cannot be called as of\(run\)"),
        (metric(unit="m", censored=True), "a censored metric is a time in s"),
        (metric(name="completed"), "metric completed: declared twice"),
        (metric(label="Energy"), "is also the label of energy_j"),
        (metric(of=lambda run: 1 / 0), "raised ZeroDivisionError"),
        (metric(of=lambda run: "much"), "its function returned 'much'"),
        (metric(of=lambda run: float("nan")), "its function returned nan"),
        (metric(of=lambda run: next(COUNTER)), "asked of the same run again"),
    ],
)
def test_a_faulty_metric_is_reported(faulty: Any, said: str) -> None:
    with pytest.raises(AssertionError, match=said):
        check_metric(faulty)


def draw(axes: Any, results: Any, style: Any) -> str:
    axes.plot(results.table("trajectories")["time_s"].to_numpy(), color=style.black)
    return "Times."


SOUND: tuple[Declared, ...] = (
    Figure("times", "Times", draw, needs=("trajectories",)),
    Mark("consultation_done", "consulted"),
)


@pytest.mark.parametrize("figure", SOUND, ids=lambda one: type(one).__name__)
def test_a_valid_figure_conforms(figure: Declared) -> None:
    check_figure(figure)


@pytest.mark.parametrize(
    ("faulty", "said"),
    [
        (draw, "it is a function; expected a remoras.Figure, Layer or Mark"),
        (Figure("", "Times", draw), "name = ''"),
        (Figure("a/b", "Times", draw), "it is no name of a file"),
        (Figure("times", "", draw), "title = ''"),
        (Figure("times", "Times", lambda axes: ""), "draw cannot be called as"),
        (Figure("times", "Times", draw, needs="trajectories"), "needs = 'trajectories'"),  # type: ignore[arg-type]
        (Figure("times", "Times", draw, needs=("sonar",)), "has no table sonar; pass runs of a mission that writes it"),
        (Figure("roles", "Times", draw), "its name 'roles' is taken"),
        (Figure("times", "Times", lambda axes, results, style: str(1 / 0)), "raised ZeroDivisionError"),
        (Figure("times", "Times", lambda axes, results, style: 1), "returned 1"),  # type: ignore[arg-type, return-value]
        (Figure("times", "Times", lambda axes, results, style: str(next(COUNTER))), "asked of the same run again"),
    ],
)
def test_a_faulty_figure_is_reported(faulty: Any, said: str) -> None:
    with pytest.raises(AssertionError, match=said):
        check_figure(faulty)
