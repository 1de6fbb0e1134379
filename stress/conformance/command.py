"""Let a plug-in be tried by its name: ``python -m remoras.testing KIND NAME``."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from exchange.errors import ExchangeError
from missions.errors import MissionsError
from missions.scenarios import load
from missions.scenarios.channel import model_named
from missions.scenarios.parts import mission_class
from remoras.errors import RemorasError

KINDS = ("strategy", "mission", "policy", "channel", "fault")
"""What can be tried by its name; of the other kinds a test calls ``check`` with what it takes."""


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
            from stress.conformance.strategies import conforms as of_strategy  # which needs Hypothesis

            yield from of_strategy(name)
        case "mission":
            from stress.conformance.missions import conforms as of_mission

            scenario = load(name)
            yield from of_mission(mission_class(scenario.scenario.mission), scenario)
        case "policy":
            from stress.conformance.policies import conforms as of_policy

            yield from of_policy(name)
        case "fault":
            from stress.conformance.faults import conforms as of_fault

            yield from of_fault(name)
        case _:
            from stress.conformance.channels import conforms as of_channel

            yield from of_channel(model_named(name))


def main(arguments: list[str]) -> int:
    """Try one plug-in; 0 if it passes, 1 if it does not, 2 if there is none."""
    if len(arguments) != 2 or arguments[0] not in KINDS:
        print(f"usage: python -m remoras.testing {'|'.join(KINDS)} NAME", file=sys.stderr)
        return 2
    try:
        for passed in conforms(*arguments):
            print(f"ok  {passed}", flush=True)
    except AssertionError as error:
        print(f"{arguments[0]} {arguments[1]} does not conform: {error}", file=sys.stderr)
        return 1
    except ModuleNotFoundError as error:
        if error.name != "hypothesis":
            raise
        print("the checks of a strategy need Hypothesis: pip install hypothesis", file=sys.stderr)
        return 2
    except (RemorasError, MissionsError, ExchangeError) as error:
        print(f"{arguments[0]} {arguments[1]}: {error}", file=sys.stderr)
        return 2
    return 0
