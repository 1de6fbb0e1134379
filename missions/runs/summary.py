"""The summary of a run: what was run, how it ended, every metric, and its milestones."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from missions.metric import NOT_APPLICABLE, Absent, Metric
from missions.scenarios.deployment import deployment_of
from missions.scenarios.scenario import Scenario
from remoras.errors import PluginError

if TYPE_CHECKING:
    from missions.runs.run import Run


def identity(scenario: Scenario, seed: int) -> dict[str, Any]:
    """The fields of a summary that are known before the run."""
    return {
        "scenario": scenario.scenario.name,
        "strategy": scenario.strategy.name,
        "policy": scenario.communication.policy,
        "channel": scenario.channel.name,
        "per": scenario.channel.mean_per(deployment_of(scenario)),
        "seed": seed,
        "n_vehicles": len(scenario.vehicle),
    }


def summary(run: Run) -> dict[str, Any]:
    """The figures of a run, with the names of the contract: a field for every metric of its setup.

    ``per`` is the mean packet error rate of the loss model as it is set, without blackouts and range. A value that a
    run does not have, such as a latency without packets, is None; one that it cannot have is left out.

    Raises:
        PluginError: a metric of the mission raises, or gives something else than a number, a truth value or None.
    """
    values = {metric.name: _value(metric, run) for metric in run.setup.metrics.values()}
    return {
        **identity(run.scenario, run.seed),
        "completed": values.pop("completed"),
        "reason": run.reason,
        **{name: value for name, value in values.items() if value is not NOT_APPLICABLE},
        "drawn": run.drawn,
        "milestones": [
            {"name": m.name, "vehicle": m.vehicle, "group": m.group, "time_s": round(m.time_s, 4)}
            for m in run.milestones
        ],
    }


def _value(metric: Metric, run: Run) -> float | int | bool | Absent | None:
    where = f"metric {metric.name} of {run.scenario.scenario.mission}"
    try:
        value = metric.of(run)
    except Exception as error:  # it may be somebody else's function
        raise PluginError(f"{where}: raised {type(error).__name__}: {error}") from error
    if value is not None and value is not NOT_APPLICABLE and not isinstance(value, float | int):
        raise PluginError(f"{where}: expected a number, a truth value or None; it gave {type(value).__name__}")
    if isinstance(value, float) and not math.isfinite(value):
        raise PluginError(f"{where}: expected a finite number, or None where a run has none; it gave {value}")
    return value
