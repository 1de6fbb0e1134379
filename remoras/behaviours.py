"""Protocol of behaviours: execution of an activity, perception of its stimulus and progress.

A behaviour belongs to one activity set of one vehicle in one run, so it may keep state. It sees the motion of its
vehicle and a ``Picture`` of received and derived data, never the truth. Calls:

* ``Mission.behaviour_for`` creates it when the vehicle takes on an activity set, by the first activity;
* ``perceive`` is called at a decision for every set, performed or not, whose last perception is no longer valid;
* ``reference`` is called in every motion tick for the guiding set, unless its last answer still holds.

A behaviour does not decide when it is performed: that follows from motivations alone. Example, a behaviour that circles
a point::

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

``remoras.testing.check_behaviour`` checks conformance.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Collection, Sequence
from typing import NamedTuple, Protocol

from exchange.arithmetic import distance
from remoras.activities import Wait
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.sensor import Observation
from remoras.work import Point

CAPTURE_M = 1.0
"""Distance within which a waypoint is reached."""
STEADY_M = 0.05
"""Approach between two decisions below which a vehicle stands still."""

FAR_M = 10_000.0
"""Scale of the stimulus of an unbegun place: 1 / (1 + distance / FAR_M)."""
FARTHER_M = 5_000.0
"""Distance from which the stimulus falls more slowly."""
LEAST_ATTRACTED = 0.55
"""Lower limit of that stimulus: with usual importances, distant work outweighs going home."""


class Perception(NamedTuple):
    """Perception of an activity by itself.

    Attributes:
        stimulus: 0..1; 0: nothing to do now.
        advance: progress rate, -1..1: 1 as planned, 0 none, -1 backwards; None if not applicable, or not observable
            while not performed. Or its function of motion and picture, called at every decision. It enters the
            satisfaction of the role even if the activity is not performed.
        done: complete, irrevocably.
        failed: this vehicle cannot do it: it does not reach the place (``makes_no_way``), this job exceeds it but
            others, with its sensors, do not (``is_beyond_it``), or else a sensor failed.
        answers: share of a call for help settled by this activity, 0..1; or its function, evaluated only on a call.
        concludes: inferred observations, recorded and sent like those of sensors, once per occurrence.
        ends: share of a job holder's wait that the activity ends, 0..1, by vehicle and role; None if it ends none.
            Only this makes calls of job holders effective.
        waits: condition awaited while this activity guides; None if it progresses.
        until_s: valid until before this time, see ``Behaviour.perceive``; by default asked for at every decision.
        until_m: valid until the vehicle has moved so far.
        per_m: largest change of a valid stimulus per metre moved; it stays above 0. The vehicle asks again before the
            change could affect a decision.
        peers: a valid perception ends with the next position received of one of these vehicles.

    >>> Perception(0.8, advance=-0.5).stimulus, DUE.stimulus, IDLE.stimulus, ADVANCING.advance, DONE.done
    (0.8, 1.0, 0.0, 1.0, True)
    """

    stimulus: float
    advance: float | Callable[[Motion, Picture], float | None] | None = None
    done: bool = False
    failed: bool = False
    answers: float | Callable[[], float] = 1.0
    concludes: tuple[Observation, ...] = ()
    makes_no_way: bool = False
    ends: Callable[[str, str], float] | None = None
    is_beyond_it: bool = False
    waits: Wait | None = None
    until_s: float = -math.inf
    peers: tuple[str, ...] = ()
    until_m: float = math.inf
    per_m: float = 0.0

    @property
    def settled(self) -> float:
        """Share of a call that would be settled, 0..1."""
        return self.answers() if callable(self.answers) else self.answers

    def progress(self, motion: Motion, picture: Picture) -> float | None:
        """Return the advance now."""
        return self.advance(motion, picture) if callable(self.advance) else self.advance


class Reference(NamedTuple):
    """Guidance output: target (m) and speed (m/s, 0 to stay).

    ``holds_m``: until ``perceive`` is called again, the answer is constant while the target is farther than this, no
    vehicle within sonar range and, at speed 0, the vehicle at rest; infinite: ask in every motion tick.
    ``is_over_ground``: the speed is over ground, as limited by sensors, and held in a current up to the greatest speed;
    else it is through the water.

    >>> Reference((100.0, 0.0), speed_mps=1.5).target_m
    (100.0, 0.0)
    """

    target_m: Point
    speed_mps: float
    holds_m: float = math.inf
    is_over_ground: bool = False


def basis(picture: Picture, performed: object) -> tuple[object, ...]:
    """Return the state on which valid perceptions depend, besides facts, time, peers and target."""
    body, groups = picture.body, picture.groups
    return (
        performed, body.battery <= body.reserve, body.outside_m > 0.0, groups.planning_due, groups.gathered,
    )  # fmt: skip


class Behaviour(Protocol):
    """Execution of an activity set; see the module docstring.

    >>> class Waiting(Behaviour):
    ...     def perceive(self, motion, picture, performed):
    ...         return DUE
    ...     def reference(self, motion, picture):
    ...         return Reference(motion.position_m, 0.0)
    >>> Waiting().reference(Motion(3.0, 4.0), Picture()).target_m
    (3.0, 4.0)
    """

    @abstractmethod
    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Return stimulus and progress of the activity now.

        An answer with ``until_s`` is valid until then, unless one of these changes before: the sets performed; a fact
        that it read by ``picture.facts.values``; ``planning_due`` or ``gathered`` of ``picture.groups``; its sensors;
        whether the energy lasts and the vehicle is in its area of operations; the received position of one of its
        ``peers``; the own position by more than ``until_m`` or ``per_m`` allow. That of the guiding set is also invalid
        within ``Reference.holds_m`` of its target. An answer that depends on anything else states no ``until_s``.

        It may keep state, since progress compares with the last call. It must not change ``motion`` or ``picture``,
        draw random numbers or read a clock; the time is ``picture.body.now_s``. ``performed``: since the last decision.
        """

    @abstractmethod
    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Return target and speed; None if the activity does not guide: the vehicle stops.

        It must not change ``motion`` or ``picture``. Vehicle limits apply; a target beyond the borders is moved inside.
        """

    def accuracy_m(self, motion: Motion, picture: Picture) -> float:
        """Return the position error (m) beyond which the activity is useless; infinite by default.

        A vehicle with a greater error gets a fix first (``missions.features.navigation``).
        """
        return math.inf


IDLE = Perception(0.0)
UNDUE = Perception(0.0, until_s=math.inf)
"""Nothing to do until facts or groups change."""
DONE = Perception(0.0, done=True)
FAILED = Perception(0.0, failed=True)
STUCK = Perception(0.0, failed=True, makes_no_way=True)
BEYOND_IT = Perception(0.0, failed=True, is_beyond_it=True)
DUE = Perception(1.0)
ALWAYS_DUE = Perception(1.0, until_s=math.inf)
"""Pending until facts or groups change."""
ADVANCING = Perception(1.0, 1.0)
STANDING = Perception(1.0, 0.0)


def distance_m(motion: Motion, point: Point) -> float:
    """Return the distance (m) from the vehicle to a point.

    >>> distance_m(Motion(0.0, 0.0), (3.0, 4.0))
    5.0
    """
    dx_m, dy_m = point[0] - motion.x_m, point[1] - motion.y_m
    return math.sqrt(dx_m * dx_m + dy_m * dy_m)


def attracted(to_go_m: float) -> Perception:
    """Return a pending perception that falls with distance (m), so the nearest place wins.

    >>> attracted(0.0).stimulus, attracted(2_500.0).stimulus, round(attracted(100_000.0).stimulus, 3)
    (1.0, 0.8, 0.556)
    """
    if to_go_m <= FARTHER_M:
        return Perception(1.0 / (1.0 + to_go_m / FAR_M))
    # From here on the stimulus falls to the lower limit, without a step.
    here = 1.0 / (1.0 + FARTHER_M / FAR_M)
    return Perception(LEAST_ATTRACTED + (here - LEAST_ATTRACTED) * FARTHER_M / to_go_m)


class Approach:
    """Progress of an approach, as a share of the intended speed; ``is_on`` while performed.

    >>> approach = Approach(1.0)
    >>> [approach.advance(to_go_m, now_s, performed=True) for now_s, to_go_m in enumerate((9.0, 8.0, 7.5, 7.5, 9.5))]
    [None, 1.0, 0.5, 0.0, -1.0]
    """

    def __init__(self, speed_mps: float) -> None:
        self._speed_mps = speed_mps
        self._last: tuple[float, float] | None = None
        self.is_on = False

    def advance(self, to_go_m: float, now_s: float, performed: bool) -> float | None:
        """Return the progress since the last call, -1..1; None unless performed then and since."""
        self.is_on = performed
        last, self._last = self._last, (to_go_m, now_s) if performed else None
        if last is None or not performed or now_s <= last[1]:
            return None
        nearer_m = last[0] - to_go_m
        if -STEADY_M <= nearer_m <= STEADY_M:
            return 0.0
        return max(-1.0, min(1.0, nearer_m / (self._speed_mps * (now_s - last[1]))))

    def perceived(self, to_go_m: float, now_s: float, performed: bool) -> Perception:
        """Return full stimulus and progress on the way to a place; before, a stimulus by distance."""
        advance = self.advance(to_go_m, now_s, performed)
        return Perception(1.0, advance) if performed else attracted(to_go_m)


class Standing(Behaviour):
    """Background activity without guidance, such as listening or sending signals."""

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        return ALWAYS_DUE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return None


class Planning(Standing):
    """Organising and planning, pending while the social layer has something to plan."""

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        return ALWAYS_DUE if picture.groups.planning_due else UNDUE


class Supervision(Standing):
    """Information gathering by a leader, satisfied by news within ``patience_s``."""

    def __init__(self, patience_s: float) -> None:
        self._patience_s = patience_s

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Return full progress while the last news are fresh, then decreasing with their age."""
        return Perception(1.0, self._progress, until_s=math.inf)

    def _progress(self, motion: Motion, picture: Picture) -> float | None:
        late_s = picture.body.now_s - picture.peers.last_news_s - self._patience_s
        if late_s <= 0.0:
            return 1.0
        return max(0.0, 1.0 - late_s / self._patience_s) if late_s < math.inf else None


