"""Jobs of field work and their behaviours: site surveys, deliveries, line surveys and lifts."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

from pydantic import Field

from exchange.arithmetic import distance, sincos
from exchange.channel import loss
from missions.fieldwork.assistance import Help, HelpAwaited
from missions.meeting.job_mission import DONE_BY, THERE_M, AnyonesJob, ReportedJob, Stay, Staying
from missions.meeting.meeting import NEWS_FRAMES
from remoras.behaviours import (
    ADVANCING,
    BEYOND_IT,
    DONE,
    IDLE,
    STANDING,
    Approach,
    Behaviour,
    Perception,
    Reference,
    distance_m,
)
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.sensor import Observation, Pose, Sensor, SensorSettings
from remoras.table import Name, PointM, Positive, Section
from remoras.work import Outlook, Point


class FieldJob(Section, AnyonesJob):
    """Table of one job, and the job itself; role ``PLAYER of NAME`` does it, figures show places as ``SHOWN``."""

    PLAYER: ClassVar[str]
    SHOWN: ClassVar[str]

    name: Name = Field(description="name of the job")


class SiteSurvey(FieldJob):
    """One ``[[site]]``: a dwell there."""

    PLAYER, SHOWN = "Surveyor", "site"

    position_m: PointM = Field(description="position, x east, y north")
    stay_s: Positive = Field(120.0, description="duration of a survey")

    @property
    def place_m(self) -> Point:
        """Its position."""
        return self.position_m

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook:
        """Return the outlook after travel and stay."""
        return outlook.stayed(self.position_m, self.stay_s, data)

    def behaviour(self, data: VehicleData, scenario: Any) -> Behaviour:
        """Create the behaviour that dwells there."""
        return Staying(self, data)


@dataclass(frozen=True)
class Delivery(AnyonesJob):
    """A load: a ``remoras.work.Job`` with ``handling_s`` at pick-up and at hand-over each."""

    PLAYER: ClassVar[str] = "Carrier"
    SHOWN: ClassVar[str] = "delivery"

    place_m: Point
    to_m: Point
    handling_s: float
    length_m: Callable[[Point, Point], float]

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook:
        """Return the outlook after the delivery."""
        way_m = self.length_m(outlook.position_m, self.place_m) + self.length_m(self.place_m, self.to_m)
        return Outlook(outlook.free_s + way_m / data.transit_speed_mps + 2.0 * self.handling_s, self.to_m)

    def behaviour(self, data: VehicleData, scenario: Any) -> Behaviour:
        """Create the behaviour that carries it."""
        return Carrying(self, data)


class Carrying(Behaviour):
    """Pick-up and hand-over of a load."""

    def __init__(self, delivery: Delivery, data: VehicleData) -> None:
        self._delivery, self._data = delivery, data
        self._stay = Stay(data)
        self._has_load = False

    @property
    def _place_m(self) -> Point:
        return self._delivery.to_m if self._has_load else self._delivery.place_m

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending, nearest first; progresses on the way and during pick-up and hand-over."""
        delivery = self._delivery
        if picture.facts.get(delivery.done) is not None:
            return DONE
        to_go_m = delivery.length_m(motion.position_m, self._place_m)
        perception = self._stay.perceive(to_go_m, delivery.handling_s, picture.body.now_s, performed)
        if perception is not DONE or self._has_load:
            return perception
        self._has_load, self._stay = True, Stay(self._data)
        return ADVANCING

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return self._stay.reference(self._place_m, motion)


ESCORTS = "escorts"
ON_LINE_M = 3.0
ABREAST = 0.5  # station of the escort as share of the largest distance; the rest covers its reaction time


