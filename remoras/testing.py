"""For tests of your own strategies, missions, managers, metrics and figures.

Strategies and missions meet the fleet under random faults, managers each other alone; ``check_metric`` and
``check_figure`` ask a metric or a figure of short runs.

>>> from remoras.testing import campaign, plan_of
>>> plan = plan_of("mapping-rendezvous", "cbba", kinds=["links"])  # doctest: +SKIP
>>> assert not campaign(plan, range(1, 21)).broken  # doctest: +SKIP
"""

from typing import TYPE_CHECKING

from remoras.conformance import check_figure, check_metric
from stress.campaign import Report, campaign, judge
from stress.drawing import Plan, plan_of, schedule_of
from stress.invariants.seam import Heard, Invariant, Moment, Scene
from stress.lives import Aired, Life
from stress.schedule import Schedule, StressFault, read_schedule
from stress.shrinking import Shrunk, shrunk
from stress.storm.fates import DOUBLED, HEARD, LOST, Copy, Fate, chances, damaged, flipped, late, replayed
from stress.storm.storm import LawBroken, Make, Storm
from stress.trial import Broken, Outcome

if TYPE_CHECKING:
    from stress.storm.machine import storm_machine

__all__ = [
    "DOUBLED",
    "HEARD",
    "LOST",
    "Aired",
    "Broken",
    "Copy",
    "Fate",
    "Heard",
    "Invariant",
    "LawBroken",
    "Life",
    "Make",
    "Moment",
    "Outcome",
    "Plan",
    "Report",
    "Scene",
    "Schedule",
    "Shrunk",
    "Storm",
    "StressFault",
    "campaign",
    "chances",
    "check_figure",
    "check_metric",
    "damaged",
    "flipped",
    "judge",
    "late",
    "plan_of",
    "read_schedule",
    "replayed",
    "schedule_of",
    "shrunk",
    "storm_machine",
]


def __getattr__(name: str) -> object:
    """The state machine, which alone needs Hypothesis."""
    if name == "storm_machine":
        from stress.storm.machine import storm_machine

        return storm_machine
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
