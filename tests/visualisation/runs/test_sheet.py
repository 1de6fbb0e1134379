"""Parts of pages over mission time: lanes of several vehicles, plans as trees, flags."""

from pathlib import Path

import pytest
from synthetic_runs import CROWD, Fiction

from missions.spans import Span
from visualisation import style
from visualisation.run_records import Tenure
from visualisation.runs import htn, roles, run_picture
from visualisation.runs.sheet import TALLEST_IN, Row, sheet


def held(role: str, start_s: float = 0.0) -> Tenure:
    return Tenure("Team", role, (Span(start_s, 100.0),), (Span(start_s + 10.0, 100.0),))


TENURES = {
    "A": [held("Leader")],
    "B": [held("Diver"), held("Left", 20.0)],
    "C": [held("Diver")],
    "D": [held("Diver", 5.0)],
}


def test_vehicles_share_a_lane_by_all_or_by_first_roles() -> None:
    assert [lane.vehicles for lane in roles.folded(TENURES, roles.FOLDS[1])] == [("A",), ("B",), ("C", "D")]
    found = roles.folded(TENURES, roles.FOLDS[2])
    assert [lane.vehicles for lane in found] == [("A",), ("B", "C", "D")]
    assert [row.role for row in found[1].rows] == ["Diver", "Left"]


def test_shares_are_of_all_vehicles_of_the_lane() -> None:
    """Three divers, driven from 10 s on, one of them from 15 s on."""
    (row, _) = roles.folded(TENURES, roles.FOLDS[2])[1].rows
    assert roles.shares(row.active, 3) == [(Span(10.0, 15.0), 2 / 3), (Span(15.0, 100.0), 1.0)]


@pytest.mark.parametrize(("n_vehicles", "n_lanes"), [(12, 12), (13, 1)])
def test_more_than_twelve_lanes_are_folded(tmp_path: Path, n_vehicles: int, n_lanes: int) -> None:
    """Although both would fit a page."""
    fleet = CROWD[:n_vehicles]
    roles = [(0.0, name, "Team", "Diver", "assigned") for name in fleet]
    fiction = Fiction(vehicles=fleet, roles=(), extra_roles=roles)  # type: ignore[arg-type]
    drawn = run_picture(fiction.write(tmp_path / "run"), "roles")
    names = [text.get_text() for text in drawn.figure.axes[0].texts if text.get_weight() == "bold"]
    assert names == fleet if n_lanes == 12 else [name.partition(":")[0] for name in names] == ["13 vehicles"]
    assert ("13 vehicles: AUV00, AUV01, AUV02, " in drawn.caption) is (n_lanes == 1)


@pytest.mark.parametrize(
    "of", ["AssignObjective(Searcher, Searching, area {})", "Work(Surveyor of line {}): to who plays it"]
)
def test_shortened_rows_of_a_narrow_page_keep_what_differs(tmp_path: Path, of: str) -> None:
    """It is at the end of some names, and in the middle of others."""
    band = [Row(of.format(number), 0.1, 1, number) for number in range(1, 15)]
    drawn = sheet(Fiction().write(tmp_path / "run"), 1.5, (), 3.5)
    assert [row.content for row, _ in drawn.rows([band])] == list(range(1, 15))
    names = [text.get_text() for text in drawn.axes.texts]
    assert len(set(names)) == 14
    assert all("\N{HORIZONTAL ELLIPSIS}" in name for name in names)


# Plans drawn as trees


def test_tree_of_a_plan_has_the_end_of_each_task(tmp_path: Path) -> None:
    """The dive of A's plan fails at 500 s of 1000 and is done by another; the meeting is dropped."""
    mission, *own = htn.trees(Fiction().write(tmp_path / "run"))
    assert (mission.vehicle, mission.is_of_group) == ("A", True)
    assert [(task.depth, task.label) for task in mission.tasks] == [
        (0, "A  Survey(Team)"),
        (1, "Dive(Diver, bay): to another"),
        (2, "AssignObjective(Diver, Diving, bay)"),
        (2, "AssignObjective(Diver, Diving, bay)"),
        (1, "Meet"),
    ]
    failed, again = ([(event.time_s, event.status) for event in mission.tasks[at].events] for at in (2, 3))
    assert failed == [(0.0, "running"), (500.0, "failed")]
    assert again == [(500.0, "running"), (1000.0, "done")]
    assert mission.tasks[2].events[0].expected_s == 750.0
    assert [(tree.vehicle, tree.is_of_group) for tree in own] == [("A", False), ("B", False)]


def marks(axes: object) -> dict[str, list[float]]:
    """Times of the marks in a window, by marker."""
    found: dict[str, list[float]] = {}
    for line in axes.lines:  # type: ignore[attr-defined]
        if line.get_marker() != "None":
            found.setdefault(line.get_marker(), []).extend(map(float, line.get_xdata()))
    return found


def test_ends_of_tasks_are_marked_at_their_times(tmp_path: Path) -> None:
    """Crosses mark failed tasks, dots done ones, dashes dropped ones, diamonds expected ends."""
    [axes] = run_picture(Fiction().write(tmp_path / "run"), "htn", width_in=3.5).figure.axes
    assert marks(axes) == {"X": [500.0], "o": [1000.0, 1000.0], "|": [1000.0], "d": [750.0, 500.0, 500.0]}


def test_bars_of_a_lost_vehicle_end_with_it(tmp_path: Path) -> None:
    """A is lost at 700 s of 1000; its plans run from the start on."""
    fiction = Fiction(faults=[(700.0, "A", "lost", "for good")])
    (axes,) = run_picture(fiction.write(tmp_path / "run"), "htn").figure.axes
    ends_s = {float(path.vertices[:, 0].max()) for bars in axes.collections for path in bars.get_paths()}
    assert {700.0, 1000.0} <= ends_s


def test_plans_that_do_not_fit_a_page_are_omitted_and_counted(tmp_path: Path) -> None:
    """60 vehicles have 61 plans: at 0.185 in each, with top tasks only, a page of 9 in has fewer than 49."""
    fiction = Fiction(tuple(f"V{number:02d}" for number in range(60)))
    drawn = run_picture(fiction.write(tmp_path / "run"), "htn")
    assert drawn.figure.get_figheight() <= TALLEST_IN
    assert "Only the top task of each plan is shown. " in drawn.caption
    n_left_out = int(drawn.caption.split(" plans are not shown.")[0].rsplit(" ", 1)[1])
    assert 61 - 49 < n_left_out < 61 - 30
    tops = [text.get_text() for text in drawn.figure.axes[0].texts if text.get_text().startswith(("V0", "V1"))]
    assert tops[0] == "V00  Survey(Team)"


def test_run_without_plans_has_a_note_in_the_figure(tmp_path: Path) -> None:
    drawn = run_picture(Fiction(recorded=False).write(tmp_path / "run"), "htn", width_in=style.COLUMN_IN)
    assert "no plan was executed" in [text.get_text() for text in drawn.figure.axes[0].get_yticklabels()]


def test_milestones_close_together_share_a_flag(tmp_path: Path) -> None:
    """At 600 s there is room for a flag, at 603 s and 606 s, a hundredth of an inch on, none for another."""
    times_s = (100.0, 600.0, 603.0, 606.0)
    fiction = Fiction(milestones=[("gathered", "", f"g{number}", at_s) for number, at_s in enumerate(times_s)])
    [axes] = run_picture(fiction.write(tmp_path / "run"), "roles").figure.axes
    assert [text.get_text() for text in axes.texts if text.get_bbox_patch()] == ["1", "2\u20134"]