class SurveyLine(FieldJob):
    """One ``[[line]]`` to survey."""

    PLAYER, SHOWN = "Surveyor", "line"

    from_m: PointM = Field(description="start, x east, y north")
    to_m: PointM = Field(description="end")
    escorted: bool = Field(False, description="true: a second vehicle must escort the surveying one")

    @property
    def place_m(self) -> Point:
        """Its start."""
        return self.from_m

    @property
    def n_helpers(self) -> int:
        """Vehicles needed besides the holder."""
        return int(self.escorted)

    @property
    def n_vehicles(self) -> int:
        """Vehicles needed at once."""
        return 1 + self.n_helpers

    @cached_property  # 2 % of a mission
    def length_m(self) -> float:
        """Length of the line."""
        return distance(self.place_m, self.to_m)

    def at(self, along_m: float) -> Point:
        """Point at a distance from the start."""
        share = along_m / self.length_m
        (x_m, y_m), (to_x_m, to_y_m) = self.place_m, self.to_m
        return x_m + share * (to_x_m - x_m), y_m + share * (to_y_m - y_m)

    def along_m(self, position_m: Point) -> float:
        """Distance from the start to the nearest point of the line.

        >>> SurveyLine(name="line 1", from_m=(0.0, 0.0), to_m=(100.0, 0.0)).along_m((40.0, 7.0))
        40.0
        """
        (x_m, y_m), (to_x_m, to_y_m) = self.place_m, self.to_m
        inner = (position_m[0] - x_m) * (to_x_m - x_m) + (position_m[1] - y_m) * (to_y_m - y_m)
        return min(self.length_m, max(0.0, inner / self.length_m))

    def beside(self, position_m: Point, aside_m: float) -> Point:
        """Point abreast of another, ``aside_m`` to the left of the line's direction.

        >>> SurveyLine(name="line 1", from_m=(0.0, 0.0), to_m=(100.0, 0.0)).beside((40.0, 1.0), 10.0)
        (40.0, 11.0)
        """
        (x_m, y_m), (to_x_m, to_y_m), share = self.place_m, self.to_m, aside_m / self.length_m
        return position_m[0] - share * (to_y_m - y_m), position_m[1] + share * (to_x_m - x_m)

    def is_left(self, position_m: Point) -> bool:
        """Return True for a point left of the line's direction."""
        (x_m, y_m), (to_x_m, to_y_m) = self.place_m, self.to_m
        return (to_x_m - x_m) * (position_m[1] - y_m) >= (to_y_m - y_m) * (position_m[0] - x_m)

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook:
        """Return the outlook after the survey, without a wait for an escort."""
        way_s = distance(outlook.position_m, self.place_m) / data.transit_speed_mps
        return Outlook(outlook.free_s + way_s + self.length_m / data.survey_speed_mps, self.to_m)

    def behaviour(self, data: VehicleData, scenario: Any) -> Behaviour:
        """Create the behaviour that surveys it."""
        return SurveyingLine(self, scenario.mission.within_m, scenario.mission.wait_s, data)

    def helper(self, help: Help, data: VehicleData, scenario: Any) -> Behaviour:
        """Create the behaviour that escorts its holder."""
        return FollowingSource(self, scenario.mission.within_m, help, data)


def is_seen(at_m: Point, within_m: float, picture: Picture) -> bool:
    """Return True if the obstacle sonar shows a vehicle within ``within_m`` of a place."""
    return any(distance(at_m, contact_m) <= within_m for contact_m in picture.body.contacts_m)


class SurveyingLine(Behaviour):
    """Survey of a line, resumed after a stop; waits, dissatisfied, for a required escort."""

    def __init__(self, line: SurveyLine, within_m: float, wait_s: float, data: VehicleData) -> None:
        self._line, self._within_m = line, within_m
        self._wait = HelpAwaited(f"an escort on {line.name}", wait_s)
        self._transit_mps, self._survey_mps = data.transit_speed_mps, data.survey_speed_mps
        self._approach = Approach(data.transit_speed_mps)
        self._surveyed_m = 0.0

    def _is_on_line(self, motion: Motion) -> bool:
        line, along_m = self._line, self._line.along_m(motion.position_m)
        # Within one second of the surveyed end, so that no stretch is skipped.
        is_next = abs(along_m - self._surveyed_m) <= max(ON_LINE_M, self._survey_mps)
        return is_next and distance_m(motion, line.at(along_m)) <= ON_LINE_M

    def _survey(self, motion: Motion, picture: Picture) -> bool:
        goes_on = not self._line.escorted or is_seen(motion.position_m, self._within_m, picture)
        if goes_on:
            self._surveyed_m = max(self._surveyed_m, self._line.along_m(motion.position_m))
        return goes_on

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending until the line is surveyed, nearest first; progresses under way and on the line."""
        line = self._line
        if picture.facts.get(line.done) is not None:
            return DONE
        if self._wait.is_given_up:
            return BEYOND_IT
        if performed and self._is_on_line(motion):
            if not self._survey(motion, picture):
                return self._wait.perceived(picture.body.now_s)
            self._wait.is_over()
            return DONE if line.length_m - self._surveyed_m <= ON_LINE_M / 2.0 else ADVANCING
        self._wait.is_over()
        to_go_m = distance_m(motion, line.at(self._surveyed_m))
        return self._approach.perceived(to_go_m, picture.body.now_s, performed)

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Head for the surveyed end in transit, then along the line; hold without an escort."""
        if not self._is_on_line(motion):
            return Reference(self._line.at(self._surveyed_m), self._transit_mps)
        if not self._survey(motion, picture):
            return Reference(motion.position_m, 0.0)
        return Reference(self._line.to_m, self._survey_mps)


