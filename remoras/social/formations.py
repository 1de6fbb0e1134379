"""Formations: which of the groups that are formed at sea there are, as one vehicle knows it.

A group is formed under a number, one more than that of its last formation, and dissolved under the same. What is said
of it counts in the order of these numbers: formed, dissolved, formed anew. Of several that form it under one number the
lower node wins. So what counts is the greatest of what was heard, whatever came first: ``Formations`` is a join.
What was said of a group before its newest formation, or before that was over, is about an earlier one, and counts no
longer.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from remoras.authority import Act, Request, Rules, may_assign
from remoras.organisation import Outcome
from remoras.social.agreed import Agreed
from remoras.social.leadership import AGREED_BEFORE, Age, LeadershipHistory

FORMED_UNDER, FORMATION, DISSOLVED = FORMATION_ATTRIBUTES = ("formedUnder", "formation", "dissolved")
LAST_FORMATION = 255
"""The ontology numbers formations up to this one."""


class Formation(NamedTuple):
    """Something said of a group, to be compared: the greater counts.

    Attributes:
        number: of the formation, from 1.
        is_over: it is dissolved.
        rank: minus the node of who formed it; 0 where it is over.
    """

    number: int
    is_over: bool
    rank: int


NEVER = Formation(0, True, 0)


class Formations:
    """The newest formation of each group that is formed at sea.

    Args:
        rules: of who may change what, with these groups.
        leadership: when who led; that of a group begins with each formation anew.
    """

    def __init__(self, rules: Rules, leadership: LeadershipHistory) -> None:
        self._rules = rules
        self._leadership = leadership
        self._newest: dict[str, tuple[Formation, Age]] = {}

    def number(self, group: str) -> int:
        """How often the group has been formed, as far as is known."""
        return self._newest[group][0].number if group in self._newest else 0

    def is_of_earlier(self, group: str, age: Age) -> bool:
        """True if what was said of the group at ``age`` was about an earlier formation of it."""
        return bool(self._newest) and age < self._newest.get(group, (NEVER, AGREED_BEFORE))[1]

    def may_come(self, group: str, agreed: Agreed) -> bool:
        """True of a group that is formed at sea and is not there."""
        return group in self._rules.at_sea and group not in agreed.organisation.groups

    def settle(self, asked: Request, number: int | None, age: Age, agreed: Agreed) -> Outcome | None:
        """Let a group be formed or dissolved, unless it may not be, or something newer is known of it.

        Where its last formation is not known to be over, a new one ends it.

        Args:
            asked: the request to form or to dissolve it.
            number: of the formation; None if that was not said.
            age: of the request.
            agreed: what counts so far.

        Returns:
            The outcome; None if something newer is known.
        """
        is_over = asked.act is Act.DISSOLVE
        rank = 0 if is_over else -self._rules.database[asked.issuer].node
        said, there = Formation(number or 0, is_over, rank), agreed.organisation
        if number is not None and said <= self._newest.get(asked.group, (NEVER,))[0]:
            return None
        if not is_over and asked.group in self._rules.at_sea:
            there = there.without_group(asked.group)
        outcome = may_assign(asked, there, self._rules, lambda who, group: self._leadership.led(who, group, age))
        if outcome is not Outcome.SUCCESS or number is None:
            return Outcome.NO_AUTHORITY if number is None else outcome
        self._newest[asked.group] = said, age
        self._leadership.begin(asked.group, None if is_over else asked.assignee, age)
        if asked.group in agreed.organisation.groups:
            agreed.dissolve(replace(asked, act=Act.DISSOLVE))
        if not is_over:
            agreed.form(asked, self._rules.at_sea[asked.group])
        return outcome
