"""Plans drawn as trees: what lies below what, what became of it, and what is left out of a page."""

from pathlib import Path

from synthetic_runs import Fiction

from visualisation import style
from visualisation.runs import htn, run_picture
from visualisation.runs.sheet import TALLEST_IN


def test_a_tree_is_read_with_what_became_of_its_tasks(tmp_path: Path) -> None:
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


def test_ends_are_marked_where_they_happened(tmp_path: Path) -> None:
    """A cross for the dive that failed, dots for what was done, a dash for what was dropped, diamonds for estimates."""
    [axes] = run_picture(Fiction().write(tmp_path / "run"), "htn", width_in=3.5).figure.axes
    assert marks(axes) == {"X": [500.0], "o": [1000.0, 1000.0], "|": [1000.0], "d": [750.0, 500.0, 500.0]}


def test_what_does_not_fit_a_page_is_left_out_and_said(tmp_path: Path) -> None:
    """60 vehicles have 61 plans: at 0.185 in each, even without what is below their tops, 9 in hold fewer than 49."""
    fiction = Fiction(tuple(f"V{number:02d}" for number in range(60)))
    drawn = run_picture(fiction.write(tmp_path / "run"), "htn")
    assert drawn.figure.get_figheight() <= TALLEST_IN
    assert "Tasks more than 0 levels below the top are left out. " in drawn.caption
    n_left_out = int(drawn.caption.split(" plans are left out.")[0].rsplit(" ", 1)[1])
    assert 61 - 49 < n_left_out < 61 - 30
    tops = [text.get_text() for text in drawn.figure.axes[0].texts if text.get_text().startswith(("V0", "V1"))]
    assert tops[0] == "V00  Survey(Team)"


def test_without_a_plan_the_figure_says_so(tmp_path: Path) -> None:
    drawn = run_picture(Fiction(recorded=False).write(tmp_path / "run"), "htn", width_in=style.COLUMN_IN)
    assert "no plan was carried out" in [text.get_text() for text in drawn.figure.axes[0].texts]
