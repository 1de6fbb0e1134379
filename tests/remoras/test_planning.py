"""The mission planner of one vehicle: pending missions, single orders, and dependencies of a plan.

The group Operational is to be "Sweep"-ed: its roles are allocated, and whoever plays LeftWinger or RightWinger gets the
objective to sweep its job, unless the job is done. The right job needs the left one to be done.
"""

import pytest
from samples import auv, database

from remoras.activities import Objective
from remoras.beliefs import Beliefs
from remoras.htn import Domain, FactsLike, Method, Operator, Plan, Task
from remoras.htn.domain import ROOT
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.social.planning import MissionPlanner
from remoras.strategy import Declaration, Negotiator
from remoras.testing.sample_worlds import Visit
from remoras.work import Work
from worldmodel import Instance, WorldModel, core_ontology_paths, read_tbox

TBOX = read_tbox(*core_ontology_paths())
NAMED = [
    ("AUV", "AUV00"),
    ("AUV", "AUV01"),
    ("Group", "Operational"),
    ("Role", "Operational.Head"),
    ("Role", "Operational.LeftWinger"),
    ("Role", "Operational.RightWinger"),
    ("Job", "left"),
    ("Job", "right"),
    ("Mission", "Sweep"),
    ("RallyPoint", "buoy"),
]
INSTANCES = tuple(Instance(uid, TBOX.class_named(kind).uid, name) for uid, (kind, name) in enumerate(NAMED))
GROUP = Group(
    "Operational",
    (
        RoleSpecification("Head", 1, 1, head=True, founding=True),
        RoleSpecification("LeftWinger", 1, 1, job="left"),
        RoleSpecification("RightWinger", 1, 1, job="right"),
    ),
)
MEMBERS = Organisation.of(
    [GROUP], [RoleAssignment("Operational", "Head", "AUV00"), RoleAssignment("Operational", "LeftWinger", "AUV01")]
)
FLEET = database(auv("AUV00"), auv("AUV01"))


JOBS = {"left": Visit("left", (0.0, 0.0)), "right": Visit("right", (0.0, 0.0), needs=("left",))}


class Allocating:
    """A strategy that gives the open roles to AUV01, and one to a stranger."""

    name = "allocating"
    declaration = Declaration("", {})

    def form(self, *_: object) -> Organisation:
        return MEMBERS

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        given = [
            work.assignment(role, "AUV01") for role in work.open if not work.organisation.members(GROUP.name, role.name)
        ]
        return (*given, RoleAssignment("Operational", "RightWinger", "AUV99"))

    def negotiator(self, me: str, group: Group) -> Negotiator | None:
        return None


def sweep(facts: FactsLike, group: str) -> list[Task]:
    tasks = [Task("AllocateRoles", (group,))]
    for role in GROUP.roles:
        if role.job is not None and facts.get(("jobDone", role.job)) is None:
            tasks.append(Task("AssignObjective", (group, role.name, "RendezVous", "buoy")))
    return tasks


DOMAIN = Domain.of(
    [Operator("AllocateRoles"), Operator("AssignObjective"), Operator("GiveMission")],
    {
        "Sweep": [Method("sweep", sweep)],
        "Delegate": [Method("delegate", lambda facts, group: [Task("GiveMission", (group, "Sweep"))])],
        "Impossible": [Method("never", lambda facts, group: [], lambda facts, group: False)],
    },
)


class Head:
    """AUV00, with its beliefs and its planner."""

    def __init__(self, **planned: Plan) -> None:
        self.beliefs = Beliefs(WorldModel(TBOX, 0, INSTANCES, n_origins=2, run_time_instances_per_origin=0))
        self.planner = MissionPlanner("AUV00", DOMAIN, self.beliefs, Allocating(), planned)
        self.organisation = MEMBERS
        self.objectives: list[Objective] = []

    def plan(self, *missions: str, done: frozenset[str] = frozenset()) -> list[tuple[str, str, str]]:
        groups = self.organisation.groups
        work = {name: Work(group, self.organisation, FLEET, JOBS, done) for name, group in groups.items()}
        deliberation = self.planner.plan(self.beliefs, {"Operational": missions or ("Sweep",)}, work, self.objectives)
        attributes = TBOX.attributes
        return [
            (self.beliefs.name(subject), attributes[attribute].name, self.beliefs.name(value))
            for subject, attribute, value in deliberation.facts
        ]


