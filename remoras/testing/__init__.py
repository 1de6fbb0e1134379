"""Checks of plug-ins for the tests of their authors.

    remoras check strategy nearest:NEAREST

tries a strategy, a policy, a channel model, a kind of fault or, by its scenario, a mission; ``conforms`` does the same
in a test. Requirements on a behaviour, a sensor, a driver, a rule of values, a metric or a figure are checked by
``check_behaviour`` and so on; each raises ``AssertionError`` with what is wrong.
"""

from collections.abc import Iterator

from missions.scenarios import load
from missions.scenarios.channel import model_named
from missions.scenarios.parts import mission_class
from remoras.testing import channels, faults, missions, policies
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

KINDS = ("strategy", "mission", "policy", "channel", "fault")
"""Kinds that are tried by name; of the others a test calls ``check_behaviour`` and so on."""


def conforms(kind: str, name: str) -> Iterator[str]:
    """Make every check of a plug-in, and say which it passed.

    Args:
        kind: one of ``KINDS``.
        name: as a scenario gives it, ``package.module:object`` or shipped; of a mission the scenario itself.

    Yields:
        The name of each check that was passed.

    Raises:
        AssertionError: a check was not passed: what is wrong.
        RemorasError, MissionsError, ExchangeError: there is nothing of that name.
    """
    match kind:
        case "strategy":
            from remoras.testing import strategies  # which needs Hypothesis

            yield from strategies.conforms(name)
        case "mission":
            scenario = load(name)
            yield from missions.conforms(mission_class(scenario.scenario.mission), scenario)
        case "policy":
            yield from policies.conforms(name)
        case "fault":
            yield from faults.conforms(name)
        case _:
            yield from channels.conforms(model_named(name))
