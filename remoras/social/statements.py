"""Statements: what a vehicle says of itself as a member and a head, as facts ready to be recorded."""

from __future__ import annotations

from collections.abc import Iterable, Set

from remoras.beliefs import Beliefs, Fact
from remoras.database import AUVDatabase
from remoras.organisation import Organisation, RoleAssignment
from remoras.social.succession import HEAD_TERM, HEADED_BY, N_TERMS, Claim, Headship, role_after, successor

AVAILABLE = "available"


class Statements:
    """What one vehicle states.

    Args:
        me: own name.
        beliefs: names facts.
        database: static data of all vehicles.
    """

    def __init__(self, me: str, beliefs: Beliefs, database: AUVDatabase) -> None:
        self._me = me
        self._beliefs = beliefs
        self._database = database
        self._plays_role = beliefs.model.tbox.attribute_named("playsRole").uid

    def available(self, takes_jobs: bool) -> Fact:
        """Whether this vehicle takes jobs."""
        return self._beliefs.fact(self._me, AVAILABLE, takes_jobs)

    def leaving(self, roles: Iterable[RoleAssignment]) -> list[Fact]:
        """This vehicle leaves these roles and takes no jobs any more."""
        return [*self.leaving_roles(roles), self.available(False)]

    def leaving_roles(self, roles: Iterable[RoleAssignment]) -> list[Fact]:
        """This vehicle leaves these roles."""
        return [self._beliefs.fact(self._me, "leftRole", f"{role.group}.{role.role}") for role in roles]

    def stepping_down(self, organisation: Organisation) -> list[Fact]:
        """This vehicle leads no longer: where others may succeed it, it takes a role of theirs.

        Args:
            organisation: as agreed.
        """
        facts: list[Fact] = []
        for group in organisation.groups.values():
            role = group.head_role
            if role is None or not group.succession or not organisation.plays(self._me, group.name, role):
                continue
            left, _ = organisation.leave_role(self._me, group.name, role)
            then = role_after(self._database, self._me, group, left)
            if then is not None:  # said first: only members have a say
                facts.append(self._beliefs.fact(self._me, "playsRole", group.path(then.role)))
            facts.append(self._beliefs.fact(self._me, "leftRole", group.path(role)))
        return facts

    def assent(self, group: str, claim: Claim, vehicle: str) -> list[Fact]:
        """That another leads a group by a claim: this vehicle has led it, and does so no longer."""
        facts = (group, HEADED_BY, vehicle), (group, HEAD_TERM, claim.term % N_TERMS)
        return [self._beliefs.fact(*fact) for fact in facts]

    def claims(
        self, present: Organisation, headship: Headship, unavailable: Set[str], headed: Set[str] = frozenset()
    ) -> list[list[Fact]]:
        """Claims to lead groups: without a head, where this vehicle is the first to succeed, or led by it in dispute.

        Args:
            present: the organisation without the absent.
            headship: the claims known.
            unavailable: vehicles that take no jobs.
            headed: groups whose heads are there, though ``present`` lacks them.
        """
        claimed = []
        for group in present.groups.values():
            if not group.succession or not present.is_member(self._me, group.name):
                continue
            heads = [name for name in present.heads(group.name) if self._database[name].social_layer]
            is_own = self._me in heads and headship.is_contested(group.name)
            if (heads and not is_own) or group.name in headed:
                continue
            if is_own or successor(group, present, self._database, unavailable) == self._me:
                facts = (
                    (group.name, HEADED_BY, self._me),
                    (group.name, HEAD_TERM, headship.next_term(group.name)),
                )
                claimed.append([self._beliefs.fact(*fact) for fact in facts])
        return claimed

    def in_place_of(self, absent: Set[str], organisation: Organisation, facts: Iterable[Fact]) -> list[Fact]:
        """The same facts, and before each that gives away a role held by the absent, that these leave it.

        Args:
            absent: vehicles that make room for others.
            organisation: as agreed.
            facts: to be stated together.
        """
        stated: list[Fact] = []
        for fact in facts:
            if fact[1] == self._plays_role:
                path = self._beliefs.name(fact[2])
                group, role = path.split(".")
                holders = organisation.members(group, role)
                specification = organisation.groups[group].role(role)
                if specification is not None and specification.maximum == len(holders) and absent >= set(holders):
                    stated += [self._beliefs.fact(name, "leftRole", path) for name in holders]
            stated.append(fact)
        return stated
