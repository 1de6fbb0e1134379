"""The mission: loads as jobs that the strategy gives out, and vehicles that carry them through a narrow passage.

All roles with a load address each other, so their holders are equals: a call of one of them means that it wants to
pass. What comes of that is the model of ``remoras.attraction``, and nothing of it stands here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from exchange.arithmetic import distance
from missions.errors import ConfigurationFault
from missions.figure import Declared, Figure, Layer, Mark, Place, RunResults, Style
from missions.files import tables_of
from missions.meeting.job_mission import (
    JobMission,
    JobScenario,
    JobSettings,
    founding_of,
    listed_faults,
    placed_in,
    with_job_roles,
)
from missions.meeting.staying import DONE_BY, AnyonesJob, Stay
from missions.meeting.truth import JOBS, done_s, draw_steps, first_s, mean_of_all_s
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric
from missions.scenarios.tables import Name, NotNegative, PointM, Raw, Section, names_of, point_of
from remoras.behaviours import ADVANCING, DONE, Behaviour, Perception, Reference
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.work import Job, Outlook, Point

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes

PASSAGE = "passage"
"""Key of the feature by which there is a reef."""
STANDS_MPS = 0.1
"""A vehicle that is slower stands."""


class DeliveryTable(Section):
    """One ``[[delivery]]``."""

    name: Name = Field(description="name of the delivery")
    from_m: PointM = Field(description="where the load is fetched, x east, y north")
    to_m: PointM = Field(description="where it is handed over")


class FerrySettings(JobSettings):
    """The ``[mission]`` table."""

    handling_s: NotNegative = Field(10.0, description="how long a vehicle stays to fetch a load, or to hand it over")


class FerryScenario(JobScenario):
    """The whole input of a run of this mission."""

    mission: FerrySettings = FerrySettings.usual()
    delivery: tuple[DeliveryTable, ...] = Field(min_length=1)

    @property
    def length_m(self) -> Callable[[Point, Point], float]:
        """Length of the way from one place to another, through the passage if there is a reef between them."""
        table = self.of_feature(PASSAGE)
        return distance if table is None else table.passage(self.guidance.separation_m).length_m


@dataclass(frozen=True)
class Delivery(AnyonesJob):
    """A load: a ``remoras.work.Job``.

    Attributes:
        name: of the delivery; place_m: where the load is fetched; to_m: where it is handed over.
        handling_s: how long either takes.
        length_m: length of the way from one place to another.
    """

    place_m: Point
    to_m: Point
    handling_s: float
    length_m: Callable[[Point, Point], float]

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook:
        """When and where the vehicle will be free if it carries the load next."""
        way_m = self.length_m(outlook.position_m, self.place_m) + self.length_m(self.place_m, self.to_m)
        return Outlook(outlook.free_s + way_m / data.transit_speed_mps + 2.0 * self.handling_s, self.to_m)


class Carrying(Behaviour):
    """Fetches a load and hands it over.

    Args:
        delivery: the job; data: of the vehicle.
    """

    def __init__(self, delivery: Delivery, data: VehicleData) -> None:
        self._delivery, self._data = delivery, data
        self._stay = Stay(data)
        self._has_load = False

    @property
    def _place_m(self) -> Point:
        return self._delivery.to_m if self._has_load else self._delivery.place_m

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due, the nearest first; it advances on the way, and while the load is fetched or handed over."""
        of = self._delivery
        if picture.facts.get(of.done) is not None:
            return DONE
        to_go_m = of.length_m(motion.position_m, self._place_m)
        found = self._stay.perceive(to_go_m, of.handling_s, picture.body.now_s, performed)
        if found is not DONE or self._has_load:
            return found
        self._has_load, self._stay = True, Stay(self._data)
        return ADVANCING

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To where the load is, or is to be, in transit; stay there."""
        return self._stay.reference(self._place_m, motion)


# What the results say ----------------------------------------------------------------------------


def mean_delivered_s(run: MeasuredRun) -> float:
    """Mean time by which a load was handed over; one that was not counts with the duration of the mission."""
    scenario: Any = run.scenario
    return mean_of_all_s(done_s(run).values(), len(scenario.delivery), run)


def blocked_s(run: MeasuredRun) -> float | Absent:
    """Time that the vehicles stood within the reef, all together, second by second of the tracks."""
    table = run.scenario.of_feature(PASSAGE)
    if table is None:
        return NOT_APPLICABLE
    west_m, east_m = table.x_m
    rows = run.recorder.rows("trajectories")
    tick_s: float = run.scenario.scenario.tick_s
    n_ticks: int = sum(west_m <= row[2] <= east_m and row[5] < STANDS_MPS for row in rows)
    return n_ticks * tick_s


METRICS = (
    Metric("mean_delivered_s", "s", Better.LOWER, "mean time until delivery", mean_delivered_s, headline=True),
    Metric("blocked_s", "s", Better.LOWER, "time that vehicles stood in the passage", blocked_s, headline=True),
)
"""Metrics of the mission, in the order of the summary."""


def draw_delivered(axes: Axes, results: RunResults, style: Style) -> str:
    """Loads handed over, over time."""
    draw_steps(axes, results, style, {"fleet": first_s(results).values()}, "loads handed over")
    return "A load counts once its vehicle has handed it over."


def draw_reef(axes: Axes, results: RunResults, style: Style) -> str:
    """The reef with its passage."""
    scenario = tables_of(results.manifest["scenario"], "manifest.json")
    reef = scenario.get(PASSAGE)
    if reef is None:
        return "There is no reef."
    (west_m, east_m), (south_m, north_m) = reef["x_m"], scenario["world"]["y_m"]
    for low_m, high_m in (
        (south_m, reef["y_m"] - reef["width_m"] / 2.0),
        (reef["y_m"] + reef["width_m"] / 2.0, north_m),
    ):
        axes.fill([west_m, east_m, east_m, west_m], [low_m, low_m, high_m, high_m], color=style.tint(style.grey, 0.4),
                  zorder=0, linewidth=0.0)  # fmt: skip
    return "Grey: the reef, which vehicles cross by its passage alone."


FIGURES: tuple[Declared, ...] = (
    Figure("delivered", "Loads handed over over mission time", draw_delivered, needs=(JOBS.name,)),
    Layer("reef", draw_reef),
    Mark("job_done", "load handed over"),
)
"""Figures of the mission."""


class FerryMission(JobMission):
    """The mission, made from a scenario."""

    Scenario = FerryScenario
    group_missions = ("Ferry",)
    objective, kind = "Carrying", "Delivery"
    needs = (*JobMission.needs, "objectiveCarrying", DONE_BY)
    vocabulary = (Path(__file__).with_name("vocabulary.ttl"),)
    metrics: ClassVar[tuple[Metric, ...]] = METRICS
    figures: ClassVar[tuple[Declared, ...]] = FIGURES
    scenario: FerryScenario

    @classmethod
    def completed(cls, raw: Raw) -> Raw:
        """The tables with a role for each delivery in the first group; these and founding roles address each other."""
        jobs = names_of(raw, "delivery")
        names = [f"Carrier of {job}" for job in jobs]
        addressed = [*names, *founding_of(raw)]
        roles = [
            {"name": name, "maximum": 1, "job": job, "influences": addressed}
            for name, job in zip(names, jobs, strict=True)
        ]
        return with_job_roles(raw, roles, {}, names)

    @classmethod
    def check(cls, raw: Raw) -> Iterable[ConfigurationFault]:
        """Deliveries outside of the world, in the reef, or with names that are taken."""
        yield from listed_faults(raw, "delivery", "from_m", "to_m")
        reef = raw.get(PASSAGE)
        for west_m, east_m in point_of(reef, "x_m") if isinstance(reef, Mapping) else ():
            for key, at_m in placed_in(raw, "delivery", "from_m", "to_m"):
                if west_m <= at_m[0] <= east_m:
                    allowed = f"in the reef or its passage, x {west_m:g} to {east_m:g}; place it outside"
                    yield ConfigurationFault(key, f"[{at_m[0]:g}, {at_m[1]:g}]", allowed)

    def jobs_of(self, scenario: FerryScenario) -> Iterable[Delivery]:
        """The deliveries."""
        handling_s, length_m = scenario.mission.handling_s, scenario.length_m
        self._deliveries = {
            one.name: Delivery(one.name, one.from_m, one.to_m, handling_s, length_m) for one in scenario.delivery
        }
        return self._deliveries.values()

    @property
    def places(self) -> Sequence[Place]:
        """Rally points, and where loads are fetched and handed over."""
        points = [Place(point.name, "rally point", (point.position_m,)) for point in self.scenario.rally_point]
        return [*points, *(Place(one.name, "delivery", (one.place_m, one.to_m)) for one in self._deliveries.values())]

    def behaviour_at(self, job: Job, data: VehicleData) -> Behaviour:
        """To carry the load."""
        return Carrying(self._deliveries[job.name], data)
