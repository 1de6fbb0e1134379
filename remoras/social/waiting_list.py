"""Waiting list: assignments for which there was no room, until an old holder leaves."""

from __future__ import annotations

from collections.abc import Callable

from remoras.authority import Act, Request
from remoras.organisation import Organisation, Outcome, RoleAssignment
from remoras.social.agreed import Agreed
from remoras.social.reigns import Age


class WaitingList:
    """Assignments that wait for room, as one vehicle knows them.

    Whoever is let in off the list holds the role for want of newer word: an assignment that was said since may be heard
    later. It takes the room then, as it would have had it been heard in time, and who was let in waits again.

    Args:
        given_at: says when the newest word of a role of a vehicle was said, by group, role and vehicle.
    """

    def __init__(self, given_at: Callable[[str, str, str], Age]) -> None:
        self._given_at = given_at
        self._denied: dict[RoleAssignment, Request] = {}
        self._let_in: dict[RoleAssignment, Request] = {}

    def take(self, asked: Request, outcome: Outcome) -> None:
        """There is new word of an assignment: it waits if there is no room for it."""
        one = _assignment(asked)
        self._denied.pop(one, None)
        self._let_in.pop(one, None)
        if outcome is Outcome.NO_ROOM:
            self._denied[one] = asked

    def yielding(self, asked: Request, age: Age, organisation: Organisation) -> frozenset[str]:
        """Holders that were let in, and of which nothing newer is known than what was ``asked`` at ``age``."""
        if asked.act is not Act.ASSIGN or not self._let_in:
            return frozenset()
        held = (RoleAssignment(asked.group, asked.role, v) for v in organisation.members(asked.group, asked.role))
        return frozenset(one.vehicle for one in held if one in self._let_in and self._age(one) < age)

    def displace(self, asked: Request, organisation: Organisation) -> None:
        """What was ``asked`` has taken the room: whoever was let in there and holds the role no longer waits again."""
        for one in [*self._let_in]:
            if (one.group, one.role) == (asked.group, asked.role) and one not in organisation.assignments:
                self._denied[one] = self._let_in.pop(one)

    def let_in(self, agreed: Agreed) -> None:
        """Let assignments count for which there is room now, the newest first."""
        self._let_in = {one: asked for one, asked in self._let_in.items() if one in agreed.organisation.assignments}
        for one in sorted(self._denied, key=self._age, reverse=True):
            outcome = agreed.assign(self._denied[one])
            if outcome is not Outcome.NO_ROOM:
                asked = self._denied.pop(one)
                self._let_in |= {one: asked} if outcome is Outcome.SUCCESS else {}

    def _age(self, one: RoleAssignment) -> Age:
        return self._given_at(one.group, one.role, one.vehicle)


def _assignment(asked: Request) -> RoleAssignment:
    return RoleAssignment(asked.group, asked.role, asked.assignee)
