"""Authority: permission to change an organisation, decided by one pure function.

The rules in order of evaluation (REMORAS, section IV.B; Ferber, Gutknecht, Michel 2003):

1. Group and role exist.
2. The issuer is a member of the group. A mission comes from the leader of the group or of one that supervises it.
3. Leaders and assigning vehicles have the social layer. A plain vehicle follows its group leader.
4. The issuer leads the group, plays a role with authority over the one in question, or has an authority that the
   strategy declares. Every vehicle may leave its own roles.
5. The assignee is a member, is able, plays the coupled role, no incompatible one, and takes jobs if the role has one.
6. A group with ``formed_by`` is formed at run time by the leader of that group and dissolved by the leader of either.
   Both assign its roles to members of both. No other group is formed or dissolved.
7. The role has a vacancy. Absent holders can be displaced.

A vehicle knows only received facts, so one may refuse a request that another grants. Leadership at the time of the
request counts: the caller passes it as ``leads``.
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
    """Kind of change that an issuer requests."""

    ASSIGN = "assign"
    RELEASE = "release"
    OBJECTIVE = "objective"
    MISSION = "mission"
    SUCCEED = "succeed"
    CREATE = "create"
    DISSOLVE = "dissolve"


class Authority(Enum):
    """Rights of members that do not lead, declared by the strategy; only for roles with a job."""

    TAKE = "take"
    """A member with the social layer takes a role itself and gives it objectives."""
    RECRUIT = "recruit"
    """As ``TAKE``; it also assigns and releases such roles of other members with social layer."""
    FOLLOW = "follow"
    """Any member takes its next role of the plan agreed before the mission."""


CONSULTING = frozenset({Authority.TAKE, Authority.RECRUIT})
"""Authorities to divide jobs among vehicles; those without the social layer are excluded."""


@dataclass(frozen=True, slots=True)
class Request:
    """Change of the organisation that a vehicle requests.

    ``issuer`` is empty for agreements before the mission, ``role`` for changes of the group itself. The ``assignee``
    gets or loses the role, or claims to lead. ``argument`` is that of the objective; for a mission its name.
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
        """Subject of the request: the newest request about a subject is valid."""
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
"""Event names of granted requests; "given" for all others."""


@dataclass(frozen=True, slots=True)
class Ruling:
    """Outcome of a request."""

    asked: Request
    outcome: Outcome

    @property
    def event(self) -> str:
        """Event name: assigned, left, given, formed, dissolved or refused."""
        if self.outcome is not Outcome.SUCCESS:
            return "refused"
        return EVENTS.get(self.asked.act, "given")

    def repeats(self, objectives: Mapping[tuple[str, str, str], Objective]) -> bool:
        """Return whether it gives a role an objective that ``objectives`` already has."""
        known = objectives.get((self.asked.group, self.asked.role, self.asked.objective))
        return self.event == "given" and known is not None and known.argument == self.asked.argument


@dataclass(frozen=True)
class Rules:
    """Rules of the fleet: groups ``at_sea`` form at run time; ``supervisors`` give missions."""

    database: AUVDatabase
    authorities: frozenset[Authority] = frozenset()
    jobs: Mapping[str, Job] = field(default_factory=dict)
    supervisors: Mapping[str, Collection[str]] = field(default_factory=dict)
    at_sea: Mapping[str, Group] = field(default_factory=dict)

    def former(self, group: str) -> str | None:
        """Return the group whose leader forms this group at run time; None for a founding group."""
        return self.at_sea[group].formed_by if group in self.at_sea else None

    @property
    def apart(self) -> frozenset[str]:
        """Vehicles excluded from dividing jobs, because they lack the social layer."""
        if self.authorities.isdisjoint(CONSULTING):
            return NOBODY
        return frozenset(name for name, data in self.database.items() if not data.social_layer)

    def is_able(self, vehicle: str, group: str, role: RoleSpecification) -> bool:
        """Return whether the vehicle can play the role, lead by it if required, and do its job."""
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
    """Return ``Outcome.SUCCESS`` if a request may be granted, else the reason for refusal.

    The ``absent`` can be displaced, the ``unavailable`` take no jobs; ``leads`` is as of the request, else as now.
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
        # A vehicle that follows the agreed plan consults no peer, so it needs no social layer.
        has_social_layer |= may and rules.authorities.isdisjoint(CONSULTING)
        may |= _has_link(asked, organisation)
    is_own = asked.assignee == me
    if is_own and asked.act is Act.RELEASE:
        return None
    if not has_social_layer:
        return Outcome.NO_SOCIAL_LAYER
    return None if may and (is_own or asked.act is not Act.SUCCEED) else Outcome.NO_AUTHORITY


def _has_link(asked: Request, organisation: Organisation) -> bool:
    """Return whether the issuer plays a role with specified authority over this one."""
    group = organisation.groups[asked.group]
    held = (group.role(role.role) for role in organisation.roles_of(asked.issuer, asked.group))
    return any(role is not None and asked.role in role.authority for role in held)


def _is_declared(asked: Request, organisation: Organisation, rules: Rules, absent: Collection[str]) -> bool:
    role = organisation.groups[asked.group].role(asked.role)
    if role is None or role.job is None or not rules.authorities:
        return False
    recruits, other = Authority.RECRUIT in rules.authorities, asked.assignee
    if asked.act is Act.OBJECTIVE:
        return recruits or organisation.plays(asked.issuer, asked.group, asked.role)
    if other == asked.issuer:
        return True
    # An absent vehicle cannot release its role itself.
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
        return None  # the previous leader is displaced
    if organisation.is_excluded(vehicle, role):
        return Outcome.EXCLUDED
    if role.played_by is not None and not organisation.plays(vehicle, *role.played_by):
        return Outcome.INCOMPATIBLE
    if role.job is not None and vehicle in unavailable:
        return Outcome.UNAVAILABLE
    holders = organisation.members(group, role.name)
    # A holder that gets its role again needs no vacancy.
    is_full = role.maximum is not None and len(holders) >= role.maximum and vehicle not in holders
    return Outcome.NO_ROOM if is_full and not set(holders) <= set(absent) else None
