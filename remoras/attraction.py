"""Attraction and repulsion: how influence signals add to where guidance goes (REMORAS, section V.B).

The paper selects the goal of the strongest motivation and combines it with other vectors: "a goal vector is selected
and a vector combination is performed to avoid obstacles and repulsive signals sent by others". At most one activity of
a decision guides; what is compatible with it are the vectors of signals. Obstacles are the part of
``remoras.avoidance``.

A signal is dissatisfaction. From the holder of another role it means: come and help. From an equal, who plays the same
role and addresses it, it means: let me pass. With the call c_j of vehicle j, 0..1, and u_j the direction to where j was
heard last::

    v = v_goal + attraction |v_goal| a_j u_j - repulsion v_greatest sum over equals k of r_k u_k

* a_j is what the call of j moves this vehicle to, if the activity that guides answers it and j calls loudest of those
  that call on its role: it goes to the one that calls.
* r_k = c_k if somebody is in the way of the goal, and the call is stronger than the own in that role: the more
  satisfied of two that are in each other's way withdraws, and the less satisfied one passes. Of equally satisfied ones
  the one whose name comes later withdraws, so that there is always one. A call counts in full while it is remembered:
  were it weaker with age, the own would seem stronger to both.

Signals act on those who are near, as far as the obstacle sonar reaches, and only while it sees somebody. While it
withdraws, a vehicle perceives no advance: else it would be dismayed by it, call louder than the other and turn round.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from exchange.arithmetic import length
from remoras.avoidance import SEPARATION_M, Velocity
from remoras.work import Point

REACH_M = 60.0
"""Signals attract and repel up to this distance, as far as the obstacle sonar reaches."""


@dataclass(frozen=True, slots=True)
class Pulls:
    """How signals of others pull at a vehicle, as its last decision weighed them.

    Attributes:
        own: how dissatisfied the vehicle is in the role by which it is guided, 0..1.
        answered: by vehicle, what its call moves this one to by the activity that guides, 0..1.
        equals: by vehicle that plays that role too, the strength of its call, 0..1, whatever its age.
    """

    own: float = 0.0
    answered: Mapping[str, float] = field(default_factory=dict)
    equals: Mapping[str, float] = field(default_factory=dict)


NO_PULLS = Pulls()


@dataclass(frozen=True, slots=True)
class GuidanceConstants:
    """Constants of guidance; a signal without weight neither attracts nor repels.

    Attributes:
        separation_m: distance that vehicles in one depth layer keep from each other.
        attraction, repulsion: weights of the equation above.
    """

    separation_m: float = SEPARATION_M
    attraction: float = 1.0
    repulsion: float = 2.0


USUAL = GuidanceConstants()
"""Constants of guidance unless a scenario sets others."""


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


def repelled(
    goal: Velocity, position_m: Point, by: Mapping[str, float], positions_m: Mapping[str, Point], weight_mps: float
) -> Velocity:
    """The velocity of a goal and of the repulsion of those to whom the vehicle gives way (m/s).

    Args:
        goal: velocity that guidance asks for (m/s).
        position_m: of the vehicle.
        by: strength of their calls, by vehicle; see ``stronger``.
        positions_m: where others were heard last.
        weight_mps: weight of repulsion times the greatest speed of the vehicle.

    >>> repelled((2.0, 0.0), (0.0, 0.0), {"AUV01": 1.0}, {"AUV01": (30.0, 0.0)}, 4.0)
    (-2.0, 0.0)
    """
    return _added(goal, position_m, by, positions_m, -weight_mps)


def stronger(pulls: Pulls, name: str) -> dict[str, float]:
    """Calls of equals that are stronger than the own of a vehicle of that name; of two alike the later name gives way.

    >>> stronger(Pulls(0.5, {}, {"AUV00": 0.5, "AUV02": 0.5, "AUV03": 0.6}), "AUV01")
    {'AUV00': 0.5, 'AUV03': 0.6}
    """
    return {
        one: strength
        for one, strength in pulls.equals.items()
        if strength > pulls.own or (strength == pulls.own and one < name)
    }


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
