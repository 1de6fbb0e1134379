"""Immutable view of the organisation as one vehicle knows it, updated round by round.

A view follows from its predecessor, the requests since (``remoras.social.consultation``), and the absent peers.
Availability follows from each vehicle's statements about itself, in any order of reception. Isolated or resigned
vehicles take no jobs until they state otherwise; one with failed sensors takes none that need them. Jobs assigned
before such a statement stay until the vehicle leaves them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

from remoras.activities import Objective
from remoras.authority import NOBODY, Act, Request, Rules, Ruling
from remoras.beliefs import Beliefs, Key
from remoras.organisation import Group, Organisation, Outcome, RoleAssignment, RoleKey
from remoras.organisation.leadership import (
    AGREED_BEFORE,
    HEAD_TERM,
    HEADED_BY,
    PLAYS_ROLE,
    ROLE_ATTRIBUTES,
    Age,
    Claim,
    Leadership,
)
from remoras.recorder import OBJECTIVES
from remoras.social.workload import takes_sensors
from worldmodel import Block, PropertyValue

HAS_MISSION = "hasMission"
FORMED_UNDER, FORMATION, DISSOLVED = FORMATION_ATTRIBUTES = ("formedUnder", "formation", "dissolved")


class DatedRequest(NamedTuple):
    """Request and its age; ``number``: formation number, encoded term of a claim, or None."""

    age: Age
    asked: Request
    fact: PropertyValue
    number: int | None = None


class Requests:
    """Reader of requests from facts; ``attributes`` are the uids of such facts."""

    def __init__(self, beliefs: Beliefs, groups: Mapping[str, Group]) -> None:
        self._name = beliefs.name
        self._groups = groups
        self._attributes = beliefs.model.tbox.attributes
        self._of_roles = frozenset(
            attribute.uid
            for attribute in self._attributes
            if attribute.name in ROLE_ATTRIBUTES or attribute.name.startswith(OBJECTIVES)
        )
        uids = {attribute.name: attribute.uid for attribute in self._attributes}
        acts = {HAS_MISSION: Act.MISSION, HEADED_BY: Act.SUCCEED, FORMED_UNDER: Act.CREATE, DISSOLVED: Act.DISSOLVE}
        numbers = {HEADED_BY: HEAD_TERM, FORMED_UNDER: FORMATION, DISSOLVED: DISSOLVED}
        self._acts = {uids[name]: act for name, act in acts.items() if name in uids}  # some need ``at_sea``
        self._numbered_by = {uids[name]: uids[number] for name, number in numbers.items() if name in uids}
        self.attributes = self._of_roles | self._acts.keys()

    def role_named(self, fact: PropertyValue) -> tuple[str, str] | None:
        """Return attribute and ``Group.Role`` of a fact about a role or objective; None for others."""
        if fact.attribute not in self._of_roles:
            return None
        name = self._attributes[fact.attribute].name
        return name, self._name(fact.subject if name.startswith(OBJECTIVES) else fact.target)

    def of(self, block: Block) -> list[DatedRequest]:
        """Return the requests in a block."""
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
        if attribute.startswith(OBJECTIVES):
            objective = attribute.removeprefix(OBJECTIVES)
            return Request(issuer, Act.OBJECTIVE, group, role, objective=objective, argument=name(fact.target))
        act = Act.ASSIGN if attribute == PLAYS_ROLE else Act.RELEASE
        return Request(issuer, act, group, role, name(fact.subject))

    def _number(self, fact: PropertyValue, block: Block) -> int | None:
        attribute = self._numbered_by.get(fact.attribute)
        beside = (
            stated.value for stated in block.facts if (stated.subject, stated.attribute) == (fact.subject, attribute)
        )
        number = None if attribute is None else next(beside, None)
        return None if number is None else round(number)  # type: ignore[arg-type]  # it is a number


AVAILABLE = "available"


@dataclass(frozen=True)
class Availability:
    """Vehicles that take jobs, as one vehicle knows.

    ``told``: whether a vehicle takes jobs, by its name and place in the order of facts; ``blind_since``: vehicles with
    failed sensors; ``news``: those with a statement since the last round.
    """

    told: Mapping[str, Mapping[Age, bool]] = field(default_factory=dict)
    blind_since: Mapping[str, Age] = field(default_factory=dict)
    news: frozenset[str] = NOBODY

    @cached_property  # 4 % of a mission with bids and 95 % loss
    def since(self) -> Mapping[str, Age]:
        """Vehicles that take no jobs, and since when."""
        since: dict[str, Age] = {}
        for name, statements in self.told.items():
            for age, takes_jobs in sorted(statements.items()):
                if takes_jobs:
                    since.pop(name, None)
                else:
                    since.setdefault(name, age)
        return since

    @cached_property  # 1 % of a mission
    def unavailable(self) -> frozenset[str]:
        """Vehicles that take no jobs."""
        return frozenset(self.since)

    def hear(self, name: str, takes_jobs: bool, age: Age) -> Availability:
        """Add a vehicle's statement whether it takes jobs."""
        statements = {**self.told, name: {**self.told.get(name, {}), age: takes_jobs}}
        return replace(self, told=statements, news=self.news | {name})

    def hear_of_sensors(self, name: str, work: bool, age: Age) -> Availability:
        """Add a vehicle's statement whether its sensors work; failure is permanent."""
        blind = {} if work else {name: min(age, self.blind_since.get(name, age))}
        return replace(self, blind_since={**self.blind_since, **blind}, news=self.news | {name})

    def takes(self, asked: Request, group: Group, age: Age, rules: Rules) -> bool:
        """Return whether the assignee takes a role with a job, as assigned at ``age``."""
        if self.since.get(asked.assignee, age) < age:
            return False
        return self.blind_since.get(asked.assignee, age) >= age or not takes_sensors(
            rules, group.role(asked.role), asked.assignee
        )


