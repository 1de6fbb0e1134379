"""Requests: what the organisational facts of a world model ask for, in the words of ``remoras.authority``."""

from __future__ import annotations

from collections.abc import Mapping

from remoras.authority import Act, Request
from remoras.beliefs import Beliefs
from remoras.organisation import Group
from remoras.social.formations import FORMATION_ATTRIBUTES
from remoras.social.negotiation import ROLE_ATTRIBUTES
from remoras.social.succession import HEAD_TERM, HEADED_BY, Claim
from worldmodel import Observation, PropertyValue

OBJECTIVE_PREFIX = "objective"
"""Attributes whose name begins so give a role an objective."""
HAS_MISSION = "hasMission"


class Requests:
    """Facts as requests.

    Args:
        beliefs: of the vehicle, for names.
        groups: by name.

    Attributes:
        attributes: of the facts that are requests.
    """

    def __init__(self, beliefs: Beliefs, groups: Mapping[str, Group]) -> None:
        tbox = beliefs.model.tbox
        self._name = beliefs.name
        self._groups = groups
        self._attributes = tbox.attributes
        self._organisational = frozenset(
            attribute.uid
            for attribute in self._attributes
            if attribute.name in ROLE_ATTRIBUTES or attribute.name.startswith(OBJECTIVE_PREFIX)
        )
        self._headed_by, self._head_term, self._has_mission = (
            tbox.attribute_named(name).uid for name in (HEADED_BY, HEAD_TERM, HAS_MISSION)
        )
        uids = {
            attribute.name: attribute.uid for attribute in self._attributes
        }  # words for groups at sea may not be there
        self._formed_under, self._formation, self._dissolved = (uids.get(name) for name in FORMATION_ATTRIBUTES)
        self._acts = frozenset({self._headed_by, self._formed_under, self._dissolved} - {None})
        self.attributes = self._organisational | self._acts | {self._has_mission}

    def waits(self, fact: PropertyValue) -> bool:
        """True if it is about roles, objectives, heads or formations: what it asks for waits for the end of a round."""
        return fact.attribute in self._organisational or fact.attribute in self._acts

    def gives_mission(self, fact: PropertyValue) -> bool:
        """True if the fact gives a group its mission."""
        return fact.attribute == self._has_mission

    def role_named(self, fact: PropertyValue) -> tuple[str, str] | None:
        """Attribute and role (``Group.Role``) of a fact about roles and objectives; None for any other fact."""
        if fact.attribute not in self._organisational:
            return None
        name = self._attributes[fact.attribute].name
        return name, self._name(fact.subject if name.startswith(OBJECTIVE_PREFIX) else fact.target)

    def name_of(self, origin: int) -> str:
        """The vehicle whose facts have this origin."""
        return self._name(origin)

    def of(self, observation: Observation) -> Request:
        """What the issuer of a fact asks for."""
        fact, name = observation.fact, self._name
        issuer = name(observation.origin)
        if fact.attribute == self._has_mission:
            return Request(issuer, Act.MISSION, name(fact.subject), argument=name(fact.target))
        if fact.attribute in (self._headed_by, self._formed_under):
            act = Act.SUCCEED if fact.attribute == self._headed_by else Act.CREATE
            group = name(fact.subject)
            return Request(issuer, act, group, self._groups[group].head_role or "", name(fact.target))
        if fact.attribute == self._dissolved:
            return Request(issuer, Act.DISSOLVE, name(fact.subject))
        attribute, path = self.role_named(fact) or ("", "")
        group, _, role = path.partition(".")
        if attribute.startswith(OBJECTIVE_PREFIX):
            objective = attribute.removeprefix(OBJECTIVE_PREFIX)
            return Request(issuer, Act.OBJECTIVE, group, role, objective=objective, argument=name(fact.target))
        act = Act.ASSIGN if attribute == ROLE_ATTRIBUTES[0] else Act.RELEASE
        return Request(issuer, act, group, role, name(fact.subject))

    def claim(self, said: Observation) -> Claim | None:
        """A claim to lead a group, by its term on the wire; None if its block does not say under which."""
        term = self._beside(said, self._head_term)
        return None if term is None else Claim(term, -said.fact.target)

    def formation(self, said: Observation) -> int | None:
        """Number of the formation that a fact forms or dissolves; None if its block does not say."""
        return self._beside(said, self._dissolved if said.fact.attribute == self._dissolved else self._formation)

    def _beside(self, said: Observation, attribute: int | None) -> int | None:
        """The number that the block of a fact says of the same subject."""
        for fact in said.block.facts:
            if fact.attribute == attribute and fact.subject == said.fact.subject:
                return round(fact.value)  # type: ignore[arg-type]  # it is a number
        return None