class Working(Standing):
    """Productive work, progressing by facts of ``sensor`` (of any if empty) within ``patience_s``."""

    def __init__(self, patience_s: float, sensor: str = "") -> None:
        self._patience_s, self._sensor = patience_s, sensor

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Return progress while the last yield is fresh; none before the first one."""
        body = picture.body
        yield_s = body.yields_s.get(self._sensor, -math.inf) if self._sensor else body.last_yield_s
        if not performed or yield_s == -math.inf:  # still on the way to its work
            return DUE if performed else ALWAYS_DUE
        if body.now_s - yield_s > self._patience_s:
            return STANDING
        return Perception(1.0, 1.0, until_s=yield_s + self._patience_s)


def awaited(group: str, picture: Picture) -> float:
    """Return the share of a group's wait due to this vehicle, 0..1, which its arrival settles."""
    return picture.groups.awaited.get(group, 1.0)


class Homing(Behaviour):
    """Go to a rally point and wait there until the group is gathered.

    Groups ``after`` gather before.
    """

    def __init__(
        self,
        point_m: Point,
        radius_m: float,
        group: str,
        data: VehicleData,
        after: Collection[str] = (),
    ) -> None:
        self._after = after
        self._point_m = point_m
        self._radius_m = radius_m
        self._group = group
        self._way = Reference(point_m, data.transit_speed_mps, radius_m)
        self._room, self._stay = Reference(point_m, data.survey_speed_mps), Reference(point_m, 0.0, 0.0)
        self._approach = Approach(data.transit_speed_mps)
        self._has_met = False
        self._picture = Picture()

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending once preceding groups are gathered, until this group is and the vehicle has come."""
        to_go_m = distance_m(motion, self._point_m)
        is_gathered = self._group in picture.groups.gathered
        self._has_met = is_gathered and (self._has_met or to_go_m + picture.body.uncertainty_m <= self._radius_m)
        if self._has_met or not picture.groups.gathered.issuperset(self._after):
            return UNDUE if self._has_met or not is_gathered else IDLE
        until_s = -math.inf if is_gathered else math.inf
        if not performed:
            self._approach.advance(to_go_m, picture.body.now_s, performed)  # ends it
        # For ``_settled``, evaluated only on a call: it needs the work of all members.
        self._picture = picture
        return Perception(1.0, self._progress if performed else None, answers=self._settled, until_s=until_s)

    def _settled(self) -> float:
        return awaited(self._group, self._picture)

    def _progress(self, motion: Motion, picture: Picture) -> float | None:
        return self._approach.advance(distance_m(motion, self._point_m), picture.body.now_s, True)

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Return the rally point in transit; after arrival stay, or make room for arrivals."""
        to_go_m = distance_m(motion, self._point_m)
        # Within the radius for certain; with a greater error, at the point itself.
        if to_go_m > max(self._radius_m - picture.body.uncertainty_m, min(CAPTURE_M, self._radius_m)):
            return self._way
        # Towards the point while the sonar detects a vehicle outside: else first arrivals would block the rim.
        makes_room = to_go_m > CAPTURE_M and any(
            distance(contact_m, self._point_m) > self._radius_m for contact_m in picture.body.contacts_m
        )
        if makes_room:
            return self._room
        # The bound of an uncertain position grows while it stays.
        return self._stay._replace(holds_m=math.inf) if picture.body.uncertainty_m else self._stay

    def accuracy_m(self, motion: Motion, picture: Picture) -> float:
        """Return half the radius once the vehicle may have arrived, so that others have room."""
        may_be_there = distance_m(motion, self._point_m) <= self._radius_m + picture.body.uncertainty_m
        return self._radius_m / 2.0 if may_be_there else math.inf