UNCHANGED = frozenset({Outcome.ROLE_ALREADY_HANDLED, Outcome.ROLE_NOT_HANDLED})
"""Outcomes of requests that are already fulfilled."""


class Formation(NamedTuple):
    """Group formed at run time; the greater state is valid, requests before ``since`` are void."""

    # ``rank`` is the negative node of the forming vehicle, 0 if dissolved.
    number: int
    is_over: bool
    rank: int
    since: Age


NEVER = Formation(0, True, 0, AGREED_BEFORE)


class Instruction(NamedTuple):
    """Assignment or release of a role; at equal age, releases sort first."""

    age: Age
    gives: bool
    vehicle: str


class Holding(NamedTuple):
    """Instructions about one role, its holders at the last evaluation, whether vehicles wait."""

    instructions: Mapping[Instruction, Request]
    holders: frozenset[str]
    is_crowded: bool = False


def founding_holdings(organisation: Organisation) -> dict[RoleKey, Holding]:
    """Return the holders of all roles agreed before the mission."""
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
    """Provisional changes by an isolated vehicle; on reconnection roles are undone, orders sent."""

    taken: tuple[RoleAssignment, ...] = ()
    displaced: tuple[RoleAssignment, ...] = ()
    orders: tuple[DatedRequest, ...] = ()


class Now(NamedTuple):
    """Presence at the end of a round: own absence until ``began_s``, peers ``missed`` since."""

    absent: frozenset[str] = NOBODY
    unavailable: frozenset[str] = NOBODY
    began_s: float = 0.0
    missed: frozenset[str] = NOBODY


