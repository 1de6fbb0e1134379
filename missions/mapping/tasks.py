"""HTN tasks of the mapping mission; rendezvous behaviours answer no call before a vehicle knows the goal as reached.

Otherwise waiting vehicles would call others away from work that remains undone.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Iterable, Mapping
from typing import Any

from missions.mapping.detections import INSPECTING
from missions.mapping.jobs import SurveyJob
from missions.mapping.sensors import swath_m
from missions.meeting.meeting import MEET, Meeting, entrusted, expected_of
from remoras.activities import Objective
from remoras.behaviours import IDLE, Behaviour, Perception, Reference
from remoras.beliefs import NOTHING_KNOWN, Beliefs, Known
from remoras.database import VehicleData
from remoras.group_hierarchy import supervised_by
from remoras.htn import ANY, Domain, Expected, FactsLike, Method, Operator, Task
from remoras.mission import ALLOCATE_ROLES, ASSIGN_OBJECTIVE, DISSOLVE_GROUP, FORM_GROUP, GIVE_MISSION, PURSUE, Finding
from remoras.motion import Motion
from remoras.organisation import Group, Organisation
from remoras.picture import Picture
from remoras.work import Job

EXPLORING = "objectiveExploring"
MOST_ANEW = 3  # most reassignments of an area; a later report of its completion is accepted


def is_to_be_inspected(facts: FactsLike, find: str) -> bool:
    """Return True while a find is known and not known to be inspected."""
    return facts.get(("foundAt", find)) is not None and facts.get(("inspectedBy", find)) is None


def given_anew(
    group: Group,
    organisation: Organisation,
    surveys: Mapping[str, SurveyJob],
    meeting: Meeting,
    unfinished: Unfinished,
    beliefs: Beliefs,
    picture: Picture,
) -> list[Finding]:
    """Return orders for areas assigned or reported done, but not known to be mapped some time after the rendezvous.

    None are due once enough cells are known to be mapped for the goal.
    """
    # A vehicle that finishes an area reports all its cells at the rendezvous, which takes a while.
    met_s = meeting.met_s(group, beliefs, picture)
    if met_s is None or picture.body.now_s - met_s < meeting.settings.patience_s / 2.0:
        return []
    if not unfinished.lacks_cells(beliefs, trusts_reports=False):
        return []
    orders = []
    for role in group.roles:
        job, path = surveys.get(role.job or ""), group.path(role.name)
        given_s = beliefs.observed_s((EXPLORING, path))
        # An area reassigned since the rendezvous has a holder under way.
        if job is None or (given_s or 0.0) > met_s:
            continue
        if not beliefs.values(job.done) and not organisation.members(group.name, role.name):
            continue
        # After ``MOST_ANEW`` orders the report is accepted: some cells may be impossible to map or to report.
        if job.left(beliefs).bits and beliefs.n_over(job.done) < MOST_ANEW:
            orders.append(Finding(path, EXPLORING, job.name))
    return orders


def open_surveys(group: Group, surveys: Mapping[str, SurveyJob], beliefs: Beliefs) -> list[SurveyJob]:
    """Return the surveys of the group's roles that are not known to be done."""
    jobs = [surveys[role.job] for role in group.roles if role.job is not None and role.job in surveys]
    return [job for job in jobs if not beliefs.values(job.done) and job.left(beliefs).bits]


def is_open_again(group: Group, surveys: Mapping[str, SurveyJob], beliefs: Beliefs) -> bool:
    """Return True while a reassigned area is not known to be done; see ``given_anew``."""
    return any(beliefs.n_over(job.done) for job in open_surveys(group, surveys, beliefs))


def is_alone_with_work(
    group: Group, organisation: Organisation, surveys: Mapping[str, SurveyJob], beliefs: Beliefs
) -> bool:
    """Return True while a leader without present members has areas not known to be done."""
    # A silent member may still be at work, and would stop if the leader met.
    others = set(organisation.members(group.name)).difference(organisation.heads(group.name))
    return not others and bool(open_surveys(group, surveys, beliefs))


class Unfinished:
    """Goal, a share of all cells, and all finds."""

    def __init__(self, surveys: Iterable[SurveyJob], goal: float, finds: Collection[str]) -> None:
        self._surveys = list(surveys)
        n_cells = sum(job.on.work.bit_count() for job in self._surveys)
        self._n_spared = n_cells - goal * n_cells
        self._finds = tuple(finds)

    def holds(self, facts: Known) -> bool:
        """Return True while more work is known to remain than the goal tolerates."""
        if any(facts.values(("foundAt", find)) and not facts.values(("inspectedBy", find)) for find in self._finds):
            return True
        return self.lacks_cells(facts)

    def lacks_cells(self, facts: Known, trusts_reports: bool = True) -> bool:
        """Return True while the goal is short of cells; all those of an area count once it is reported done."""
        n_left = 0
        for job in self._surveys:
            is_done = trusts_reports and facts.values(job.done)
            n_left += 0 if is_done else job.left(facts).bits.bit_count()
            if n_left > self._n_spared:
                break
        return n_left > self._n_spared


