"""The diary of a vehicle: rows are written when a view or a choice changes, and say what changed."""

from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Candidate, Objective
from remoras.diary import Diary
from remoras.organisation import Group, Organisation, RoleAssignment
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
GROUP = Group("Operational")
NAMES = ("AUV02", "AUV01")
"""In the order of the nodes."""


def candidates(*chosen: ActivitySet, stimulus: float = 0.5) -> list[Candidate]:
    return [
        Candidate(EVADE, 0.0, 0.0, 0.0, "", None, EVADE in chosen, None),
        Candidate(SURVEY, stimulus, 0.7, 0.0, "", None, SURVEY in chosen, 0.7),
        Candidate(HOMING, 1.0, 0.9, 0.5, "AUV02", 17, HOMING in chosen, 0.5),
    ]


def test_a_choice_is_written_with_all_that_stood_to_choice() -> None:
    recorder = Recorder()
    Diary("AUV01", NAMES, recorder).weighs(8.0, candidates(SURVEY))
    assert recorder.decisions == [
        (8.0, "AUV01", "", "", "", "", ["Evade"], 0.0, 0.0, 0.0, "", None, False, None),
        (8.0, "AUV01", "Operational", "LeftWinger", "Exploring", "left", ["Zigzag", "Mapping"], 0.5, 0.7, 0.0, "",
         None, True, 0.7),
        (8.0, "AUV01", "Operational", "Performer", "RendezVous", "rally", ["Homing"], 1.0, 0.9 - 0.5, 0.5, "AUV02",
         17, False, 0.5),
    ]  # fmt: skip


def test_nothing_is_written_while_only_numbers_change() -> None:
    recorder = Recorder()
    diary = Diary("AUV01", NAMES, recorder)
    for number in range(10):
        diary.weighs(2.0 * number, candidates(SURVEY, stimulus=0.5 + 0.01 * number))
    assert {row[0] for row in recorder.decisions} == {0.0}
    diary.weighs(30.0, candidates(HOMING))
    diary.weighs(32.0, candidates(HOMING)[:-1])
    assert [row[0] for row in recorder.decisions] == [0.0] * 3 + [30.0] * 3 + [32.0] * 2


def test_roles_begin_and_cease_to_drive_and_activities_are_those_of_the_choice() -> None:
    recorder = Recorder()
    diary = Diary("AUV01", NAMES, recorder)
    diary.drives(2.0, frozenset({("Operational", "LeftWinger")}), candidates(SURVEY))
    diary.drives(4.0, frozenset({("Operational", "Performer")}), candidates(HOMING))
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


def test_a_view_is_written_as_what_has_changed_in_it() -> None:
    recorder = Recorder()
    diary = Diary("AUV01", NAMES, recorder)
    winger = RoleAssignment("Operational", "LeftWinger", "AUV02")
    first, then = (
        Organisation.of([GROUP], [winger]),
        Organisation.of([GROUP], [RoleAssignment(*EXPLORING_ROLE, "AUV01")]),
    )
    diary.view(0.0, first, [EXPLORING])
    diary.view(7.0, first, [EXPLORING])
    diary.view(14.0, then, [EXPLORING, MEETING])
    assert recorder.organisation == [
        (0.0, "AUV01", "AUV02", "Operational", "LeftWinger", "assigned"),
        (14.0, "AUV01", "AUV02", "Operational", "LeftWinger", "left"),
        (14.0, "AUV01", "AUV01", "Operational", "LeftWinger", "assigned"),
    ]
    assert [(row[0], *row[4:]) for row in recorder.objectives] == [
        (0.0, "Exploring", "left"),
        (14.0, "RendezVous", "rally"),
    ]


EXPLORING_ROLE = ("Operational", "LeftWinger")
