"""Availability: which vehicles take jobs, by what each of them says of itself.

A vehicle that is cut off or has resigned takes none, until it says that it does again; one whose sensors yield nothing
takes none for which it needs them. What was given to it before it said so stays with it until it leaves that. So it is
a function of what was said, whatever was heard first: the order, or that its assignee takes none.
"""

from __future__ import annotations

from remoras.authority import Request, Rules
from remoras.beliefs import Beliefs
from remoras.organisation import Group
from remoras.social.leadership import Age
from remoras.social.reports import SENSORS_WORK, takes_sensors
from remoras.social.statements import AVAILABLE
from worldmodel import Change


class Availability:
    """Who takes jobs, as one vehicle knows it.

    Args:
        me: own name.
        beliefs: of the vehicle.
        rules: of who may change what.

    Attributes:
        unavailable: vehicles that take no jobs.
        is_misjudged: before this vehicle began anew it has said that it takes no jobs.
        news: vehicles of which something has become known since somebody took these.
        attributes: of the facts that it takes note of; those of ``Reports`` are among them.
    """

    def __init__(self, me: str, beliefs: Beliefs, rules: Rules) -> None:
        tbox = beliefs.model.tbox
        self.unavailable: frozenset[str] = frozenset()
        self.is_misjudged = False
        self.news: set[str] = set()
        self._me = me
        self._beliefs = beliefs
        self._rules = rules
        self._available, self._sensors_work = (tbox.attribute_named(name).uid for name in (AVAILABLE, SENSORS_WORK))
        self.attributes = frozenset({self._available, self._sensors_work})
        self._said: dict[str, dict[Age, bool]] = {}
        self._since: dict[str, Age] = {}  # vehicles that take no jobs
        self._blind_since: dict[str, Age] = {}

    def note(self, change: Change) -> None:
        """Take note of what a vehicle says of itself; what this one said before it began anew is over."""
        block = change.block
        for position, fact in enumerate(block.facts):
            if fact.attribute not in (self._available, self._sensors_work) or fact.subject != block.origin:
                continue
            name, age = self._beliefs.name(block.origin), (*block.key, position)
            if fact.attribute == self._sensors_work:
                if not fact.value:
                    self._blind_since[name] = min(age, self._blind_since.get(name, age))
            elif name == self._me and block.epoch != self._beliefs.model.epoch:
                self.is_misjudged |= not fact.value
                continue
            else:
                self._said.setdefault(name, {})[age] = bool(fact.value)
                self._work_out(name)
            self.news.add(name)

    def _work_out(self, name: str) -> None:
        """Since when a vehicle takes no jobs, if it does not."""
        since: Age | None = None
        for age, takes_jobs in sorted(self._said[name].items()):
            since = None if takes_jobs else since or age
        self._since.pop(name, None)
        if since is not None:
            self._since[name] = since
        self.unavailable = frozenset(self._since)

    def takes(self, asked: Request, group: Group, age: Age) -> bool:
        """True if the assignee takes a role of a group that was given to it at ``age``; anybody takes one without job.

        Args:
            asked: gives the role.
            group: specification.
            age: when it was given.
        """
        role = group.role(asked.role)
        if role is None or role.job is None:
            return True
        if self._since.get(asked.assignee, age) < age:
            return False
        return self._blind_since.get(asked.assignee, age) >= age or not takes_sensors(self._rules, group, asked)
