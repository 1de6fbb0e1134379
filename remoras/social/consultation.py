"""Consultation: what is said in one TDMA frame about roles and objectives counts from its end.

In a frame every vehicle has had its say, so vehicles that hear their assignments in different slots of it start
together, and none acts on half a discussion. What was said counts in the world model's order of facts, whatever the
order in which it was heard, and only if its issuer is a member of the group. For the role of a vehicle, and for an
objective of a role, the newest statement counts. A role that has no room waits for an old holder to leave: the news of
its successor may come first. Holders that are absent make room. Nobody is given a role that it cannot play, or a job
while it takes none. Of claims to lead a group the greatest counts, see ``remoras.social.succession``.

What a vehicle states while it is cut off counts for itself alone; ``Consultation.come_back`` undoes it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from remoras.activities import Objective
from remoras.beliefs import Beliefs
from remoras.database import AUVDatabase
from remoras.organisation import Organisation, Outcome, RoleAssignment
from remoras.social.negotiation import ROLE_ATTRIBUTES
from remoras.social.succession import HEAD_TERM, HEADED_BY, Claim, Headship, is_able_to_lead, role_after
from worldmodel import Change, Observation, PropertyValue

OBJECTIVE_PREFIX = "objective"
"""Attributes whose name begins so give a role an objective."""
NOBODY: frozenset[str] = frozenset()

Age = tuple[float, int, int, int]


@dataclass(slots=True)
class Agreed:
    """What counts from the end of a round.

    Attributes:
        organisation: with all that was agreed.
        absent: vehicles that make room for others; unavailable: those that take no jobs.
        assigned, left: roles that vehicles took and left, in the order in which they did.
        objectives: given to roles.
        refused: what does not count, and why, in words.
    """

    organisation: Organisation
    absent: frozenset[str] = NOBODY
    unavailable: frozenset[str] = NOBODY
    assigned: list[RoleAssignment] = field(default_factory=list)
    left: list[RoleAssignment] = field(default_factory=list)
    objectives: list[Objective] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)

    def assign(self, one: RoleAssignment) -> Outcome:
        """Let a vehicle play a role; where there is no room, in the place of holders that are all absent."""
        organisation, outcome = self.organisation.assign(one.vehicle, one.group, one.role)
        if outcome is Outcome.ACCESS_DENIED and self.absent.issuperset(self.organisation.members(one.group, one.role)):
            for name in self.organisation.members(one.group, one.role):
                self.leave(RoleAssignment(one.group, one.role, name))
            organisation, outcome = self.organisation.assign(one.vehicle, one.group, one.role)
        if outcome is Outcome.SUCCESS:
            self.organisation = organisation
            self.assigned.append(one)
        return outcome

    def leave(self, one: RoleAssignment) -> Outcome:
        """Let a vehicle play a role no longer."""
        self.organisation, outcome = self.organisation.leave_role(one.vehicle, one.group, one.role)
        if outcome is Outcome.SUCCESS:
            self.left.append(one)
        return outcome


def _age(observation: Observation) -> Age:
    """The world model's order of facts: time, then origin, sequence and position."""
    return observation.time_s, observation.origin, observation.block.sequence, observation.position


