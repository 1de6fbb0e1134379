"""Authority: who may change what in an organisation, decided by one pure function.

The rules, in the order in which they are asked (REMORAS, section IV.B; Ferber, Gutknecht, Michel 2003):

1. Group and role exist.
2. The issuer is a member of the group. A group's mission comes from its own head or from one that supervises it.
3. Who leads or gives out has the social layer. A plain vehicle follows what the head of its group tells it.
4. The issuer leads the group, or plays a role that has authority over the one in question. Members have the
   authorities besides that the strategy declares. Everybody may leave roles of its own.
5. The assignee is a member of the group, is able, plays no role that is incompatible with this one, plays the role that
   this one is to be played with, and takes jobs where the role has one.
6. A group with ``formed_by`` is formed at sea by who leads the group that this names, and dissolved by who leads
   either. These give its roles to members of both. Nobody forms or dissolves any other group.
7. The role has room. Holders that are absent make room.

A vehicle knows only what it has heard, so the same request may be refused by one and granted by another. It counts who
led when the request was made: whoever decides passes that as ``leads``.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from enum import Enum

from remoras.activities import Objective
from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, Outcome, RoleSpecification
from remoras.work import Job, is_ever_able

NOBODY: frozenset[str] = frozenset()


class Act(Enum):
    """What an issuer wants to change."""

    ASSIGN = "assign"
    RELEASE = "release"
    OBJECTIVE = "objective"
    MISSION = "mission"
    SUCCEED = "succeed"
    CREATE = "create"
    DISSOLVE = "dissolve"


class Authority(Enum):
    """What members may change that do not lead their group, by declaration of the strategy; roles with a job alone."""

    TAKE = "take"
    """A member with the social layer takes a role itself, and says what it is for."""
    RECRUIT = "recruit"
    """The same, and it gives such roles to other members with the social layer, and takes them back."""
    FOLLOW = "follow"
    """Any member takes the next role of what was agreed before the mission."""


CONSULTING = frozenset({Authority.TAKE, Authority.RECRUIT})
"""Authorities by which vehicles divide jobs among themselves; those without the social layer have no part in it."""


@dataclass(frozen=True, slots=True)
class Request:
    """What ``issuer`` wants to change.

    Attributes:
        issuer: name of the vehicle; empty for what was agreed before the mission.
        act: kind of change.
        group: that is changed.
        role: of the group; empty for changes of the group itself.
        assignee: who is to play the role, or no longer; the issuer itself where it succeeds.
        objective, argument: what the role is for; of a mission the argument is its name.
    """

    issuer: str
    act: Act
    group: str
    role: str = ""
    assignee: str = ""
    objective: str = ""
    argument: str = ""

    @property
    def about(self) -> tuple[str, ...]:
        """What it speaks of: of several requests about the same the newest counts."""
        if self.act is Act.OBJECTIVE:
            return self.group, self.role, f"objective {self.objective}"
        if self.act in (Act.CREATE, Act.DISSOLVE):
            return self.group, "formation"
        return (self.group, self.role, self.assignee) if self.role else (self.group, "mission", self.argument)

    def __str__(self) -> str:
        words = {
            Act.ASSIGN: f"{self.assignee} as {self.role} of {self.group}",
            Act.RELEASE: f"{self.assignee} no longer as {self.role} of {self.group}",
            Act.OBJECTIVE: f"{self.objective} {self.argument} for {self.role} of {self.group}",
            Act.MISSION: f"{self.argument} for {self.group}",
            Act.SUCCEED: f"itself as head of {self.group}",
            Act.CREATE: f"to form {self.group} under {self.assignee}",
        }
        return words.get(self.act, f"to {self.act.value} {self.group}")


EVENTS = {
    Act.ASSIGN: "assigned",
    Act.SUCCEED: "assigned",
    Act.RELEASE: "left",
    Act.CREATE: "formed",
    Act.DISSOLVE: "dissolved",
}
"""What has happened once a request is granted, in a word; for all others it is "given"."""


@dataclass(frozen=True, slots=True)
class Ruling:
    """What became of a request."""

    asked: Request
    outcome: Outcome

    @property
    def event(self) -> str:
        """In a word: assigned, left, given, formed, dissolved or refused."""
        if self.outcome is not Outcome.SUCCESS:
            return "refused"
        return EVENTS.get(self.asked.act, "given")

    def repeats(self, objectives: Mapping[tuple[str, str, str], Objective]) -> bool:
        """True if it gives a role an objective that it has, by the ``objectives`` of roles by group, role and name."""
        known = objectives.get((self.asked.group, self.asked.role, self.asked.objective))
        return self.event == "given" and known is not None and known.argument == self.asked.argument


@dataclass(frozen=True)
class Rules:
    """What the whole fleet knows before the mission of who may change what.

    Attributes:
        database: static data of all vehicles.
        authorities: that the strategy declares.
        jobs: of the mission, by name.
        supervisors: groups whose heads give a group its mission, by its name.
        at_sea: groups that are formed at sea, by name.
    """

    database: AUVDatabase
    authorities: frozenset[Authority] = frozenset()
    jobs: Mapping[str, Job] = field(default_factory=dict)
    supervisors: Mapping[str, Collection[str]] = field(default_factory=dict)
    at_sea: Mapping[str, Group] = field(default_factory=dict)

    def former(self, group: str) -> str | None:
        """Name of the group whose head forms a group at sea; None for groups that are founded before the mission."""
        return self.at_sea[group].formed_by if group in self.at_sea else None

    @property
    def apart(self) -> frozenset[str]:
        """Vehicles that have no part where the others divide jobs among themselves: they have no social layer."""
        if self.authorities.isdisjoint(CONSULTING):
            return NOBODY
        return frozenset(name for name, data in self.database.items() if not data.social_layer)

    def is_able(self, vehicle: str, group: str, role: RoleSpecification) -> bool:
        """True if the vehicle can play the role, has the social layer to lead by it, and what its job takes."""
        data = self.database[vehicle]
        job = self.jobs.get(role.job) if role.job is not None else None
        leads = data.social_layer or not role.head
        return data.can_play(group, role.name) and leads and (job is None or is_ever_able(job, data))


def may_assign(
    asked: Request,
    organisation: Organisation,
    rules: Rules,
    leads: Callable[[str, str], bool] | None = None,
    absent: Collection[str] = NOBODY,
    unavailable: Collection[str] = NOBODY,
) -> Outcome:
    """``Outcome.SUCCESS`` if a request may be granted, else why it is refused; nothing is changed.

    Args:
        asked: the request.
        organisation: as whoever decides knows it.
        rules: that hold for the whole fleet.
        leads: says of a vehicle and a group whether it led it when it asked; as the organisation has it if None.
        absent: vehicles that make room for others.
        unavailable: vehicles that take no jobs.
    """
    led = leads if leads is not None else lambda vehicle, group: vehicle in organisation.heads(group)
    return (
        _unknown(asked, organisation, rules)
        or _unauthorised(asked, organisation, rules, led, absent)
        or _unfit(asked, organisation, rules, absent, unavailable)
        or Outcome.SUCCESS
    )


def _unknown(asked: Request, organisation: Organisation, rules: Rules) -> Outcome | None:
    group = organisation.groups.get(asked.group)
    if asked.act is Act.CREATE:
        if group is not None:
            return Outcome.ALREADY_GROUP
        return None if asked.group in rules.at_sea else Outcome.NOT_GROUP
    if group is None:
        return Outcome.NOT_GROUP
    named = asked.act in (Act.MISSION, Act.DISSOLVE) or not group.roles or group.role(asked.role) is not None
    return None if named else Outcome.NOT_ROLE


def _unauthorised(
    asked: Request,
    organisation: Organisation,
    rules: Rules,
    led: Callable[[str, str], bool],
    absent: Collection[str],
) -> Outcome | None:
    me, group, has_social_layer = asked.issuer, asked.group, rules.database[asked.issuer].social_layer
    former = rules.former(group)
    forms = former is not None and led(me, former)
    if asked.act is Act.CREATE:
        may = forms
    elif asked.act is Act.DISSOLVE:
        may = forms or (former is not None and led(me, group))
    elif asked.act is Act.MISSION:
        may = forms or any(led(me, led_group) for led_group in (group, *rules.supervisors.get(group, ())))
    elif led(me, group) or (forms and asked.act is not Act.SUCCEED):
        may = True
    elif not organisation.is_member(me, group):
        return Outcome.OUTSIDE
    elif asked.act is Act.SUCCEED:
        may = bool(organisation.groups[group].succession)
    else:
        may = _is_declared(asked, organisation, rules, absent)
        has_social_layer |= may and rules.authorities.isdisjoint(CONSULTING)
        may |= _has_link(asked, organisation)
    is_own = asked.assignee == me
    if is_own and asked.act is Act.RELEASE:
        return None
    if not has_social_layer:
        return Outcome.NO_SOCIAL_LAYER
    return None if may and (is_own or asked.act is not Act.SUCCEED) else Outcome.NO_AUTHORITY


def _has_link(asked: Request, organisation: Organisation) -> bool:
    """True if the issuer plays a role that has authority over the one in question, as the specification says."""
    group = organisation.groups[asked.group]
    held = (group.role(role.role) for role in organisation.roles_of(asked.issuer, asked.group))
    return any(role is not None and asked.role in role.authority for role in held)


def _is_declared(asked: Request, organisation: Organisation, rules: Rules, absent: Collection[str]) -> bool:
    """True if a member that does not lead has the authority by declaration."""
    role = organisation.groups[asked.group].role(asked.role)
    if role is None or role.job is None or not rules.authorities:
        return False
    recruits, other = Authority.RECRUIT in rules.authorities, asked.assignee
    if asked.act is Act.OBJECTIVE:
        return recruits or organisation.plays(asked.issuer, asked.group, asked.role)
    if other == asked.issuer:
        return True
    in_its_place = asked.act is Act.RELEASE and other in absent
    return in_its_place or (recruits and rules.database[other].social_layer)


def _unfit(
    asked: Request, organisation: Organisation, rules: Rules, absent: Collection[str], unavailable: Collection[str]
) -> Outcome | None:
    if asked.act not in (Act.ASSIGN, Act.SUCCEED, Act.CREATE):
        return None
    vehicle, group, former = asked.assignee, asked.group, rules.former(asked.group)
    role = (rules.at_sea if asked.act is Act.CREATE else organisation.groups)[group].role(asked.role)
    if role is None:
        return None
    comes_in = former is not None and organisation.is_member(vehicle, former)
    if asked.act is not Act.SUCCEED and not comes_in and not organisation.is_member(vehicle, group):
        return Outcome.NOT_OF_GROUP
    if not rules.is_able(vehicle, group, role):
        return Outcome.UNABLE
    if asked.act is Act.SUCCEED:
        return None  # the old head gives way
    if organisation.is_excluded(vehicle, role):
        return Outcome.EXCLUDED
    if role.played_by is not None and not organisation.plays(vehicle, *role.played_by):
        return Outcome.INCOMPATIBLE
    if role.job is not None and vehicle in unavailable:
        return Outcome.UNAVAILABLE
    holders = organisation.members(group, role.name)
    is_full = role.maximum is not None and len(holders) >= role.maximum and vehicle not in holders
    return Outcome.NO_ROOM if is_full and not set(holders) <= set(absent) else None
