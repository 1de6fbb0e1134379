"""The run log of a vehicle: rows are written when a view or a choice changes, and say what changed."""

from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective, WeighedSet
from remoras.authority import Act, Request, Ruling
from remoras.fleet.run_log import RunLog
from remoras.organisation import Outcome
from remoras.recorder import Recorder

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
    RunLog("AUV01", NAMES, recorder).decided(8.0, frozenset(), candidates(SURVEY))
    assert recorder.decisions == [
        (8.0, "AUV01", "", "", "", "", ["Evade"], 0.0, 0.0, 0.0, "", None, False, None),
        (8.0, "AUV01", "Operational", "LeftWinger", "Exploring", "left", ["Zigzag", "Mapping"], 0.5, 0.7, 0.0, "",
         None, True, 0.7),
        (8.0, "AUV01", "Operational", "Performer", "RendezVous", "rally", ["Homing"], 1.0, 0.9 - 0.5, 0.5, "AUV02",
         17, False, 0.5),
    ]  # fmt: skip


def test_what_is_chosen_no_more_drives_no_more_and_the_same_again_is_not_written() -> None:
    """A set that has gone takes its role with it, though nothing else is chosen in its place."""
    recorder, driving = Recorder(), frozenset({("Operational", "LeftWinger")})
    log = RunLog("AUV01", NAMES, recorder)
    log.decided(8.0, driving, candidates(SURVEY, EVADE))
    log.decided(9.0, driving, candidates(SURVEY, EVADE))
    log.decided(10.0, frozenset(), candidates(EVADE)[:1])
    about = ("AUV01", "Operational", "LeftWinger")
    assert recorder.roles == [(8.0, *about, "active"), (10.0, *about, "inactive")]
    assert [row[:4:3] for row in recorder.activities] == [
        (8.0, "Evade"), (8.0, "Zigzag"), (8.0, "Mapping"), (10.0, "Evade")
    ]  # fmt: skip


def test_changes_and_refusals_are_written_with_who_asked_for_them() -> None:
    recorder = Recorder()
    taken = Request("AUV02", Act.SUCCEED, "Operational", "Coordinator", "AUV02")
    evicted = Request("AUV01", Act.RELEASE, "Operational", "Coordinator", "AUV02")
    mission = Request("ASV00", Act.MISSION, "Operational", argument="Patrol")
    rulings = [Ruling(taken, Outcome.SUCCESS), Ruling(evicted, Outcome.NO_AUTHORITY), Ruling(mission, Outcome.SUCCESS)]
    RunLog("AUV01", NAMES, recorder).rulings(7.0, rulings)
    head = ("AUV02", "Operational", "Coordinator")
    assert recorder.organisation == [
        (7.0, "AUV01", *head, "assigned", "AUV02", "succeed", "", "", "success"),
        (7.0, "AUV01", *head, "refused", "AUV01", "release", "", "", "issuer without authority"),
        (7.0, "AUV01", "", "Operational", "", "given", "ASV00", "mission", "", "Patrol", "success"),
    ]
    detail = "AUV01: AUV02 no longer as Coordinator of Operational: issuer without authority"
    assert recorder.faults == [(7.0, "AUV01", "refused assignment", detail)]
