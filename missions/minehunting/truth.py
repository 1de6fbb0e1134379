"""Ground truth, metrics and figures of classifications."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from missions.figure import Declared, Figure, Mark, RunResults, Style, run_end_s
from missions.meeting.meeting import Meeting
from missions.meeting.truth import JOBS, JobTruth, mean_of_all_s, n_stated
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric
from missions.minehunting.imagery import CLASSIFIED, MINE, REVISITS, ROCK, STRIPS, Minefield
from remoras.mission import FleetView, Milestone
from remoras.organisation import Group
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Table, Unread
from remoras.truth import left

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CLASSIFICATIONS = Table(
    "classifications", (TIME, VEHICLE, Column("contact", "str"), Column("kind", "str"), Column("truth", "str"))
)
"""First classification of each contact, with its true class."""


class MinehuntingTruth(JobTruth):
    """Referee of classifications: the goal is all contacts, right or wrong."""

    work = "classify"

    def __init__(
        self, meeting: Meeting, objective: str, recorder: Recorder, contacts: Sequence[str], world: Minefield
    ) -> None:
        super().__init__(meeting, objective, recorder)
        self._contacts, self._world = contacts, world
        self._claims = Unread(recorder.items)
        self._classification_rows = recorder.rows(CLASSIFICATIONS.name)
        self._classified: set[str] = set()

    def watch(self, fleet: FleetView, now_s: float) -> None:
        super().watch(fleet, now_s)
        for _, by, _, _, subject, attribute, value, *_ in self._claims:
            if attribute == CLASSIFIED and subject not in self._classified:
                self._classified.add(subject)
                truth = MINE if subject in self._world.mines else ROCK
                self._classification_rows.append((now_s, by, subject, value, truth))
                self.milestones.append(Milestone(now_s, "classified", by))

    @property
    def goal_fraction(self) -> float:
        return len(self._classified) / len(self._contacts)

    @property
    def jobs_done(self) -> Collection[str]:
        return self._done | self._classified

    def reachable_fraction(self, fleet: FleetView) -> float:
        if not left(fleet):
            return self.goal_fraction
        return (len(self._contacts) - len(self.out_of_reach(fleet))) / len(self._contacts)

    def out_of_reach(self, fleet: FleetView) -> Sequence[str]:
        within = super().out_of_reach(fleet)
        return [name for name in self._contacts if name in within]

    def is_worked_off(self, group: Group) -> bool:
        return self.goal_fraction >= 1.0

    def reasons(self, fleet: FleetView, now_s: float) -> Iterator[str]:
        yield from super().reasons(fleet, now_s)
        if awaited := ", ".join(name for name in self._contacts if name in self._done - self._classified):
            yield f"analysts wait for strips of {awaited} until the end"

    def _undone(self, group: Group) -> list[str]:
        return [name for name in self._contacts if name not in self._classified]


# Results ----------------------------------------------------------------------------------------


def mean_classified_s(run: MeasuredRun) -> float:
    """Mean time of classification; missing ones count with the mission's duration."""
    scenario: Any = run.scenario
    times_s = [row[0] for row in run.recorder.rows(CLASSIFICATIONS.name)]
    return mean_of_all_s(times_s, len(scenario.contact), run)


def wrong_fraction(run: MeasuredRun) -> float | Absent:
    """Share of wrong classifications."""
    wrong = [row[3] != row[4] for row in run.recorder.rows(CLASSIFICATIONS.name)]
    return sum(wrong) / len(wrong) if wrong else NOT_APPLICABLE


METRICS = (
    Metric("mean_classified_s", "s", Better.LOWER, "mean time until classification", mean_classified_s, headline=True),
    Metric("wrong_fraction", "", Better.LOWER, "misclassified contacts", wrong_fraction, headline=True),
    Metric("n_revisits", "", Better.LOWER, "requested revisits", lambda run: n_stated(run, REVISITS)),
)


def draw_classified(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw strips taken and contacts classified over time."""
    taken_s = [row["time_s"] for row in results.table(STRIPS.name).to_pylist()]
    said_s = [row["time_s"] for row in results.table(CLASSIFICATIONS.name).to_pylist()]
    end_s = run_end_s(results)
    for times_s, label, color, line in (
        (taken_s, "strips taken", style.grey, "--"),
        (said_s, "contacts classified", style.black, "-"),
    ):
        shares = [number / max(1, len(times_s)) for number in range(len(times_s) + 1)]
        axes.step([0.0, *times_s, end_s], [*shares, shares[-1]], where="post", color=color, linestyle=line, label=label)
    axes.set_xlim(0.0, end_s)
    axes.set_xlabel(style.axis("time", "s"))
    axes.set_ylabel(style.axis("share of the final number"))
    return "The lag between the curves is due to the channel and to undecided analysts."


FIGURES: tuple[Declared, ...] = (
    Figure(
        "classified", "Strips taken and contacts classified over mission time", draw_classified,
        needs=(STRIPS.name, CLASSIFICATIONS.name, JOBS.name),
    ),
    Mark("job_done", "view done"),
)  # fmt: skip