class AfterWork(Behaviour):
    """Rendezvous behaviour that answers no call before the goal is reached."""

    def __init__(self, meeting: Behaviour, unfinished: Unfinished) -> None:
        self._meeting = meeting
        self._unfinished = unfinished
        self._perceived, self._facts = IDLE, NOTHING_KNOWN  # of the meeting alone, with these facts

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Perceive as the behaviour, with the effect on calls replaced."""
        self._perceived, self._facts = self._meeting.perceive(motion, picture, performed), picture.facts
        is_due = self._perceived.stimulus > 0.0
        return self._perceived._replace(answers=self._settled) if is_due else self._perceived

    def _settled(self) -> float:
        return 0.0 if self._unfinished.holds(self._facts) else self._perceived.settled

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return self._meeting.reference(motion, picture)

    def accuracy_m(self, motion: Motion, picture: Picture) -> float:
        return self._meeting.accuracy_m(motion, picture)


MISSIONS = SUPERVISION, AREA_MAPPING = "Supervision", "AreaMapping"
INSPECTION = "Inspection"  # mission of a group formed at run time; scenarios never assign it
EXPLORE = "Explore"  # task of a group, one of its roles and the role's area
HAVE_INSPECTED = "HaveInspected"  # task of a group formed at run time: exist while finds need inspection


def social_domain(meeting: Meeting, finds: Collection[str]) -> Domain:
    """Return the HTN domain from missions of groups to orders; ``finds`` names the find jobs."""
    groups = meeting.groups

    def orders(group: str, role: str) -> list[Task]:
        declared = groups[group].role(role)
        area = None if declared is None else declared.job
        names = () if area is None else ("Positioning", "Exploring")
        return [Task(ASSIGN_OBJECTIVE, (group, role, name, area)) for name in names]

    methods = {SUPERVISION: supervision_methods(groups), AREA_MAPPING: mapping_methods(groups, finds)}
    if any(group.formed_by is not None for group in groups.values()):
        methods |= inspection_methods(groups, finds)
    return Domain.of(meeting.operators("Exploring"), {**methods, EXPLORE: entrusted(orders), **meeting.methods()})


def supervision_methods(groups: Mapping[str, Group]) -> list[Method]:
    """Mission Supervision: give each supervised group its mission, Supervision or AreaMapping; meet."""
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
    """AreaMapping: allocate roles, explore every area, inspect detected ``finds``, then meet."""

    def unfinished(facts: FactsLike, group: Group) -> list[tuple[str, str]]:
        return [
            (role.name, role.job)
            for role in group.roles
            if role.job is not None and role.job not in finds and facts.get(("areaDone", role.job)) is None
        ]

    def has_work(facts: FactsLike, group: str) -> bool:
        # Both are evaluated, since a plan depends on all facts that were read.
        return any((unfinished(facts, by_name[group]), waiting(facts, by_name[group], finds)))

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
    """Return the detected and uninspected finds of a group's roles."""
    return [role.job for role in group.roles if role.job and role.job in finds and is_to_be_inspected(facts, role.job)]


def inspection_methods(by_name: Mapping[str, Group], finds: Collection[str]) -> dict[str, list[Method]]:
    """Inspections by groups formed at run time.

    HaveInspected: form a group after a find; dissolve it without finds or present members. Inspection: recruit members
    and allocate roles after each detection or inspection.
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
        # All are read before any is judged, since a plan depends on all of them.
        holders = [facts.get(("members", path)) for path in paths]
        return not has_work(facts, group) or not any(holders)

    def task(name: str, *args: str) -> Callable[..., list[Task]]:
        return lambda facts, group: [Task(name, (group, *args))]

    forming = [
        Method("form a group", task(FORM_GROUP), is_needed, (FORM_GROUP,)),
        Method("dissolve it", task(DISSOLVE_GROUP), is_over, (DISSOLVE_GROUP,)),
        Method("let it inspect", task(GIVE_MISSION, INSPECTION), is_there, (GIVE_MISSION,)),
        Method.fixed("nothing to inspect"),
    ]
    inspecting = [
        Method("inspect", task(ALLOCATE_ROLES), has_work, (ALLOCATE_ROLES,)),
        Method.fixed("all is inspected"),
    ]
    return {INSPECTION: inspecting, HAVE_INSPECTED: forming}


def activity_domain(jobs: Mapping[str, Job]) -> Domain:
    """Objectives into activities; task arguments are the objective and the vehicle data.

    ==================  ====================  ==========================  ============================
    elementary task     test                  effect                      expected
    ==================  ====================  ==========================  ============================
    ZigzagExploring     a mapping sensor      the area is explored        travel and work of its job
    Inspecting          the find is known     it is inspected             travel and work of its job
    Mapping             a mapping sensor      the group has met           unknown
    Positioning         none                  none: it is permanent       unknown
    ==================  ====================  ==========================  ============================
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

    def left(facts: FactsLike, objective: Objective, data: VehicleData) -> Expected | None:
        return expected_of(facts, objective.argument, data)

    def either(name: str, activity: str, when: Callable[..., bool], otherwise: str) -> list[Method]:
        return [
            Method(name, lambda facts, *args: [Task(activity, args)], when, (activity,)),
            Method(otherwise, lambda facts, *args: [], lambda facts, *args: not when(facts, *args), ()),
        ]

    return Domain.of(
        [
            Operator("ZigzagExploring", has_sensor, done, expected=left),
            Operator("Inspecting", is_found, done, expected=left),
            Operator("Mapping", has_sensor, met, expected=None),
            Operator("Positioning", expected=None, lasts=True),
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
