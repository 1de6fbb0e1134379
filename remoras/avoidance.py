"""How vehicles in one depth layer keep clear of each other: optimal reciprocal collision avoidance (ORCA).

After van den Berg, Guy, Lin and Manocha, Reciprocal n-body collision avoidance, Robotics Research (ISRR 2009),
Springer 2011, 3-19. To be no nearer than r to a neighbour for the next tau seconds, a vehicle must not choose a
velocity that, relative to the neighbour's, lies in the velocity obstacle: the cone from the origin that touches the
disc of radius r at p, the position of the neighbour from here, cut off by the disc of radius r / tau at p / tau. Let u
be the least change that brings the relative velocity out of it. If each of the two takes half of it, they keep clear.
So a neighbour allows the half-plane of velocities v with

    (v - (v_own + u / 2)) . n >= 0,   n the outward normal where the obstacle is left.

Of the velocities that all neighbours allow, and that are not faster than the vehicle, the nearest to the preferred one
is taken: a linear program in two dimensions, solved one half-plane after the other (section 5.1 of the paper). If none
is allowed by all, the one that goes the least distance beyond any of them is taken (section 5.2).

Four things are added for vehicles that turn like AUVs:

* a margin for turning, in the manner of Alonso-Mora et al., DARS 2010: r is the separation, a tenth of it, and the
  radius of the own turning circle at the present speed. So vehicles that stand still may stand close together;
* a right-hand bias, after rules 14 and 15 of the COLREGs: while somebody is in the way, the preferred velocity is first
  turned to the right, and slowed down if one that it would run into is on the right-hand side. Without the turn,
  symmetric encounters come to a standstill; without the slowing, two that want to change sides go on side by side;
* the borders of the area of operations are walls: nobody keeps clear of others by leaving it;
* the velocity is carried out as far as a tick allows, see ``remoras.motion.follow``.

A neighbour that does not avoid, or cannot, is avoided too: every tick takes half of what is left.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from exchange.arithmetic import atan2, length, sincos

Velocity = tuple[float, float]
Bounds = tuple[float, float, float, float]
"""Borders of the area of operations: x_min, y_min, x_max, y_max (m)."""
SEPARATION_M = 5.0
"""Distance that vehicles in one depth layer keep unless a scenario sets another."""
INSIDE_M = 10.0
"""A vehicle whose target lies outside stays this far inside, so that a current does not take it out in a turn."""
HORIZON_S = 10.0
"""tau: vehicles keep clear for so long ahead."""
MARGIN = 1.1
"""The separation is kept with this factor, since a course is kept for a tick at a time."""
RECOVERY_S = 2.0
"""Time in which vehicles that are too near for the margin part again."""
BERTHS = 4.0
"""Whoever would pass within this many separations is in the way: one turns to the right in time."""
LOOKOUT_S = 30.0
"""An encounter farther ahead than this is not yet a concern."""
RIGHT_RAD = 0.3
"""Angle by which a preferred velocity is turned to the right while somebody is in the way."""
GIVE_WAY = 0.6
"""Share of the preferred speed that a vehicle keeps while it gives way to one on its right-hand side."""
RIGHT_HAND_SIDE_RAD = 0.1, math.radians(112.5)
"""Bearings to the right of the preferred course, from nearly ahead to two points abaft the beam (COLREG 13 and 15)."""
FASTEST_MPS = 20.0
"""No vehicle is faster."""
PARALLEL = 1e-9
"""Half-planes whose borders enclose an angle with a smaller sine are parallel."""


class Neighbour(NamedTuple):
    """Another vehicle close by, as the obstacle sonar sees it: its position from here, and its velocity."""

    dx_m: float
    dy_m: float
    vx_mps: float
    vy_mps: float


class HalfPlane(NamedTuple):
    """Velocities (m/s) that are allowed: those to the left of a line through (x, y) with unit direction (dx, dy)."""

    x: float
    y: float
    dx: float
    dy: float

    def excess_mps(self, velocity: Velocity) -> float:
        """How far a velocity is beyond the line; 0 or less if it is allowed."""
        return self.dx * (self.y - velocity[1]) - self.dy * (self.x - velocity[0])


def time_to_pass_s(neighbour: Neighbour, own: Velocity, within_m: float, horizon_s: float) -> float | None:
    """Time (s) until a neighbour is closest; None unless it then passes within a distance and a time.

    Velocities are taken as constant: t = -d.v / v.v with d the relative position and v the relative velocity.

    Args:
        neighbour: as the obstacle sonar sees it.
        own: velocity of this vehicle (m/s).
        within_m: the distance; horizon_s: how far ahead to look.

    >>> time_to_pass_s(Neighbour(20.0, 1.0, -1.0, 0.0), (1.0, 0.0), within_m=5.0, horizon_s=30.0)
    10.0
    >>> time_to_pass_s(Neighbour(20.0, 9.0, -1.0, 0.0), (1.0, 0.0), within_m=5.0, horizon_s=30.0)
    """
    vx_mps, vy_mps = neighbour.vx_mps - own[0], neighbour.vy_mps - own[1]
    closing = -(neighbour.dx_m * vx_mps + neighbour.dy_m * vy_mps)
    speed_squared = vx_mps * vx_mps + vy_mps * vy_mps
    if closing <= 0.0 or speed_squared == 0.0:
        return None
    time_s = closing / speed_squared
    if time_s > horizon_s:
        return None
    miss_x_m = neighbour.dx_m + vx_mps * time_s
    miss_y_m = neighbour.dy_m + vy_mps * time_s
    return time_s if miss_x_m * miss_x_m + miss_y_m * miss_y_m < within_m * within_m else None


def allowed_by(neighbour: Neighbour, own: Velocity, radius_m: float, horizon_s: float = HORIZON_S) -> HalfPlane:
    """Velocities that keep a vehicle clear of a neighbour, if the neighbour does its half.

    Args:
        neighbour: as the obstacle sonar sees it.
        own: velocity of this vehicle (m/s).
        radius_m: distance to be kept, margin included; horizon_s: for how long ahead.

    A neighbour 25 m ahead stands still, and so does the vehicle. It may come nearer by (25 - 5) / 10 = 2 m/s, and takes
    half of that for itself, for the neighbour may come as well:

    >>> plane = allowed_by(Neighbour(25.0, 0.0, 0.0, 0.0), (0.0, 0.0), 5.0, 10.0)
    >>> plane.excess_mps((1.0, 0.0)), plane.excess_mps((1.5, 0.0))
    (0.0, 0.5)
    """
    px, py, their_vx, their_vy = neighbour
    vx, vy = own[0] - their_vx, own[1] - their_vy
    distance_squared = px * px + py * py
    distance_m = math.sqrt(distance_squared)
    if distance_m <= radius_m:
        horizon_s = RECOVERY_S
    wx, wy = vx - px / horizon_s, vy - py / horizon_s  # from the centre of the disc that cuts the cone off
    w_squared = wx * wx + wy * wy
    along = wx * px + wy * py
    if distance_m <= radius_m or (along < 0.0 and along * along > radius_m * radius_m * w_squared):
        w = math.sqrt(w_squared)
        if w > 0.0:
            nx, ny = wx / w, wy / w
        else:  # on the very centre of the disc: away from the neighbour; on one spot, to the right of the own course
            nx, ny = (-px / distance_m, -py / distance_m) if distance_m > 0.0 else (0.0, -1.0)
        out = radius_m / horizon_s - w
        return HalfPlane(own[0] + 0.5 * out * nx, own[1] + 0.5 * out * ny, ny, -nx)
    leg_m = math.sqrt(distance_squared - radius_m * radius_m)
    if px * wy - py * wx > 0.0:  # the left leg of the cone is nearer
        dx, dy = (px * leg_m - py * radius_m) / distance_squared, (px * radius_m + py * leg_m) / distance_squared
    else:
        dx, dy = -(px * leg_m + py * radius_m) / distance_squared, (px * radius_m - py * leg_m) / distance_squared
    on_leg = vx * dx + vy * dy
    return HalfPlane(own[0] + 0.5 * (on_leg * dx - vx), own[1] + 0.5 * (on_leg * dy - vy), dx, dy)


def _nearest_on_line(
    planes: Sequence[HalfPlane], number: int, most_mps: float, wanted: Velocity, is_direction: bool
) -> Velocity | None:
    """The best velocity on the border of one half-plane, within the disc and all half-planes before it.

    Args:
        planes: half-planes; ``number``: of the one whose border is meant.
        most_mps: greatest speed.
        wanted: the velocity to be near to or, if ``is_direction``, the direction in which to go as far as possible.
    """
    x, y, dx, dy = planes[number]
    middle = x * dx + y * dy
    inside = middle * middle + most_mps * most_mps - x * x - y * y
    if inside < 0.0:
        return None  # the disc does not reach the line
    root = math.sqrt(inside)
    low, high = -middle - root, -middle + root
    for ox, oy, odx, ody in planes[:number]:
        sine = dx * ody - dy * odx
        beyond = odx * (y - oy) - ody * (x - ox)
        if -PARALLEL <= sine <= PARALLEL:
            if beyond < 0.0:
                return None
            continue
        at = beyond / sine
        if sine > 0.0:
            high = min(high, at)
        else:
            low = max(low, at)
        if low > high:
            return None
    if is_direction:
        at = high if wanted[0] * dx + wanted[1] * dy > 0.0 else low
    else:
        at = min(high, max(low, dx * (wanted[0] - x) + dy * (wanted[1] - y)))
    return x + at * dx, y + at * dy


def _nearest(
    planes: Sequence[HalfPlane], most_mps: float, wanted: Velocity, is_direction: bool = False
) -> tuple[Velocity, int]:
    """The best velocity that all half-planes allow, and how many do; fewer than all where there is none."""
    vx, vy = wanted
    speed = length(vx, vy)
    if is_direction or speed > most_mps:
        vx, vy = (vx / speed * most_mps, vy / speed * most_mps) if speed > 0.0 else (0.0, 0.0)
    for number, plane in enumerate(planes):
        if plane.dx * (plane.y - vy) - plane.dy * (plane.x - vx) > 0.0:
            found = _nearest_on_line(planes, number, most_mps, wanted, is_direction)
            if found is None:
                return (vx, vy), number
            vx, vy = found
    return (vx, vy), len(planes)


def _least_excess(
    planes: Sequence[HalfPlane], first: int, most_mps: float, best: Velocity, n_walls: int = 0
) -> Velocity:
    """The velocity whose greatest excess over any half-plane is least: a linear program in three dimensions.

    Args:
        planes: half-planes; ``first``: the first that the best one so far, ``best``, cannot satisfy.
        most_mps: greatest speed.
        n_walls: of how many half-planes, the first ones, nothing is given up.
    """
    excess = 0.0
    for number in range(max(first, n_walls), len(planes)):
        x, y, dx, dy = plane = planes[number]
        if plane.excess_mps(best) <= excess:
            continue
        equal = [*planes[:n_walls]]  # and where the excess over an earlier half-plane is no more than over this one
        for ox, oy, odx, ody in planes[n_walls:number]:
            sine = dx * ody - dy * odx
            if -PARALLEL <= sine <= PARALLEL:
                if dx * odx + dy * ody > 0.0:
                    continue
                px, py = 0.5 * (x + ox), 0.5 * (y + oy)
            else:
                at = (odx * (y - oy) - ody * (x - ox)) / sine
                px, py = x + at * dx, y + at * dy
            ex, ey = odx - dx, ody - dy
            long = length(ex, ey)
            equal.append(HalfPlane(px, py, ex / long, ey / long))
        found, n_met = _nearest(equal, most_mps, (-dy, dx), is_direction=True)
        if n_met == len(equal):  # else a rounding error: keep what there was
            best = found
        excess = plane.excess_mps(best)
    return best


def nearest_within(bounds_m: Bounds, place_m: tuple[float, float]) -> tuple[float, float]:
    """The same object if a place lies within bounds, else the nearest place ``INSIDE_M`` from the borders.

    >>> nearest_within((0.0, 0.0, 500.0, 500.0), (520.0, 30.0))
    (490.0, 30.0)
    """
    x_min, y_min, x_max, y_max = bounds_m
    x_m, y_m = place_m
    if x_min <= x_m <= x_max and y_min <= y_m <= y_max:
        return place_m
    x_m, y_m = max(x_m, x_min + INSIDE_M), max(y_m, y_min + INSIDE_M)
    return min(x_m, x_max - INSIDE_M), min(y_m, y_max - INSIDE_M)


def walls_of(bounds_m: Bounds, x_m: float, y_m: float) -> list[HalfPlane]:
    """Velocities that do not take a vehicle out of the area of operations within ``RECOVERY_S``, border by border.

    A border that it cannot reach so soon at ``FASTEST_MPS`` is left out; beyond one, it goes no farther.

    Args:
        bounds_m: of the area of operations.
        x_m, y_m: of the vehicle.

    >>> walls_of((0.0, 0.0, 500.0, 500.0), 100.0, 3.0)
    [HalfPlane(x=0.0, y=-1.5, dx=1.0, dy=0.0)]
    """
    x_min, y_min, x_max, y_max = bounds_m
    outwards = ((x_max - x_m, 1.0, 0.0), (y_max - y_m, 0.0, 1.0), (x_m - x_min, -1.0, 0.0), (y_m - y_min, 0.0, -1.0))
    return [
        HalfPlane(x * max(0.0, to_go_m) / RECOVERY_S, y * max(0.0, to_go_m) / RECOVERY_S, -y, x)
        for to_go_m, x, y in outwards
        if to_go_m < FASTEST_MPS * RECOVERY_S
    ]


def within_walls(walls: Sequence[HalfPlane], velocity: Velocity, most_mps: float) -> Velocity:
    """The velocity nearest to one (m/s) that is no faster than ``most_mps`` and goes beyond no wall."""
    return _nearest(walls, most_mps, velocity)[0]


def clearance_m(separation_m: float, speed_mps: float, turn_rate_radps: float) -> float:
    """Distance (m) that a vehicle at a speed keeps from others: the separation, a margin, and room to turn.

    >>> round(clearance_m(5.0, 2.57, 0.5), 2)
    10.64
    """
    return MARGIN * separation_m + speed_mps / turn_rate_radps


def clear_velocity(
    preferred: Velocity,
    own: Velocity,
    neighbours: Iterable[Neighbour],
    separation_m: float,
    turn_rate_radps: float,
    most_mps: float,
    walls: Sequence[HalfPlane] = (),
) -> Velocity | None:
    """The velocity (m/s) nearest to the preferred one that keeps clear of all neighbours; the least bad without one.

    Args:
        preferred: velocity that guidance asks for; own: that of the vehicle now.
        neighbours: as the obstacle sonar sees them.
        separation_m: distance to be kept.
        turn_rate_radps, most_mps: greatest rate of turn and speed of the vehicle.
        walls: what it does not go beyond while it keeps clear.

    Returns:
        None if nobody is in the way, so that guidance is carried out as it is.
    """
    radius_m = clearance_m(separation_m, length(*own), turn_rate_radps)
    berth_m = BERTHS * separation_m
    planes = [*walls]
    is_in_way = gives_way = False
    for neighbour in neighbours:
        plane = allowed_by(neighbour, own, radius_m)
        planes.append(plane)
        if plane.excess_mps(preferred) > 0.0:
            is_in_way = True
            gives_way = gives_way or _is_on_right(neighbour, preferred)
        elif not is_in_way:
            is_in_way = time_to_pass_s(neighbour, preferred, berth_m, LOOKOUT_S) is not None
    if not is_in_way:
        return None
    share = GIVE_WAY if gives_way else 1.0
    sin, cos = sincos(RIGHT_RAD)
    cos, sin = share * cos, share * sin
    turned = preferred[0] * cos + preferred[1] * sin, preferred[1] * cos - preferred[0] * sin
    best, n_met = _nearest(planes, most_mps, turned)
    return best if n_met == len(planes) else _least_excess(planes, n_met, most_mps, best, len(walls))


def _is_on_right(neighbour: Neighbour, course: Velocity) -> bool:
    """True if a neighbour is on the right-hand side of a course."""
    ahead = course[0] * neighbour.dx_m + course[1] * neighbour.dy_m
    right = course[1] * neighbour.dx_m - course[0] * neighbour.dy_m
    return RIGHT_HAND_SIDE_RAD[0] < atan2(right, ahead) < RIGHT_HAND_SIDE_RAD[1]
