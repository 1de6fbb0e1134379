"""View: what counts of the organisation, as one vehicle knows it. An immutable value, folded round by round.

A view follows from the one before it, from what was stated since, and from whom the vehicle takes for absent
(``remoras.social.consultation``). It records nothing, sends nothing and reads no clock.

Availability: which vehicles take jobs, by what each of them says of itself. An immutable value.

A vehicle that is cut off or has resigned takes none, until it says that it does again; one whose sensors yield nothing
takes none for which it needs them. What was given to it before it said so stays with it until it leaves that. So it is
a function of what was said, whatever was heard first: the order, or that its assignee takes none.

Role holders: who holds a role with a job or with room for few, by all that was said of it, whatever was heard first.

An assignment finds room or waits. When a holder leaves, the newest of those that wait is let in, for want of newer
word: what is said later takes the room from it, and it waits again. Where heads alone give out jobs, holders that have
theirs from before a head led, or began anew, make room for whom it names: it may know nothing of what was told before,
and nobody would do what it gives out again. So this is a function of what was said and of no order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from remoras.activities import Objective
from remoras.authority import NOBODY, Act, Request, Rules, Ruling
from remoras.beliefs import Key
from remoras.organisation import Group, Organisation, Outcome, RoleAssignment, RoleKey
from remoras.social.leadership import AGREED_BEFORE, Age, Claim, Leadership
from remoras.social.reports import takes_sensors
from remoras.social.requests import HAS_MISSION, DatedRequest

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


def holders_after(
    instructions: Iterable[Instruction],
    room: float,
    led_since: Callable[[Instruction], Age | None] = lambda instruction: None,
) -> tuple[set[str], list[str]]:
    """Who of at most ``room`` hold a role after all that was said of it, and who waits for room, the newest first.

    Args:
        instructions: in any order.
        room: for so many.
        led_since: since when the head that gave it has led: who holds the role from before makes room; or None.
    """
    holders: dict[str, bool] = {}  # with whether it was let in
    waiting: dict[str, Age] = {}
    given_at: dict[str, Age] = {}
    for instruction in sorted(instructions):
        age, gives, name = instruction
        waiting.pop(name, None)
        if gives:
            since = led_since(instruction)
            given_at[name] = age
            let_in = [holder for holder, was_let_in in holders.items() if was_let_in and holder != name]
            if name in holders or len(holders) < room:
                holders[name] = False
            elif let_in:
                del holders[let_in[0]]
                waiting[let_in[0]] = given_at[let_in[0]]
                holders[name] = False
            elif since is not None and all(
                given_at[holder] < since or is_of_earlier_life(given_at[holder], age) for holder in holders
            ):
                holders = {name: False}
            else:
                waiting[name] = age
        elif holders.pop(name, None) is not None and waiting:
            newest = max(waiting, key=lambda vehicle: waiting[vehicle])
            del waiting[newest]
            holders[newest] = True
    return set(holders), sorted(waiting, key=lambda vehicle: waiting[vehicle], reverse=True)


def is_of_earlier_life(before: Age, after: Age) -> bool:
    """True if whoever said the latter said the former before it began anew, and may know nothing of it."""
    return before[1] == after[1] and before[2] < after[2]


def is_limited(view: View, asked: Request) -> bool:
    """True if something is asked on which it depends who holds a role with a job or with room for few.

    Nobody waits for the role of a head that is succeeded: after it has left, the first in order claims the group.
    """
    group = view.group(asked.group)
    is_claimed = asked.role == group.head_role and bool(group.succession)
    if asked.act not in (Act.ASSIGN, Act.RELEASE) or is_claimed:
        return False
    role = group.role(asked.role)
    return role is not None and (role.maximum is not None or role.job is not None)


def yielding_to(view: View, asked: Request, age: Age) -> frozenset[str]:
    """Holders of a role that have it from before the issuer led, and make room for whom it names."""
    since = _led_since(view, asked, age)
    if since is None:
        return NOBODY
    holders = view.organisation.members(asked.group, asked.role)
    return frozenset(name for name in holders if view.stated(asked.group, asked.role, name) < since)


def settle(view: View, asked: Request, age: Age) -> View:
    """What is ``asked`` at ``age`` counts among all that was said of the role, and who holds it follows from that.

    If the vehicle in question does not get the role for now, it is noted why: it waits for room, or takes no jobs.
    """
    place = asked.group, asked.role
    holding, gives, stands = _reconciled(view, place), asked.act is Act.ASSIGN, _stands(view, asked, age)
    instructions, holders = dict(holding.instructions), holding.holders
    is_full = len(holders) >= _room(view, place) and asked.assignee not in holders
    if gives and stands and is_full and view.rules.authorities and holders <= view.now.absent:  # else heads say so
        for name in holders:
            instructions[Instruction(age, False, name)] = Request(asked.issuer, Act.RELEASE, *place, name)
    instructions[Instruction(age, gives, asked.assignee)] = asked
    view, follows, waiting = _follow(view, place, holding._replace(instructions=instructions), asked.issuer)
    for request in follows:
        view = view.do(request, age if request.about == asked.about else None)
    if asked.assignee in waiting:
        return view.note(asked, Outcome.NO_ROOM)
    if not stands:
        return view.note(asked, Outcome.UNAVAILABLE)
    is_outside = not follows and not view.organisation.is_member(asked.assignee, asked.group)
    return view.note(asked, Outcome.NOT_IN_GROUP) if is_outside else view


def renew(view: View, group: str, issuer: str) -> View:
    """Who holds the jobs of a group follows from all that was said of them, now that more is known.

    Args:
        view: as it is.
        group: its name.
        issuer: that has claimed it, or of which it is known anew whether it takes jobs.
    """
    jobs = {role.name for role in view.group(group).roles if role.job is not None}
    follows: list[Request] = []
    for place in [place for place in view.holdings if place[0] == group and place[1] in jobs]:
        view, more, _ = _follow(view, place, _reconciled(view, place), issuer)
        follows += more
    for request in follows:
        view = view.do(request)
    return view


def let_in(view: View) -> View:
    """Who waits plays a role for which there is room now, the newest first: holders may have left otherwise.

    Where vehicles divide jobs among themselves, holders that are absent may make room.
    """
    follows: list[Request] = []
    for place in sorted(place for place, holding in view.holdings.items() if holding.is_crowded):
        holding = _reconciled(view, place)
        view = replace(view, holdings={**view.holdings, place: holding})
        n_free = math.inf if view.rules.authorities else _room(view, place) - len(holding.holders)
        waiting = _after(view, place, holding.instructions)[1]
        follows += [_last_given(holding, name) for number, name in enumerate(waiting) if number < n_free]
    for request in follows:
        view = view.assign(request)
    return view


def _follow(view: View, place: RoleKey, holding: Holding, issuer: str) -> tuple[View, list[Request], list[str]]:
    """Releases and assignments by which those hold a role that are to, after all that was said of it; and who waits."""
    holders, waiting = _after(view, place, holding.instructions)
    after = Holding(holding.instructions, frozenset(holders), bool(waiting))
    follows = [Request(issuer, Act.RELEASE, *place, name) for name in sorted(holding.holders - holders)]
    follows += [_last_given(holding, name) for name in sorted(holders - holding.holders)]
    return replace(view, holdings={**view.holdings, place: after}), follows, waiting


def _after(view: View, place: RoleKey, instructions: Mapping[Instruction, Request]) -> tuple[set[str], list[str]]:
    """Who holds a role and who waits for room after all that counts of what was said of it."""
    counting = [instruction for instruction, asked in instructions.items() if _stands(view, asked, instruction.age)]
    return holders_after(counting, _room(view, place), lambda last: _led_since(view, instructions[last], last.age))


def _stands(view: View, asked: Request, age: Age) -> bool:
    """True unless the issuer, as is known now, led no more by then, or the assignee took no jobs."""
    if _is_for_heads(view, asked) and not view.leadership.led(asked.issuer, asked.group, age):
        return False
    return asked.act is not Act.ASSIGN or view.availability.takes(asked, view.group(asked.group), age, view.rules)


def _led_since(view: View, asked: Request, age: Age) -> Age | None:
    """Since when the issuer of an assignment has led, where heads alone give out the role; else None."""
    is_order = asked.act is Act.ASSIGN and _is_for_heads(view, asked)
    return view.leadership.since(asked.issuer, asked.group, age) if is_order else None


def _is_for_heads(view: View, asked: Request) -> bool:
    """True if heads alone may ask it: it gives out or takes back a role with a job that is another's."""
    role = view.group(asked.group).role(asked.role)
    is_own = asked.issuer in ("", asked.assignee) and asked.act is Act.RELEASE
    return bool(asked.issuer and role and role.job and not is_own and not view.rules.authorities)


def _room(view: View, place: RoleKey) -> float:
    role = view.group(place[0]).role(place[1])
    return math.inf if role is None or role.maximum is None else role.maximum


def _reconciled(view: View, place: RoleKey) -> Holding:
    """What was said of a role, with what has become of it by other ways, such as a claim to lead the group."""
    before, now = view.holdings.get(place, Holding({}, NOBODY)), frozenset(view.organisation.members(*place))
    instructions = dict(before.instructions)
    for name in sorted(before.holders ^ now):
        age = view.stated(*place, name)
        if name in now:
            instructions.setdefault(Instruction(age, True, name), Request("", Act.ASSIGN, *place, name))
        elif instructions.pop(Instruction(age, True, name), None) is None:
            instructions[Instruction(age, False, name)] = Request("", Act.RELEASE, *place, name)
    return Holding(instructions, now, before.is_crowded)


def _last_given(holding: Holding, name: str) -> Request:
    last = max(instruction for instruction in holding.instructions if instruction[1:] == (True, name))
    return holding.instructions[last]
