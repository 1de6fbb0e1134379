"""HTN tasks of mission mapping, and the work that is left unfinished.

A vehicle that is called weighs what answering can change. A mission whose goal is not reached is not complete, however
early its groups meet: the head waits for who has work to do, or all meet in vain. So as long as a vehicle does not know
that enough is mapped and every find is inspected, the behaviours of the meeting answer no call. Otherwise vehicles that
wait would call others off work that nobody else does.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Iterable, Mapping
from functools import partial
from typing import Any

from missions.mapping.detections import INSPECTING
from missions.mapping.jobs import SurveyJob
from missions.mapping.sensors import swath_m
from missions.meeting.meeting import MEET, Meeting
from missions.meeting.orders import entrusted, expected_of
from remoras.activities import Objective
from remoras.behaviours import IDLE, Behaviour, Perception, Reference, awaited
from remoras.beliefs import Beliefs, Known
from remoras.database import VehicleData
from remoras.htn import ANY, Domain, Expected, FactsLike, Method, Operator, Task
from remoras.mission import ALLOCATE_ROLES, ASSIGN_OBJECTIVE, DISSOLVE_GROUP, FORM_GROUP, GIVE_MISSION, PURSUE, Finding
from remoras.motion import Motion
from remoras.nesting import supervised_by
from remoras.organisation import Group, Organisation
from remoras.picture import Picture
from remoras.work import Job

EXPLORING = "objectiveExploring"
"""The fact that gives a role an area."""
MOST_ANEW = 3
"""So often an area is given anew; what is reported in spite of that is believed."""


def is_to_be_inspected(facts: FactsLike, find: str) -> bool:
    """True while a find is known and not known to be inspected."""
    return facts.get(("foundAt", find)) is not None and facts.get(("inspectedBy", find)) is None


def given_anew(
    group: Group,
    organisation: Organisation,
    surveys: Mapping[str, SurveyJob],
    meeting: Meeting,
    beliefs: Beliefs,
    picture: Picture,
) -> list[Finding]:
    """Orders for areas of a group that are held or said to be done, and of which not all cells are known to be mapped.

    Whoever is done with an area knows all its cells, and tells them when it meets the others. So half the patience
    after a meeting that shows the job unfinished the report counts no longer, whoever has heard it; who holds an area
    and does not do it may know by a report that the head has not heard that it is done. After ``MOST_ANEW`` times a
    report is believed: it may be that some cells cannot be mapped, or be heard of.

    Args:
        group: whose head asks; organisation: without the absent.
        surveys: of all areas, by name.
        meeting: of all groups.
        beliefs: of the head; picture: what else it knows.
    """
    met_s = meeting.met_s(group, beliefs, picture)
    if met_s is None or picture.body.now_s - met_s < meeting.patience_s / 2.0:
        return []
    found = []
    for role in group.roles:
        job, path = surveys.get(role.job or ""), group.path(role.name)
        given_s = beliefs.observed_s((EXPLORING, path))
        if job is None or (given_s or 0.0) > met_s:
            continue
        if not beliefs.values(job.done) and not organisation.members(group.name, role.name):
            continue
        if job.left(beliefs).bits and beliefs.n_over(job.done) < MOST_ANEW:
            found.append(Finding(path, EXPLORING, job.name))
    return found


def is_open_again(group: Group, surveys: Mapping[str, SurveyJob], beliefs: Beliefs) -> bool:
    """True while an area of a group that was given anew is not known to be done; arguments as of ``given_anew``."""
    jobs = (surveys[role.job] for role in group.roles if role.job is not None and role.job in surveys)
    again = (job for job in jobs if beliefs.n_over(job.done))
    return any(not beliefs.values(job.done) and job.left(beliefs).bits for job in again)


def is_alone_with_work(
    group: Group, organisation: Organisation, surveys: Mapping[str, SurveyJob], beliefs: Beliefs
) -> bool:
    """True while a head has nobody left in its group, and areas of it are not known to be done.

    Losses may bring a silence of a lease about: whom it takes for absent may be at work, and would stop if it met.
    """
    if set(organisation.members(group.name)).difference(organisation.heads(group.name)):
        return False
    jobs = (surveys[role.job] for role in group.roles if role.job is not None and role.job in surveys)
    return any(not beliefs.values(job.done) and job.left(beliefs).bits for job in jobs)


class Unfinished:
    """Whether a vehicle knows that the goal is reached.

    Args:
        surveys: of all areas.
        goal: share of their cells.
        finds: names of what may be found.
    """

    def __init__(self, surveys: Iterable[SurveyJob], goal: float, finds: Collection[str]) -> None:
        self._surveys = list(surveys)
        n_cells = sum(job.on.work.bit_count() for job in self._surveys)
        self._n_spared = n_cells - goal * n_cells
        self._finds = tuple(finds)
        self._n_told = -1
        self._holds = True

    def holds(self, facts: Known) -> bool:
        """True while more is left than the goal spares, as far as is known."""
        if self._n_told != facts.n_told:
            self._n_told, self._holds = facts.n_told, self.is_work_left(facts)
        return self._holds

    def answers(self, group: str, picture: Picture) -> float:
        """How much of a call to a group's meeting is settled by coming to it: nothing before the goal is reached."""
        return 0.0 if self.holds(picture.facts) else awaited(group, picture)

    def settled(self, found: Perception, facts: Known) -> float:
        """How much of a call the behaviour of the meeting settles that has perceived this: nothing before then."""
        return 0.0 if self.holds(facts) else found.settled

    def is_work_left(self, facts: Known) -> bool:
        """The same of any vehicle's knowledge; nothing is remembered of it."""
        if any(facts.values(("foundAt", find)) and not facts.values(("inspectedBy", find)) for find in self._finds):
            return True
        n_left = 0
        for job in self._surveys:
            n_left += 0 if facts.values(job.done) else job.left(facts).bits.bit_count()
            if n_left > self._n_spared:
                break
        return n_left > self._n_spared


