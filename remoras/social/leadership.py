"""Leadership: claims, terms, succession.

The first in that order claims the group under the greatest term known and one more. Vehicles may see different peers,
so several may claim. Which claims count, ``remoras.social.leadership`` says; of these the greatest wins, by term and
then by lower node, in whatever order they are heard. Whoever led before and lets it count steps down and assents.

A claim may count for some and for others not: who was out of reach may claim by a role that others have given away
meanwhile, or take a head for absent that they hear. Then the head that they have claims again, under a greater term.

An order counts by who led when it was given, whatever is heard first: the order, or that its issuer leads. So this is a
function of what was heard, and of whom this vehicle has missed, and of no order. Before all claims lead those that
founded the group. Of the claims that count, and were made by a time, the greatest leads. A head that has left its role
leads no longer.

Nobody takes the lead from a head that is there. So a claim counts only against heads that are excused: the hearer has
not heard them for a lease since it heard the claim. Who led when the claim was made, and leads still, is asked; of two
who claim in one vacancy the one that did not know of the other is refused by nobody. A head that has never left may
claim again, and what others have claimed meanwhile is void, with all that they have ordered: those who went over to
another come back. So the head itself decides whether its silence was an absence, and all follow it: it claims again, or
it assents, which ends its lead for all who have heard it all the while. Who has lost its memory may assent to a claim
whose vehicle has assented to it, or after which it has claimed again: such an assent says nothing. A claim by who is a
member of the group only since it leads another counts as long as that lead does. (The vote before the claim in section
9.6 of D. Ongaro, Consensus: Bridging Theory and Practice, Stanford 2014, keeps a server that is cut off from disturbing
the others; here each hearer has that vote for itself.)
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from remoras.authority import NOBODY
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


Age = tuple[float, int, int, int, int]
"""Place in the world model's order of facts: time, origin, epoch and order of the block, then position in it."""
AGREED_BEFORE: Age = (-math.inf, 0, 0, 0, 0)
_NOW: Age = (math.inf, 0, 0, 0, 0)


class Claimed(NamedTuple):
    """A claim to lead a group, since when it was made, and the vehicle that made it."""

    claim: Claim
    since: Age
    vehicle: str


