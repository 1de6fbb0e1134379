"""Conformance checks of metrics and figures, raising ``AssertionError``."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from remoras import api

if TYPE_CHECKING:
    from missions.figure import Declared
    from missions.metric import Metric

SCENARIO = "mapping-rendezvous"
DURATIONS_S = (2.0, 120.0)
"""Durations of the default runs; the first is nearly without events."""
PER = 0.3


def check_metric(metric: Metric, runs: Sequence[api.Run] = ()) -> None:
    """Check a metric: declaration and repeatable values, by default in two short ``runs``."""
    from missions.errors import ConfigurationError
    from missions.metric import collected, faults_of_metric
    from missions.runs.metrics import CORE_METRICS

    if faults := list(faults_of_metric(metric)):
        raise AssertionError("; ".join(faults))
    try:
        collected("metrics of every run and this one", (*CORE_METRICS, metric))
    except ConfigurationError as error:
        raise AssertionError(str(error)) from None
    _expect_same(f"metric {metric.name}", lambda run: run.metric(metric), runs)


def check_figure(figure: Declared, runs: Sequence[api.Run] = ()) -> None:
    """Check a figure, layer or mark, drawn from memory and folders; see ``check_metric``."""
    from missions.figure import Mark, faults_of_figure

    if faults := list(faults_of_figure(figure)):
        raise AssertionError("; ".join(faults))
    needs = () if isinstance(figure, Mark) else figure.needs

    def caption(run: api.Run) -> str:
        if lacking := [table for table in needs if table not in run.tables]:
            raise AssertionError(f"{run!r} has no table {', '.join(lacking)}; pass runs of a mission that writes it")
        drawn: Any = run.plot(figure)
        return str(drawn.caption)

    _expect_same("caption", caption, runs)


def _expect_same(subject: str, ask: Callable[[api.Run], object], runs: Sequence[api.Run]) -> None:
    from missions.errors import MissionsError
    from remoras.errors import RemorasError
    from visualisation.output import VisualisationError

    with _read_back(runs or _short_runs()) as pairs:
        for run, written in pairs:
            try:
                first, again, of_folder = (ask(asked) for asked in (run, run, written))
            except (MissionsError, RemorasError, VisualisationError) as error:
                raise AssertionError(f"{subject} of {run!r}: {error}") from error
            for other, how in ((again, "asked of the same run again"), (of_folder, "asked of its folder")):
                if first != other:
                    function = "it has to be a function of the run alone"
                    raise AssertionError(f"{subject} of {run!r} is {first!r}, and {other!r} {how}: {function}")


@cache  # runs, of which each check draws
def _short_runs() -> tuple[api.Run, ...]:
    return tuple(api.run(SCENARIO, per=PER, set={"scenario.duration_s": duration_s}) for duration_s in DURATIONS_S)


@contextmanager
def _read_back(runs: Sequence[api.Run]) -> Iterator[list[tuple[api.Run, api.Run]]]:
    from missions.errors import OutputError

    with tempfile.TemporaryDirectory() as folder:
        pairs = []
        for number, run in enumerate(runs):
            try:
                copy = api.open(run.save(Path(folder) / str(number)))
            # A run from a folder cannot be saved: it is its own copy.
            except OutputError:
                copy = run
            assert isinstance(copy, api.Run)
            pairs.append((run, copy))
        yield pairs