class AfterWork(Behaviour):
    """A behaviour of the meeting, which answers no call while the goal is not reached.

    Args:
        meeting: the behaviour itself.
        unfinished: says so.
    """

    def __init__(self, meeting: Behaviour, unfinished: Unfinished) -> None:
        self._meeting = meeting
        self._unfinished = unfinished
        self._found = self._perceived = IDLE  # when it was due last, and what was made of that

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """As the behaviour itself, but for the calls that it answers where it is due."""
        found = self._meeting.perceive(motion, picture, performed)
        if found.stimulus <= 0.0:
            return found
        if found != self._found:
            self._found, answers = found, partial(self._unfinished.settled, found, picture.facts)
            self._perceived = found._replace(answers=answers)
        return self._perceived

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """As the behaviour itself."""
        return self._meeting.reference(motion, picture)

    def accuracy_m(self, motion: Motion, picture: Picture) -> float:
        """As the behaviour itself."""
        return self._meeting.accuracy_m(motion, picture)


MISSIONS = SUPERVISION, AREA_MAPPING = "Supervision", "AreaMapping"
INSPECTION = "Inspection"
"""Mission of a group that is formed at sea; a scenario gives it to none."""
EXPLORE = "Explore"
"""Task of a group, one of its roles and the role's area."""
HAVE_INSPECTED = "HaveInspected"
"""Task of a group that is formed at sea: to be there as long as there is something to inspect."""


def social_domain(
    groups: Mapping[str, Group],
    meeting: Meeting,
    jobs: Mapping[str, Job],
    finds: Collection[str],
) -> Domain:
    """Missions of groups into orders.

    Args:
        groups: by name; meeting: of the groups.
        jobs: by name.
        finds: names of those of them that may be found.
    """

    def orders(group: str, role: str) -> list[Task]:
        of = groups[group].role(role)
        area = None if of is None else of.job
        names = () if area is None else ("Positioning", "Exploring")
        return [Task(ASSIGN_OBJECTIVE, (group, role, name, area)) for name in names]

    methods = {SUPERVISION: supervision_methods(groups), AREA_MAPPING: mapping_methods(groups, finds)}
    if any(group.formed_by is not None for group in groups.values()):
        methods |= {INSPECTION: inspection_methods(groups, finds), HAVE_INSPECTED: forming_methods(groups, finds)}
    return Domain.of(
        meeting.operators(jobs, "Exploring"),
        {**methods, EXPLORE: entrusted(orders), **meeting.methods()},
    )