@dataclass(frozen=True)
class View:
    """Organisation as one vehicle knows it, its derivation, and the results of the last round.

    Equality ignores the results. ``newest``: place of the valid request in the order of facts, by ``Request.about``.
    ``holdings``: of roles with a job or a limited number of holders. ``greatest``: greatest claim known for each group,
    valid or not; ``crowned`` is the one in force. ``came_in``: group whose leader is thereby a member of another, by
    (other group, vehicle). ``stepped_down``: role that a leader took when it stepped down, by (group, vehicle).
    ``at_sea``: requests about groups formed at run time. ``unlawful``: unauthorised statements of the last round.
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
        """Create from the organisation agreed before the mission."""
        leadership = Leadership.founded(organisation, rules.at_sea)
        return cls(rules, organisation, leadership, holdings=founding_holdings(organisation))

    # Queries -------------------------------------------------------------------------------------

    def group(self, name: str) -> Group:
        """Return the specification of a group, formed or not."""
        return self.rules.at_sea.get(name) or self.organisation.groups[name]

    def is_head(self, asked: Request) -> bool:
        """Return whether the role is that of the group's leader."""
        return asked.role == self.group(asked.group).head_role

    def stated(self, *about: str) -> Age:
        """Return the age of the valid request about a subject; ``AGREED_BEFORE`` without one."""
        return self.newest.get(about, AGREED_BEFORE)

    def formation(self, group: str) -> int:
        """Return the number of the latest known formation of a group at run time; 0 without one."""
        return self.formations.get(group, NEVER).number

    # Results of the last round -------------------------------------------------------------------

    def granted(self, *events: str) -> list[Request]:
        """Return the requests with these events, in order."""
        return [ruling.asked for ruling in self.rulings if ruling.event in events]

    @property
    def assigned(self) -> list[RoleAssignment]:
        """Roles taken in the last round, in order."""
        return [RoleAssignment(asked.group, asked.role, asked.assignee) for asked in self.granted("assigned")]

    @property
    def left(self) -> list[RoleAssignment]:
        """Roles released in the last round, in order."""
        return [RoleAssignment(asked.group, asked.role, asked.assignee) for asked in self.granted("left")]

    @property
    def objectives(self) -> dict[tuple[str, str, str], Objective]:
        """Objectives given in the last round, by group, role and name."""
        return {
            (r.group, r.role, r.objective): Objective(r.group, r.role, r.objective, r.argument)
            for r in self.granted("given")
            if r.act is Act.OBJECTIVE
        }

    @property
    def renewed(self) -> tuple[str, ...]:
        """Groups formed or dissolved in the last round; their earlier agreements are void."""
        return tuple(dict.fromkeys(asked.group for asked in [*self.granted("formed"), *self.granted("dissolved")]))

    @property
    def keys(self) -> set[Key]:
        """Keys of facts changed by missions and formations."""
        missions = [asked for asked in self.granted("given") if asked.act is Act.MISSION]
        has = {(HAS_MISSION, asked.group) for asked in missions}
        has |= {("given", f"{asked.group}.{asked.argument}") for asked in missions}
        return has | {("formed", group) for group in self.renewed}

    # Transitions ---------------------------------------------------------------------------------

    def assign(self, asked: Request, yielding: frozenset[str] = NOBODY) -> View:
        """Assign a role; without vacancy, displace its holders if all are absent or ``yielding``."""
        view, place = self, (asked.group, asked.role)
        organisation, outcome = view.organisation.assign(asked.assignee, *place)
        holders = view.organisation.members(*place)
        if outcome is Outcome.NO_ROOM and (self.now.absent | yielding).issuperset(holders):
            for name in holders:
                view = view.leave(Request(asked.issuer, Act.RELEASE, *place, name))
            organisation, outcome = view.organisation.assign(asked.assignee, *place)
        return view if outcome is not Outcome.SUCCESS else replace(view, organisation=organisation).note(asked, outcome)

    def leave(self, asked: Request) -> View:
        """Release a role."""
        organisation, outcome = self.organisation.leave_role(asked.assignee, asked.group, asked.role)
        return replace(self, organisation=organisation).note(asked, outcome)

    def do(self, asked: Request, age: Age | None = None, yielding: frozenset[str] = NOBODY) -> View:
        """Assign or release a role; a leader's term begins or ends at ``age``, if given."""
        plays = asked.act is not Act.RELEASE
        view = self.assign(asked, yielding) if plays else self.leave(asked)
        if age is None or view.organisation is self.organisation or not self.is_head(asked):
            return view
        return replace(view, leadership=view.leadership.change(asked.group, asked.assignee, plays, age))

    def overrule(self, asked: Request, age: Age) -> View:
        """Assign or release a role as of ``age``, unless a newer request is valid."""
        if self.newest.get(asked.about, age) > age:
            return self
        return replace(self, newest={**self.newest, asked.about: age}).do(asked)

    def note(self, asked: Request, outcome: Outcome) -> View:
        """Append the outcome of a request, unless already fulfilled."""
        return self if outcome in UNCHANGED else replace(self, rulings=(*self.rulings, Ruling(asked, outcome)))

    def refuse(self, request: DatedRequest, outcome: Outcome) -> View:
        """Mark a request as unauthorised."""
        return replace(self, unlawful=self.unlawful | {request.age}).note(request.asked, outcome)
