"""Conformance checks of plug-ins for their authors; a failure raises ``AssertionError``.

``remoras check strategy nearest:NEAREST`` checks a strategy, policy, channel model, sensor, kind of fault or, by its
scenario, a mission; ``conforms`` does so in a test. For other plug-ins, call ``check_behaviour`` and so on.
"""

from collections.abc import Iterator
from importlib import import_module

from remoras.errors import PluginError
from remoras.testing.behaviours import check as check_behaviour
from remoras.testing.channels import check_driver
from remoras.testing.faults import check as check_fault
from remoras.testing.figures import check_figure, check_metric
from remoras.testing.missions import check as check_mission
from remoras.testing.policies import check_value_rule as check_value
from remoras.testing.sensors import check as check_sensor

if not __debug__:
    raise PluginError("python -O drops the assertions that check plug-ins; run without -O and PYTHONOPTIMIZE")

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

KINDS = {
    "strategy": "strategies", "mission": "missions", "policy": "policies", "channel": "channels", "sensor": "sensors",
    "fault": "faults",
}  # fmt: skip
"""Kinds checked by name, each with its module; a test calls ``check_behaviour`` and so on for others."""


def conforms(kind: str, name: str) -> Iterator[str]:
    """Run all checks of a plug-in (a mission by its scenario) and yield names of passed ones."""
    passed: Iterator[str] = import_module(f"{__name__}.{KINDS[kind]}").conforms(name)
    return passed
