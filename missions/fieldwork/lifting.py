"""Recovery: site surveys by one vehicle, lifts by several at once.

An object has one end per required vehicle, on a circle around its middle. A vehicle takes the nearest end where its
obstacle sonar shows no vehicle. The lift starts once all ends are taken and ends after ``lift_s``; a departure restarts
it. Sonar alone shows whether the other ends are taken, without messages.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from pydantic import Field

from exchange.arithmetic import distance, sincos
from exchange.channel import loss
from missions.fieldwork.helping import NEWS_FRAMES, Help, HelpAwaited
from missions.fieldwork.sites import SiteSurvey
from missions.meeting.staying import DONE_BY, THERE_M, AnyonesJob, Stay
from remoras.behaviours import BEYOND_IT, DONE, IDLE, Behaviour, Perception, Reference, distance_m
from remoras.beliefs import Known
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.sensor import Observation, Pose, Sensor, SensorSettings
from remoras.work import Outlook, Point

LYING_AT, HELPS = "lyingAt", "helps"
SURELY_M = 1.5
"""Distance at which a vehicle counts on its end: reports are quantised, arrivals overshoot."""
NEAREST_M = 5.0
"""Least distance of an object from its site."""
SEEN_SHARE = 0.9
"""Largest distance, as share of the shortest sonar range: a survey detects every object."""


@dataclass(frozen=True)
class Lift(AnyonesJob):
    """Lift of an object: a ``remoras.work.DivisibleJob`` that exists once its place is reported.

    Attributes:
        lift_s: duration once all ``n_vehicles`` are present.
        length_m: distance between neighbouring ends.
        place_m: middle of the object; the origin before it is known.
        resumed: False: a successor restarts it.
    """

    lift_s: float
    n_vehicles: int
    length_m: float
    place_m: Point = (0.0, 0.0)
    share_left: float = 1.0
    resumed: ClassVar[bool] = False

    @property
    def n_helpers(self) -> int:
        """Vehicles needed besides the holder."""
        return self.n_vehicles - 1

    def left(self, facts: Known) -> Lift | None:
        """Return the job at the reported place; None before any report."""
        place_m = facts.get((LYING_AT, self.name))
        if place_m is None:
            return None
        return replace(self, place_m=place_m, share_left=1.0 if facts.get(self.done) is None else 0.0)

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook:
        """Return the outlook after the lift, with the others present."""
        if self.share_left == 0.0:
            return outlook
        return outlook.stayed(self.place_m, self.lift_s, data)

    def ends_m(self, middle_m: Point) -> tuple[Point, ...]:
        """Return the ends of the object for a given middle.

        >>> Lift("lift 1", 60.0, 2, 10.0).ends_m((100.0, 50.0))
        ((105.0, 50.0), (95.0, 50.0))
        """
        if self.n_vehicles == 1:
            return (middle_m,)
        radius_m = self.length_m / (2.0 * sincos(math.pi / self.n_vehicles)[0])
        found = []
        for number in range(self.n_vehicles):
            sin, cos = sincos(2.0 * math.pi * number / self.n_vehicles)
            found.append((round(middle_m[0] + radius_m * cos, 6), round(middle_m[1] + radius_m * sin, 6)))
        return tuple(found)


@dataclass(frozen=True)
class SeaField:
    """True middle of each object of a run, by lift."""

    lying_m: tuple[tuple[str, Point], ...]


def laid_out(lifts: Collection[str], sites: Sequence[SiteSurvey], range_m: float, seed: int) -> SeaField:
    """Sample object positions near equally likely sites, within the shortest sonar's range."""
    found = []
    for number, lift in enumerate(lifts):
        which, course, far = (loss.uniform(seed, loss.FINDS, number, 0, draw) for draw in (0, 1, 2))
        site = sites[min(int(which * len(sites)), len(sites) - 1)]
        sin, cos = sincos(2.0 * math.pi * course)
        away_m = NEAREST_M + far * max(0.0, SEEN_SHARE * range_m - NEAREST_M)
        found.append((lift, (site.place_m[0] + away_m * cos, site.place_m[1] + away_m * sin)))
    return SeaField(tuple(found))


