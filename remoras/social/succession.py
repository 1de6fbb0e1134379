"""Succession of heads: who leads a group whose head is lost, by an order that all its members compute alike.

The first in that order claims the group under the greatest term known and one more. Vehicles may see different peers,
so several may claim. The greatest claim wins, by term and then by lower node, whatever the order in which claims
are heard and however often: ``Headship`` is a join. Whoever led before and hears of it steps down.

Who was out of reach may claim by a role that others have given away meanwhile. These refuse it, so only it would take
itself for the head: the head that the others have claims again, under a greater term, as any head of the past may.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import NamedTuple

from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment

HEADED_BY, HEAD_TERM = "headedBy", "headTerm"
LAST_TERM = 255
"""The ontology names terms up to this one."""


class Claim(NamedTuple):
    """A claim to lead a group, to be compared: the greater wins.

    Attributes:
        term: how often the group has changed its head, this change included.
        rank: minus the node of who claims.
    """

    term: int
    rank: int


class Headship:
    """The greatest claim known for each group, and the greatest that was refused."""

    def __init__(self) -> None:
        self._claims: dict[str, Claim] = {}
        self._refused: dict[str, Claim] = {}

    def take(self, group: str, claim: Claim) -> bool:
        """Note a claim; True if it is the greatest now and was not before."""
        if group in self._claims and self._claims[group] >= claim:
            return False
        self._claims[group] = claim
        return True

    def refuse(self, group: str, claim: Claim) -> None:
        """Note a claim that does not count here; whoever made it, and all who heard of it first, may go by it."""
        self._refused[group] = max(claim, self._refused.get(group, claim))

    def is_contested(self, group: str, node: int) -> bool:
        """True if a claim greater than any that counts was refused, and a new one of this node would be greater."""
        refused = self._refused.get(group)
        if refused is None or (group in self._claims and self._claims[group] >= refused):
            return False
        return Claim(self.next_term(group), -node) > refused

    def forget(self, group: str) -> None:
        """The group is formed anew: claims to lead it before are over."""
        self._claims.pop(group, None)
        self._refused.pop(group, None)

    def term(self, group: str) -> int:
        """The greatest term known of a group; 0 for the head that was agreed before the mission."""
        return self._claims[group].term if group in self._claims else 0

    def next_term(self, group: str) -> int:
        """The term of a new claim, above all that are known."""
        refused = self._refused[group].term if group in self._refused else 0
        return min(max(self.term(group), refused) + 1, LAST_TERM)


def successor(
    group: Group, organisation: Organisation, database: AUVDatabase, unavailable: Collection[str] = ()
) -> str | None:
    """Who is to lead a group without a head; None if nobody is able to.

    The members that play a role of the succession, are able to lead, and play no role of another group that is
    incompatible with it, are ordered by the first such role, then by how
    many roles with a job they are able to play, by energy and by name.

    Args:
        group: that has no head.
        organisation: without vehicles that are absent.
        database: static data of all vehicles.
        unavailable: vehicles that take no jobs.
    """
    jobs = [role.name for role in group.roles if role.job is not None]

    def order(name: str) -> tuple[int, int, float, str]:
        data = database[name]
        first = next(n for n, role in enumerate(group.succession) if organisation.plays(name, group.name, role))
        n_able = 0 if name in unavailable else sum(data.can_play(group.name, role) for role in jobs)
        return first, -n_able, -data.energy_j, name

    head = group.role(group.head_role or "")
    excluded = [] if head is None else [(of, role) for of, role in head.incompatible if of != group.name]
    holders = {name for role in group.succession for name in organisation.members(group.name, role)}
    able = [
        name
        for name in holders
        if is_able_to_lead(database, name, group) and not any(organisation.plays(name, *other) for other in excluded)
    ]
    return min(able, key=order, default=None)


def is_able_to_lead(database: AUVDatabase, vehicle: str, group: Group) -> bool:
    """True if the vehicle has the social layer and can play the head's role."""
    data = database[vehicle]
    return data.social_layer and group.head_role is not None and data.can_play(group.name, group.head_role)


def role_after(database: AUVDatabase, vehicle: str, group: Group, organisation: Organisation) -> RoleAssignment | None:
    """The role that a head takes when it steps down: the first of the succession that it can play.

    None if it plays another founding role of the group already, or can play none.

    Args:
        database: static data of all vehicles.
        vehicle: who leads no longer.
        group: that it has led.
        organisation: after it has left the head's role.
    """
    founding = {role.name for role in group.roles if role.founding}
    if any(role.role in founding for role in organisation.roles_of(vehicle, group.name)):
        return None
    for name in group.succession:
        role = group.role(name)
        is_able = database[vehicle].can_play(group.name, name)
        if is_able and role is not None and not organisation.is_excluded(vehicle, role):
            return RoleAssignment(group.name, name, vehicle)
    return None


def yielding_above(group: Group, role: str, heads: Collection[str], organisation: Organisation) -> tuple[str, ...]:
    """Who leaves a role of the group above for a new head that has to play it: who led before, or its sole holder.

    Who leads another group by that role keeps it.

    Args:
        group: above the one that has a new head; role: of it, by whose holder that is led.
        heads: that the group below has had, also those that have stepped down.
        organisation: as agreed.
    """
    demands = group.role(role)
    is_sole = demands is not None and demands.maximum == 1
    leads = {
        name
        for below in organisation.groups.values()
        for one in below.roles
        if one.head and one.played_by == (group.name, role)
        for name in organisation.members(below.name, one.name)
    }
    gone = set(heads) - leads
    return tuple(name for name in organisation.members(group.name, role) if is_sole or name in gone)


def excluded_by_leading(group: Group, vehicle: str, organisation: Organisation) -> tuple[RoleAssignment, ...]:
    """Roles of a group that a vehicle plays and that are incompatible with leading it."""
    head = group.role(group.head_role or "")
    if head is None or not head.incompatible:
        return ()
    held = organisation.roles_of(vehicle, group.name)
    return tuple(assignment for assignment in held if (assignment.group, assignment.role) in head.incompatible)


def playing(organisation: Organisation, vehicle: str, group: str, roles: Iterable[str]) -> Organisation:
    """The organisation as it was when a vehicle claimed to lead a group: it plays the roles that it has left since.

    Else a claim would count for those who hear of it before another has taken the place of its issuer, and not for
    those who hear of it later.

    Args:
        organisation: as it is now.
        vehicle: that claimed to lead; group: which; roles: of the succession that it has left since.
    """
    for role in roles:
        for other in organisation.members(group, role):
            organisation, _ = organisation.leave_role(other, group, role)
        organisation, _ = organisation.assign(vehicle, group, role)
    return organisation
