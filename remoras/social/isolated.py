"""Isolated changes: what a vehicle that is cut off has changed for itself.

When it comes back, roles are undone, and what it gave to roles and groups is told: nobody else has heard of that.
"""

from __future__ import annotations

from collections.abc import Callable

from remoras.authority import Act, Request
from remoras.beliefs import Fact
from remoras.organisation import Organisation, RoleAssignment
from remoras.social.agreed import Agreed
from worldmodel import PropertyValue


class IsolatedChanges:
    """Roles that a vehicle took and gave up while it was cut off, and orders that it gave."""

    def __init__(self) -> None:
        self._taken: dict[RoleAssignment, None] = {}
        self._displaced: dict[RoleAssignment, None] = {}
        self._given: dict[Request, Fact] = {}

    @property
    def has_changes(self) -> bool:
        """True if something was agreed alone that is to be undone."""
        return bool(self._taken or self._displaced)

    def note(self, agreed: Agreed, n_assigned: int, n_left: int) -> None:
        """Note what was agreed alone, behind so many roles that were assigned and left before."""
        for assignment in agreed.left[n_left:]:
            if assignment in self._taken:
                del self._taken[assignment]
            else:
                self._displaced[assignment] = None
        self._taken.update(dict.fromkeys(agreed.assigned[n_assigned:]))

    def give(self, asked: Request, fact: PropertyValue) -> None:
        """Note what was said alone, if it gives a role an objective or a group a mission: that is not undone."""
        if not asked.assignee:
            self._given[asked] = fact.subject, fact.attribute, fact.value

    def untold(self, may: Callable[[Request], bool]) -> list[Fact]:
        """What the vehicle gave alone, once it is back: that which it ``may`` still give, to be told now."""
        given, self._given = self._given, {}
        return [fact for asked, fact in given.items() if may(asked)]

    def forget(self, group: str) -> None:
        """A group was formed or dissolved at sea: there is nothing to undo in it."""
        for roles in (self._taken, self._displaced):
            for role in [role for role in roles if role.group == group]:
                del roles[role]
        self._given = {asked: fact for asked, fact in self._given.items() if asked.group != group}

    def come_back(self, me: str, organisation: Organisation) -> Agreed:
        """The vehicle is cut off no longer: it leaves what it took on alone, and others hold again what they held.

        Args:
            me: its name.
            organisation: that counted so far.
        """
        agreed = Agreed(organisation)
        for assignment in self._taken:
            agreed.leave(Request(me, Act.RELEASE, assignment.group, assignment.role, assignment.vehicle))
        for assignment in self._displaced:
            agreed.assign(Request(me, Act.ASSIGN, assignment.group, assignment.role, assignment.vehicle))
        self._taken.clear()
        self._displaced.clear()
        return agreed
