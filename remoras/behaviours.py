"""The seam of behaviours: how an activity is carried out, and how it perceives its own stimulus and advance.

A behaviour belongs to one activity set of one vehicle in one run, so it may remember what it has seen. It sees the
motion of its vehicle and a ``Picture`` of what the vehicle has heard or worked out, never the truth. Who calls what:

* ``Mission.behaviour_for`` makes a behaviour when the vehicle takes on an activity set, which its first activity names;
* ``perceive`` is called at every decision for every set, whether the vehicle performs it or not;
* ``reference`` is called in every motion tick for the set that guides the vehicle, and for no other, unless its last
  answer says that it still holds.

A behaviour decides nothing: it never says when the vehicle turns to it. That follows from motivations alone. A runnable
example, a behaviour that circles a point::

    class Circling(Behaviour):
        def __init__(self, centre_m: Point, radius_m: float, data: VehicleData) -> None:
            self._centre_m, self._radius_m, self._speed_mps = centre_m, radius_m, data.survey_speed_mps

        def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
            return ADVANCING if performed else DUE

        def reference(self, motion: Motion, picture: Picture) -> Reference | None:
            x_m, y_m = self._centre_m
            ahead_rad = math.atan2(motion.y_m - y_m, motion.x_m - x_m) + 0.5
            target_m = x_m + self._radius_m * math.cos(ahead_rad), y_m + self._radius_m * math.sin(ahead_rad)
            return Reference(target_m, self._speed_mps)

``remoras.testing.check_behaviour`` checks a behaviour against this text.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Collection, Sequence
from functools import partial
from typing import NamedTuple, Protocol

from exchange.arithmetic import distance
from remoras.activities import Wait
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.sensor import Observation
from remoras.work import Point

CAPTURE_M = 1.0
"""A waypoint counts as reached within this distance."""
STEADY_M = 0.05
"""A vehicle that comes nearer by less than this between two decisions stands still."""

FAR_M = 10_000.0
"""The stimulus of a place where nothing has been begun falls with distance as if it were half as much there."""
FARTHER_M = 5_000.0
"""From here on it falls more slowly."""
LEAST_ATTRACTED = 0.55
"""It stays above this: with the usual importances nobody goes home since its work is far away."""


class Perception(NamedTuple):
    """What an activity perceives of itself.

    Attributes:
        stimulus: 0..1; 0 means that there is nothing to do now.
        advance: how fast the objective gets on, -1..1: 1 as fast as planned, 0 not at all, -1 back as fast. None where
            there is nothing to get on with, or nothing to be perceived of it unless it is performed. It counts for the
            satisfaction of the role, whether the activity is performed or not.
        done: True once all there was to do has been done; it will not come back.
        failed: True once it is clear that this vehicle cannot do it: a sensor gives nothing, say.
        makes_no_way: True if that is since the vehicle does not get there, and no sensor is to blame.
        answers: 0..1, how much of a call for help would be settled if the vehicle turned to this activity; or what
            works that out, which is asked only while somebody calls.
        concludes: what it has found out by comparing what it expected with what it perceives; recorded and told like
            what a sensor observes, once for each time that it is said.
        ends: how much of the wait of a holder of a job, 0..1, the activity ends, by the name of the vehicle and its
            role; None if it ends no such wait. Calls of holders of jobs move nothing else.
        is_beyond_it: True if it has failed since this job is beyond the vehicle, which takes others, with its sensors.
        waits: what the vehicle waits for while this activity guides it; None if it gets on by itself.
    """

    stimulus: float
    advance: float | None = None
    done: bool = False
    failed: bool = False
    answers: float | Callable[[], float] = 1.0
    concludes: tuple[Observation, ...] = ()
    makes_no_way: bool = False
    ends: Callable[[str, str], float] | None = None
    is_beyond_it: bool = False
    waits: Wait | None = None

    @property
    def settled(self) -> float:
        """How much of a call would be settled, 0..1."""
        return self.answers() if callable(self.answers) else self.answers


class Reference(NamedTuple):
    """What guidance asks of the control: where to go (m) and how fast (m/s, 0 to stay).

    Attributes:
        holds_m: until the next decision the answer stays the same while the vehicle is farther than this from the
            target; infinite by default, then the behaviour is asked in every motion tick.
        is_over_ground: True if the speed is one over ground, as sensors have limits of: where water moves the vehicle
            holds it as far as its greatest speed allows. Else it is through the water.
    """

    target_m: Point
    speed_mps: float
    holds_m: float = math.inf
    is_over_ground: bool = False


class Behaviour(Protocol):
    """What carries an activity set out; see the text of this module."""

    @abstractmethod
    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Stimulus and advance of the activity now.

        Called by the functional layer at every decision, for sets that are not performed too. It may remember what it
        sees, since advance is a comparison with the last call. It must not change ``motion`` or ``picture``, draw
        random numbers or read a clock; the time is ``picture.body.now_s``.

        Args:
            performed: True if the vehicle performed the activity since the last decision.
        """
        ...

    @abstractmethod
    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Target and speed; None for an activity that does not guide, or has nowhere to go.

        Called by the functional layer once a motion tick, while the decision holds this set and one of its activities
        guides, unless the last answer holds, see ``Reference``. On None the vehicle slows down to a stop. It must not
        change ``motion`` or ``picture``: the control moves the vehicle within its limits, and to the nearest place in
        the area of operations if the target lies outside.
        """
        ...

    def accuracy_m(self, motion: Motion, picture: Picture) -> float:
        """Error of the vehicle's place with which the activity is of no use now; infinite by default.

        Called by the functional layer at every decision for the set that guides, and only where navigation errs. A
        vehicle that may be farther off learns first where it is, see ``missions.features.navigation``.
        """
        return math.inf


IDLE = Perception(0.0)
DONE = Perception(0.0, done=True)
FAILED = Perception(0.0, failed=True)
STUCK = Perception(0.0, failed=True, makes_no_way=True)
BEYOND_IT = Perception(0.0, failed=True, is_beyond_it=True)
DUE = Perception(1.0)
ADVANCING = Perception(1.0, 1.0)
STANDING = Perception(1.0, 0.0)


def distance_m(motion: Motion, point: Point) -> float:
    """Distance from the vehicle to a point (m)."""
    dx_m, dy_m = point[0] - motion.x_m, point[1] - motion.y_m
    return math.sqrt(dx_m * dx_m + dy_m * dy_m)


def attracted(to_go_m: float) -> Perception:
    """Due, but the less the farther away (m): so a vehicle that may go to several places begins with the nearest.

    >>> attracted(0.0).stimulus, attracted(2_500.0).stimulus, round(attracted(100_000.0).stimulus, 3)
    (1.0, 0.8, 0.556)
    """
    if to_go_m <= FARTHER_M:
        return Perception(1.0 / (1.0 + to_go_m / FAR_M))
    here = 1.0 / (1.0 + FARTHER_M / FAR_M)
    return Perception(LEAST_ATTRACTED + (here - LEAST_ATTRACTED) * FARTHER_M / to_go_m)


class Approach:
    """Perceives how fast a vehicle gets nearer to where it wants to be, as a share of the speed that it means to go.

    Args:
        speed_mps: at which it means to go.

    Attributes:
        is_on: True if the last call was told that the activity is performed; else one that is not changes nothing.

    >>> approach = Approach(1.0)
    >>> [approach.advance(to_go_m, now_s, performed=True) for now_s, to_go_m in enumerate((9.0, 8.0, 7.5, 7.5, 9.5))]
    [None, 1.0, 0.5, 0.0, -1.0]
    """

    def __init__(self, speed_mps: float) -> None:
        self._speed_mps = speed_mps
        self._last: tuple[float, float] | None = None
        self.is_on = False

    def advance(self, to_go_m: float, now_s: float, performed: bool) -> float | None:
        """The advance since the last call, -1..1; None unless it was performed then and since.

        Args:
            to_go_m: distance that is left.
            now_s: time of the decision.
            performed: True if the vehicle performed the activity since the last decision.
        """
        self.is_on = performed
        last, self._last = self._last, (to_go_m, now_s) if performed else None
        if last is None or not performed or now_s <= last[1]:
            return None
        nearer_m = last[0] - to_go_m
        if -STEADY_M <= nearer_m <= STEADY_M:
            return 0.0
        return max(-1.0, min(1.0, nearer_m / (self._speed_mps * (now_s - last[1]))))


class Standing(Behaviour):
    """Something that is always worth doing and guides nobody, such as listening or sending signals."""

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Always due."""
        return DUE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """It guides nobody."""
        return None


