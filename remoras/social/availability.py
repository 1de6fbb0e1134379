"""Availability: which vehicles take jobs, by what each of them says of itself. An immutable value.

A vehicle that is cut off or has resigned takes none, until it says that it does again; one whose sensors yield nothing
takes none for which it needs them. What was given to it before it said so stays with it until it leaves that. So it is
a function of what was said, whatever was heard first: the order, or that its assignee takes none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from remoras.authority import NOBODY, Request, Rules
from remoras.organisation import Group
from remoras.social.leadership import Age
from remoras.social.reports import takes_sensors

AVAILABLE = "available"


@dataclass(frozen=True, slots=True)
class Availability:
    """Who takes jobs, as one vehicle knows it.

    Attributes:
        told: whether it takes jobs, as each vehicle has said, and when.
        blind_since: vehicles whose sensors yield nothing.
        news: vehicles of which something was heard since the end of the last round.
        since: vehicles that take no jobs; unavailable: the same, by their names alone.
    """

    told: Mapping[str, Mapping[Age, bool]] = field(default_factory=dict)
    blind_since: Mapping[str, Age] = field(default_factory=dict)
    news: frozenset[str] = NOBODY
    since: Mapping[str, Age] = field(init=False)
    unavailable: frozenset[str] = field(init=False)

    def __post_init__(self) -> None:
        since: dict[str, Age] = {}
        for name, told in self.told.items():
            for age, takes_jobs in sorted(told.items()):
                if takes_jobs:
                    since.pop(name, None)
                else:
                    since.setdefault(name, age)
        object.__setattr__(self, "since", since)
        object.__setattr__(self, "unavailable", frozenset(since))

    def hear(self, name: str, takes_jobs: bool, age: Age) -> Availability:
        """A vehicle has said whether it takes jobs."""
        told = {**self.told, name: {**self.told.get(name, {}), age: takes_jobs}}
        return replace(self, told=told, news=self.news | {name})

    def hear_of_sensors(self, name: str, work: bool, age: Age) -> Availability:
        """A vehicle has said whether its sensors yield anything; that they do not it says for good."""
        blind = {} if work else {name: min(age, self.blind_since.get(name, age))}
        return replace(self, blind_since={**self.blind_since, **blind}, news=self.news | {name})

    def takes(self, asked: Request, group: Group, age: Age, rules: Rules) -> bool:
        """True if the assignee takes a role of a group that was given to it at ``age``; anybody takes one without job.

        Args:
            asked: gives the role.
            group: specification.
            age: when it was given.
            rules: which jobs take sensors.
        """
        role = group.role(asked.role)
        if role is None or role.job is None:
            return True
        if self.since.get(asked.assignee, age) < age:
            return False
        return self.blind_since.get(asked.assignee, age) >= age or not takes_sensors(rules, group, asked)