class SonarSettings(SensorSettings):
    """Table ``[[vehicle.sensor]]`` of a sonar that shows objects."""

    EQUIPMENT: ClassVar[str] = "Sonar"

    range_m: float = Field(40.0, gt=NEAREST_M, description="maximum range to an object")

    def make(self, data: VehicleData) -> Sensor:
        """Create the sonar of a vehicle."""
        return Sonar(self.range_m)


class Sonar:
    """Sonar that shows each object once."""

    table = None

    def __init__(self, range_m: float) -> None:
        self._range_m = range_m
        self._seen: set[str] = set()

    def sense(self, pose: Pose, world: SeaField, now_s: float) -> list[Observation]:
        """Return objects newly within range."""
        found = []
        for name, (x_m, y_m) in world.lying_m:
            if name not in self._seen and distance((x_m, y_m), (pose.x_m, pose.y_m)) <= self._range_m:
                self._seen.add(name)
                found.append(Observation(((name, LYING_AT, (x_m + pose.error_m[0], y_m + pose.error_m[1])),)))
        return found


class Lifting(Behaviour):
    """Lift from one end of an object; alone there it waits, dissatisfied, for ``wait_s``."""

    def __init__(self, lift: Lift, data: VehicleData, wait_s: float) -> None:
        self._lift, self._wait = lift, HelpAwaited(f"others at {lift.name}", wait_s)
        self._stay = Stay(data)
        self._end_m: Point | None = None
        self._full_s = -math.inf  # last time all ends were seen taken: beyond range the sonar does not show them

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
        free_m = [end_m for end_m in ends_m if not _is_taken(end_m, picture)]
        if self._end_m not in free_m:  # also if another vehicle has taken it
            self._end_m = min(free_m, key=lambda end_m: distance_m(motion, end_m), default=None)
        if self._end_m is None:
            self._full_s = picture.body.now_s
        if self._end_m is None or picture.body.now_s - self._full_s < NEWS_FRAMES * picture.frame_s:
            return IDLE
        to_go_m = distance_m(motion, self._end_m)
        is_there = performed and to_go_m <= THERE_M
        if is_there and (
            to_go_m > SURELY_M
            or any(end_m != self._end_m and not _is_taken(end_m, picture, SURELY_M) for end_m in ends_m)
        ):
            self._stay.begin_anew()
            return self._wait.perceived(picture.body.now_s)
        self._wait.is_over()
        return self._stay.perceive(to_go_m, self._lift.lift_s, picture.body.now_s, performed)

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Head for an end in transit; hold there."""
        return None if self._end_m is None else self._stay.reference(self._end_m, motion)


def _is_taken(end_m: Point, picture: Picture, within_m: float = THERE_M) -> bool:
    return any(distance(end_m, contact_m) <= within_m for contact_m in picture.body.contacts_m)


class Helping(Lifting):
    """Help at another vehicle's lift; after ``wait_s`` without the others free for other calls."""

    def __init__(self, lift: Lift, help: Help, data: VehicleData, wait_s: float) -> None:
        super().__init__(lift, data, wait_s)
        self._me, self._help = data.name, help

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending like ``Lifting`` while another helper is needed; reports its start and the end."""
        middle_m = picture.facts.get((LYING_AT, self._lift.name))
        to_go_m = math.inf if middle_m is None else distance_m(motion, middle_m)
        is_of_use = self._help.is_of_use(middle_m, to_go_m, picture, performed)
        if middle_m is None or not is_of_use or picture.facts.get(self._lift.done) is not None:
            return IDLE
        found = self._perceived(middle_m, motion, picture, performed)
        if self._wait.is_given_up:
            return IDLE
        if found is DONE:
            return Perception(1.0, 1.0, concludes=(Observation(((self._lift.name, DONE_BY, self._me),)),))
        return found._replace(concludes=self._help.said(), ends=self._help.ends) if found.stimulus else found
