"""The mission: lines as jobs that the strategy gives out, some of which take a second vehicle that follows.

What moves vehicles to follow is help, as ``missions.meeting.helping`` has it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from exchange.arithmetic import distance
from missions.errors import ConfigurationFault
from missions.escort.lines import ESCORTS, ON_LINE_M, FollowingSource, SurveyingLine, SurveyLine
from missions.figure import Declared, Figure, Mark, Place, RunResults, Style
from missions.meeting.helping import JUDGED, URGENCY, Help, HelpMission, HelpSettings
from missions.meeting.job_mission import JobScenario, founding_of, job_role, listed_faults, with_job_roles
from missions.meeting.meeting import Meeting
from missions.meeting.staying import DONE_BY
from missions.meeting.truth import (
    JOBS,
    WAITS,
    JobTruth,
    done_s,
    draw_steps,
    event_s,
    first_s,
    mean_of_all_s,
    mean_wait_s,
)
from missions.metric import Better, MeasuredRun, Metric
from missions.scenarios.tables import Name, PointM, Raw, Section, entries, point_of
from remoras.behaviours import Behaviour
from remoras.database import VehicleData
from remoras.mission import ABILITIES, FleetView
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Table
from remoras.work import Job

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SEEN_M = 30.0
"""An obstacle sonar sees no vehicle farther away."""
SHORTEST_M = 10.0
MARK_M = 5.0
"""The truth looks at marks along a line, this far apart."""
PASSED_M = 1.5 * ON_LINE_M
"""Whoever comes this near to a mark has passed it: it may be off the line, and as far from where it stopped."""
ESCORTING = Table("escorting", (TIME, VEHICLE, Column("line", "str"), Column("event", "str")))
"""When a vehicle stood at the beginning of a line that takes an escort (``waits``), and when it was ``surveyed``."""
SURVEYED = "surveyed"


class LineTable(Section):
    """One ``[[line]]``."""

    name: Name = Field(description="name of the line")
    from_m: PointM = Field(description="where it begins, x east, y north")
    to_m: PointM = Field(description="where it ends")
    escorted: bool = Field(False, description="true: it takes a second vehicle that follows the one which surveys it")


class EscortSettings(HelpSettings):
    """The ``[mission]`` table."""

    within_m: float = Field(
        20.0, ge=10.0, le=SEEN_M, description="an escort farther away than this is of no use to who surveys a line"
    )


class EscortScenario(JobScenario):
    """The whole input of a run of this mission."""

    mission: EscortSettings = EscortSettings()
    line: tuple[LineTable, ...] = Field(min_length=1)


class EscortTruth(JobTruth):
    """Notes which lines were really surveyed, whatever vehicles believe.

    A line that takes an escort is surveyed once somebody has passed each of its marks while another one was within the
    distance of an escort.

    Args:
        meeting: of the mission; objective: of roles with a job; recorder: takes the rows.
        lines: those that take an escort; within_m: greatest distance of an escort.
    """

    def __init__(
        self, meeting: Meeting, objective: str, recorder: Recorder, lines: Sequence[SurveyLine], within_m: float
    ) -> None:
        super().__init__(meeting, objective, recorder)
        self._escorting = recorder.rows(ESCORTING.name)
        self._within_m = within_m
        self._lines = {line.name: line for line in lines}
        self._marks = {line.name: {line.at(along_m) for along_m in marks_m(line.length_m)} for line in lines}
        self._waited: set[str] = set()

    @property
    def jobs_done(self) -> Collection[str]:
        """Lines that were really surveyed."""
        return self._done - self._marks.keys()

    def watch(self, fleet: FleetView, now_s: float) -> None:
        """Note what was done since the last look."""
        super().watch(fleet, now_s)
        at_m = {vehicle.name: vehicle.position_m for vehicle in fleet.vehicles if vehicle.is_alive}
        escorted = {
            name: here_m
            for name, here_m in at_m.items()
            if any(other != name and distance(here_m, there_m) <= self._within_m for other, there_m in at_m.items())
        }
        for name, marks in list(self._marks.items()):
            if name not in self._waited:
                start_m = self._lines[name].place_m
                waits = next((who for who, here_m in at_m.items() if distance(here_m, start_m) <= PASSED_M), None)
                if waits is not None:
                    self._waited.add(name)
                    self._escorting.append((now_s, waits, name, WAITS))
            for who, here_m in escorted.items():
                marks -= {mark_m for mark_m in marks if distance(here_m, mark_m) <= PASSED_M}
                if not marks:
                    del self._marks[name]
                    self._escorting.append((now_s, who, name, SURVEYED))
                    break


def marks_m(length_m: float) -> list[float]:
    """How far along a line its marks are.

    >>> marks_m(12.0)
    [0.0, 5.0, 10.0]
    """
    return [MARK_M * number for number in range(int(length_m / MARK_M) + 1)]


# What the results say ----------------------------------------------------------------------------


def mean_surveyed_s(run: MeasuredRun) -> float:
    """Mean time by which a line was surveyed; one that was not counts with the duration of the mission."""
    scenario: Any = run.scenario
    surveyed_s = done_s(run)
    for line, time_s in event_s(run, ESCORTING.name, SURVEYED).items():
        if line in surveyed_s:
            surveyed_s[line] = max(surveyed_s[line], time_s)
    return mean_of_all_s(surveyed_s.values(), len(scenario.line), run)


def mean_escort_s(run: MeasuredRun) -> float | None:
    """Mean time from when a vehicle stood at an escorted line to when it was surveyed; to the end where it was not.

    None if no vehicle came to any.
    """
    return mean_wait_s(run, ESCORTING.name, SURVEYED)


METRICS = (
    Metric("mean_surveyed_s", "s", Better.LOWER, "mean time until a line is surveyed", mean_surveyed_s, headline=True),
    Metric(
        "mean_escort_s", "s", Better.LOWER, "mean time of a vehicle at an escorted line", mean_escort_s, headline=True
    ),
)
"""Metrics of the mission, in the order of the summary."""


def draw_surveyed(axes: Axes, results: RunResults, style: Style) -> str:
    """Lines surveyed over time."""
    draw_steps(axes, results, style, {"fleet": first_s(results).values()}, "lines surveyed")
    return "A line counts once its vehicle has been along all of it, escorted where it takes an escort."


FIGURES: tuple[Declared, ...] = (
    Figure("surveyed", "Lines surveyed over mission time", draw_surveyed, needs=(JOBS.name,)),
    Mark("job_done", "line surveyed"),
)
"""Figures of the mission."""


# What there is to do ---------------------------------------------------------------------------


class EscortMission(HelpMission):
    """The mission, made from a scenario."""

    Scenario = EscortScenario
    group_missions = ("LineSurvey",)
    objective, kind = "Surveying", "SurveyLine"
    help_activity = "Following"
    needs = (*HelpMission.needs, "objectiveSurveying", DONE_BY, ESCORTS)
    vocabulary = (Path(__file__).with_name("vocabulary.ttl"), ABILITIES)
    tables: ClassVar[tuple[Table, ...]] = (*HelpMission.tables, ESCORTING)
    metrics: ClassVar[tuple[Metric, ...]] = METRICS
    figures: ClassVar[tuple[Declared, ...]] = FIGURES
    scenario: EscortScenario

    @classmethod
    def completed(cls, raw: Raw) -> Raw:
        """The tables with a role for each line in the first group; of escorted lines it calls on the founding roles."""
        roles = [
            job_role("Surveyor", line["name"], founding_of(raw) if line.get("escorted") is True else None)
            for line in entries(raw, "line")
            if line.get("name") is not None
        ]
        return with_job_roles(raw, roles, {ESCORTS: URGENCY, **JUDGED})

    @classmethod
    def check(cls, raw: Raw) -> Iterable[ConfigurationFault]:
        """Lines outside of the world, too short, with names that are taken, or take more than there are."""
        yield from listed_faults(raw, "line", "from_m", "to_m")
        for line in entries(raw, "line"):
            for from_m, to_m in zip(point_of(line, "from_m"), point_of(line, "to_m"), strict=False):
                if distance(from_m, to_m) < SHORTEST_M:
                    given = f"[{to_m[0]:g}, {to_m[1]:g}]"
                    allowed = f"the line is too short; allowed: {SHORTEST_M:g} m or more from from_m"
                    yield ConfigurationFault(f"line.{line.get('name')}.to_m", given, allowed)
            if line.get("escorted") is True and len(entries(raw, "vehicle")) == 1:
                allowed = "takes two vehicles, and there is one; allowed: false"
                yield ConfigurationFault(f"line.{line.get('name')}.escorted", "true", allowed)

    def jobs_of(self, scenario: EscortScenario) -> Iterable[SurveyLine]:
        """The lines."""
        self._lines = {one.name: SurveyLine(one.name, one.from_m, one.to_m, one.escorted) for one in scenario.line}
        self._escorted = {name: line for name, line in self._lines.items() if line.is_escorted}
        return self._lines.values()

    @property
    def helped(self) -> Collection[str]:
        """Lines that take an escort."""
        return self._escorted

    def helper(self, job: str, group: str, holders: Collection[str], data: VehicleData) -> Behaviour:
        """To follow the holder of a line."""
        help = Help(job, group, holders, data.name, 1, ESCORTS, self.helped)
        return FollowingSource(self._lines[job], self.scenario.mission.within_m, help, data)

    def behaviour_at(self, job: Job, data: VehicleData) -> Behaviour:
        """To survey the line."""
        settings = self.scenario.mission
        return SurveyingLine(self._lines[job.name], settings.within_m, settings.wait_s, data)

    def truth(self, recorder: Recorder, world: Any) -> EscortTruth:
        """Notes what was really surveyed."""
        lines = list(self._escorted.values())
        return EscortTruth(self.meeting, self.objective, recorder, lines, self.scenario.mission.within_m)

    @property
    def places(self) -> Sequence[Place]:
        """Rally points and lines."""
        points = [Place(point.name, "rally point", (point.position_m,)) for point in self.scenario.rally_point]
        return [*points, *(Place(one.name, "line", (one.place_m, one.to_m)) for one in self._lines.values())]
