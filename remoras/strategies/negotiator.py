"""Common parts of strategies that divide jobs at run time, with a convergent claim table.

The table keeps each vehicle's latest claim to each role; the strongest claim wins, ties go to the lower node. Merging
is a join, so vehicles with the same claims agree, whatever order, repetition and relaying of messages.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import Field

from remoras.authority import Authority
from remoras.database import VehicleData
from remoras.organisation import Group, RoleAssignment, RoleSpecification
from remoras.strategies.allocation import Engagement, Expectations
from remoras.strategies.factors import NO_JOIN_S, SETTINGS, AtSea, Factors, Help, helped_by, joins, known_from
from remoras.strategies.help_auction import HelpAuction
from remoras.strategies.initial_roles import common_roles, founded
from remoras.strategy import JOB_DONE, Declaration, Negotiator, Situation, Statable, Statement
from remoras.work import Work

S = TypeVar("S")

QUEUE = Field(ge=1, le=64, description="maximum jobs per vehicle, including the current one")
MARGIN = Field(ge=0.0, le=1.0, description="minimum gain, as a share of the remaining time, for moving jobs")
JOIN = Field(ge=0.0, le=1e6, description="minimum time that an idle vehicle saves by joining another's job (s)")


def frames(what: str, least: int = 1, most: int = 1000) -> Any:
    """Return the field of a parameter in TDMA frames."""
    return Field(ge=least, le=most, description=f"TDMA frames {what}")


SHOWN = {
    "playsRole": "the sender holds a job for which its role may call others",
    "leftRole": "the sender has left such a job",
}


def taking(source: str, messages: Mapping[str, str], blocks_per_round: int = 1) -> Declaration:
    """Return the declaration of a strategy in which each vehicle takes jobs on its own."""
    return Declaration(
        source=source,
        messages={**messages, **SHOWN, JOB_DONE: "the sender has done a job"},
        blocks_per_round=blocks_per_round,
        authorities=frozenset({Authority.TAKE}),
        private_jobs=True,
    )


def in_blocks(facts: Sequence[Statable], most: int) -> list[Statement]:
    """Group facts with a common block header into blocks of at most ``most``."""
    return [Statement(tuple(facts[n : n + most])) for n in range(0, len(facts), most)]


class DividedAtSea:
    """Strategy that assigns only roles without a job before the dive; ``member`` does the rest."""

    __slots__ = ()
    member: ClassVar[type[Member[Any]]]
    form = staticmethod(founded)

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Return the common roles."""
        return common_roles(work)

    def negotiator(self, me: str, group: Group) -> Negotiator:
        """Return the part of one member: any may succeed a leader."""
        return self.member(me, group, self)


@dataclass(frozen=True, slots=True)
class Helped(DividedAtSea):
    """Strategy with the factor ``help``; ``planned`` is its declaration without."""

    help: Help = "none"

    planned: ClassVar[Declaration]

    @property
    def declaration(self) -> Declaration:
        """Declaration for the current ``help``."""
        return helped_by(self.help, self.planned)

    def negotiator(self, me: str, group: Group) -> Negotiator:
        """Return the part of one member, with that in auctions of help if these are chosen."""
        part = self.member(me, group, self)
        return HelpAuction(me, group, part) if self.help == "auction" else part


class Placed(Helped):
    """Strategy with a level of every factor: parameters, or constants of its class."""

    __slots__ = ()
    common_plan: str
    decides: ClassVar[str] = "each"
    announces: str
    repairs: str = "changes"

    @property
    def declaration(self) -> Declaration:
        """Declaration for the current ``help`` and ``common_plan``."""
        return known_from(self.common_plan, helped_by(self.help, self.planned))

    @property
    def factors(self) -> Factors:
        """Factor levels of this strategy."""
        plan = "all" if all(getattr(self, switch, True) for switch in SETTINGS["plan"]) else "own"
        join = joins(getattr(self, "join_s", NO_JOIN_S))
        return Factors(self.common_plan, self.decides, plan, self.announces, join, self.repairs, self.help)


@dataclass(frozen=True, slots=True)
class KnownFromStart(Placed):
    """Strategy with ``common_plan``; ``planned`` is its declaration with missions known at 0 s."""

    common_plan: AtSea = "missions"


