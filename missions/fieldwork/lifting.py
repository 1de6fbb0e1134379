"""What there is to do, and how vehicles do it: a survey at a site takes one vehicle, a lift takes several at once.

An object has as many ends as it takes vehicles, on a circle around its middle. A vehicle takes the nearest end where
its obstacle sonar sees nobody. Once all ends are taken the lift is under way, and it is over after ``lift_s``; whoever
leaves earlier spoils it. A vehicle sees that the other ends are taken, so nothing has to be said about it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from pydantic import Field

from exchange.acoustics import loss
from exchange.arithmetic import distance, sincos
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
"""A vehicle counts on an end that it has taken if it is this near: the place that was told is rounded, and who has just
come swings round its end for some seconds."""
NEAREST_M = 5.0
"""No object lies nearer to the middle of a site."""
SEEN_SHARE = 0.9
"""And none farther than this share of the range of the shortest sonar: whoever surveys the site sees it."""


@dataclass(frozen=True)
class Lift(AnyonesJob):
    """An object: a ``remoras.work.DivisibleJob`` that comes up when somebody says where it lies.

    Attributes:
        name: of the lift; lift_s: how long it takes once all are there; n_vehicles: how many it takes at once.
        length_m: distance of two neighbouring ends.
        place_m: middle of the object; the origin of the map before it is known.
        share_left: 1 until it is done, then 0.
        resumed: who takes it over begins anew.
    """

    lift_s: float
    n_vehicles: int
    length_m: float
    place_m: Point = (0.0, 0.0)
    share_left: float = 1.0
    resumed: ClassVar[bool] = False

    @property
    def n_helpers(self) -> int:
        """How many it takes beside whoever has it."""
        return self.n_vehicles - 1

    def left(self, facts: Known) -> Lift | None:
        """The job at the place known; None while nobody has said where it is."""
        place_m = facts.get((LYING_AT, self.name))
        if place_m is None:
            return None
        return replace(self, place_m=place_m, share_left=1.0 if facts.get(self.done) is None else 0.0)

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook:
        """When the vehicle will be free if it lifts the object next, and finds the others there."""
        if self.share_left == 0.0:
            return outlook
        return outlook.stayed(self.place_m, self.lift_s, data)

    def ends_m(self, middle_m: Point) -> tuple[Point, ...]:
        """The ends of the object where its middle lies there.

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
    """What lies in the field in one run: the middle of each object by the name of its lift."""

    lying_m: tuple[tuple[str, Point], ...]


def laid_out(lifts: Collection[str], sites: Sequence[SiteSurvey], range_m: float, seed: int) -> SeaField:
    """Where the objects lie in the run with that seed: each near a site, every site and direction as likely.

    Args:
        lifts: their names; sites: of the field; range_m: of the shortest sonar; seed: root of all draws.
    """
    found = []
    for number, lift in enumerate(lifts):
        which, course, far = (loss.uniform(seed, loss.FINDS, number, 0, draw) for draw in (0, 1, 2))
        site = sites[min(int(which * len(sites)), len(sites) - 1)]
        sin, cos = sincos(2.0 * math.pi * course)
        away_m = NEAREST_M + far * max(0.0, SEEN_SHARE * range_m - NEAREST_M)
        found.append((lift, (site.place_m[0] + away_m * cos, site.place_m[1] + away_m * sin)))
    return SeaField(tuple(found))


class SonarSettings(SensorSettings):
    """The table ``[[vehicle.sensor]]`` of a sonar that shows objects."""

    EQUIPMENT: ClassVar[str] = "Sonar"

    range_m: float = Field(40.0, gt=NEAREST_M, description="farthest object that it shows")

    def make(self, data: VehicleData) -> Sensor:
        """The sonar of a vehicle."""
        return Sonar(self.range_m)


class Sonar:
    """Shows where objects lie, each once.

    Args:
        range_m: how far it sees.
    """

    table = None

    def __init__(self, range_m: float) -> None:
        self._range_m = range_m
        self._seen: set[str] = set()

    def sense(self, pose: Pose, world: SeaField, now_s: float) -> list[Observation]:
        """Objects within range that it has not shown yet."""
        found = []
        for name, (x_m, y_m) in world.lying_m:
            if name not in self._seen and distance((x_m, y_m), (pose.x_m, pose.y_m)) <= self._range_m:
                self._seen.add(name)
                found.append(Observation(((name, LYING_AT, (x_m + pose.error_m[0], y_m + pose.error_m[1])),)))
        return found


class Lifting(Behaviour):
    """Takes an end of an object and stays until the lift is over; alone there it stands still, and is dissatisfied.

    Args:
        lift: the job; data: of the vehicle.
        wait_s: after so long there without all others it gives up.
    """

    def __init__(self, lift: Lift, data: VehicleData, wait_s: float) -> None:
        self._lift, self._wait = lift, HelpAwaited(f"others at {lift.name}", wait_s)
        self._stay = Stay(data)
        self._end_m: Point | None = None
        self._full_s = -math.inf  # when it last saw all ends taken: from farther off its sonar does not show them

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due once it is known where the object lies; it advances on the way, and while all are there."""
        if picture.facts.get(self._lift.done) is not None:
            return DONE
        if self._wait.is_given_up:
            return BEYOND_IT
        middle_m = picture.facts.get((LYING_AT, self._lift.name))
        return IDLE if middle_m is None else self._perceived(middle_m, motion, picture, performed)

    def _perceived(self, middle_m: Point, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """The same where the middle of the object is known."""
        ends_m = self._lift.ends_m(middle_m)
        free_m = [end_m for end_m in ends_m if not _is_taken(end_m, picture)]
        if self._end_m not in free_m:  # of an end that another one has taken, too
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
        """To an end in transit; stay there."""
        return None if self._end_m is None else self._stay.reference(self._end_m, motion)


def _is_taken(end_m: Point, picture: Picture, within_m: float = THERE_M) -> bool:
    return any(distance(end_m, contact_m) <= within_m for contact_m in picture.body.contacts_m)


class Helping(Lifting):
    """Takes an end of an object that another vehicle is to lift; who holds the lift waits for it.

    Args:
        lift: the job; help: whether this vehicle is of use there; data: of the vehicle.
        wait_s: after so long there without all others it is free for other calls.
    """

    def __init__(self, lift: Lift, help: Help, data: VehicleData, wait_s: float) -> None:
        super().__init__(lift, data, wait_s)
        self._me, self._help = data.name, help

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due as ``Lifting`` is, as long as another one is needed; it says when it begins, and that it is done."""
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
