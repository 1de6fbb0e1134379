"""The run log of a vehicle: rows are written when a view or a choice changes, and say what changed."""

from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective, WeighedSet
from remoras.authority import Act, Request, Ruling
from remoras.htn import Domain, Execution, Operator, Plan, Task, plan
from remoras.organisation import Group, Organisation, Outcome, RoleAssignment
from remoras.recorder import Recorder
from remoras.run_log import RunLog

EXPLORING = Objective("Operational", "LeftWinger", "Exploring", "left")
MEETING = Objective("Operational", "Performer", "RendezVous", "rally")
SURVEY = ActivitySet(
    EXPLORING,
    ActivityKind.INDIVIDUAL,
    (Activity("Zigzag", ActivityType.GUIDANCE), Activity("Mapping", ActivityType.PRODUCTIVE, sensors=("sonar",))),
    1.0,
)
HOMING = ActivitySet(MEETING, ActivityKind.COLLECTIVE, (Activity("Homing", ActivityType.GUIDANCE),), 0.4)
EVADE = ActivitySet(None, ActivityKind.VITAL, (Activity("Evade", ActivityType.GUIDANCE),), 4.0)
GROUP = Group("Operational")
NAMES = ("AUV02", "AUV01")
"""In the order of the nodes."""


def candidates(*chosen: ActivitySet, stimulus: float = 0.5) -> list[WeighedSet]:
    return [
        WeighedSet(EVADE, 0.0, 0.0, 0.0, "", None, EVADE in chosen, None),
        WeighedSet(SURVEY, stimulus, 0.7, 0.0, "", None, SURVEY in chosen, 0.7),
        WeighedSet(HOMING, 1.0, 0.9, 0.5, "AUV02", 17, HOMING in chosen, 0.5),
    ]


def test_a_choice_is_written_with_all_that_stood_to_choice() -> None:
    recorder = Recorder()
    RunLog("AUV01", NAMES, recorder).weighs(8.0, candidates(SURVEY))
    assert recorder.decisions == [
        (8.0, "AUV01", "", "", "", "", ["Evade"], 0.0, 0.0, 0.0, "", None, False, None),
        (8.0, "AUV01", "Operational", "LeftWinger", "Exploring", "left", ["Zigzag", "Mapping"], 0.5, 0.7, 0.0, "",
         None, True, 0.7),
        (8.0, "AUV01", "Operational", "Performer", "RendezVous", "rally", ["Homing"], 1.0, 0.9 - 0.5, 0.5, "AUV02",
         17, False, 0.5),
    ]  # fmt: skip


def test_nothing_is_written_while_only_numbers_change() -> None:
    recorder = Recorder()
    run_log = RunLog("AUV01", NAMES, recorder)
    for number in range(10):
        run_log.weighs(2.0 * number, candidates(SURVEY, stimulus=0.5 + 0.01 * number))
    assert {row[0] for row in recorder.decisions} == {0.0}
    run_log.weighs(30.0, candidates(HOMING))
    run_log.weighs(32.0, candidates(HOMING)[:-1])
    assert [row[0] for row in recorder.decisions] == [0.0] * 3 + [30.0] * 3 + [32.0] * 2


def test_a_role_that_is_left_and_taken_anew_at_once_is_one_that_it_plays() -> None:
    recorder = Recorder()
    asked = [
        Request("AUV01", act, "Operational", "LeftWinger", name)
        for name in ("AUV01", "AUV02")
        for act in (Act.RELEASE, Act.ASSIGN)
    ]
    RunLog("AUV01", NAMES, recorder).rulings(8.0, [Ruling(request, Outcome.SUCCESS) for request in asked])
    assert recorder.roles == [
        (8.0, "AUV01", "Operational", "LeftWinger", "left"),
        (8.0, "AUV01", "Operational", "LeftWinger", "assigned"),
    ]


def test_roles_begin_and_cease_to_drive_and_activities_are_those_of_the_choice() -> None:
    recorder = Recorder()
    run_log = RunLog("AUV01", NAMES, recorder)
    run_log.drives(2.0, frozenset({("Operational", "LeftWinger")}), candidates(SURVEY))
    run_log.drives(4.0, frozenset({("Operational", "Performer")}), candidates(HOMING))
    assert [row[2:] for row in recorder.roles] == [
        ("Operational", "LeftWinger", "active"),
        ("Operational", "LeftWinger", "inactive"),
        ("Operational", "Performer", "active"),
    ]
    assert recorder.activities == [
        (2.0, "AUV01", "guidance", "Zigzag", "LeftWinger", 0.7),
        (2.0, "AUV01", "productive", "Mapping", "LeftWinger", 0.7),
        (4.0, "AUV01", "guidance", "Homing", "Performer", 0.9),
    ]


def test_what_was_agreed_before_is_written_by_node_and_by_nobody_in_particular() -> None:
    recorder = Recorder()
    roles = [RoleAssignment("Operational", "LeftWinger", name) for name in ("AUV01", "AUV02")]
    RunLog("AUV01", NAMES, recorder).founded(Organisation.of([GROUP], roles), [EXPLORING], 0.0)
    winger = ("Operational", "LeftWinger")
    assert recorder.organisation == [
        (0.0, "AUV01", "AUV02", *winger, "assigned", "", "assign", "", "", "success"),
        (0.0, "AUV01", "AUV01", *winger, "assigned", "", "assign", "", "", "success"),
        (0.0, "AUV01", "", *winger, "given", "", "objective", "Exploring", "left", "success"),
    ]


def test_changes_and_refusals_are_written_with_who_asked_for_them() -> None:
    recorder = Recorder()
    taken = Request("AUV02", Act.SUCCEED, "Operational", "Coordinator", "AUV02")
    evicted = Request("AUV01", Act.RELEASE, "Operational", "Coordinator", "AUV02")
    mission = Request("ASV00", Act.MISSION, "Operational", argument="Patrol")
    rulings = [
        Ruling(taken, Outcome.SUCCESS),
        Ruling(evicted, Outcome.NO_AUTHORITY),
        Ruling(mission, Outcome.SUCCESS),
    ]
    RunLog("AUV01", NAMES, recorder).rulings(7.0, rulings)
    head = ("AUV02", "Operational", "Coordinator")
    assert recorder.organisation == [
        (7.0, "AUV01", *head, "assigned", "AUV02", "succeed", "", "", "success"),
        (7.0, "AUV01", *head, "refused", "AUV01", "release", "", "", "issuer without authority"),
        (7.0, "AUV01", "", "Operational", "", "given", "ASV00", "mission", "", "Patrol", "success"),
    ]
    detail = "AUV01: AUV02 no longer as Coordinator of Operational: issuer without authority"
    assert recorder.faults == [(7.0, "AUV01", "refused assignment", detail)]


def test_plans_of_groups_and_of_a_vehicle_are_written_once() -> None:
    recorder, facts = Recorder(), dict[str, bool]()
    domain = Domain.of([Operator("dive", effects=lambda facts: {"deep": True})], {})
    made = plan(domain, facts, Task("dive"))
    assert isinstance(made, Plan)
    run_log, execution = RunLog("AUV01", NAMES, recorder), Execution(domain, made)
    for now_s in (1.0, 2.0):
        run_log.plans(now_s, {"Operational": execution}, {EXPLORING: execution})
    assert [row[:6] for row in recorder.plans] == [
        (1.0, "AUV01", "Operational", "", "", ""),
        (1.0, "AUV01", "Operational", "LeftWinger", "Exploring", "left"),
    ]
