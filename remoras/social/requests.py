"""Requests: what the organisational facts of a world model ask for, in the words of ``remoras.authority``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from remoras.authority import Act, Request
from remoras.beliefs import Beliefs
from remoras.organisation import Group
from remoras.social.leadership import HEAD_TERM, HEADED_BY, PLAYS_ROLE, ROLE_ATTRIBUTES, Age
from worldmodel import Block, PropertyValue

OBJECTIVE_PREFIX = "objective"
"""Attributes whose name begins so give a role an objective."""
HAS_MISSION = "hasMission"
FORMED_UNDER, FORMATION, DISSOLVED = FORMATION_ATTRIBUTES = ("formedUnder", "formation", "dissolved")


class DatedRequest(NamedTuple):
    """What the issuer of a fact asks for.

    Attributes:
        age: when it was stated.
        asked: the request.
        fact: that it is.
        number: of a formation, or the term of a claim as it is on the wire; None where the block does not say.
    """

    age: Age
    asked: Request
    fact: PropertyValue
    number: int | None = None


class Requests:
    """Facts as requests.

    Args:
        beliefs: of the vehicle, for names.
        groups: all that there may be, by name.

    Attributes:
        attributes: of the facts that are requests.
    """

    def __init__(self, beliefs: Beliefs, groups: Mapping[str, Group]) -> None:
        self._name = beliefs.name
        self._groups = groups
        self._attributes = beliefs.model.tbox.attributes
        self._of_roles = frozenset(
            attribute.uid
            for attribute in self._attributes
            if attribute.name in ROLE_ATTRIBUTES or attribute.name.startswith(OBJECTIVE_PREFIX)
        )
        uids = {attribute.name: attribute.uid for attribute in self._attributes}
        acts = {HAS_MISSION: Act.MISSION, HEADED_BY: Act.SUCCEED, FORMED_UNDER: Act.CREATE, DISSOLVED: Act.DISSOLVE}
        numbers = {HEADED_BY: HEAD_TERM, FORMED_UNDER: FORMATION, DISSOLVED: DISSOLVED}
        self._acts = {uids[name]: act for name, act in acts.items() if name in uids}  # some need groups at sea
        self._numbered_by = {uids[name]: uids[number] for name, number in numbers.items() if name in uids}
        self.attributes = self._of_roles | self._acts.keys()

    def role_named(self, fact: PropertyValue) -> tuple[str, str] | None:
        """Attribute and role (``Group.Role``) of a fact about roles and objectives; None for any other fact."""
        if fact.attribute not in self._of_roles:
            return None
        name = self._attributes[fact.attribute].name
        return name, self._name(fact.subject if name.startswith(OBJECTIVE_PREFIX) else fact.target)

    def of(self, block: Block) -> list[DatedRequest]:
        """What the issuer of a block asks for."""
        return [
            DatedRequest((*block.key, position), self._asked(fact, block), fact, self._number(fact, block))
            for position, fact in enumerate(block.facts)
            if fact.attribute in self.attributes
        ]

    def _asked(self, fact: PropertyValue, block: Block) -> Request:
        name, issuer = self._name, self._name(block.origin)
        match self._acts.get(fact.attribute):
            case Act.MISSION:
                return Request(issuer, Act.MISSION, name(fact.subject), argument=name(fact.target))
            case Act.DISSOLVE:
                return Request(issuer, Act.DISSOLVE, name(fact.subject))
            case (Act.SUCCEED | Act.CREATE) as leads:
                group = name(fact.subject)
                return Request(issuer, leads, group, self._groups[group].head_role or "", name(fact.target))
        attribute, path = self.role_named(fact) or ("", "")
        group, _, role = path.partition(".")
        if attribute.startswith(OBJECTIVE_PREFIX):
            objective = attribute.removeprefix(OBJECTIVE_PREFIX)
            return Request(issuer, Act.OBJECTIVE, group, role, objective=objective, argument=name(fact.target))
        act = Act.ASSIGN if attribute == PLAYS_ROLE else Act.RELEASE
        return Request(issuer, act, group, role, name(fact.subject))

    def _number(self, fact: PropertyValue, block: Block) -> int | None:
        """The number that a block states of the same subject beside a fact; None if it states none."""
        attribute = self._numbered_by.get(fact.attribute)
        beside = (
            stated.value for stated in block.facts if (stated.subject, stated.attribute) == (fact.subject, attribute)
        )
        number = None if attribute is None else next(beside, None)
        return None if number is None else round(number)  # type: ignore[arg-type]  # it is a number