LEFT, RIGHT = ((f"Operational.{role}", "objectiveRendezVous", "buoy") for role in ("LeftWinger", "RightWinger"))


@pytest.mark.parametrize(
    ("key", "due"),
    [
        (("jobDone", "left"), True),  # the search looked it up, and the right job needs it
        (("hasMission", "Operational"), True),
        (("position", "AUV01"), False),
        (("jobDone", "elsewhere"), False),
    ],
)
def test_a_plan_is_remade_when_a_fact_it_depends_on_changes(key: tuple[str, str], due: bool) -> None:
    head = Head()
    head.planner.take_on(["Operational"])
    head.plan()
    head.planner.reconsider({key}, ["Operational"], head.beliefs)
    assert bool(head.planner.due) is due


def test_roles_are_assigned_once_and_to_members_only() -> None:
    """RightWinger is open once the left job is done; the stranger gets nothing."""
    head = Head()
    head.planner.take_on(["Operational"])
    assert ("AUV01", "playsRole", "Operational.RightWinger") in head.plan(done=frozenset({"left"}))
    assert head.planner.orders.issued == {RoleAssignment("Operational", "RightWinger", "AUV01")}
    head.planner.plan_again(["Operational"])
    assert head.plan(done=frozenset({"left"})) == []  # proposed already: the strategy sees it as played


def test_an_assigned_job_is_pending_until_its_vehicle_reports_on_it() -> None:
    head, worker = Head(), Beliefs(WorldModel(TBOX, 1, INSTANCES, n_origins=2, run_time_instances_per_origin=0))
    head.planner.take_on(["Operational"])
    head.plan(done=frozenset({"left"}))
    assert head.planner.orders.waits_for({"AUV01"}, ())
    assert not head.planner.orders.waits_for(set(), ())  # it is known to have heard
    assert not head.planner.orders.waits_for({"AUV01"}, {"right"})  # and so is that it is done
    head.planner.orders.note(worker.model.record([worker.fact("left", "knownDone", True)], 1.0))
    assert head.planner.orders.waits_for({"AUV01"}, ())
    head.planner.orders.note(worker.model.record([worker.fact("right", "knownDone", False)], 2.0))
    assert not head.planner.orders.waits_for({"AUV01"}, ())


def test_a_group_carries_out_a_second_mission_beside_its_first() -> None:
    """Its head gives its own group a mission more; both are planned, and what is done of the first stays done."""
    head = Head()
    head.planner.take_on(["Operational"])
    assert head.plan("Delegate") == [("Operational", "hasMission", "Sweep")]
    head.planner.end_round([], head.beliefs)
    head.planner.reconsider({("hasMission", "Operational")}, ["Operational"], head.beliefs)
    assert head.plan("Delegate", "Sweep") == [LEFT, RIGHT]  # the first is not given again
    execution = head.planner.executions["Operational"]
    roots = [str(branch.task) for branch in execution.branches if branch.parent == ROOT]
    assert roots == ["Delegate(Operational)", "Sweep(Operational)"]


@pytest.mark.parametrize("missions", [("Sweep", "Impossible"), ("Impossible", "Sweep")])
def test_of_several_missions_those_with_a_plan_are_carried_out(missions: tuple[str, str]) -> None:
    head = Head()
    head.planner.take_on(["Operational"])
    work = {name: Work(group, MEMBERS, FLEET, JOBS) for name, group in MEMBERS.groups.items()}
    deliberation = head.planner.plan(head.beliefs, {"Operational": missions}, work, ())
    assert [str(one.task) for one in deliberation.impossible] == ["Impossible(Operational)"]
    assert len(deliberation.facts) == 2