@dataclass(frozen=True, slots=True)
class Lead:
    """What is known of the lead of one group.

    Attributes:
        claims: to lead it, each with the heads that do not stand against it.
        by_leading: of claims by who is a member by the lead of another group alone: that group.
        began: vehicles that were given the role of the head, and when.
        ended: vehicles that left it, and when; with the vehicle to whose claim they assented, if it was by that.
    """

    claims: Mapping[Claimed, frozenset[str]] = field(default_factory=dict)
    by_leading: Mapping[Claimed, str] = field(default_factory=dict)
    began: frozenset[tuple[str, Age]] = frozenset()
    ended: Mapping[tuple[str, Age], str | None] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Leadership:
    """When which vehicles led. What becomes known gives another value; the same one where it was known.

    Attributes:
        groups: the lead of each, by name.
    """

    groups: Mapping[str, Lead]
    _counting: dict[str, list[Claimed]] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def founded(cls, organisation: Organisation, at_sea: Iterable[str] = ()) -> Leadership:
        """By what was agreed before the mission; nobody leads yet what is formed at sea."""
        heads = {group: organisation.heads(group) for group in organisation.groups} | dict.fromkeys(at_sea, ())
        return cls({group: Lead(began=frozenset((name, AGREED_BEFORE) for name in of)) for group, of in heads.items()})

    # What becomes known --------------------------------------------------------------------------

    def claim(
        self, group: str, claimed: Claimed, excused: Collection[str] = NOBODY, by_leading: str | None = None
    ) -> Leadership:
        """A vehicle has claimed to lead a group.

        Args:
            group: its name; claimed: the claim.
            excused: vehicles that do not stand against it, as far as is known here; what was excused once stays so.
            by_leading: a group by whose lead alone the vehicle is a member: the claim counts if it led that by then.
        """
        lead = self.groups[group]
        before = lead.claims.get(claimed)
        if before is not None and before.issuperset(excused):
            return self
        claims = {**lead.claims, claimed: (before or NOBODY).union(excused)}
        by = lead.by_leading if by_leading is None else {**lead.by_leading, claimed: by_leading}
        # Groups stand in the order in which they were claimed first: so they are crowned, and assented to.
        others = {name: of for name, of in self.groups.items() if name != group or lead.claims}
        return Leadership({**others, group: replace(lead, claims=claims, by_leading=by)})

    def miss(self, absent: Collection[str]) -> Leadership:
        """These do not stand any more against claims that do not count yet."""
        after = self
        for group, lead in self.groups.items():
            excused = {
                claimed: heads.union(absent)
                for claimed, heads in lead.claims.items()
                if not heads.issuperset(absent) and not after.counts(group, claimed)
            }
            if excused:
                after = after._with(group, replace(lead, claims={**lead.claims, **excused}))
        return after

    def change(self, group: str, vehicle: str, leads: bool, age: Age, to: str | None = None) -> Leadership:
        """A vehicle was given the role of the head at ``age``, or has left it, or assents ``to`` another's claim."""
        lead, at = self.groups[group], (vehicle, age)
        if at in (lead.began if leads else lead.ended):
            return self
        if leads:
            return self._with(group, replace(lead, began=lead.began | {at}))
        return self._with(group, replace(lead, ended={**lead.ended, at: to}))

    def begin(self, group: str, vehicle: str | None, age: Age) -> Leadership:
        """A group is formed anew, led by ``vehicle`` since ``age``; it is dissolved if None."""
        groups = {
            name: replace(lead, by_leading={claimed: by for claimed, by in lead.by_leading.items() if by != group})
            for name, lead in self.groups.items()
        }
        began = frozenset() if vehicle is None else frozenset({(vehicle, age)})
        return Leadership({**groups, group: Lead(began=began)})

    def _with(self, group: str, lead: Lead) -> Leadership:
        return Leadership({**self.groups, group: lead})

    # Which claims count --------------------------------------------------------------------------

    def counting(self, group: str) -> list[Claimed]:
        """The claims to lead a group that count, the lesser ones first."""
        if group in self._counting:
            return self._counting[group]
        counting: list[Claimed] = []
        self._counting[group] = counting  # whoever stands against a claim leads by the lesser ones
        for claimed, excused in sorted(self.groups[group].claims.items()):
            if not self.is_member(group, claimed):
                continue
            began = self._has_led_since(group, claimed)
            if began is not None:
                void = [other for other in counting if began <= other.since < claimed.since]
                counting[:] = [other for other in counting if other.vehicle == claimed.vehicle or other not in void]
            elif not self._heads_against(group, claimed) <= excused:
                continue
            counting.append(claimed)
        return counting

    def counts(self, group: str, claimed: Claimed) -> bool:
        """True if a claim to lead a group counts."""
        return claimed in self.counting(group)

    def is_member(self, group: str, claimed: Claimed) -> bool:
        """False if who claimed a group was a member of it by the lead of another alone, which it had not."""
        of = self.groups[group].by_leading.get(claimed)
        return of is None or self.led(claimed.vehicle, of, claimed.since)

    def _has_led_since(self, group: str, claimed: Claimed) -> Age | None:
        """Since when who claims has led and has not left itself, whoever has claimed meanwhile; None if it has not."""
        left = [age for age in self._ends(group, claimed.vehicle) if age <= claimed.since]
        began = (age for age in self._begins(group, claimed.vehicle) if age < claimed.since)
        return min((age for age in began if not any(age < end for end in left)), default=None)

    def _heads_against(self, group: str, claimed: Claimed) -> set[str]:
        """Others that led a group when it was claimed, and lead it still, by the lesser claims."""
        names = {name for name, _ in self.groups[group].began} | {other.vehicle for other in self.counting(group)}
        return {
            name
            for name in names - {claimed.vehicle}
            if self.led(name, group, claimed.since) and self.led(name, group, _NOW)
        }

    def _reigns(self, group: str) -> list[Claimed]:
        """The claims by which a group was led one after another: each is greater, or the head before had left."""
        reigns: list[Claimed] = []
        for claimed in sorted(self.counting(group), key=lambda claimed: claimed.since):
            if not reigns or claimed.claim > reigns[-1].claim or self._has_left(group, reigns[-1], claimed.since):
                reigns.append(claimed)
        return reigns

    def _begins(self, group: str, vehicle: str) -> list[Age]:
        """When a vehicle came to lead a group, whoever led it besides."""
        began = [age for name, age in self.groups[group].began if name == vehicle]
        return began + [claimed.since for claimed in self.counting(group) if claimed.vehicle == vehicle]

    def _ends(self, group: str, vehicle: str) -> list[Age]:
        """When a vehicle left the lead of a group, or assented to a claim that it had not answered, nor its author."""
        ended = self.groups[group].ended
        return [age for (name, age), to in ended.items() if name == vehicle and not self._is_void(group, name, age, to)]

    def _is_void(self, group: str, vehicle: str, age: Age, to: str | None) -> bool:
        """True of an assent ``to`` whom assented to the vehicle since it claimed, or to whom this has claimed again."""
        if to is None:
            return False
        lead = self.groups[group]
        claims = [claimed for claimed in lead.claims if claimed.since < age]
        since = max([claimed.since for claimed in claims if claimed.vehicle == to], default=AGREED_BEFORE)
        ends = [end for (name, end), other in lead.ended.items() if (name, other) == (to, vehicle)]
        answers = [claimed.since for claimed in claims if claimed.vehicle == vehicle]
        return any(since < at < age for at in (*ends, *answers))

    def _has_left(self, group: str, reign: Claimed, by: Age) -> bool:
        """True if who leads a group by a claim had left by then."""
        return any(reign.since < age <= by for age in self._ends(group, reign.vehicle))

    # Who led when --------------------------------------------------------------------------------

    @property
    def claimed(self) -> list[str]:
        """Groups that somebody has claimed to lead."""
        return [group for group, lead in self.groups.items() if lead.claims]

    @property
    def leading(self) -> dict[str, Claimed]:
        """The claim by which each group is led that is led by one."""
        reigns = {group: self._reigns(group)[-1:] for group in self.claimed}
        return {group: last[0] for group, last in reigns.items() if last and not self._has_left(group, last[0], _NOW)}

    def without_claims(self, group: str) -> tuple[str, Age] | None:
        """Who leads a group without a claim, and since when; None if nobody does."""
        names = [name for _, name in sorted((age, name) for name, age in self.groups[group].began)]
        since = {name: self.since(name, group, _NOW) for name in names}
        return next(((name, age) for name, age in since.items() if age is not None), None)

    def is_claim(self, age: Age) -> bool:
        """True if what was said at ``age`` is a claim to lead a group."""
        return any(age == claimed.since for lead in self.groups.values() for claimed in lead.claims)

    def has_claimed(self, vehicle: str, group: str) -> bool:
        """True if the vehicle has led the group, or has claimed to."""
        lead = self.groups[group]
        return any(name == vehicle for name, _ in lead.began) or any(
            claimed.vehicle == vehicle for claimed in lead.claims
        )

    def has_led(self, vehicle: str, group: str, at: Age) -> bool:
        """True if the vehicle has led the group at any time before ``at``."""
        return any(age < at for age in self._begins(group, vehicle))

    def led(self, vehicle: str, group: str, at: Age) -> bool:
        """True if the vehicle led the group at ``at``."""
        return self.since(vehicle, group, at) is not None

    def since(self, vehicle: str, group: str, at: Age) -> Age | None:
        """Since when the vehicle led the group at ``at``; None if it did not."""
        if group not in self.groups:
            return None
        began = [age for name, age in self.groups[group].began if name == vehicle]
        ended = self._ends(group, vehicle)
        for reign in self._reigns(group):
            (began if reign.vehicle == vehicle else ended).append(reign.since)
        latest = max((age for age in began if age <= at), default=None)
        return None if latest is None or any(latest < age <= at for age in ended) else latest
