"""Collision avoidance within one depth layer: optimal reciprocal collision avoidance (ORCA).

After van den Berg, Guy, Lin and Manocha, Reciprocal n-body collision avoidance, Robotics Research (ISRR 2009), Springer
2011, 3-19. To stay at least r from a neighbour for tau seconds, the relative velocity must lie outside the velocity
obstacle. This is the cone from the origin tangent to the disc of radius r at p, the relative position, truncated by the
disc of radius r / tau at p / tau. Let u be the least change of the relative velocity that leaves it. If each of the two
takes half of u, they stay clear, so a neighbour allows the half-plane of velocities v with

    (v - (v_own + u / 2)) . n >= 0,   n the outward normal where the obstacle is left.

The result is the allowed velocity nearest to the preferred one within the speed limit (section 5.1), else the one
with the least greatest violation (section 5.2). A turning margin (Alonso-Mora et al., DARS 2010), a right-hand bias
(COLREG rules 14 and 15) and borders of the area of operations as walls suit it to AUVs, see
``docs/model/vehicle.md``. A neighbour that does not avoid is avoided too: every tick takes half of the rest.
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
INSIDE_M = 10.0
"""Distance inside the border for targets outside, a margin for current during a turn."""
HORIZON_S = 10.0
"""tau: time horizon of avoidance."""
MARGIN = 1.1
"""Factor on the separation, since a course is constant for one tick."""
RECOVERY_S = 2.0
"""Time for vehicles inside the margin to separate."""
BERTHS = 4.0
"""Passing distance, in separations, below which a vehicle is in the way."""
LOOKOUT_S = 30.0
"""Maximum time to an encounter of concern."""
RIGHT_RAD = 0.3
"""Turn of the preferred velocity to the right."""
GIVE_WAY = 0.6
"""Share of the preferred speed while yielding to a vehicle on the right-hand side."""
RIGHT_HAND_SIDE_RAD = 0.1, math.radians(112.5)
"""Bearings to the right of the course, up to two points abaft the beam (COLREG 13 and 15)."""
FASTEST_MPS = 20.0
PARALLEL = 1e-9
"""Sine below which two half-plane borders are parallel."""


class Neighbour(NamedTuple):
    """Vehicle detected by the obstacle sonar: relative position and velocity."""

    dx_m: float
    dy_m: float
    vx_mps: float
    vy_mps: float


class HalfPlane(NamedTuple):
    """Allowed velocities (m/s): left of a line through (x, y) with unit direction (dx, dy)."""

    x: float
    y: float
    dx: float
    dy: float

    def excess_mps(self, velocity: Velocity) -> float:
        """Return the violation by a velocity; 0 or less if allowed."""
        return self.dx * (self.y - velocity[1]) - self.dy * (self.x - velocity[0])


def time_to_pass_s(neighbour: Neighbour, own: Velocity, within_m: float, horizon_s: float) -> float | None:
    """Return the time (s) to the closest approach, t = -d.v / v.v at constant relative velocity.

    None if it lies beyond ``horizon_s`` or at a distance of at least ``within_m``.

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
    """Return the velocities that keep clear of a neighbour that does its half.

    ``radius_m`` includes the margin. Example: a neighbour 25 m ahead and the vehicle stand still. It may approach by
    (25 - 5) / 10 = 2 m/s and takes half of that, since the neighbour may approach too:

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
    wx, wy = vx - px / horizon_s, vy - py / horizon_s  # from the centre of the truncating disc
    w_squared = wx * wx + wy * wy
    along = wx * px + wy * py
    if distance_m <= radius_m or (along < 0.0 and along * along > radius_m * radius_m * w_squared):
        w = math.sqrt(w_squared)
        if w > 0.0:
            nx, ny = wx / w, wy / w
        else:  # at the disc centre: away from the neighbour; at equal positions: in -y direction
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
    """``wanted`` is the target velocity or, with ``is_direction``, the direction to maximise."""
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
        along_mps = beyond / sine
        if sine > 0.0:
            high = min(high, along_mps)
        else:
            low = max(low, along_mps)
        if low > high:
            return None
    if is_direction:
        along_mps = high if wanted[0] * dx + wanted[1] * dy > 0.0 else low
    else:
        along_mps = min(high, max(low, dx * (wanted[0] - x) + dy * (wanted[1] - y)))
    return x + along_mps * dx, y + along_mps * dy


def _nearest(
    planes: Sequence[HalfPlane], most_mps: float, wanted: Velocity, is_direction: bool = False
) -> tuple[Velocity, int]:
    """Optimal velocity, and the number of half-planes satisfied; fewer than all if infeasible."""
    vx, vy = wanted
    speed = length(vx, vy)
    if is_direction or speed > most_mps:
        vx, vy = (vx / speed * most_mps, vy / speed * most_mps) if speed > 0.0 else (0.0, 0.0)
    for number, plane in enumerate(planes):
        # Section 5.1: if the optimum so far violates a half-plane, the new one lies on the border of that.
        if plane.dx * (plane.y - vy) - plane.dy * (plane.x - vx) > 0.0:
            nearest = _nearest_on_line(planes, number, most_mps, wanted, is_direction)
            if nearest is None:
                return (vx, vy), number
            vx, vy = nearest
    return (vx, vy), len(planes)


def _least_excess(
    planes: Sequence[HalfPlane], first: int, most_mps: float, best: Velocity, n_walls: int = 0
) -> Velocity:
    """Velocity with the least greatest violation (section 5.2); ``n_walls`` first ones are hard."""
    excess = 0.0
    for number in range(max(first, n_walls), len(planes)):
        x, y, dx, dy = plane = planes[number]
        if plane.excess_mps(best) <= excess:
            continue
        equal = [*planes[:n_walls]]  # plus: excess over each earlier half-plane at most that over this one
        for ox, oy, odx, ody in planes[n_walls:number]:
            sine = dx * ody - dy * odx
            if -PARALLEL <= sine <= PARALLEL:
                # With equal directions the two excesses differ by a constant: no velocity changes their order.
                if dx * odx + dy * ody > 0.0:
                    continue
                px, py = 0.5 * (x + ox), 0.5 * (y + oy)
            else:
                along_mps = (odx * (y - oy) - ody * (x - ox)) / sine
                px, py = x + along_mps * dx, y + along_mps * dy
            ex, ey = odx - dx, ody - dy
            long = length(ex, ey)
            equal.append(HalfPlane(px, py, ex / long, ey / long))
        candidate, n_met = _nearest(equal, most_mps, (-dy, dx), is_direction=True)
        if n_met == len(equal):  # else a rounding error: keep the last optimum
            best = candidate
        excess = plane.excess_mps(best)
    return best


def nearest_within(bounds_m: Bounds, place_m: tuple[float, float]) -> tuple[float, float]:
    """Return a place inside bounds (the same object), else the nearest one ``INSIDE_M`` inside.

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
    """Return the half-planes that keep a vehicle inside its borders for ``RECOVERY_S``.

    Borders out of reach at ``FASTEST_MPS`` are omitted; beyond a border, it goes no farther out.

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
    """Return the velocity (m/s) nearest to the given one within walls and speed limit."""
    return _nearest(walls, most_mps, velocity)[0]


def clearance_m(separation_m: float, speed_mps: float, turn_rate_radps: float) -> float:
    """Return the distance (m) kept at a speed: separation with margin, plus turning radius.

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
    """Return the clear velocity (m/s) nearest to the preferred one, or the least bad one.

    None if no neighbour is in the way, so that guidance stays unchanged. ``walls`` are hard constraints meanwhile.
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
    ahead = course[0] * neighbour.dx_m + course[1] * neighbour.dy_m
    right = course[1] * neighbour.dx_m - course[0] * neighbour.dy_m
    return RIGHT_HAND_SIDE_RAD[0] < atan2(right, ahead) < RIGHT_HAND_SIDE_RAD[1]