class FollowingSource(Behaviour):
    """Escort of a line's holder; waits at the line's start until the holder is near the line."""

    def __init__(self, line: SurveyLine, within_m: float, help: Help, data: VehicleData) -> None:
        self._line, self._within_m, self._help = line, within_m, help
        self._speed_mps = data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)

    def _source_m(self, picture: Picture) -> Point:
        """Position of the holder by sonar or as received; else the start of the line."""
        line, within_m = self._line, self._within_m
        for name in self._help.holders:
            heard_m = picture.peers.positions_m.get(name)
            # A holder far from the line has yet to reach it.
            if heard_m is not None and distance(line.at(line.along_m(heard_m)), heard_m) <= within_m:
                seen_m = [at_m for at_m in picture.body.contacts_m if distance(at_m, heard_m) <= within_m]
                # The sonar contact nearest to the received position is the holder, and is fresher.
                return min(seen_m, key=lambda at_m: distance(at_m, heard_m), default=heard_m)
        return line.place_m

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending while the line is open and needs an escort; progresses while approaching or near."""
        is_needed = self._help.holders and picture.facts.get(self._line.done) is None
        source_m = self._source_m(picture) if is_needed else None
        to_go_m = math.inf if source_m is None else distance_m(motion, source_m)
        if not self._help.is_of_use(source_m, to_go_m, picture, performed):
            return IDLE
        if performed and to_go_m <= self._within_m:
            perception = ADVANCING if picture.body.contacts_m else STANDING
        else:
            perception = self._approach.perceived(to_go_m, picture.body.now_s, performed)
        return perception._replace(concludes=self._help.said(), ends=self._help.ends)

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Head for the nearer side of the holder; hold there."""
        aside_m = ABREAST * self._within_m
        abreast_m = self._line.beside(
            self._source_m(picture), aside_m if self._line.is_left(motion.position_m) else -aside_m
        )
        return Reference(abreast_m, 0.0 if distance_m(motion, abreast_m) <= ON_LINE_M else self._speed_mps)


LYING_AT, HELPS = "lyingAt", "helps"
SURELY_M = 1.5  # distance at which a vehicle counts on its end: reports are quantised, arrivals overshoot
NEAREST_M = 5.0  # least distance of an object from its site
SEEN_SHARE = 0.9  # largest distance, as share of the shortest sonar range: a survey detects every object


@dataclass(frozen=True, kw_only=True)
class Lift(ReportedJob):
    """Lift of an object by ``n_vehicles`` at ends ``length_m`` apart, around ``place_m``; it takes ``stay_s``."""

    PLAYER: ClassVar[str] = "Lifter"
    SHOWN: ClassVar[str] = ""
    placed_by = LYING_AT

    n_vehicles: int
    length_m: float

    @property
    def n_helpers(self) -> int:
        """Vehicles needed besides the holder."""
        return self.n_vehicles - 1

    def ends_m(self, middle_m: Point) -> tuple[Point, ...]:
        """Return the ends of the object: corners of a regular polygon around a given middle, ``length_m`` apart."""
        if self.n_vehicles == 1:
            return (middle_m,)
        # Neighbouring ends are the corners of a regular polygon: length = 2 radius sin(pi / n).
        radius_m = self.length_m / (2.0 * sincos(math.pi / self.n_vehicles)[0])
        ends = []
        for number in range(self.n_vehicles):
            sin, cos = sincos(2.0 * math.pi * number / self.n_vehicles)
            ends.append((round(middle_m[0] + radius_m * cos, 6), round(middle_m[1] + radius_m * sin, 6)))
        return tuple(ends)

    def behaviour(self, data: VehicleData, scenario: Any) -> Behaviour:
        """Create the behaviour that lifts."""
        return Lifting(self, data, scenario.mission.wait_s)

    def helper(self, help: Help, data: VehicleData, scenario: Any) -> Behaviour:
        """Create the behaviour that helps to lift."""
        return Helping(self, help, data, scenario.mission.wait_s)


SeaField = Mapping[str, Point]  # true middle of each object of a run, by lift


def laid_out(lifts: Collection[str], sites: Sequence[SiteSurvey], range_m: float, seed: int) -> SeaField:
    """Sample object positions near equally likely sites, within the shortest sonar's range."""
    lying = {}
    for number, lift in enumerate(lifts):
        which, course, far = (loss.uniform(seed, loss.FINDS, number, 0, draw) for draw in (0, 1, 2))
        site = sites[min(int(which * len(sites)), len(sites) - 1)]
        sin, cos = sincos(2.0 * math.pi * course)
        away_m = NEAREST_M + far * max(0.0, SEEN_SHARE * range_m - NEAREST_M)
        lying[lift] = site.place_m[0] + away_m * cos, site.place_m[1] + away_m * sin
    return lying