def supervision_methods(groups: Mapping[str, Group]) -> list[Method]:
    """Supervision: the groups that are supervised get their missions, then the own group meets.

    Groups that supervise others get supervision too, the rest mapping.

    Args:
        groups: by name.
    """
    supervised = supervised_by(group for group in groups.values() if group.formed_by is None)

    def delegate(facts: FactsLike, group: str) -> list[Task]:
        return [
            *(
                Task(GIVE_MISSION, (name, SUPERVISION if supervised[name] else AREA_MAPPING))
                for name in supervised[group]
            ),
            Task(MEET, (group,)),
        ]

    return [Method("delegate the mapping", delegate, uses=(GIVE_MISSION, MEET))]


def mapping_methods(by_name: Mapping[str, Group], finds: Collection[str]) -> list[Method]:
    """AreaMapping: roles are allocated, every area is explored and every find inspected, then the group meets.

    Args:
        by_name: groups with their roles.
        finds: names of what may be found; a plan rests on what has been.
    """

    def unfinished(facts: FactsLike, group: Group) -> list[tuple[str, str]]:
        return [
            (role.name, role.job)
            for role in group.roles
            if role.job is not None and role.job not in finds and facts.get(("areaDone", role.job)) is None
        ]

    def has_work(facts: FactsLike, group: str) -> bool:
        to_do = unfinished(facts, by_name[group]), waiting(facts, by_name[group], finds)  # a plan rests on all of them
        return any(to_do)

    def inspected(group: str) -> list[Task]:
        return [Task(HAVE_INSPECTED, (formed.name,)) for formed in by_name.values() if formed.formed_by == group]

    def together(facts: FactsLike, group: str) -> bool:
        return facts.get(("gatheredAt", group)) is not None

    def explore(facts: FactsLike, group: str) -> list[Task]:
        explored = [Task(EXPLORE, (group, name, area)) for name, area in unfinished(facts, by_name[group])]
        mapped = [
            Task(ASSIGN_OBJECTIVE, (group, role.name, "Mapping", group))
            for role in by_name[group].roles
            if not role.founding and role.job is None
        ]
        return [Task(ALLOCATE_ROLES, (group,)), *explored, *mapped, *inspected(group), Task(MEET, (group,))]

    forming = (HAVE_INSPECTED,) if any(group.formed_by is not None for group in by_name.values()) else ()
    return [
        Method("stay together", lambda facts, group: inspected(group), together, forming),
        Method("explore, then meet", explore, has_work, (ALLOCATE_ROLES, EXPLORE, ASSIGN_OBJECTIVE, MEET, *forming)),
        Method("meet", lambda facts, group: [*inspected(group), Task(MEET, (group,))], uses=(MEET, *forming)),
    ]


def waiting(facts: FactsLike, group: Group, finds: Collection[str]) -> list[str]:
    """What is found and not inspected of that which roles of a group inspect."""
    return [role.job for role in group.roles if role.job and role.job in finds and is_to_be_inspected(facts, role.job)]


def inspection_methods(by_name: Mapping[str, Group], finds: Collection[str]) -> list[Method]:
    """Inspection: members are recruited, and roles allocated among them, whenever something is found or inspected.

    Args:
        by_name: groups with their roles.
        finds: names of what may be found.
    """

    def has_work(facts: FactsLike, group: str) -> bool:
        return bool(waiting(facts, by_name[group], finds))

    return [
        Method("inspect", lambda facts, group: [Task(ALLOCATE_ROLES, (group,))], has_work, (ALLOCATE_ROLES,)),
        Method("all is inspected", lambda facts, group: [], uses=()),
    ]


