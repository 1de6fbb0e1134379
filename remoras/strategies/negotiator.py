"""What strategies have in common whose vehicles divide jobs at sea: each of their modules holds its decision rule."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import Field

from remoras.authority import Authority
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
