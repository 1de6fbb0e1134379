"""A policy as a strategy: it enters a run by the door by which all strategies do."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from typing import Any, TypeAlias

from missions.benchmark.learning.observing import Observer, Sight
from remoras.authority import Authority
from remoras.errors import PluginError
from remoras.organisation import Group
from remoras.strategies.founding import common_roles, founded
from remoras.strategy import JOB_DONE, Declaration, Move, Negotiator, Situation

Policy: TypeAlias = Callable[[Sight], int]
"""Gives the action for an observation."""

DECLARATION = Declaration(
    source="a policy over observations of what one vehicle knows",
    messages={
        "playsRole": "the sender has taken a job",
        "leftRole": "the sender has left a job",
        JOB_DONE: "a vehicle has done a job",
    },
    authorities=frozenset({Authority.TAKE}),
)


class PolicyNegotiator:
    """One vehicle that does what a policy says.

    Args:
        me: name of the vehicle.
        group: whose jobs are divided.
        policy: of this vehicle alone.
    """

    def __init__(self, me: str, group: Group, policy: Policy) -> None:
        self._observer = Observer(me, group)
        self._policy = policy

    def negotiate(self, situation: Situation) -> Move:
        """What the action of the policy states."""
        seen = self._observer.observation(situation)
        return self._observer.move(self._policy(seen), seen["action_mask"], situation)


class PolicyStrategy:
    """A strategy whose vehicles each do what a copy of a policy says: they share nothing but messages.

    Args:
        policy: gives the action for an observation.
        name: by which results and figures show it.
    """

    declaration = DECLARATION
    form = staticmethod(founded)
    adapt = staticmethod(common_roles)

    def __init__(self, policy: Policy, name: str) -> None:
        self.name = name
        self._policy = policy

    def negotiator(self, me: str, group: Group) -> Negotiator | None:
        """What ``me`` divides the jobs of ``group`` with."""
        return PolicyNegotiator(me, group, deepcopy(self._policy))


def strategy(policy: Policy, name: str = "learned") -> Any:
    """A strategy, see ``remoras.Strategy``, whose vehicles do what a policy says.

    Each vehicle of each run has a deep copy of the policy, so what a policy keeps is what one vehicle remembers.

    Args:
        policy: a function, or an object that is called, of an observation; gives the number of an action.
        name: by which results and figures show it.

    Raises:
        PluginError: the policy cannot be called.

    >>> strategy(lambda seen: int(seen["action_mask"].argmax())).name
    'learned'
    """
    if not callable(policy):
        raise PluginError(f"policy is {type(policy).__name__}; allowed: a function of an observation")
    return PolicyStrategy(policy, name)
