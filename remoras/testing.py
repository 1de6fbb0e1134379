"""For tests of plug-ins: what each kind has to keep to, and the fleet, or managers alone, under random faults.

    python -m remoras.testing strategy nearest:NEAREST

tries a strategy, a policy, a channel model, a kind of fault or, by its scenario, a mission; ``conforms`` does the same
in a test. What a behaviour, a sensor, a driver, a rule of values, a metric or a figure has to keep to is checked by
``check_behaviour`` and so on.

>>> from remoras.testing import campaign, plan_of
>>> plan = plan_of("mapping-rendezvous", "cbba", kinds=["links"])  # doctest: +SKIP
>>> assert not campaign(plan, range(1, 21)).broken  # doctest: +SKIP
"""

import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from remoras.conformance import check_figure, check_metric
from remoras.plugin_folders import drop_current_folder, look_in
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
    from stress.conformance.behaviours import check as check_behaviour
    from stress.conformance.command import conforms
    from stress.conformance.drivers import check as check_driver
    from stress.conformance.faults import check as check_fault
    from stress.conformance.missions import check as check_mission
    from stress.conformance.sensors import check as check_sensor
    from stress.conformance.values import check as check_value
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
    "check_behaviour",
    "check_driver",
    "check_fault",
    "check_figure",
    "check_metric",
    "check_mission",
    "check_sensor",
    "check_value",
    "conforms",
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


LATE = {
    "storm_machine": ("stress.storm.machine", "storm_machine"),
    "conforms": ("stress.conformance.command", "conforms"),
    "check_behaviour": ("stress.conformance.behaviours", "check"),
    "check_driver": ("stress.conformance.drivers", "check"),
    "check_fault": ("stress.conformance.faults", "check"),
    "check_mission": ("stress.conformance.missions", "check"),
    "check_sensor": ("stress.conformance.sensors", "check"),
    "check_value": ("stress.conformance.values", "check"),
}
"""Names that are loaded when they are used: some need Hypothesis."""


def __getattr__(name: str) -> object:
    if name not in LATE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, wanted = LATE[name]
    return getattr(import_module(module), wanted)


if __name__ == "__main__":  # python -m remoras.testing
    drop_current_folder()
    look_in([str(Path.cwd())])
    from stress.conformance.command import main

    sys.exit(main(sys.argv[1:]))
