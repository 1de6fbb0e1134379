"""Watch, ``[watch]``: CPU time limit for decisions of untrusted strategies; a file write ends the run.

A vehicle whose strategy exceeds the limit stays silent; the run continues. Only here machine time enters the model:
near the limit, two runs may differ.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import Field

from missions.feature import Feature, Joining
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric
from remoras.events import Host, Observer
from remoras.recorder import TIME, VEHICLE, Column, Table
from remoras.table import Section

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario
    from remoras.strategy import Strategy

KEY = "watch"
SILENCED = Table("silenced", (TIME, VEHICLE, Column("group", "str"), Column("part", "str")))
"""Vehicle, group and strategy part of each timeout, for scenarios with ``watch.cpu_s``."""


class WatchTable(Section):
    """The table ``[watch]``."""

    cpu_s: float = Field(0.0, ge=0.0, le=1e6, description="CPU time limit of a strategy per decision (s), 0 for none")


def watched(scenario: Scenario, strategy: Strategy) -> Strategy:
    """Wrap a strategy in the time limit unless it is wrapped already."""
    from remoras.decision_timeout import InTime

    return strategy if isinstance(strategy, InTime) else InTime(strategy, scenario.of_feature(KEY).cpu_s)


class Watch(Observer):
    """Run hooks that record timeouts of strategy parts."""

    def __init__(self, joining: Joining) -> None:
        joining.recorder.declare(SILENCED)

    def on_start(self, host: Host) -> None:
        from remoras.decision_timeout import InTime

        strategy = host.vehicles[0].social.strategy
        assert isinstance(strategy, InTime)  # guaranteed by ``Feature.strategy``
        strategy.silent.clear()
        rows = host.recorder.rows(SILENCED.name)
        strategy.late = lambda part, vehicle, group, now_s: rows.append((now_s, vehicle, group, part))


def n_silenced(run: MeasuredRun) -> int | Absent:
    """Number of decisions over the time limit."""
    return len(run.recorder.rows(SILENCED.name)) if run.scenario.of_feature(KEY).cpu_s else NOT_APPLICABLE


FEATURE = Feature(
    {"": {KEY: (WatchTable, WatchTable.usual())}},
    Watch,
    metrics=(Metric("n_silenced", "", Better.LOWER, "decisions beyond the CPU time limit", n_silenced),),
    strategy=watched,
)
