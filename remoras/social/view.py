"""View: what counts of the organisation, as one vehicle knows it. An immutable value, folded round by round.

A view follows from the one before it, from what was stated since, and from whom the vehicle takes for absent
(``remoras.social.consultation``). It records nothing, sends nothing and reads no clock.

Availability: which vehicles take jobs, by what each of them says of itself. An immutable value.

A vehicle that is cut off or has resigned takes none, until it says that it does again; one whose sensors yield nothing
takes none for which it needs them. What was given to it before it said so stays with it until it leaves that. So it is
a function of what was said, whatever was heard first: the order, or that its assignee takes none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from remoras.activities import Objective
from remoras.authority import NOBODY, Act, Request, Rules, Ruling
from remoras.beliefs import Beliefs, Key
from remoras.organisation import Group, Organisation, Outcome, RoleAssignment, RoleKey
from remoras.social.leadership import (
    AGREED_BEFORE,
    HEAD_TERM,
    HEADED_BY,
    PLAYS_ROLE,
    ROLE_ATTRIBUTES,
    Age,
    Claim,
    Leadership,
)
from remoras.social.workload import takes_sensors
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


AVAILABLE = "available"


@dataclass(frozen=True, slots=True)
class Availability:
    """Who takes jobs, as one vehicle knows it.

    Attributes:
        told: whether it takes jobs, as each vehicle has said, and when.
        blind_since: vehicles whose sensors yield nothing.
        news: vehicles of which something was heard since the end of the last round.
        since: vehicles that take no jobs; unavailable: the same, by their names alone.
    """

    told: Mapping[str, Mapping[Age, bool]] = field(default_factory=dict)
    blind_since: Mapping[str, Age] = field(default_factory=dict)
    news: frozenset[str] = NOBODY
    since: Mapping[str, Age] = field(init=False)
    unavailable: frozenset[str] = field(init=False)

    def __post_init__(self) -> None:
        since: dict[str, Age] = {}
        for name, told in self.told.items():
            for age, takes_jobs in sorted(told.items()):
                if takes_jobs:
                    since.pop(name, None)
                else:
                    since.setdefault(name, age)
        object.__setattr__(self, "since", since)
        object.__setattr__(self, "unavailable", frozenset(since))

    def hear(self, name: str, takes_jobs: bool, age: Age) -> Availability:
        """A vehicle has said whether it takes jobs."""
        told = {**self.told, name: {**self.told.get(name, {}), age: takes_jobs}}
        return replace(self, told=told, news=self.news | {name})

    def hear_of_sensors(self, name: str, work: bool, age: Age) -> Availability:
        """A vehicle has said whether its sensors yield anything; that they do not it says for good."""
        blind = {} if work else {name: min(age, self.blind_since.get(name, age))}
        return replace(self, blind_since={**self.blind_since, **blind}, news=self.news | {name})

    def takes(self, asked: Request, group: Group, age: Age, rules: Rules) -> bool:
        """True if the assignee takes a role of a group that was given to it at ``age``; anybody takes one without job.

        Args:
            asked: gives the role.
            group: specification.
            age: when it was given.
            rules: which jobs take sensors.
        """
        role = group.role(asked.role)
        if role is None or role.job is None:
            return True
        if self.since.get(asked.assignee, age) < age:
            return False
        return self.blind_since.get(asked.assignee, age) >= age or not takes_sensors(rules, group, asked)


UNCHANGED = frozenset({Outcome.ROLE_ALREADY_HANDLED, Outcome.ROLE_NOT_HANDLED})
"""Outcomes of what is so already: neither a change nor a refusal."""


class Formation(NamedTuple):
    """What was said of a group that is formed at sea, to be compared: the greater counts.

    Attributes:
        number: of the formation, from 1.
        is_over: it is dissolved.
        rank: minus the node of who formed it; 0 where it is over.
        since: when that was said; what was said of the group before is about an earlier formation.
    """

    number: int
    is_over: bool
    rank: int
    since: Age


NEVER = Formation(0, True, 0, AGREED_BEFORE)


class Instruction(NamedTuple):
    """When a role was given to a vehicle or taken from it; what was said at one time takes it before it gives it."""

    age: Age
    gives: bool
    vehicle: str


class Holding(NamedTuple):
    """What was said of the holders of one role.

    Attributes:
        instructions: by which it was given and taken.
        holders: who held it when these were looked at last.
        is_crowded: somebody waits for room.
    """

    instructions: Mapping[Instruction, Request]
    holders: frozenset[str]
    is_crowded: bool = False


def founding_holdings(organisation: Organisation) -> dict[RoleKey, Holding]:
    """Who holds which role by what was agreed before the mission."""
    held: dict[RoleKey, list[str]] = {}
    for assignment in sorted(organisation.assignments):
        held.setdefault((assignment.group, assignment.role), []).append(assignment.vehicle)
    return {
        place: Holding(
            {Instruction(AGREED_BEFORE, True, name): Request("", Act.ASSIGN, *place, name) for name in names},
            frozenset(names),
        )
        for place, names in held.items()
    }


class Isolated(NamedTuple):
    """What a vehicle that is cut off has changed for itself.

    Attributes:
        taken, displaced: roles that were taken and left, to be undone when it comes back.
        orders: what it gave to roles and groups, to be told then: nobody else has heard of that.
    """

    taken: tuple[RoleAssignment, ...] = ()
    displaced: tuple[RoleAssignment, ...] = ()
    orders: tuple[DatedRequest, ...] = ()


class Now(NamedTuple):
    """What a vehicle sees at the end of a round.

    Attributes:
        absent: vehicles that make room for others.
        unavailable: those that take no jobs.
        began_s: until when it was away itself for a lease (s): of claims from before it cannot say whether their heads
            were there. missed: itself, and whom it has not heard since.
    """

    absent: frozenset[str] = NOBODY
    unavailable: frozenset[str] = NOBODY
    began_s: float = 0.0
    missed: frozenset[str] = NOBODY


@dataclass(frozen=True)
class View:
    """The organisation as one vehicle knows it, what it follows from, and what the last round has come to.

    Views are equal if the same follows from them, whatever came of the last round.

    Attributes:
        rules: of who may change what.
        organisation: groups and roles as agreed.
        leadership: who led when; availability: who takes jobs since when.
        newest: when the statement that counts was made, by what it is about (``Request.about``).
        holdings: of roles with a job or with room for few, what was said of their holders.
        missions: that groups were given at sea, by their names, in the order in which they were given last.
        formations: the newest of each group that is formed at sea.
        waiting: requests that are refused for now; at_sea: all about groups that are formed at sea, since they were.
        greatest: the greatest claim to lead each group, whether it counts or not; crowned: the one by which it is led.
        came_in: by leading which group a vehicle came into another, by that and its name.
        stepped_down: what a head took when it stepped down, by group and its name.
        isolated: what was changed while the vehicle is cut off.
        now: what the vehicle sees.
        rulings: what became of every request in the last round, changes and refusals, in order.
        unlawful: when statements were made that their issuers had no right to make.
    """

    rules: Rules = field(compare=False, repr=False)
    organisation: Organisation
    leadership: Leadership
    availability: Availability = field(default_factory=Availability)
    newest: Mapping[tuple[str, ...], Age] = field(default_factory=dict)
    holdings: Mapping[RoleKey, Holding] = field(default_factory=dict)
    missions: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    formations: Mapping[str, Formation] = field(default_factory=dict)
    waiting: Mapping[Age, DatedRequest] = field(default_factory=dict)
    at_sea: Mapping[Age, DatedRequest] = field(default_factory=dict)
    greatest: Mapping[str, Claim] = field(default_factory=dict)
    crowned: Mapping[str, Claim | None] = field(default_factory=dict)
    came_in: Mapping[RoleKey, str] = field(default_factory=dict)
    stepped_down: Mapping[RoleKey, RoleAssignment] = field(default_factory=dict)
    isolated: Isolated = field(default=Isolated())
    now: Now = field(default=Now(), compare=False)
    rulings: tuple[Ruling, ...] = field(default=(), compare=False)
    unlawful: frozenset[Age] = field(default=frozenset(), compare=False)

    @classmethod
    def founded(cls, organisation: Organisation, rules: Rules) -> View:
        """What was agreed before the mission."""
        leadership = Leadership.founded(organisation, rules.at_sea)
        return cls(rules, organisation, leadership, holdings=founding_holdings(organisation))

    # What follows from it ------------------------------------------------------------------------

    def group(self, name: str) -> Group:
        """Specification of a group, whether there is one or it is yet to be formed at sea."""
        return self.rules.at_sea.get(name) or self.organisation.groups[name]

    def is_head(self, asked: Request) -> bool:
        """True if the role is that of the head of its group."""
        return asked.role == self.group(asked.group).head_role

    def stated(self, *about: str) -> Age:
        """When the statement that counts was made; ``AGREED_BEFORE`` if nothing was said of it at sea."""
        return self.newest.get(about, AGREED_BEFORE)

    def formation(self, group: str) -> int:
        """How often a group has been formed, as far as is known."""
        return self.formations.get(group, NEVER).number

    # What the last round has come to -------------------------------------------------------------

    def granted(self, *events: str) -> list[Request]:
        """Requests of which these events came, in order."""
        return [ruling.asked for ruling in self.rulings if ruling.event in events]

    @property
    def assigned(self) -> list[RoleAssignment]:
        """Roles that vehicles took, in the order in which they did."""
        return [RoleAssignment(asked.group, asked.role, asked.assignee) for asked in self.granted("assigned")]

    @property
    def left(self) -> list[RoleAssignment]:
        """Roles that vehicles left, in the order in which they did."""
        return [RoleAssignment(asked.group, asked.role, asked.assignee) for asked in self.granted("left")]

    @property
    def objectives(self) -> dict[tuple[str, str, str], Objective]:
        """Objectives that were given to roles, by group, role and name."""
        return {
            (of.group, of.role, of.objective): Objective(of.group, of.role, of.objective, of.argument)
            for of in self.granted("given")
            if of.act is Act.OBJECTIVE
        }

    @property
    def renewed(self) -> tuple[str, ...]:
        """Groups that were formed or dissolved: what was agreed in them before is over."""
        return tuple(dict.fromkeys(asked.group for asked in [*self.granted("formed"), *self.granted("dissolved")]))

    @property
    def keys(self) -> set[Key]:
        """Facts that have changed with missions and formations."""
        missions = [asked for asked in self.granted("given") if asked.act is Act.MISSION]
        has = {(HAS_MISSION, asked.group) for asked in missions}
        has |= {("given", f"{asked.group}.{asked.argument}") for asked in missions}
        return has | {("formed", group) for group in self.renewed}

    # The next one --------------------------------------------------------------------------------

    def assign(self, asked: Request, yielding: frozenset[str] = NOBODY) -> View:
        """A vehicle plays a role; where there is no room, in the place of holders that all are absent or yield."""
        view, place = self, (asked.group, asked.role)
        organisation, outcome = view.organisation.assign(asked.assignee, *place)
        holders = view.organisation.members(*place)
        if outcome is Outcome.NO_ROOM and (self.now.absent | yielding).issuperset(holders):
            for name in holders:
                view = view.leave(Request(asked.issuer, Act.RELEASE, *place, name))
            organisation, outcome = view.organisation.assign(asked.assignee, *place)
        return view if outcome is not Outcome.SUCCESS else replace(view, organisation=organisation).note(asked, outcome)

    def leave(self, asked: Request) -> View:
        """A vehicle plays a role no longer."""
        organisation, outcome = self.organisation.leave_role(asked.assignee, asked.group, asked.role)
        return replace(self, organisation=organisation).note(asked, outcome)

    def do(self, asked: Request, age: Age | None = None, yielding: frozenset[str] = NOBODY) -> View:
        """A vehicle plays a role, or no longer; where it is that of the head, it leads since ``age``, or no longer."""
        plays = asked.act is not Act.RELEASE
        view = self.assign(asked, yielding) if plays else self.leave(asked)
        if age is None or view.organisation is self.organisation or not self.is_head(asked):
            return view
        return replace(view, leadership=view.leadership.change(asked.group, asked.assignee, plays, age))

    def overrule(self, asked: Request, age: Age) -> View:
        """The same as of ``age``, unless something newer counts."""
        if self.newest.get(asked.about, age) > age:
            return self
        return replace(self, newest={**self.newest, asked.about: age}).do(asked)

    def note(self, asked: Request, outcome: Outcome) -> View:
        """With what became of a request, unless it is so already."""
        return self if outcome in UNCHANGED else replace(self, rulings=(*self.rulings, Ruling(asked, outcome)))

    def refuse(self, request: DatedRequest, outcome: Outcome) -> View:
        """A statement that its issuer had no right to make counts for nothing."""
        return replace(self, unlawful=self.unlawful | {request.age}).note(request.asked, outcome)
