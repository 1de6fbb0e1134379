"""Isolated changes: what a vehicle that is cut off has changed for itself, to be undone when it comes back."""

from __future__ import annotations

from remoras.authority import Act, Request
from remoras.organisation import Organisation, RoleAssignment
from remoras.social.agreed import Agreed


class IsolatedChanges:
    """Roles that a vehicle took and gave up while it was cut off."""

    def __init__(self) -> None:
        self._taken: dict[RoleAssignment, None] = {}
        self._displaced: dict[RoleAssignment, None] = {}

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

    def forget(self, group: str) -> None:
        """A group was formed or dissolved at sea: there is nothing to undo in it."""
        for roles in (self._taken, self._displaced):
            for role in [role for role in roles if role.group == group]:
                del roles[role]

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