class Gap:
    """Hysteresis on the distance to another vehicle, evaluated only on a new position of it.

    Above ``open_m`` the gap opens, below ``closed_m`` it closes. ``speed_mps`` is the own speed if the other vehicle
    follows: its lag by one TDMA frame is deducted.
    """

    def __init__(self, open_m: float, closed_m: float, speed_mps: float = 0.0) -> None:
        self._speed_mps = speed_mps
        self._open_m, self._closed_m = open_m, closed_m
        self._n_positions = -1  # number of positions at the last evaluation
        self._is_open = False

    def is_open(self, name: str, to_go_m: float, picture: Picture) -> bool:
        """True while the gap to a vehicle at a distance of ``to_go_m`` is open."""
        # Approaching a last received position is no approach to the vehicle, which has moved on: a leader and its
        # followers would alternate at each step.
        if (n_positions := picture.peers.n_positions.get(name, 0)) != self._n_positions:
            self._n_positions = n_positions
            behind_m = self._speed_mps * picture.frame_s if self._speed_mps else 0.0
            self._is_open = to_go_m - behind_m > (self._closed_m if self._is_open else self._open_m)
        return self._is_open


class FollowingLeader(Behaviour):
    """Follow the first of ``leaders`` of a group received: once ``distance_m`` away, close to half of it."""

    def __init__(
        self, leaders: Sequence[str], group: str, distance_m: float, data: VehicleData, after: Collection[str] = ()
    ) -> None:
        self._leaders, self._group, self._after, self._picture = tuple(leaders), group, after, Picture()
        self._near_m = distance_m / 2.0
        self._gaps = {name: Gap(distance_m, self._near_m) for name in leaders}
        self._data = data
        self._approach = Approach(data.transit_speed_mps)

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Return a stimulus while lagging, see ``Gap``, once the preceding groups are gathered."""
        if not picture.groups.gathered.issuperset(self._after):
            return UNDUE
        leader = self._leader(picture)
        if leader is None:
            return UNDUE._replace(peers=self._leaders)
        to_go_m = distance_m(motion, picture.peers.positions_m[leader])
        is_open = self._gaps[leader].is_open(leader, to_go_m, picture)
        self._picture = picture
        if not is_open:
            return UNDUE._replace(peers=self._leaders)
        if not (performed or self._approach.is_on):
            return Perception(1.0, answers=self._settled, until_s=math.inf, peers=self._leaders)
        advance = self._approach.advance(to_go_m, picture.body.now_s, performed)
        # A leader that moves on is no setback.
        return Perception(1.0, None if advance is None else max(0.0, advance), answers=self._settled)

    def _settled(self) -> float:
        return awaited(self._group, self._picture)  # to follow a leader that waits for all is to come

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Return the last received position of the leader, staying near it; None without one."""
        name = self._leader(picture)
        if name is None:
            return None
        leader_m = picture.peers.positions_m[name]
        is_near = distance_m(motion, leader_m) <= self._near_m
        return Reference(leader_m, 0.0 if is_near else self._data.transit_speed_mps)

    def _leader(self, picture: Picture) -> str | None:
        return next((name for name in self._leaders if name in picture.peers.positions_m), None)


