"""Attraction and repulsion: effect of influence signals on guidance (REMORAS, section V.B).

The paper: "a goal vector is selected and a vector combination is performed to avoid obstacles and repulsive signals
sent by others". ``docs/model/vehicle.md`` has the vectors and the right of way. A signal requests help from the holder
of another role, passage from a vehicle of equal rank. Two roles have equal rank if they are one that addresses itself,
or address each other and one of them has a job.

A yielding vehicle with another one behind it *relays the call*, one step weaker. A follower on the same course without
a stronger call yields to that and relays it in turn, so a row clears a passage. Own calls are even, relayed ones odd.

Signals act within sonar range and only on a sonar contact. A vehicle that withdraws or queues perceives no progress;
else its dissatisfaction would exceed that of the other vehicle and it would turn back.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from pydantic import Field

from exchange.arithmetic import distance, length
from remoras.motion.avoidance import SEPARATION_M, Neighbour, Velocity
from remoras.picture import Peers
from remoras.table import NotNegative, Sparse
from remoras.work import Point

ASIDE = 0.7071067811865476
"""Sine and cosine of a quarter of pi."""
HINDERED_S = 30.0
"""Time (s) for which a vehicle calls after an obstruction: the other one may be leaving."""
KNOWN_M = 20.0
"""Maximum distance between a sonar contact and the last received position of its vehicle."""
LEG_M = 10.0
"""Length of a leg that determines the course."""
LANES = 2.0
"""Half-width of the lane ahead, in separations."""
PRESSED = 1.2
"""Factor on the separation among equals: a withdrawing row may leave no space behind."""
REACH_M = 60.0
"""Range of attraction and repulsion, that of the obstacle sonar."""


@dataclass(frozen=True, slots=True)
class Pulls:
    """Attraction and repulsion inputs from the last decision, 0..1.

    ``own`` is the strongest own call sent lately in roles with equals; ``answered`` the motivation by the call of each
    vehicle, by the guiding activity. ``equals``: call of each vehicle of equal rank, regardless of age; ``passed``: of
    those that they relay. ``is_among_equals``: the guiding role has roles of equal rank.
    """

    own: float = 0.0
    answered: Mapping[str, float] = field(default_factory=dict)
    equals: Mapping[str, float] = field(default_factory=dict)
    passed: Mapping[str, float] = field(default_factory=dict)
    is_among_equals: bool = False


NO_PULLS = Pulls()
UNMOVED = Pulls(is_among_equals=True)
"""Inputs of a vehicle with equals but without signals."""


class GuidanceTable(Sparse):
    """Table ``[guidance]``; weight 0 disables attraction or repulsion."""

    UNSAID = frozenset({"keeps_calls"})

    separation_m: float = Field(
        SEPARATION_M, ge=1.0, le=20.0, description="minimum distance between vehicles in one depth layer"
    )
    attraction: NotNegative = Field(
        1.0, description="weight of the attraction to a nearby caller that the vehicle responds to"
    )
    repulsion: NotNegative = Field(
        2.0, description="weight of the repulsion by nearby calls on more satisfied vehicles in the way"
    )
    keeps_calls: bool = Field(
        False, description="true: a withdrawing vehicle does not relay the call to the ones behind it"
    )


def attracted_velocity(
    goal: Velocity, position_m: Point, pulls: Pulls, positions_m: Mapping[str, Point], weight: float
) -> Velocity:
    """Return the goal velocity plus attraction to callers (m/s), at most as fast as the goal.

    >>> attracted_velocity((3.0, 0.0), (0.0, 0.0), Pulls(answered={"AUV01": 1.0}), {"AUV01": (-30.0, 0.0)}, 0.5)
    (1.5, 0.0)
    """
    (x_mps, y_mps), most_mps = goal, length(*goal)
    for name, strength in pulls.answered.items():
        if (at_m := positions_m.get(name)) is None:
            continue
        dx_m, dy_m = at_m[0] - position_m[0], at_m[1] - position_m[1]
        distance_m = length(dx_m, dy_m)
        if 0.0 < distance_m <= REACH_M:
            x_mps += weight * most_mps * strength * dx_m / distance_m
            y_mps += weight * most_mps * strength * dy_m / distance_m
    speed_mps = length(x_mps, y_mps)
    share = most_mps / speed_mps if speed_mps > most_mps else 1.0
    return share * x_mps, share * y_mps


def repelled(position_m: Point, at_m: Point, weight_mps: float) -> Velocity:
    """Return the yielding velocity (m/s): away from the other vehicle and to the right.

    >>> [round(one, 9) for one in repelled((0.0, 0.0), (30.0, 0.0), 2.0**0.5)]
    [-1.0, -1.0]
    """
    dx_m, dy_m = at_m[0] - position_m[0], at_m[1] - position_m[1]
    scale = weight_mps * ASIDE / (length(dx_m, dy_m) or 1.0)
    return -scale * (dx_m - dy_m), -scale * (dy_m + dx_m)


def ahead(goal: Velocity, neighbours: Sequence[Neighbour], lane_m: float) -> Neighbour | None:
    """Return the nearest sonar contact ahead, within ``lane_m`` of the course; None without one.

    >>> near, far = Neighbour(9.0, 1.0, 0.0, 0.0), Neighbour(20.0, 0.0, 0.0, 0.0)
    >>> ahead((2.0, 0.0), [far, near, Neighbour(-5.0, 0.0, 0.0, 0.0)], 10.0) == near
    True
    """
    speed_mps = length(*goal)
    nearest, nearest_m = None, REACH_M
    for neighbour in neighbours if speed_mps > 0.0 else ():
        along_m = (neighbour.dx_m * goal[0] + neighbour.dy_m * goal[1]) / speed_mps
        aside_m = (neighbour.dx_m * goal[1] - neighbour.dy_m * goal[0]) / speed_mps
        if 0.0 < along_m <= nearest_m and -lane_m <= aside_m <= lane_m:
            nearest, nearest_m = neighbour, along_m
    return nearest


class Courses:
    """Courses of other vehicles, from their last legs of at least ``LEG_M``."""

    def __init__(self) -> None:
        self._from_m: dict[str, Point] = {}
        self._bound: dict[str, Point] = {}

    def note(self, peers: Peers) -> None:
        """Update from received positions; a new vehicle has its current heading as course."""
        headings = peers.headings
        for name, at_m in peers.positions_m.items():
            from_m = self._from_m.get(name)
            if from_m is None:
                self._from_m[name] = at_m
                if name in headings:
                    self._bound[name] = headings[name]
            # Shorter moves are evasive: a vehicle pushed back a little, or letting another one pass, keeps its course.
            elif (leg_m := distance(from_m, at_m)) >= LEG_M:
                self._from_m[name] = at_m
                self._bound[name] = (at_m[0] - from_m[0]) / leg_m, (at_m[1] - from_m[1]) / leg_m

    def is_against(self, name: str, goal: Velocity) -> bool:
        """True if a vehicle's course opposes a velocity (90 deg or more apart), or is unknown."""
        east, north = self._bound.get(name, (-goal[0], -goal[1]))
        return east * goal[0] + north * goal[1] <= 0.0