def forming_methods(by_name: Mapping[str, Group], finds: Collection[str]) -> list[Method]:
    """HaveInspected: a group is formed once something is found, given its mission, and dissolved once all is inspected.

    Where nobody of it is there any more it is dissolved too, to be formed anew of others.

    Args:
        by_name: groups with their roles.
        finds: names of what may be found.
    """

    def is_there(facts: FactsLike, group: str) -> bool:
        return bool(facts.get(("formed", group)))

    def has_work(facts: FactsLike, group: str) -> bool:
        return bool(waiting(facts, by_name[group], finds))

    def is_needed(facts: FactsLike, group: str) -> bool:
        return not is_there(facts, group) and has_work(facts, group)

    def is_over(facts: FactsLike, group: str) -> bool:
        if not is_there(facts, group):
            return False
        paths = [by_name[group].path(role.name) for role in by_name[group].roles if role.founding]
        holders = [facts.get(("members", path)) for path in paths]  # a plan rests on all of them
        return not has_work(facts, group) or not any(holders)

    def mission(facts: FactsLike, group: str) -> list[Task]:
        return [Task(GIVE_MISSION, (group, INSPECTION))]

    return [
        Method("form a group", lambda facts, group: [Task(FORM_GROUP, (group,))], is_needed, (FORM_GROUP,)),
        Method("dissolve it", lambda facts, group: [Task(DISSOLVE_GROUP, (group,))], is_over, (DISSOLVE_GROUP,)),
        Method("let it inspect", mission, is_there, (GIVE_MISSION,)),
        Method("nothing to inspect", lambda facts, group: [], uses=()),
    ]


def activity_domain(jobs: Mapping[str, Job]) -> Domain:
    """Objectives into activities; every task has the objective and the data of its vehicle as arguments.

    ==================  ====================  ==========================  ============================
    elementary task     test                  effect                      expected
    ==================  ====================  ==========================  ============================
    ZigzagExploring     a mapping sensor      the area is explored        way and work, as of its job
    Inspecting          the find is known     it is inspected             way and work, as of its job
    Mapping             a mapping sensor      the group has met           nobody can tell
    Positioning         none                  none: it goes on            nobody can tell
    ==================  ====================  ==========================  ============================

    Args:
        jobs: of the mission, by name.
    """

    def has_sensor(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        return swath_m(data) > 0.0

    def apart(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        return has_sensor(facts, objective, data) and facts.get(("gatheredAt", objective.group)) is None

    def explorable(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        return apart(facts, objective, data) and facts.get(("areaDone", objective.argument)) is None

    def inspectable(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        return apart(facts, objective, data) and is_to_be_inspected(facts, objective.argument)

    def is_found(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        return facts.get(("foundAt", objective.argument)) is not None

    def done(facts: FactsLike, objective: Objective, data: VehicleData) -> Mapping[Hashable, Any]:
        return {jobs[objective.argument].done: ANY}

    def met(facts: FactsLike, objective: Objective, data: VehicleData) -> Mapping[Hashable, Any]:
        return {("gatheredAt", objective.group): ANY}

    def job(facts: FactsLike, objective: Objective, data: VehicleData) -> Expected | None:
        return expected_of(jobs[objective.argument], data, facts.get(("position", data.name)) or data.start_m)

    def unknown(facts: FactsLike, objective: Objective, data: VehicleData) -> None:
        return None

    def either(name: str, activity: str, when: Callable[..., bool], otherwise: str) -> list[Method]:
        return [
            Method(name, lambda facts, *args: [Task(activity, args)], when, (activity,)),
            Method(otherwise, lambda facts, *args: [], lambda facts, *args: not when(facts, *args), ()),
        ]

    return Domain.of(
        [
            Operator("ZigzagExploring", has_sensor, done, expected=job),
            Operator("Inspecting", is_found, done, expected=job),
            Operator("Mapping", has_sensor, met, expected=unknown),
            Operator("Positioning", expected=unknown, lasts=True),
        ],
        {
            f"{PURSUE}Exploring": either("zigzag", "ZigzagExploring", explorable, "nothing left to explore"),
            f"{PURSUE}Mapping": either("map what is explored", "Mapping", apart, "nothing left to map"),
            f"{PURSUE}{INSPECTING}": either("closer pass", "Inspecting", inspectable, "nothing to inspect"),
            f"{PURSUE}Positioning": [
                Method("take place", lambda facts, *args: [Task("Positioning", args)], uses=("Positioning",))
            ],
        },
    )