class LeadingFollowers(Behaviour):
    """Wait for followers that lag by ``distance_m``, until a quarter of it is recovered."""

    def __init__(self, followers: Sequence[str], group: str, distance_m: float, data: VehicleData) -> None:
        self._gaps = {name: Gap(distance_m, 0.75 * distance_m, data.transit_speed_mps) for name in followers}
        self._group = group
        self._came: set[str] = set()

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Return a stimulus while a follower of the gathered group lags, if it ever came."""
        if self._group not in picture.groups.gathered:
            return UNDUE
        positions_m = picture.peers.positions_m
        known = {name for name in self._gaps if name in positions_m}
        behind = {
            name for name in known if self._gaps[name].is_open(name, distance_m(motion, positions_m[name]), picture)
        }
        # A follower that never came may be lost or elsewhere: no wait for it.
        self._came |= known - behind
        return (ALWAYS_DUE if behind & self._came else UNDUE)._replace(peers=tuple(self._gaps))

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return Reference(motion.position_m, 0.0)


class Positioning(Behaviour):
    """Take a position ``offset_m`` ahead of the leader and to its left, in a gathered group."""

    def __init__(self, leaders: Sequence[str], group: str, offset_m: Point, data: VehicleData) -> None:
        self._leaders = leaders
        self._group = group
        self._offset_m = offset_m
        self._data = data
        self._approach = Approach(data.transit_speed_mps)

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Return a stimulus while the position is known, with the progress of the approach."""
        if self._group not in picture.groups.gathered:
            return UNDUE
        place = self._place(picture)
        if place is None:
            return IDLE
        advance = self._approach.advance(distance_m(motion, place), picture.body.now_s, performed)
        return Perception(1.0, None if advance is None else max(0.0, advance))

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Return the position in transit; stay on arrival; None while unknown."""
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