class SonarSettings(SensorSettings):
    """Table ``[[vehicle.sensor]]`` of a sonar that shows objects."""

    EQUIPMENT: ClassVar[str] = "Sonar"

    range_m: float = Field(40.0, gt=NEAREST_M, description="maximum range to an object")

    def make(self, data: VehicleData) -> Sensor:
        return Sonar(self.range_m)


class Sonar:
    """Sonar that shows each object once."""

    table = None

    def __init__(self, range_m: float) -> None:
        self._range_m = range_m
        self._seen: set[str] = set()

    def sense(self, pose: Pose, world: SeaField, now_s: float) -> list[Observation]:
        """Return objects newly within range."""
        observations = []
        for name, (x_m, y_m) in world.items():
            if name not in self._seen and distance((x_m, y_m), (pose.x_m, pose.y_m)) <= self._range_m:
                self._seen.add(name)
                observations.append(Observation(((name, LYING_AT, (x_m + pose.error_m[0], y_m + pose.error_m[1])),)))
        return observations


class Lifting(Behaviour):
    """Lift from one end of an object; alone there it waits, dissatisfied, for ``wait_s``."""

    def __init__(self, lift: Lift, data: VehicleData, wait_s: float) -> None:
        self._lift, self._wait = lift, HelpAwaited(f"others at {lift.name}", wait_s, lift.n_helpers)
        self._stay = Stay(data)
        self._end_m: Point | None = None
        self._full_s = -math.inf  # last time all ends were seen taken

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending once the place is known; progresses on the way and while all ends are taken."""
        if picture.facts.get(self._lift.done) is not None:
            return DONE
        if self._wait.is_given_up:
            return BEYOND_IT
        middle_m = picture.facts.get((LYING_AT, self._lift.name))
        return IDLE if middle_m is None else self._perceived(middle_m, motion, picture, performed)

    def _perceived(self, middle_m: Point, motion: Motion, picture: Picture, performed: bool) -> Perception:
        ends_m = self._lift.ends_m(middle_m)
        free_m = [end_m for end_m in ends_m if not is_seen(end_m, THERE_M, picture)]
        if self._end_m not in free_m:  # also if another vehicle has taken it
            self._end_m = min(free_m, key=lambda end_m: distance_m(motion, end_m), default=None)
        if self._end_m is None:
            self._full_s = picture.body.now_s
        # A vehicle without an end is soon out of sonar range, where all ends seem free: it stays away for a while.
        if self._end_m is None or picture.body.now_s - self._full_s < NEWS_FRAMES * picture.frame_s:
            return IDLE
        to_go_m = distance_m(motion, self._end_m)
        is_there = performed and to_go_m <= THERE_M
        if is_there and (
            to_go_m > SURELY_M
            or any(end_m != self._end_m and not is_seen(end_m, SURELY_M, picture) for end_m in ends_m)
        ):
            # The lift lasts its whole duration with all ends taken, so each gap restarts it.
            self._stay.begin_anew()
            return self._wait.perceived(picture.body.now_s)
        self._wait.is_over()
        return self._stay.perceive(to_go_m, self._lift.stay_s, picture.body.now_s, performed)

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return None if self._end_m is None else self._stay.reference(self._end_m, motion)


class Helping(Lifting):
    """Help at another vehicle's lift; after ``wait_s`` without the others free for other calls."""

    def __init__(self, lift: Lift, help: Help, data: VehicleData, wait_s: float) -> None:
        super().__init__(lift, data, wait_s)
        self._me, self._help = data.name, help

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending like ``Lifting``, if another helper is needed; records start of the help and completed lift."""
        middle_m = picture.facts.get((LYING_AT, self._lift.name))
        to_go_m = math.inf if middle_m is None else distance_m(motion, middle_m)
        is_of_use = self._help.is_of_use(middle_m, to_go_m, picture, performed)
        if middle_m is None or not is_of_use or picture.facts.get(self._lift.done) is not None:
            return IDLE
        seen = self._perceived(middle_m, motion, picture, performed)
        if self._wait.is_given_up:
            return IDLE
        # Done is reported by the holder's objective; a helper states the fact, which then ends its activity.
        if seen is DONE:
            return Perception(1.0, 1.0, concludes=(Observation(((self._lift.name, DONE_BY, self._me),)),))
        return seen._replace(concludes=self._help.said(), ends=self._help.ends) if seen.stimulus else seen
