"""Watch: ``[watch]``, CPU time that a strategy may take for a decision, and files that it may not write.

For strategies that somebody else wrote, as in benchmarks. Whoever takes too long is asked no more and sends nothing
from then on, as a vehicle that has fallen silent, and the run goes on; whoever writes files ends it.
Time of this machine enters the model here, and only here: of a strategy that comes near the limit two runs may differ.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import Field

from missions.feature import Feature, Joining
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric
from remoras.events import Host, Observer
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Table
from remoras.table import Section

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario
    from remoras.deciding import InTime
    from remoras.strategy import Strategy

KEY = "watch"
SILENCED = Table("silenced", (TIME, VEHICLE, Column("group", "str"), Column("part", "str")))
"""Who is asked no more from ``time_s`` on, since a decision took too long, and by which part of the strategy; written
in runs of scenarios with ``watch.cpu_s``."""


class WatchTable(Section):
    """The table ``[watch]``."""

    cpu_s: float = Field(
        0.0, ge=0.0, le=1e6, description="CPU time that a strategy may take for a decision (s), 0 for any"
    )


def watched(scenario: Scenario, strategy: Strategy) -> Strategy:
    """Watch a strategy, unless it is watched already."""
    from remoras.deciding import InTime

    return strategy if isinstance(strategy, InTime) else InTime(strategy, scenario.of_feature(KEY).cpu_s)


class Watch(Observer):
    """Lets a run note who falls silent."""

    def __init__(self, joining: Joining) -> None:
        joining.recorder.declare(SILENCED)

    def on_start(self, host: Host) -> None:
        """Note from now on which parts of the strategy fall silent."""
        from remoras.deciding import InTime

        strategy = host.vehicles[0].social.strategy
        assert isinstance(strategy, InTime)  # the feature made it
        watched_by(strategy, host.recorder)


def watched_by(strategy: InTime, recorder: Recorder) -> None:
    """Let a strategy, of which no part has fallen silent yet, tell a recorder of those that do."""
    strategy.silent.clear()
    rows = recorder.rows(SILENCED.name)
    strategy.late = lambda part, vehicle, group, now_s: rows.append((now_s, vehicle, group, part))


def n_silenced(run: MeasuredRun) -> int | Absent:
    """How often a decision took too long."""
    return len(run.recorder.rows(SILENCED.name)) if run.scenario.of_feature(KEY).cpu_s else NOT_APPLICABLE


FEATURE = Feature(
    {"": {KEY: (WatchTable, WatchTable.usual())}},
    Watch,
    metrics=(Metric("n_silenced", "", Better.LOWER, "decisions that took too long", n_silenced),),
    strategy=watched,
)
