"""Leadership: claims, terms, succession.

If a group has no leader, the first in the succession claims it under the greatest known term plus one. Vehicles may see
different peers, so several may claim. Of the valid claims the greatest wins, by term, then by lower node, in any order
of reception. The previous leader then steps down and acknowledges the new one. An order is valid if its issuer led
then.

A present leader blocks claims. A claim is valid only if all leaders of that time that still lead are presumed absent:
the receiver of the claim has not received them for a lease since. Of two claims for one vacancy, the one that did not
know of the other is blocked by none. A leader decides itself whether its silence was an absence: it claims again, which
voids claims made meanwhile and orders based on them, or it acknowledges, which ends its term.

(Compare the pre-vote in section 9.6 of D. Ongaro, Consensus: Bridging Theory and Practice, Stanford 2014, which keeps
an isolated server from disturbing others. Here each receiver has that vote for itself.)
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
"""Modulus of encoded terms, decoded as the nearest to the greatest known (as in RFC 1982)."""
FURTHEST = 64
"""Limit of a claim's term above the greatest known: vehicles without claims decode it alike."""


class Claim(NamedTuple):
    """Leadership claim, the greater wins: number of leader changes so far, then negative node."""

    term: int
    rank: int


def read_claim(claim: Claim, greatest: Claim | None) -> Claim | None:
    """Return a claim with its decoded term; None if it leaps ahead or precedes the first term.

    >>> [read_claim(Claim(term, 0), None) for term in (64, 65, 255)]
    [Claim(term=64, rank=0), None, None]
    >>> next_term(Claim(255, 0)), read_claim(Claim(0, 0), Claim(255, 0)), read_claim(Claim(254, 0), Claim(255, 0))
    (0, Claim(term=256, rank=0), Claim(term=254, rank=0))
    """
    known = 0 if greatest is None else greatest.term
    ahead = (claim.term - known + N_TERMS // 2) % N_TERMS - N_TERMS // 2
    return claim._replace(term=known + ahead) if 0 < known + ahead <= known + FURTHEST else None


def next_term(greatest: Claim | None) -> int:
    """Return the encoded term of a new claim, one above all known; the first is 1."""
    return 1 if greatest is None else (greatest.term + 1) % N_TERMS


def successor(
    group: Group, organisation: Organisation, database: AUVDatabase, unavailable: Collection[str] = ()
) -> str | None:
    """Return the vehicle that should lead a group without a leader; None if no member can.

    Candidates hold a role of the succession, can lead, and hold no incompatible role elsewhere. They are ordered by
    that role, the number of job roles they can hold (0 if ``unavailable``), energy and name.
    """
    jobs = [role.name for role in group.roles if role.job is not None]

    def order(name: str) -> tuple[int, int, float, str]:
        data = database[name]
        first = next(n for n, role in enumerate(group.succession) if organisation.plays(name, group.name, role))
        n_able = 0 if name in unavailable else sum(data.can_play(group.name, role) for role in jobs)
        return first, -n_able, -data.energy_j, name

    head = group.role(group.head_role or "")
    excluded = [] if head is None else [(g, role) for g, role in head.incompatible if g != group.name]
    holders = {name for role in group.succession for name in organisation.members(group.name, role)}
    able = [
        name
        for name in holders
        if is_able_to_lead(database, name, group) and not any(organisation.plays(name, *other) for other in excluded)
    ]
    return min(able, key=order, default=None)


def is_able_to_lead(database: AUVDatabase, vehicle: str, group: Group) -> bool:
    """Return whether the vehicle has the social layer and can hold the leader's role."""
    data = database[vehicle]
    return data.social_layer and group.head_role is not None and data.can_play(group.name, group.head_role)


def role_after(database: AUVDatabase, vehicle: str, group: Group, organisation: Organisation) -> RoleAssignment | None:
    """Return the role of the succession for a leader that steps down; None without a vacant one."""
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
    """Return facts that hand over all groups of the vehicle that have a succession."""
    facts: list[tuple[str, str, str]] = []
    for group in organisation.groups.values():
        role = group.head_role
        if role is None or not group.succession or not organisation.plays(vehicle, group.name, role):
            continue
        left, _ = organisation.leave_role(vehicle, group.name, role)
        next_role = role_after(database, vehicle, group, left)
        if next_role is not None:  # first, since only members may make requests
            facts.append((vehicle, PLAYS_ROLE, group.path(next_role.role)))
        facts.append((vehicle, LEFT_ROLE, group.path(role)))
    return facts


def yielding_above(group: Group, role: str, heads: Collection[str], organisation: Organisation) -> tuple[str, ...]:
    """Return holders of ``role`` that yield to the new leader of the group below."""
    demands = group.role(role)
    is_sole = demands is not None and demands.maximum == 1
    leads = {
        name
        for below in organisation.groups.values()
        for lead in below.roles
        if lead.head and lead.played_by == (group.name, role)
        for name in organisation.members(below.name, lead.name)
    }
    # A former leader leaves the role, unless it leads another group by it; a sole holder leaves it in any case.
    gone = set(heads) - leads
    return tuple(name for name in organisation.members(group.name, role) if is_sole or name in gone)


def excluded_by_leading(group: Group, vehicle: str, organisation: Organisation) -> tuple[RoleAssignment, ...]:
    """Return the vehicle's roles in a group that are incompatible with leading it."""
    head = group.role(group.head_role or "")
    if head is None or not head.incompatible:
        return ()
    held = organisation.roles_of(vehicle, group.name)
    return tuple(assignment for assignment in held if (assignment.group, assignment.role) in head.incompatible)


def playing(organisation: Organisation, vehicle: str, group: str, roles: Iterable[str]) -> Organisation:
    """Return the organisation as of a claim: the claimant holds roles that it has left since."""
    # Otherwise a claim would be valid only for vehicles that receive it before the claimant is replaced.
    for role in roles:
        for other in organisation.members(group, role):
            organisation, _ = organisation.leave_role(other, group, role)
        organisation, _ = organisation.assign(vehicle, group, role)
    return organisation


Age = tuple[float, int, int, int, int]
"""Place in the world model's order of facts: time, origin, epoch, order of block; position."""
AGREED_BEFORE: Age = (-math.inf, 0, 0, 0, 0)
_NOW: Age = (math.inf, 0, 0, 0, 0)


class Claimed(NamedTuple):
    """A leadership claim, its place in the order of facts, and the claimant."""

    claim: Claim
    since: Age
    vehicle: str


@dataclass(frozen=True, slots=True)
class Lead:
    """Knowledge about the leadership of one group.

    ``claims`` come with the leaders presumed absent, which do not block them; ``by_leading`` with a group, for
    claimants that are members only through leading it. ``began``: vehicles that were given the leader's role, and when;
    ``ended``: vehicles that left it, with the claimant if they left by acknowledging a claim, else None.
    """

    claims: Mapping[Claimed, frozenset[str]] = field(default_factory=dict)
    by_leading: Mapping[Claimed, str] = field(default_factory=dict)
    began: frozenset[tuple[str, Age]] = frozenset()
    ended: Mapping[tuple[str, Age], str | None] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Leadership:
    """Terms of all leaders, by group; immutable. Updates return a new value, or self if known."""

    groups: Mapping[str, Lead]
    # Derived from a value that never changes; without them a fleet that hears nearly nothing takes a fifth longer.
    _counting: dict[str, list[Claimed]] = field(default_factory=dict, init=False, repr=False, compare=False)
    _reigning: dict[str, list[Claimed]] = field(default_factory=dict, init=False, repr=False, compare=False)
    _ended: dict[tuple[str, str], list[Age]] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def founded(cls, organisation: Organisation, at_sea: Iterable[str] = ()) -> Leadership:
        """Create from the organisation before the mission; groups formed at run time have no leader."""
        heads = {group: organisation.heads(group) for group in organisation.groups} | dict.fromkeys(at_sea, ())
        return cls(
            {group: Lead(began=frozenset((name, AGREED_BEFORE) for name in names)) for group, names in heads.items()}
        )

    # Updates -------------------------------------------------------------------------------------

    def claim(
        self, group: str, claimed: Claimed, excused: Collection[str] = NOBODY, by_leading: str | None = None
    ) -> Leadership:
        """Add a claim that ``excused`` vehicles do not block; valid only if it led ``by_leading``."""
        lead = self.groups[group]
        before = lead.claims.get(claimed)
        if before is not None and before.issuperset(excused):
            return self
        claims = {**lead.claims, claimed: (before or NOBODY).union(excused)}
        by = lead.by_leading if by_leading is None else {**lead.by_leading, claimed: by_leading}
        # Groups keep the order of their first claims, in which leaders are installed and acknowledged.
        others = {name: known for name, known in self.groups.items() if name != group or lead.claims}
        return Leadership({**others, group: replace(lead, claims=claims, by_leading=by)})

    def miss(self, absent: Collection[str]) -> Leadership:
        """Presume these vehicles absent for all claims that are not yet valid."""
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
        """Record that a vehicle got the leader's role, left it, or acknowledges the claim of ``to``."""
        lead, event = self.groups[group], (vehicle, age)
        if event in (lead.began if leads else lead.ended):
            return self
        if leads:
            return self._with(group, replace(lead, began=lead.began | {event}))
        return self._with(group, replace(lead, ended={**lead.ended, event: to}))

    def begin(self, group: str, vehicle: str | None, age: Age) -> Leadership:
        """Restart a group under ``vehicle`` since ``age``; None dissolves it."""
        groups = {
            name: replace(lead, by_leading={claimed: by for claimed, by in lead.by_leading.items() if by != group})
            for name, lead in self.groups.items()
        }
        began = frozenset() if vehicle is None else frozenset({(vehicle, age)})
        return Leadership({**groups, group: Lead(began=began)})

    def _with(self, group: str, lead: Lead) -> Leadership:
        return Leadership({**self.groups, group: lead})

    # Valid claims --------------------------------------------------------------------------------

    def counting(self, group: str) -> list[Claimed]:
        """Return the valid claims of members to lead a group, in ascending order.

        A valid claimant led already, or each leader by a lesser claim is presumed absent, acknowledges it or has left.
        """
        if group in self._counting:
            return self._counting[group]
        counting: list[Claimed] = []
        self._counting[group] = counting  # a vehicle that blocks a claim leads by a lesser one
        for claimed, excused in sorted(self.groups[group].claims.items()):
            if not self.is_member(group, claimed):
                continue
            began = self._has_led_since(group, claimed)
            if began is not None:
                # Its silence was no absence: claims made meanwhile by others rest on an error.
                void = [other for other in counting if began <= other.since < claimed.since]
                counting[:] = [other for other in counting if other.vehicle == claimed.vehicle or other not in void]
            elif not self._heads_against(group, claimed) <= excused:
                continue
            counting.append(claimed)
        self._reigning[group] = self._reigns(group)
        return counting

    def counts(self, group: str, claimed: Claimed) -> bool:
        """Return whether a claim is valid; see ``counting``."""
        return claimed in self.counting(group)

    def is_member(self, group: str, claimed: Claimed) -> bool:
        """Return False if membership required leading another group, which the claimant did not."""
        other_group = self.groups[group].by_leading.get(claimed)
        return other_group is None or self.led(claimed.vehicle, other_group, claimed.since)

    def _has_led_since(self, group: str, claimed: Claimed) -> Age | None:
        left = [age for age in self._ends(group, claimed.vehicle) if age <= claimed.since]
        began = (age for age in self._begins(group, claimed.vehicle) if age < claimed.since)
        return min((age for age in began if not any(age < end for end in left)), default=None)

    def _heads_against(self, group: str, claimed: Claimed) -> set[str]:
        names = {name for name, _ in self.groups[group].began} | {other.vehicle for other in self.counting(group)}
        return {
            name
            for name in names - {claimed.vehicle}
            if self.led(name, group, claimed.since) and self.led(name, group, _NOW)
        }

    def _reigns(self, group: str) -> list[Claimed]:
        valid = self.counting(group)
        if group in self._reigning:
            return self._reigning[group]
        reigns: list[Claimed] = []
        for claimed in sorted(valid, key=lambda claimed: claimed.since):
            # A lesser claim leads only once its predecessor has left.
            if not reigns or claimed.claim > reigns[-1].claim or self._has_left(group, reigns[-1], claimed.since):
                reigns.append(claimed)
        return reigns

    def _begins(self, group: str, vehicle: str) -> list[Age]:
        began = [age for name, age in self.groups[group].began if name == vehicle]
        return began + [claimed.since for claimed in self.counting(group) if claimed.vehicle == vehicle]

    def _ends(self, group: str, vehicle: str) -> list[Age]:
        if (ends := self._ended.get((group, vehicle))) is None:
            ended = self.groups[group].ended.items()
            ends = [age for (name, age), to in ended if name == vehicle and not self._is_void(group, name, age, to)]
            self._ended[group, vehicle] = ends
        return ends

    def _is_void(self, group: str, vehicle: str, age: Age, to: str | None) -> bool:
        if to is None:
            return False
        # A vehicle that has lost its memory may acknowledge a claim although, since then, it has claimed itself or the
        # claimant has acknowledged it: this has no effect.
        lead = self.groups[group]
        claims = [claimed for claimed in lead.claims if claimed.since < age]
        since = max([claimed.since for claimed in claims if claimed.vehicle == to], default=AGREED_BEFORE)
        ends = [end for (name, end), other in lead.ended.items() if (name, other) == (to, vehicle)]
        answers = [claimed.since for claimed in claims if claimed.vehicle == vehicle]
        return any(since < event < age for event in (*ends, *answers))

    def _has_left(self, group: str, reign: Claimed, by: Age) -> bool:
        return any(reign.since < age <= by for age in self._ends(group, reign.vehicle))

    # Terms ---------------------------------------------------------------------------------------

    @property
    def claimed(self) -> list[str]:
        """Groups with at least one claim."""
        return [group for group, lead in self.groups.items() if lead.claims]

    @property
    def leading(self) -> dict[str, Claimed]:
        """Claim in force of each group led by a claim."""
        reigns = {group: self._reigns(group)[-1:] for group in self.claimed}
        return {group: last[0] for group, last in reigns.items() if last and not self._has_left(group, last[0], _NOW)}

    def without_claims(self, group: str) -> tuple[str, Age] | None:
        """Return the leader of a group without a claim and the start of its term; None if none."""
        names = [name for _, name in sorted((age, name) for name, age in self.groups[group].began)]
        since = {name: self.since(name, group, _NOW) for name in names}
        return next(((name, age) for name, age in since.items() if age is not None), None)

    def is_claim(self, age: Age) -> bool:
        """Return whether the fact at ``age`` is a leadership claim."""
        return any(age == claimed.since for lead in self.groups.values() for claimed in lead.claims)

    def has_claimed(self, vehicle: str, group: str) -> bool:
        """Return whether the vehicle was given the leader's role, or has claimed it."""
        lead = self.groups[group]
        return any(name == vehicle for name, _ in lead.began) or any(
            claimed.vehicle == vehicle for claimed in lead.claims
        )

    def has_led(self, vehicle: str, group: str, at: Age) -> bool:
        """Return whether the vehicle has led the group at any time before ``at``."""
        return any(age < at for age in self._begins(group, vehicle))

    def led(self, vehicle: str, group: str, at: Age) -> bool:
        """Return whether the vehicle led the group at ``at``."""
        return self.since(vehicle, group, at) is not None

    def since(self, vehicle: str, group: str, at: Age) -> Age | None:
        """Return the start of the vehicle's term at ``at``; None if it did not lead."""
        if group not in self.groups:
            return None
        began = [age for name, age in self.groups[group].began if name == vehicle]
        ended = [*self._ends(group, vehicle)]
        for reign in self._reigns(group):
            (began if reign.vehicle == vehicle else ended).append(reign.since)
        latest = max((age for age in began if age <= at), default=None)
        return None if latest is None or any(latest < age <= at for age in ended) else latest