def vehicle_at(at_m: Point, positions_m: Mapping[str, Point]) -> str | None:
    """Return the vehicle last received within ``KNOWN_M`` of a sonar contact, or None.

    >>> vehicle_at((30.0, 0.0), {"AUV01": (33.0, 0.0), "AUV02": (28.0, 0.0)})
    'AUV02'
    """
    nearest = min(positions_m, key=lambda name: (distance(positions_m[name], at_m), name), default=None)
    return nearest if nearest is not None and distance(positions_m[nearest], at_m) <= KNOWN_M else None


def yields(pulls: Pulls, name: str, other: str, is_against: bool, yielded: bool) -> float:
    """Return the call to which a vehicle yields, 0..1; 0 if none.

    ``other`` is the vehicle ahead, ``is_against`` if on another course. If it ``yielded``, its own call does not count.

    >>> alike = Pulls(0.5, {}, {"AUV01": 0.5, "AUV03": 0.5})
    >>> yields(alike, "AUV02", "AUV01", True, False), yields(alike, "AUV02", "AUV03", True, False)
    (0.5, 0.0)
    >>> yields(alike, "AUV02", "AUV01", False, False)
    0.0
    >>> yields(Pulls(0.5, {}, {}, {"AUV03": 0.6}), "AUV02", "AUV03", False, False)
    0.6
    """
    # The call weakens while its emitter passes: compared anew, the vehicle would turn back too early.
    own = 0.0 if yielded else pulls.own
    passed, call = pulls.passed.get(other, 0.0), pulls.equals.get(other, 0.0) if is_against else 0.0
    # Relays weaken a call, so the own one never returns stronger and no vehicle yields to it.
    if passed > own:
        return passed
    return call if call > own or (call == own > 0.0 and other < name) else 0.0


def own_signal(value: int) -> int:
    """Encode an own signal: the next even number at or below.

    >>> own_signal(-77), own_signal(-128), own_signal(127)
    (-78, -128, 126)
    """
    return value & ~1


def passed_signal(strength: float) -> int:
    """Encode a relayed call: the next weaker odd number.

    >>> [passed_signal(value / 128.0) for value in (78, 77, 1)]
    [-77, -75, 1]
    """
    value = -round(128.0 * strength)
    # Odd, since own signals are even (``own_signal``): receivers distinguish both without another bit.
    return value + 1 if value % 2 == 0 else value + 2