class Consultation:
    """What one vehicle has heard and said in this round, and what counts from earlier ones.

    Args:
        beliefs: of the vehicle.
        database: static data of all vehicles.
    """

    def __init__(self, beliefs: Beliefs, database: AUVDatabase) -> None:
        self._beliefs = beliefs
        self._database = database
        self._attributes = beliefs.model.tbox.attributes
        self._organisational = frozenset(
            one.uid for one in self._attributes if one.name in ROLE_ATTRIBUTES or one.name.startswith(OBJECTIVE_PREFIX)
        )
        self._headed_by = beliefs.model.tbox.attribute_named(HEADED_BY).uid
        self._head_term = beliefs.model.tbox.attribute_named(HEAD_TERM).uid
        self._pending: list[Observation] = []
        self._pending_alone: list[Observation] = []
        self._newest: dict[tuple[str, ...], Age] = {}  # what counts, and since when
        self._denied: dict[RoleAssignment, None] = {}  # there was no room for it
        self._taken_alone: dict[RoleAssignment, None] = {}
        self._displaced_alone: dict[RoleAssignment, None] = {}
        self.headship = Headship()

    @property
    def is_due(self) -> bool:
        """True if something was said that does not count yet."""
        return bool(self._pending or self._pending_alone)

    def note(self, change: Change, alone: bool = False) -> None:
        """Keep what a block says of roles, objectives and heads until the end of the round.

        Args:
            change: that the block made to the world model.
            alone: True if this vehicle states it for itself alone, since it is cut off.
        """
        for position, fact in enumerate(change.block.facts):
            if fact.attribute in self._organisational or fact.attribute == self._headed_by:
                (self._pending_alone if alone else self._pending).append(Observation(change.block, position))

    def role_named(self, fact: PropertyValue) -> tuple[str, str] | None:
        """Attribute and role (``Group.Role``) of an organisational fact; None for any other fact."""
        if fact.attribute not in self._organisational:
            return None
        name = self._attributes[fact.attribute].name
        return name, self._beliefs.name(fact.subject if name.startswith(OBJECTIVE_PREFIX) else fact.target)

    def end(
        self, organisation: Organisation, absent: frozenset[str] = NOBODY, unavailable: frozenset[str] = NOBODY
    ) -> Agreed:
        """End of the round: what was said in it counts now, unless something newer counts already.

        Args:
            organisation: that counted so far.
            absent: vehicles whose roles others may be given.
            unavailable: vehicles that take no jobs.
        """
        agreed = Agreed(organisation, absent, unavailable)
        pending, self._pending = sorted(self._pending, key=_age), []
        for observation in pending:
            if observation.fact.attribute == self._headed_by:
                self._succeed(observation, agreed)
            else:
                self._count(observation, agreed)
        for one in sorted(self._denied, key=lambda one: self._newest[one.group, one.role, one.vehicle], reverse=True):
            if agreed.assign(one) is not Outcome.ACCESS_DENIED:  # its successor was heard of first
                del self._denied[one]
        alone, self._pending_alone = sorted(self._pending_alone, key=_age), []
        if alone:
            self._count_alone(alone, agreed)
        return agreed

    # What members say ----------------------------------------------------------------------------

    def _count(self, observation: Observation, agreed: Agreed, alone: bool = False) -> None:
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
        if not alone and not self._is_newest(about, _age(observation)):
            return
        if is_objective:
            name, argument = attribute.removeprefix(OBJECTIVE_PREFIX), self._beliefs.name(fact.target)
            agreed.objectives.append(Objective(group, role, name, argument))
        else:
            self._take(RoleAssignment(group, role, vehicle), attribute == ROLE_ATTRIBUTES[0], agreed)

    def _is_newest(self, about: tuple[str, ...], age: Age) -> bool:
        """True if nothing newer is known about it; it counts since ``age`` then."""
        if self._newest.get(about, age) > age:
            return False
        self._newest[about] = age
        return True

    def _take(self, one: RoleAssignment, plays: bool, agreed: Agreed) -> None:
        self._denied.pop(one, None)
        if plays and (why := self._unfit(one, agreed)):
            agreed.refused.append(f"{one.vehicle} as {one.role} of {one.group}: {why}")
            return
        outcome = agreed.assign(one) if plays else agreed.leave(one)
        if outcome is Outcome.ACCESS_DENIED:
            self._denied[one] = None
        if outcome not in (Outcome.SUCCESS, Outcome.ROLE_ALREADY_HANDLED, Outcome.ROLE_NOT_HANDLED):
            agreed.refused.append(f"{one.vehicle} as {one.role} of {one.group}: {outcome.value}")

    def _unfit(self, one: RoleAssignment, agreed: Agreed) -> str:
        """Why the vehicle is not to be given the role, in words; empty if it may be.

        Who takes no jobs and has left the group has resigned, and is not called back.
        """
        group = agreed.organisation.groups.get(one.group)
        role = group.role(one.role) if group is not None else None
        if role is None:
            return ""  # the organisation itself says what is wrong
        if not self._database[one.vehicle].can_play(one.role):
            return "it cannot play the role"
        if one.vehicle in agreed.unavailable:
            if role.job is not None:
                return "it takes no jobs"
            if not agreed.organisation.is_member(one.vehicle, one.group):
                return "it has resigned"
        return ""

    # Claims --------------------------------------------------------------------------------------

    def _succeed(self, observation: Observation, agreed: Agreed) -> None:
        """Take note of a claim to lead a group; the greatest one makes its vehicle the head, and the old head no more.

        Whether a claim is sound depends on what the whole fleet knows, so all come to the same end.
        """
        group = agreed.organisation.groups[self._beliefs.name(observation.fact.subject)]
        vehicle = self._beliefs.name(observation.fact.target)
        facts = observation.block.facts
        terms = [f.value for f in facts if f.attribute == self._head_term and f.subject == observation.fact.subject]
        if observation.origin != observation.fact.target or not terms:
            agreed.refused.append(f"{vehicle} as head of {group.name}: a vehicle claims it for itself, with a term")
            return
        head_role = group.head_role
        if head_role is None or not is_able_to_lead(self._database, vehicle, group):
            agreed.refused.append(f"{vehicle} as head of {group.name}: it is not able to lead")
            return
        claim = Claim(round(terms[0]), -self._database[vehicle].node)  # type: ignore[arg-type]  # it is a number
        if not self.headship.take(group.name, claim):
            return
        age = _age(observation)
        before = [name for name in agreed.organisation.heads(group.name) if name != vehicle]
        self._hand_over(RoleAssignment(group.name, head_role, vehicle), before, age, agreed)
        role = group.role(head_role)
        if role is not None and role.played_by is not None and self._database[vehicle].can_play(role.played_by[1]):
            holders = agreed.organisation.members(*role.played_by)
            self._hand_over(RoleAssignment(*role.played_by, vehicle), holders, age, agreed)
        for name in before:
            then = role_after(self._database, name, group, agreed.organisation)
            if then is not None and self._is_newest((then.group, then.role, then.vehicle), age):
                agreed.assign(then)

    def _hand_over(self, to: RoleAssignment, holders: list[str] | tuple[str, ...], age: Age, agreed: Agreed) -> None:
        """Let holders leave a role for another, unless a newer word says something else of one of them."""
        for name in holders:
            if name != to.vehicle and self._is_newest((to.group, to.role, name), age):
                agreed.leave(RoleAssignment(to.group, to.role, name))
        if self._is_newest((to.group, to.role, to.vehicle), age):
            agreed.assign(to)

    # Cut off -------------------------------------------------------------------------------------

    def _count_alone(self, pending: list[Observation], agreed: Agreed) -> None:
        """Let what the vehicle states for itself alone count, and note what is to be undone."""
        n_assigned, n_left = len(agreed.assigned), len(agreed.left)
        for observation in pending:
            if observation.fact.attribute != self._headed_by:
                self._count(observation, agreed, alone=True)
        for one in agreed.left[n_left:]:
            if one in self._taken_alone:
                del self._taken_alone[one]
            else:
                self._displaced_alone[one] = None
        self._taken_alone.update(dict.fromkeys(agreed.assigned[n_assigned:]))

    def come_back(self, organisation: Organisation) -> Agreed:
        """The vehicle is cut off no longer: it leaves what it took on alone, and others hold again what they held.

        Args:
            organisation: that counted so far.
        """
        agreed = Agreed(organisation)
        for one in self._taken_alone:
            agreed.leave(one)
        for one in self._displaced_alone:
            agreed.assign(one)
        self._taken_alone.clear()
        self._displaced_alone.clear()
        return agreed