class Member(Negotiator, Generic[S]):
    """One vehicle's part in dividing the jobs of a group."""

    def __init__(self, me: str, group: Group, strategy: S) -> None:
        self._me, self._group, self._with = me, group, strategy
        self._expectations = Expectations()
        # Others help only a known holder.
        self._shown = {role.name for role in group.roles if role.job and role.influences}

    def _given(self, vehicle: str, role: str) -> Statable:
        return vehicle, "playsRole", self._group.path(role)

    def _left(self, vehicle: str, role: str) -> Statable:
        return vehicle, "leftRole", self._group.path(role)

    def _takes(self, role: str) -> Statement:
        return Statement((self._given(self._me, role),), told=role in self._shown)

    def _leaves(self, role: str) -> Statement:
        return Statement((self._left(self._me, role),), told=role in self._shown)

    def _engagement(
        self, vehicle: str, held: Sequence[RoleSpecification], situation: Situation, unheard: Collection[str] = ()
    ) -> Engagement:
        work, now_s = situation.work, situation.now_s
        seen_s = now_s if vehicle == self._me else situation.heard_s.get(vehicle, 0.0)
        return self._expectations.of(work.database[vehicle], held, work, now_s, seen_s, unheard)

    def _kept(self, work: Work, places: Mapping[str, str]) -> tuple[RoleSpecification | None, list[RoleSpecification]]:
        # Lower nodes stay: all at a crowded job decide alike without a message.
        node, held = work.database[self._me].node, work.held_by(self._me)
        crowded = []
        for role in held:
            before = sum(place == role.name and work.database[v].node < node for v, place in places.items())
            if role.maximum is not None and before >= role.maximum:
                crowded.append(role)
        return next((role for role in held if role not in crowded), None), crowded


@dataclass(frozen=True, slots=True, order=True)
class RoleClaim:
    """Claim of a vehicle to a role; the greater ``at`` is the newer, strength 0 withdraws it."""

    at: int
    strength: int


class Claims:
    """Latest claims by role and vehicle, of one group."""

    def __init__(self, group: str) -> None:
        self._group = group
        self._of: dict[str, dict[str, RoleClaim]] = {}
        self.members: Mapping[str, VehicleData] = {}
        """Vehicles with valid claims."""
        self._winners: dict[str, str | None] = {}  # as far as asked for since the last change

    def meet(self, names: Iterable[str], database: Mapping[str, VehicleData]) -> None:
        """Set the vehicles with valid claims."""
        members = {name: database[name] for name in names}
        if members.keys() != self.members.keys():
            self._winners.clear()
        self.members = members

    def take(self, role: str, vehicle: str, claim: RoleClaim) -> bool:
        """Merge a claim; True if it is newer than the stored one."""
        known = self._of.setdefault(role, {})
        if vehicle in known and known[vehicle] >= claim:
            return False
        known[vehicle] = claim
        self._winners.pop(role, None)
        return True

    def of(self, role: str, vehicle: str) -> RoleClaim | None:
        """Return the latest claim of a vehicle to a role, or None."""
        return self._of.get(role, {}).get(vehicle)

    def standing(self, role: str) -> dict[str, RoleClaim]:
        """Return the valid claims to a role: not withdrawn, by members able to play it."""
        return {v: claim for v, claim in self._of.get(role, {}).items() if self.stands(role, v)}

    def stands(self, role: str, vehicle: str) -> bool:
        """Return whether a vehicle has a valid claim to a role."""
        claim, data = self.of(role, vehicle), self.members.get(vehicle)
        return claim is not None and claim.strength > 0 and data is not None and data.can_play(self._group, role)

    def has(self, role: str, strength: int) -> bool:
        """True if a valid claim has that strength."""
        return any(claim.strength == strength for claim in self.standing(role).values())

    def made_before(self, at: int, vehicle: str, strength: int) -> set[str]:
        """Return the roles with a claim of that strength by a vehicle, made before ``at``."""
        latest = ((role, claims.get(vehicle)) for role, claims in self._of.items())
        return {role for role, claim in latest if claim is not None and claim.strength == strength and claim.at < at}

    def winner(self, role: str) -> str | None:
        """Return the vehicle with the strongest valid claim, or None."""
        if role not in self._winners:
            claims = self.standing(role)
            self._winners[role] = min(claims, key=lambda v: (-claims[v].strength, self.members[v].node), default=None)
        return self._winners[role]

    def beats(self, role: str, vehicle: str, strength: int) -> bool:
        """True if a claim of that strength would win, or the vehicle already does."""
        winner = self.winner(role)
        if winner is None or winner == vehicle:
            return True
        nodes = self.members[vehicle].node, self.members[winner].node
        return (strength, -nodes[0]) > (self.standing(role)[winner].strength, -nodes[1])
