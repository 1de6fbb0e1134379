"""What strategies have in common whose vehicles divide jobs at sea: each of their modules holds its decision rule.

Who claims which role, as far as one vehicle knows: a table that heals itself.

Of each vehicle's claim to a role the latest is kept; of the claims to a role the strongest wins, of equals that of
the lower node. Hearing is a join: the order, repetitions and relays of messages make no difference, only what has not
been heard yet does. So vehicles that have heard the same agree, and nobody has to ask whether others did.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import Field

from remoras.authority import Authority
from remoras.database import AUVDatabase
from remoras.organisation import Group, RoleSpecification
from remoras.strategies.factors import AtSea, known_from
from remoras.strategies.founding import common_roles, founded
from remoras.strategy import JOB_DONE, Declaration, Statable, Statement
from remoras.work import Work

S = TypeVar("S")


def frames(what: str, least: int = 1, most: int = 1000) -> Any:
    """A parameter that counts TDMA frames."""
    return Field(ge=least, le=most, description=f"TDMA frames {what}")


def taking(source: str, messages: Mapping[str, str], blocks_per_round: int = 1) -> Declaration:
    """Declaration of a strategy in which each vehicle takes jobs itself."""
    return Declaration(
        source=source,
        messages={**messages, JOB_DONE: "the sender has done a job"},
        blocks_per_round=blocks_per_round,
        authorities=frozenset({Authority.TAKE}),
        private_jobs=True,
    )


def in_blocks(facts: Sequence[Statable], most: int) -> list[Statement]:
    """Facts that share the head of a block, at most so many together."""
    return [Statement(tuple(facts[n : n + most])) for n in range(0, len(facts), most)]


class DividedAtSea:
    """Strategy that before the dive gives out only roles without a job."""

    __slots__ = ()
    form = staticmethod(founded)
    adapt = staticmethod(common_roles)


class KnownFromStart(DividedAtSea):
    """Strategy with the parameter ``common_plan``; ``planned`` is its declaration where missions are known at 0 s."""

    __slots__ = ()
    common_plan: AtSea
    planned: ClassVar[Declaration]

    @property
    def declaration(self) -> Declaration:
        """What it is and what it takes from the vehicles."""
        return known_from(self.common_plan, self.planned)


class Member(Generic[S]):
    """One vehicle's part in dividing the jobs of a group.

    Args:
        me: its name; group: whose jobs are divided; strategy: with the parameters.
    """

    def __init__(self, me: str, group: Group, strategy: S) -> None:
        self._me, self._group, self._with = me, group, strategy

    def _takes(self, role: str) -> Statement:
        return Statement(((self._me, "playsRole", self._group.path(role)),), told=False)

    def _leaves(self, role: str) -> Statement:
        return Statement(((self._me, "leftRole", self._group.path(role)),), told=False)

    def _kept(self, work: Work, places: Mapping[str, str]) -> tuple[RoleSpecification | None, list[RoleSpecification]]:
        """The role that this vehicle stays at, and those that it leaves since lower nodes fill them.

        Args:
            work: as it is known; places: roles by vehicle.
        """
        node, held = work.database[self._me].node, work.held_by(self._me)
        crowded = []
        for role in held:
            before = sum(at == role.name and work.database[v].node < node for v, at in places.items())
            if role.maximum is not None and before >= role.maximum:
                crowded.append(role)
        return next((role for role in held if role not in crowded), None), crowded


@dataclass(frozen=True, slots=True, order=True)
class RoleClaim:
    """How strongly a vehicle claims a role; strength 0 withdraws the claim.

    ``at`` orders the claims of one vehicle to one role, the greater is the newer: the round it was made in, say.
    """

    at: int
    strength: int


class Claims:
    """Latest claims by role and vehicle.

    Args:
        database: static data of all vehicles.
        group: whose roles are claimed.
    """

    def __init__(self, database: AUVDatabase, group: str) -> None:
        self._database = database
        self._group = group
        self._of: dict[str, dict[str, RoleClaim]] = {}
        self._members: Collection[str] = database.names
        self._winners: dict[str, str | None] = {}  # as far as asked for since the last change

    @property
    def members(self) -> Collection[str]:
        """Only their claims count."""
        return self._members

    @members.setter
    def members(self, names: Collection[str]) -> None:
        if names != self._members:
            self._members = names
            self._winners.clear()

    def take(self, role: str, vehicle: str, claim: RoleClaim) -> bool:
        """Note a claim; True if it is news."""
        known = self._of.setdefault(role, {})
        if vehicle in known and known[vehicle] >= claim:
            return False
        known[vehicle] = claim
        self._winners.pop(role, None)
        return True

    def of(self, role: str, vehicle: str) -> RoleClaim | None:
        """The latest claim of a vehicle."""
        return self._of.get(role, {}).get(vehicle)

    def standing(self, role: str) -> dict[str, RoleClaim]:
        """Claims, not withdrawn, of members that are able to play the role."""
        claims = self._of.get(role, {}).items()
        return {
            v: claim
            for v, claim in claims
            if claim.strength > 0 and v in self._members and self._database[v].can_play(self._group, role)
        }

    def has(self, role: str, strength: int) -> bool:
        """True if a claim of that strength stands."""
        return any(claim.strength == strength for claim in self.standing(role).values())

    def made_before(self, at: int, vehicle: str, strength: int) -> set[str]:
        """Roles that a vehicle has claimed with that strength since before ``at``."""
        latest = ((role, claims.get(vehicle)) for role, claims in self._of.items())
        return {role for role, claim in latest if claim is not None and claim.strength == strength and claim.at < at}

    def winner(self, role: str) -> str | None:
        """Who has the strongest claim."""
        if role not in self._winners:
            claims = self.standing(role)
            self._winners[role] = min(claims, key=lambda v: (-claims[v].strength, self._database[v].node), default=None)
        return self._winners[role]

    def beats(self, role: str, vehicle: str, strength: int) -> bool:
        """True if a claim of that strength would win."""
        winner = self.winner(role)
        if winner is None or winner == vehicle:
            return True
        nodes = self._database[vehicle].node, self._database[winner].node
        return (strength, -nodes[0]) > (self.standing(role)[winner].strength, -nodes[1])