class Planning(Standing):
    """Organising and planning, which are due while the social layer has something to plan."""

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due while the picture says that planning is."""
        return DUE if picture.groups.planning_due else IDLE


class Supervision(Standing):
    """Gathering information as a leader, who is content while news of the mission keep coming in.

    Args:
        patience_s: how long it waits for the next news.
    """

    def __init__(self, patience_s: float) -> None:
        self._patience_s = patience_s

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due; it advances while the last news are fresh, and the less the older they are then."""
        late_s = picture.body.now_s - picture.peers.last_news_s - self._patience_s
        if late_s <= 0.0:
            return ADVANCING
        return Perception(1.0, max(0.0, 1.0 - late_s / self._patience_s)) if late_s < math.inf else DUE


class Working(Standing):
    """Productive work, which advances while the sensors of the vehicle yield something now and then.

    Args:
        patience_s: how long it waits for the next yield.
    """

    def __init__(self, patience_s: float) -> None:
        self._patience_s = patience_s

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due; once something was found, it advances while the last yield is fresh."""
        if not performed or picture.body.last_yield_s == -math.inf:  # on the way to where there is work
            return DUE
        return ADVANCING if picture.body.now_s - picture.body.last_yield_s <= self._patience_s else STANDING


def awaited(group: str, picture: Picture) -> float:
    """How much of a call to a meeting is settled by coming, 0..1: as far as the group waits for this vehicle alone."""
    return picture.groups.awaited.get(group, 1.0)


class Homing(Behaviour):
    """Goes to a rally point and waits there until the group is together.

    Who has arrived makes room: while the obstacle sonar sees somebody who has not, it goes on towards the point. Else
    those who come first would stand at the rim, in the way of all others.

    Args:
        point_m: the rally point; radius_m: a vehicle this near has arrived.
        group: name of the group that meets.
        data: of the vehicle.
        answers: how much of a call is settled by coming, 0..1, by the group and the picture.
        after: groups of the vehicle that meet before.
    """

    def __init__(
        self,
        point_m: Point,
        radius_m: float,
        group: str,
        data: VehicleData,
        answers: Callable[[str, Picture], float] = awaited,
        after: Collection[str] = (),
    ) -> None:
        self._answers, self._after = answers, after
        self._picture: Picture | None = None  # when it was due last
        self._due = IDLE  # what was perceived then
        self._point_m = point_m
        self._radius_m = radius_m
        self._group = group
        self._data = data
        self._way = Reference(point_m, data.transit_speed_mps, radius_m)
        self._room, self._stay = Reference(point_m, data.survey_speed_mps), Reference(point_m, 0.0)
        self._approach = Approach(data.transit_speed_mps)
        self._has_met = False

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due until the group is together and the vehicle has surely come; it advances while the vehicle comes nearer.

        Before the groups that meet first are together there is nothing to come for.
        Who was there before, and was away when the group met, comes once more: others may have met without it.
        """
        to_go_m = distance_m(motion, self._point_m)
        is_gathered = self._group in picture.groups.gathered
        self._has_met = is_gathered and (self._has_met or to_go_m + picture.body.uncertainty_m <= self._radius_m)
        if self._has_met or not picture.groups.gathered.issuperset(self._after):
            return IDLE
        advance = None
        if performed or self._approach.is_on:
            advance = self._approach.advance(to_go_m, picture.body.now_s, performed)
        if self._answers is awaited and not picture.groups.awaited:
            return Perception(1.0, advance)
        if self._picture is not picture or self._due.advance != advance:
            self._picture, answers = picture, partial(self._answers, self._group, picture)
            self._due = Perception(1.0, advance, answers=answers)
        return self._due

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To the rally point in transit; on arrival stay there, or make room for those who come."""
        to_go_m = distance_m(motion, self._point_m)
        if to_go_m > max(self._radius_m - picture.body.uncertainty_m, min(CAPTURE_M, self._radius_m)):
            return self._way
        makes_room = to_go_m > CAPTURE_M and any(
            distance(contact_m, self._point_m) > self._radius_m for contact_m in picture.body.contacts_m
        )
        return self._room if makes_room else self._stay

    def accuracy_m(self, motion: Motion, picture: Picture) -> float:
        """Half the radius, once the vehicle may have arrived: so there is room for others where it surely is there."""
        may_be_there = distance_m(motion, self._point_m) <= self._radius_m + picture.body.uncertainty_m
        return self._radius_m / 2.0 if may_be_there else math.inf


class Gap:
    """Whether another vehicle is too far away. That shows each time that it is heard anew, and not in between.

    Who comes nearer to where another one was heard does not come nearer to that one, which has gone on meanwhile. So
    one that moves in steps of what is heard, as a leader and its followers do, does not take turns at each step.

    Args:
        open_m: one farther away is too far away.
        closed_m: until it is this near.
        speed_mps: of the vehicle, where the other one follows it: that one goes to where it heard the vehicle last, so
            it is behind by the way of a TDMA frame besides.
    """

    def __init__(self, open_m: float, closed_m: float, speed_mps: float = 0.0) -> None:
        self._speed_mps = speed_mps
        self._open_m, self._closed_m = open_m, closed_m
        self._n_positions = -1  # that had been heard when it was judged
        self._is_open = False

    def is_open(self, name: str, to_go_m: float, picture: Picture) -> bool:
        """True while the vehicle of that name, which is so far from where it was heard last, is too far away."""
        if (n_positions := picture.peers.n_positions.get(name, 0)) != self._n_positions:
            self._n_positions = n_positions
            behind_m = self._speed_mps * picture.frame_s if self._speed_mps else 0.0
            self._is_open = to_go_m - behind_m > (self._closed_m if self._is_open else self._open_m)
        return self._is_open


class FollowingLeader(Behaviour):
    """Follows the first leader that has been heard, at a distance.

    Args:
        leaders: names, in order of preference.
        distance_m: it lets the leader get this far ahead, and then catches up by half.
        data: of the vehicle.
        after: groups of the vehicle that meet before that of the leader.
    """

    def __init__(
        self, leaders: Sequence[str], distance_m: float, data: VehicleData, after: Collection[str] = ()
    ) -> None:
        self._leaders, self._after = leaders, after
        self._near_m = distance_m / 2.0
        self._gaps = {name: Gap(distance_m, self._near_m) for name in leaders}
        self._data = data
        self._approach = Approach(data.transit_speed_mps)

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due while it has fallen behind, see ``Gap``, once the groups that meet first are together."""
        leader = self._leader(picture)
        if leader is None or not picture.groups.gathered.issuperset(self._after):
            return IDLE
        to_go_m = distance_m(motion, picture.peers.positions_m[leader])
        if not self._gaps[leader].is_open(leader, to_go_m, picture):
            return IDLE
        if not performed and not self._approach.is_on:
            return DUE
        advance = self._approach.advance(to_go_m, picture.body.now_s, performed)
        return Perception(1.0, None if advance is None else max(0.0, advance))  # a leader that leads on is no setback

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To where the leader was last heard, and wait near it; None if none was."""
        name = self._leader(picture)
        if name is None:
            return None
        leader_m = picture.peers.positions_m[name]
        is_near = distance_m(motion, leader_m) <= self._near_m
        return Reference(leader_m, 0.0 if is_near else self._data.transit_speed_mps)

    def _leader(self, picture: Picture) -> str | None:
        return next((name for name in self._leaders if name in picture.peers.positions_m), None)


class LeadingFollowers(Behaviour):
    """Waits for followers that fall behind while the group moves together.

    Args:
        followers: names.
        group: name of the group.
        distance_m: a follower farther away than this has fallen behind, until a quarter of that is made up for.
        data: of the vehicle.
    """

    def __init__(self, followers: Sequence[str], group: str, distance_m: float, data: VehicleData) -> None:
        self._gaps = {name: Gap(distance_m, 0.75 * distance_m, data.transit_speed_mps) for name in followers}
        self._group = group
        self._came: set[str] = set()

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due while a follower of the gathered group has fallen behind; one that never came does not follow."""
        if self._group not in picture.groups.gathered:
            return IDLE
        positions_m = picture.peers.positions_m
        known = {name for name in self._gaps if name in positions_m}
        behind = {
            name for name in known if self._gaps[name].is_open(name, distance_m(motion, positions_m[name]), picture)
        }
        self._came |= known - behind
        return DUE if behind & self._came else IDLE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Stay."""
        return Reference(motion.position_m, 0.0)


class Positioning(Behaviour):
    """Takes a place in the formation once the group is together.

    Args:
        leaders: names, in order of preference; the first whose course is known counts.
        group: name of the group.
        offset_m: of the place from the leader, ahead of it and to its left.
        data: of the vehicle.
    """

    def __init__(self, leaders: Sequence[str], group: str, offset_m: Point, data: VehicleData) -> None:
        self._leaders = leaders
        self._group = group
        self._offset_m = offset_m
        self._data = data
        self._approach = Approach(data.transit_speed_mps)

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due while the place is known; it advances while the vehicle comes nearer."""
        place = self._place(picture)
        if place is None:
            return IDLE
        advance = self._approach.advance(distance_m(motion, place), picture.body.now_s, performed)
        return Perception(1.0, None if advance is None else max(0.0, advance))

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To the place in transit; stay there on arrival, and None while it is not known."""
        place = self._place(picture)
        if place is None:
            return None
        in_place = distance_m(motion, place) <= CAPTURE_M
        return Reference(place, 0.0 if in_place else self._data.transit_speed_mps)

    def _place(self, picture: Picture) -> Point | None:
        if self._group not in picture.groups.gathered:
            return None
        leader = next((name for name in self._leaders if name in picture.peers.headings), None)
        if leader is None:
            return None
        x_m, y_m = picture.peers.positions_m[leader]
        east, north = picture.peers.headings[leader]
        ahead_m, left_m = self._offset_m
        return (
            x_m + ahead_m * east - left_m * north,
            y_m + ahead_m * north + left_m * east,
        )
