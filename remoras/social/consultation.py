"""Consultation: what is said in one TDMA frame about roles and objectives counts from its end.

In a frame every vehicle has had its say, so vehicles that hear their assignments in different slots of it start
together, and none acts on half a discussion. What was said counts in the world model's order of facts, whatever the
order in which it was heard, and only if its issuer is a member of the group. For the role of a vehicle, and for an
objective of a role, the newest statement counts. A role that has no room waits for an old holder to leave: the news of
its successor may come first.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from remoras.activities import Objective
from remoras.beliefs import Beliefs
from remoras.organisation import Organisation, Outcome, RoleAssignment
from remoras.social.negotiation import ROLE_ATTRIBUTES
from worldmodel import Change, Observation, PropertyValue

OBJECTIVE_PREFIX = "objective"
"""Attributes whose name begins so give a role an objective."""

Age = tuple[float, int, int, int]


@dataclass(slots=True)
class Agreed:
    """What counts from the end of a round.

    Attributes:
        organisation: with all that was agreed.
        assigned, left: roles that vehicles took and left, in the order in which they did.
        objectives: given to roles.
        refused: what does not count, and why, in words.
    """

    organisation: Organisation
    assigned: list[RoleAssignment] = field(default_factory=list)
    left: list[RoleAssignment] = field(default_factory=list)
    objectives: list[Objective] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)


def _age(observation: Observation) -> Age:
    """The world model's order of facts: time, then origin, sequence and position."""
    return observation.time_s, observation.origin, observation.block.sequence, observation.position


class Consultation:
    """What one vehicle has heard and said in this round, and what counts from earlier ones.

    Args:
        beliefs: of the vehicle.
    """

    def __init__(self, beliefs: Beliefs) -> None:
        self._beliefs = beliefs
        self._attributes = beliefs.model.tbox.attributes
        self._organisational = frozenset(
            one.uid for one in self._attributes if one.name in ROLE_ATTRIBUTES or one.name.startswith(OBJECTIVE_PREFIX)
        )
        self._pending: list[Observation] = []
        self._newest: dict[tuple[str, ...], Age] = {}  # what counts, and since when
        self._denied: dict[RoleAssignment, None] = {}  # there was no room for it

    @property
    def is_due(self) -> bool:
        """True if something was said that does not count yet."""
        return bool(self._pending)

    def note(self, change: Change) -> None:
        """Keep what a block says of roles and objectives until the end of the round."""
        for position, fact in enumerate(change.block.facts):
            if fact.attribute in self._organisational:
                self._pending.append(Observation(change.block, position))

    def role_named(self, fact: PropertyValue) -> tuple[str, str] | None:
        """Attribute and role (``Group.Role``) of an organisational fact; None for any other fact."""
        if fact.attribute not in self._organisational:
            return None
        name = self._attributes[fact.attribute].name
        return name, self._beliefs.name(fact.subject if name.startswith(OBJECTIVE_PREFIX) else fact.target)

    def end(self, organisation: Organisation) -> Agreed:
        """End of the round: what was said in it counts now, unless something newer counts already.

        Args:
            organisation: that counted so far.
        """
        agreed = Agreed(organisation)
        pending = sorted(self._pending, key=_age)
        self._pending = []
        for observation in pending:
            self._count(observation, agreed)
        return agreed

    def _count(self, observation: Observation, agreed: Agreed) -> None:
        fact = observation.fact
        attribute, path = self.role_named(fact) or ("", "")
        group, role = path.split(".")
        issuer = self._beliefs.name(observation.origin)
        if not agreed.organisation.may_assign(issuer, group):
            agreed.refused.append(f"{issuer} is no member of {group}, its {attribute} does not count")
            return
        is_objective = attribute.startswith(OBJECTIVE_PREFIX)
        vehicle = "" if is_objective else self._beliefs.name(fact.subject)
        about = (group, role, attribute if is_objective else vehicle)
        age = _age(observation)
        if self._newest.get(about, age) > age:
            return
        self._newest[about] = age
        if is_objective:
            name, argument = attribute.removeprefix(OBJECTIVE_PREFIX), self._beliefs.name(fact.target)
            agreed.objectives.append(Objective(group, role, name, argument))
        else:
            self._take(RoleAssignment(group, role, vehicle), attribute == ROLE_ATTRIBUTES[0], agreed)

    def _take(self, one: RoleAssignment, plays: bool, agreed: Agreed) -> None:
        change = agreed.organisation.assign if plays else agreed.organisation.leave_role
        agreed.organisation, outcome = change(one.vehicle, one.group, one.role)
        self._denied.pop(one, None)
        if outcome is Outcome.ACCESS_DENIED:
            self._denied[one] = None
        if outcome is Outcome.SUCCESS:
            (agreed.assigned if plays else agreed.left).append(one)
            waiting = [other for other in self._denied if (other.group, other.role) == (one.group, one.role)]
            if not plays and waiting:  # its successor was heard of first
                self._take(waiting[-1], True, agreed)
        elif outcome not in (Outcome.ROLE_ALREADY_HANDLED, Outcome.ROLE_NOT_HANDLED):
            agreed.refused.append(f"{one.vehicle} as {one.role} of {one.group}: {outcome.value}")
