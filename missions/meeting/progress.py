"""What missions of jobs say of their progress: when things were done, in the mean and as a figure."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

from missions.figure import RunResults, Style
from missions.meeting.truth import JOBS
from missions.metric import MeasuredRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def done_s(run: MeasuredRun) -> dict[str, float]:
    """When each job was done for the first time, by its name (s)."""
    first_s: dict[str, float] = {}
    for time_s, _, job in run.recorder.rows(JOBS.name):
        first_s.setdefault(job, time_s)
    return first_s


def mean_of_all_s(times_s: Collection[float], n_all: int, run: MeasuredRun) -> float:
    """Mean time (s) of what was done; each of ``n_all`` that was not counts with the duration of the mission."""
    scenario: Any = run.scenario
    return (math.fsum(times_s) + (n_all - len(times_s)) * float(scenario.scenario.duration_s)) / n_all


def first_s(results: RunResults) -> dict[str, float]:
    """The same as ``done_s`` of the tables of a results folder."""
    return {row["job"]: row["time_s"] for row in reversed(results.table(JOBS.name).to_pylist())}


def draw_steps(
    axes: Axes, results: RunResults, style: Style, times_s: Mapping[str, Collection[float]], label: str
) -> None:
    """How many things were done over mission time, a line for each kind.

    Args:
        times_s: when, by kind.
        label: of the vertical axis.
    """
    end_s = max((row["time_s"] for row in results.table("trajectories").to_pylist()), default=0.0)
    for (kind, of), line in zip(times_s.items(), ("-", "--"), strict=False):
        ordered = sorted(of)
        axes.step([0.0, *ordered, end_s], [*range(len(ordered) + 1), len(ordered)], where="post", linestyle=line,
                  color=style.black, label=kind)  # fmt: skip
    axes.set_xlabel(style.axis("time", "s"))
    axes.set_ylabel(style.axis(label))
    axes.locator_params("y", integer=True)
