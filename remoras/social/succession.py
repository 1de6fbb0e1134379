"""Succession of heads: who leads a group whose head is lost, by an order that all its members compute alike.

The first in that order claims the group under the greatest term known and one more. Vehicles may see different peers,
so several may claim. Which claims count, ``remoras.social.leadership`` says; of these the greatest wins, by term and
then by lower node, in whatever order they are heard. Whoever led before and lets it count steps down and assents.

A claim may count for some and for others not: who was out of reach may claim by a role that others have given away
meanwhile, or take a head for absent that they hear. Then the head that they have claims again, under a greater term.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import NamedTuple

from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment

HEADED_BY, HEAD_TERM = "headedBy", "headTerm"
ROLE_ATTRIBUTES = PLAYS_ROLE, LEFT_ROLE = ("playsRole", "leftRole")
N_TERMS = 256
"""Terms on the wire are modulo this, and are read as those nearest to the greatest known (as in RFC 1982)."""
FURTHEST = 64
"""Terms ahead of the greatest known that a claim may have. It is far more than a group has heads in one mission, so
that nobody is locked out that has missed many claims; and a quarter of all terms, so that a claim and those which end
it are still read alike by who has heard of neither."""


class Claim(NamedTuple):
    """A claim to lead a group, to be compared: the greater wins.

    Attributes:
        term: how often the group has changed its head, this change included.
        rank: minus the node of who claims.
    """

    term: int
    rank: int


def read_claim(claim: Claim, greatest: Claim | None) -> Claim | None:
    """A claim with its term as one that goes on after 255; None if it leaps, or is from before the first.

    Args:
        claim: with its term as it is on the wire.
        greatest: of the claims to lead the same group that are known.

    >>> [read_claim(Claim(term, 0), None) for term in (64, 65, 255)]
    [Claim(term=64, rank=0), None, None]
    >>> next_term(Claim(255, 0)), read_claim(Claim(0, 0), Claim(255, 0)), read_claim(Claim(254, 0), Claim(255, 0))
    (0, Claim(term=256, rank=0), Claim(term=254, rank=0))
    """
    known = 0 if greatest is None else greatest.term
    ahead = (claim.term - known + N_TERMS // 2) % N_TERMS - N_TERMS // 2
    return claim._replace(term=known + ahead) if 0 < known + ahead <= known + FURTHEST else None


def next_term(greatest: Claim | None) -> int:
    """The term of a new claim, one above all that are known, as it is on the wire; the first is 1."""
    return 1 if greatest is None else (greatest.term + 1) % N_TERMS


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
    """The role that a head takes when it steps down: the first of the succession that it can play and that has room.

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
        n_holders = len(organisation.members(group.name, name))
        has_room = role is not None and (role.maximum is None or n_holders < role.maximum)
        if is_able and role is not None and has_room and not organisation.is_excluded(vehicle, role):
            return RoleAssignment(group.name, name, vehicle)
    return None


def stepping_down(vehicle: str, organisation: Organisation, database: AUVDatabase) -> list[tuple[str, str, str]]:
    """What a vehicle says that leads no longer: where others may succeed it, it takes a role of theirs.

    Args:
        vehicle: its name.
        organisation: as agreed.
        database: static data of all vehicles.
    """
    facts: list[tuple[str, str, str]] = []
    for group in organisation.groups.values():
        role = group.head_role
        if role is None or not group.succession or not organisation.plays(vehicle, group.name, role):
            continue
        left, _ = organisation.leave_role(vehicle, group.name, role)
        then = role_after(database, vehicle, group, left)
        if then is not None:  # said first: only members have a say
            facts.append((vehicle, PLAYS_ROLE, group.path(then.role)))
        facts.append((vehicle, LEFT_ROLE, group.path(role)))
    return facts


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
        for lead in below.roles
        if lead.head and lead.played_by == (group.name, role)
        for name in organisation.members(below.name, lead.name)
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
