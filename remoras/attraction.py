"""Attraction and repulsion: how influence signals add to where guidance goes (REMORAS, section V.B).

The paper selects the goal of the strongest motivation and combines it with other vectors: "a goal vector is selected
and a vector combination is performed to avoid obstacles and repulsive signals sent by others". At most one activity of
a decision guides; what is compatible with it are the vectors of signals. Obstacles are the part of
``remoras.avoidance``.

A signal is dissatisfaction. From the holder of another role it means: come and help. From an equal it means: let me
pass. Equals play the same role, which addresses itself, or roles that address each other and of which one has a job.
With u_j the direction to vehicle j::

    v = v_goal + attraction |v_goal| a_j u_j
    v = - min(1, repulsion) v_greatest (u_k turned left by a quarter of pi)     while it gives way to k

* a_j, 0..1, is what the call of j moves this vehicle to, if the activity that guides answers it and j calls loudest of
  those that call on its role: it goes to the one that calls.
* k is the nearest vehicle ahead. In a passage whoever gives way goes back by that; where there is room it goes aside to
  its right as well. How loud the call is decides whether it gives way, not how fast.

Interactive satisfaction, after Simonin and Ferber (SAB 2000): a vehicle takes another one for hindrance or for
indifferent by what the two do to each other. Whoever is ahead and goes the same way hinders nobody: one that queues
behind it gets on with nothing and complains of nothing. Whoever is ahead and does not hinders, and is hindered. Of
these two the one that is more satisfied gives way, of equally satisfied ones the one whose name comes later, so that
there is always one; it does until the other one is content, or out of its way. What counts as own is the strongest
call of its own that a vehicle has sent lately, for what it hears may be an answer to that. A call counts in full while
it is remembered: were it weaker with age, the own would seem stronger to both.

A vehicle that gives way and has somebody behind it *passes the call on*: its signal is then the one to which it gives
way, one degree weaker. Whoever is behind, goes the same way and has no stronger call gives way to that, and passes it
on in turn. So a row of vehicles clears a passage, and whoever calls never gives way to its own call, come back. The
lowest bit of a signal tells the two apart: a call of one's own is even, one that is passed on odd, see ``own_signal``.

Signals act on those who are near, as far as the obstacle sonar reaches, and only while it sees somebody. While it
withdraws or queues, a vehicle perceives no advance: else it would be dismayed by it, call louder than the other and
turn round.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from pydantic import Field

from exchange.arithmetic import distance, length
from remoras.avoidance import SEPARATION_M, Neighbour, Velocity
from remoras.picture import Peers
from remoras.table import NotNegative, Sparse
from remoras.work import Point

ASIDE = 0.7071067811865476
"""Sine and cosine of a quarter of pi."""
HINDERED_S = 30.0
"""For so long a vehicle that was hindered goes on to call: the other one may be on its way out."""
KNOWN_M = 20.0
"""Whom the sonar sees is the vehicle that was heard last no farther from there: what was heard is some seconds old."""
LEG_M = 10.0
"""A leg of this length shows where a vehicle is bound for."""
LANES = 2.0
"""Who is no farther from the course than so many separations is ahead."""
PRESSED = 1.2
"""Equals keep the separation with this factor more: in a row that goes back, the next one may have no half to give."""
REACH_M = 60.0
"""Signals attract and repel up to this distance, as far as the obstacle sonar reaches."""


@dataclass(frozen=True, slots=True)
class Pulls:
    """How signals of others pull at a vehicle, as its last decision weighed them.

    Attributes:
        own: strongest call that the vehicle has sent of its own lately in roles in which it has equals, 0..1.
        answered: by vehicle, what its call moves this one to by the activity that guides, 0..1.
        equals: by vehicle that is its equal, the strength of its call, 0..1, whatever its age.
        passed: the same of calls that equals pass on.
        is_among_equals: True if the role by which the vehicle is guided has equals.
    """

    own: float = 0.0
    answered: Mapping[str, float] = field(default_factory=dict)
    equals: Mapping[str, float] = field(default_factory=dict)
    passed: Mapping[str, float] = field(default_factory=dict)
    is_among_equals: bool = False


NO_PULLS = Pulls()
UNMOVED = Pulls(is_among_equals=True)
"""Of a vehicle among equals that no signal moves."""


class GuidanceTable(Sparse):
    """The table ``[guidance]``; a signal without weight neither attracts nor repels."""

    UNSAID = frozenset({"keeps_calls"})

    separation_m: float = Field(
        SEPARATION_M, ge=1.0, le=20.0, description="distance that vehicles in one depth layer keep from each other"
    )
    attraction: NotNegative = Field(
        1.0, description="weight by which a call that a vehicle answers draws it to the one that calls, nearby"
    )
    repulsion: NotNegative = Field(
        2.0, description="weight by which a call makes more satisfied vehicles withdraw that are in the way, nearby"
    )
    keeps_calls: bool = Field(
        False, description="true: a vehicle that withdraws does not pass the call on to who is behind it"
    )


def attracted_velocity(
    goal: Velocity, position_m: Point, pulls: Pulls, positions_m: Mapping[str, Point], weight: float
) -> Velocity:
    """The velocity of a goal and of the attraction of those whose calls are answered (m/s), no faster than the goal's.

    Args:
        goal: velocity that guidance asks for (m/s).
        position_m: of the vehicle.
        pulls: of others.
        positions_m: where others were heard last.
        weight: of attraction.

    >>> attracted_velocity((3.0, 0.0), (0.0, 0.0), Pulls(answered={"AUV01": 1.0}), {"AUV01": (-30.0, 0.0)}, 0.5)
    (1.5, 0.0)
    """
    speed_mps = length(*goal)
    x_mps, y_mps = _added(goal, position_m, pulls.answered, positions_m, weight * speed_mps)
    return _limited((x_mps, y_mps), speed_mps)


def repelled(position_m: Point, at_m: Point, weight_mps: float) -> Velocity:
    """The velocity by which a vehicle gives way to another one (m/s): away from it, and aside to its right.

    Args:
        position_m: of the vehicle; at_m: of the other one.
        weight_mps: how fast.

    >>> [round(one, 9) for one in repelled((0.0, 0.0), (30.0, 0.0), 2.0**0.5)]
    [-1.0, -1.0]
    """
    dx_m, dy_m = at_m[0] - position_m[0], at_m[1] - position_m[1]
    scale = weight_mps * ASIDE / (length(dx_m, dy_m) or 1.0)
    return -scale * (dx_m - dy_m), -scale * (dy_m + dx_m)


def ahead(goal: Velocity, position_m: Point, neighbours: Sequence[Neighbour], lane_m: float) -> Neighbour | None:
    """The nearest of those whom the sonar sees ahead of a vehicle, no farther than ``lane_m`` from its course.

    Args:
        goal: velocity that guidance asks for (m/s).
        position_m: of the vehicle; neighbours: as the obstacle sonar sees them.

    >>> near, far = Neighbour(9.0, 1.0, 0.0, 0.0), Neighbour(20.0, 0.0, 0.0, 0.0)
    >>> ahead((2.0, 0.0), (0.0, 0.0), [far, near, Neighbour(-5.0, 0.0, 0.0, 0.0)], 10.0) == near
    True
    """
    speed_mps = length(*goal)
    found, nearest_m = None, REACH_M
    for one in neighbours if speed_mps > 0.0 else ():
        along_m = (one.dx_m * goal[0] + one.dy_m * goal[1]) / speed_mps
        aside_m = (one.dx_m * goal[1] - one.dy_m * goal[0]) / speed_mps
        if 0.0 < along_m <= nearest_m and -lane_m <= aside_m <= lane_m:
            found, nearest_m = one, along_m
    return found


class Courses:
    """Where others are bound for, by the last legs of some length that they were heard to make.

    A vehicle that is pushed back a little, or lets another one by, is bound for where it was bound for.
    """

    def __init__(self) -> None:
        self._from_m: dict[str, Point] = {}
        self._bound: dict[str, Point] = {}

    def note(self, peers: Peers) -> None:
        """Note where others were heard last; whoever is new is bound for where it was going then."""
        headings = peers.headings
        for name, at_m in peers.positions_m.items():
            from_m = self._from_m.get(name)
            if from_m is None:
                self._from_m[name] = at_m
                if name in headings:
                    self._bound[name] = headings[name]
            elif (leg_m := distance(from_m, at_m)) >= LEG_M:
                self._from_m[name] = at_m
                self._bound[name] = (at_m[0] - from_m[0]) / leg_m, (at_m[1] - from_m[1]) / leg_m

    def is_against(self, name: str, goal: Velocity) -> bool:
        """True unless a vehicle is known to go the way of a velocity, rather than against it or across."""
        east, north = self._bound.get(name, (-goal[0], -goal[1]))
        return east * goal[0] + north * goal[1] <= 0.0


def vehicle_at(at_m: Point, positions_m: Mapping[str, Point]) -> str | None:
    """The vehicle that was heard last next to a place where the sonar sees somebody; None if none was near.

    >>> vehicle_at((30.0, 0.0), {"AUV01": (33.0, 0.0), "AUV02": (28.0, 0.0)})
    'AUV02'
    """
    nearest = min(positions_m, key=lambda name: (distance(positions_m[name], at_m), name), default=None)
    return nearest if nearest is not None and distance(positions_m[nearest], at_m) <= KNOWN_M else None


def yields(pulls: Pulls, name: str, other: str, is_against: bool, yielded: bool) -> float:
    """The call of another vehicle to which one gives way, 0..1; 0 if to none.

    Args:
        pulls: of signals; name: of the vehicle.
        other: the one ahead of it; is_against: that one goes another way.
        yielded: the vehicle has given way to it just before: then its own call counts no more.

    >>> alike = Pulls(0.5, {}, {"AUV01": 0.5, "AUV03": 0.5})
    >>> yields(alike, "AUV02", "AUV01", True, False), yields(alike, "AUV02", "AUV03", True, False)
    (0.5, 0.0)
    >>> yields(alike, "AUV02", "AUV01", False, False)
    0.0
    >>> yields(Pulls(0.5, {}, {}, {"AUV03": 0.6}), "AUV02", "AUV03", False, False)
    0.6
    """
    own = 0.0 if yielded else pulls.own
    passed, call = pulls.passed.get(other, 0.0), pulls.equals.get(other, 0.0) if is_against else 0.0
    if passed > own:
        return passed
    return call if call > own or (call == own > 0.0 and other < name) else 0.0


def own_signal(value: int) -> int:
    """The signal by which a vehicle tells an equal its own satisfaction: the next even number below.

    >>> own_signal(-77), own_signal(-128), own_signal(127)
    (-78, -128, 126)
    """
    return value & ~1


def passed_signal(strength: float) -> int:
    """The signal by which a vehicle passes a call on: the odd number next weaker than its own.

    >>> [passed_signal(value / 128.0) for value in (78, 77, 1)]
    [-77, -75, 1]
    """
    value = -round(128.0 * strength)
    return value + 1 if value % 2 == 0 else value + 2


def _added(
    goal: Velocity, position_m: Point, strengths: Mapping[str, float], positions_m: Mapping[str, Point], scale: float
) -> Velocity:
    """A velocity and the directions to those that are near, each by its strength and a scale."""
    x_mps, y_mps = goal
    for name, strength in strengths.items():
        if (at_m := positions_m.get(name)) is None:
            continue
        dx_m, dy_m = at_m[0] - position_m[0], at_m[1] - position_m[1]
        distance_m = length(dx_m, dy_m)
        if 0.0 < distance_m <= REACH_M:
            x_mps += scale * strength * dx_m / distance_m
            y_mps += scale * strength * dy_m / distance_m
    return x_mps, y_mps


def _limited(velocity: Velocity, most_mps: float) -> Velocity:
    """A velocity, slowed down to a speed if it is faster."""
    speed_mps = length(*velocity)
    share = most_mps / speed_mps if speed_mps > most_mps else 1.0
    return share * velocity[0], share * velocity[1]
