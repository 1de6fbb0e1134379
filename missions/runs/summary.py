"""Summary of a run: identity, outcome, every metric, milestones."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from missions.metric import NOT_APPLICABLE
from missions.runs.reader import KeptRun, value_of
from missions.runs.tables import recorded_table
from missions.scenarios.scenario import Scenario

if TYPE_CHECKING:
    from missions.runs.run import Run


def identity(scenario: Scenario, seed: int) -> dict[str, Any]:
    """Return the fields known before the run."""
    return {
        "scenario": scenario.scenario.name,
        "strategy": scenario.strategy.name,
        "policy": scenario.communication.policy,
        "channel": scenario.channel.name,
        "per": scenario.channel.mean_per(scenario.deployment),
        "seed": seed,
        "n_vehicles": len(scenario.vehicle),
    }


def summary(run: Run) -> dict[str, Any]:
    """Return the summary of a run, or raise PluginError for a metric that fails.

    Metrics named by the scenario read the run as stored (``KeptRun``), those of the mission the run itself. ``per`` is
    the mean packet error rate of the loss model, without blackouts and range. An undefined value, such as a latency
    without packets, is None; a metric that does not apply is absent.
    """
    of, own = run.scenario.scenario.mission, run.setup.own_metrics
    names = {metric.name for metric in own.values()}
    shipped = [metric for metric in run.setup.metrics.values() if metric.name not in names]
    values = {metric.name: value_of(metric, run, of) for metric in shipped}
    fields = {
        **identity(run.scenario, run.seed),
        "completed": values.pop("completed"),
        "reason": run.reason,
        **_applicable(values),
    }
    milestones = [
        {"name": m.name, "vehicle": m.vehicle, "group": m.group, "time_s": round(m.time_s, 4)} for m in run.milestones
    ]
    recorder = run.recorder
    kept = KeptRun(
        {**fields, "milestones": milestones}, recorder.tables, partial(recorded_table, recorder), lambda: run.scenario
    )
    measured = {metric.name: value_of(metric, kept, reference) for reference, metric in own.items()}
    return {**fields, **_applicable(measured), "drawn": run.drawn, "milestones": milestones}


def _applicable(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in values.items() if value is not NOT_APPLICABLE}
