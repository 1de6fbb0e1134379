"""Conformance checks of plug-ins for their authors; a failure raises ``AssertionError``.

``remoras check strategy nearest:NEAREST`` checks a strategy, policy, channel model, sensor, kind of fault or, by its
scenario, a mission; ``conforms`` does so in a test. For other plug-ins, call ``check_behaviour`` and so on.
"""

from collections.abc import Iterator

from missions.scenarios import load
from missions.scenarios.channel import model_named
from missions.scenarios.parts import mission_class
from remoras.testing import channels, faults, missions, policies, sensors
from remoras.testing.behaviours import check as check_behaviour
from remoras.testing.channels import check_driver
from remoras.testing.faults import check as check_fault
from remoras.testing.figures import check_figure, check_metric
from remoras.testing.missions import check as check_mission
from remoras.testing.policies import check_value_rule as check_value
from remoras.testing.sensors import check as check_sensor

__all__ = [
    "check_behaviour",
    "check_driver",
    "check_fault",
    "check_figure",
    "check_metric",
    "check_mission",
    "check_sensor",
    "check_value",
    "conforms",
]

KINDS = ("strategy", "mission", "policy", "channel", "sensor", "fault")
"""Kinds checked by name; a test calls ``check_behaviour`` and so on for others."""


def conforms(kind: str, name: str) -> Iterator[str]:
    """Run all checks of a plug-in (a mission by its scenario) and yield names of passed ones."""
    match kind:
        case "strategy":
            from remoras.testing import strategies  # needs Hypothesis

            yield from strategies.conforms(name)
        case "mission":
            scenario = load(name)
            yield from missions.conforms(mission_class(scenario.scenario.mission), scenario)
        case "policy":
            yield from policies.conforms(name)
        case "sensor":
            yield from sensors.conforms(name)
        case "fault":
            yield from faults.conforms(name)
        case _:
            yield from channels.conforms(model_named(name))
