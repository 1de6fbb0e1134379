"""Where to look next: the route of most information per time, less what others are about to look at.

These are the elementary behaviours of which the search is made. No one of them knows of a plan; what the fleet does
follows from each vehicle's map, from what it heard that others hold, and from its leash.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from missions.arrows.belief_map import Chart, look_information
from missions.arrows.contact import Find, Leash
from missions.arrows.seafloor import Array, CellGrid, halved, summed
from remoras.work import Point

TURN_S = 20.0
"""What every choice costs beside the way."""
STRIDE = 2
"""Of the cells every so many-th column and row may be gone to."""
N_FIRST, N_LEGS = 5, 3
"""So many targets that are best for themselves are compared as the first of a route of so many."""
Way = tuple[Point, Point]
"""From where to where somebody goes."""


def beside(grid: CellGrid, way: Way) -> Array:
    """Distance of the centre of each cell from a way (m), shape (n_cells,)."""
    (x_m, y_m), (to_x_m, to_y_m) = way
    east_m, north_m = to_x_m - x_m, to_y_m - y_m
    length2 = east_m * east_m + north_m * north_m
    dx_m, dy_m = grid.x_m - x_m, grid.y_m - y_m
    along = np.clip((dx_m * east_m + dy_m * north_m) / length2, 0.0, 1.0) if length2 > 0.0 else np.zeros(grid.n_cells)
    off_x, off_y = dx_m - along * east_m, dy_m - along * north_m
    return np.asarray(np.sqrt(off_x * off_x + off_y * off_y))


class Leg(NamedTuple):
    """The way to a target: where that is, how many sites it may be expected to find, and the time that it takes (s)."""

    target_m: Point
    sites: float
    takes_s: float


class Return(NamedTuple):
    """Coming back: how long it takes until it is heard (s), and how much longer it takes to go on from there (s)."""

    heard_in_s: float
    pause_s: float


def goes_on(
    leg: Leg, finds: Sequence[Find], takes_s: float, now: Return, later: Return, left_s: float, busy_s: float
) -> bool:
    """True if coming back after a leg gains more than coming back now, or neither gains anything; see ``contact``.

    Args:
        leg: that it would go.
        finds: of which nobody has heard who can identify them.
        takes_s: how long it takes to identify what it finds on the leg.
        now, later: coming back before the leg, and after it.
        left_s: until the search ends.
        busy_s: until who identifies finds is done with what it has heard of.

    >>> leg, finds, back = Leg((500.0, 0.0), 0.04, 100.0), [Find(0.9, 200.0)], Return(400.0, 400.0)
    >>> goes_on(leg, finds, 200.0, back, back, 2000.0, 0.0)
    False
    >>> goes_on(leg, finds, 200.0, back, back, 2000.0, 1000.0)  # who identifies them has its hands full
    True
    """

    def gain(told: Sequence[Find], after_s: float, back: Return) -> float:
        until_s = left_s - max(after_s + back.heard_in_s, busy_s)
        identified = sum(find.p_site * max(0.0, until_s - find.takes_s) for find in told)
        missed = leg.sites / leg.takes_s * back.pause_s * max(0.0, left_s - after_s - back.pause_s / 2.0)
        return identified - 2.0 * missed  # found later, and identified later

    return max(0.0, gain([*finds, Find(leg.sites, takes_s)], leg.takes_s, later)) >= gain(finds, 0.0, now)


class Trail:
    """Where a vehicle has been lately: what it has just looked at, whether it has told so or not.

    Args:
        choosing: of the vehicle.
        grid: the cells.
    """

    def __init__(self, choosing: Choosing, grid: CellGrid) -> None:
        self._choosing, self._grid = choosing, grid
        self._passed_s = {range_m: np.full(grid.n_cells, -math.inf) for range_m in choosing.ranges_m}

    def note(self, at_m: Point, now_s: float) -> None:
        """It is here now."""
        dx_m, dy_m = self._grid.x_m - at_m[0], self._grid.y_m - at_m[1]
        off2 = dx_m * dx_m + dy_m * dy_m
        for one, range_m in self._choosing.ranges_m.items():
            self._passed_s[one][off2 <= range_m * range_m] = now_s

    def is_fresh(self, detector: int, now_s: float) -> npt.NDArray[np.bool_]:
        """Cells that a detector has just looked at, shape (n_cells,)."""
        return np.asarray(now_s - self._passed_s[detector] < self._choosing.again_s[detector])


@dataclass(frozen=True)
class Choosing:
    """How a vehicle with some detectors chooses.

    Attributes:
        ranges_m: of its detectors, by their number; again_s: how long a look of each makes another one worthless.
        speed_mps: at which it searches.
        repulsion, repulsion_m: how much it leaves to others, and how far from their way.
        leaves_finds: cells in which something was found are left to who identifies it.
    """

    ranges_m: Mapping[int, float]
    again_s: Mapping[int, float]
    speed_mps: float
    repulsion: float
    repulsion_m: float
    leaves_finds: bool = False

    def information(self, chart: Chart, held: Sequence[Way], track: Trail, now_s: float) -> dict[int, Array]:
        """What a look of each detector at each cell may tell (bits) that nobody else is about to find out.

        Args:
            chart: of the vehicle.
            held: the ways of others.
            track: where it has been lately.
            now_s: the time.
        """
        left = self._left(chart, held)
        return {
            one: np.where(track.is_fresh(one, now_s), 0.0, left * look_information(chart.shares, chart.rates[one]))
            for one in self.ranges_m
        }

    def _left(self, chart: Chart, held: Sequence[Way]) -> Array:
        """Which share of each cell is neither left to others nor to who identifies what was found, shape (n_cells,)."""
        left = np.where(chart.holds_find, 0.0, 1.0) if self.leaves_finds else np.ones(chart.grid.n_cells)
        for way in held:
            left *= 1.0 - self.repulsion * np.maximum(0.0, 1.0 - beside(chart.grid, way) / self.repulsion_m)
        return left

    def _sites(self, chart: Chart, left: Array, track: Trail, off2: Array, now_s: float) -> float:
        """How many sites are found on a way, of which cells are so far off (m2), shape (n_cells,)."""
        missed = np.ones_like(chart.shares)
        for one, range_m in self.ranges_m.items():
            looked = (off2 <= range_m * range_m) & ~track.is_fresh(one, now_s)
            missed *= 1.0 - chart.rates[one][:, None] * looked
        return summed(left * chart.sites((1.0 - missed) * chart.shares))

    def choose(
        self, chart: Chart, held: Sequence[Way], track: Trail, at_m: Point, leash: Leash | None, now_s: float
    ) -> Leg | None:
        """The first leg of the best route; None if there is no point to which it may go.

        Each target that is among the best for itself begins a route, which goes on to where most is told per time of
        what is left. The route that tells most per time is taken (a rollout of the greedy choice; Bertsekas, Tsitsiklis
        and Wu, Journal of Heuristics 3, 1997).

        Args:
            chart, held, track: see ``information``.
            at_m: where it is.
            leash: how far it may go; None where it may go anywhere.
            now_s: the time.
        """
        grid = chart.grid
        cells = np.arange(grid.n_cells)
        on_lattice = (cells // grid.n_columns % STRIDE == 0) & (cells % grid.n_columns % STRIDE == 0)
        x_m, y_m = grid.x_m[on_lattice], grid.y_m[on_lattice]
        if leash is not None:
            allowed = leash.allows(x_m, y_m, at_m, self.speed_mps, now_s)
            x_m, y_m = x_m[allowed], y_m[allowed]
        if len(x_m) == 0:
            return None
        bits = self.information(chart, held, track, now_s)
        legs = self._legs(grid, bits, at_m, x_m, y_m)
        firsts = np.argsort(-legs[0] / legs[1], kind="stable")[:N_FIRST]
        rates = [self._rate(grid, bits, legs, int(first), x_m, y_m) for first in firsts]
        best = int(firsts[int(np.argmax(rates))])
        sites = self._sites(chart, self._left(chart, held), track, legs[2][best], now_s)
        return Leg((float(x_m[best]), float(y_m[best])), sites, float(legs[1][best]))

    def _legs(
        self, grid: CellGrid, bits: Mapping[int, Array], at_m: Point, x_m: Array, y_m: Array
    ) -> tuple[Array, Array, Array]:
        """What looks on the way to each point tell (bits), the time it takes (s), and how far off cells are (m2)."""
        told, off2 = np.zeros(len(x_m)), _off_squared(grid, at_m, x_m, y_m)
        for detector, of in bits.items():
            range_m = self.ranges_m[detector]
            told += halved(np.where(off2 <= range_m * range_m, of, 0.0))
        dx_m, dy_m = x_m - at_m[0], y_m - at_m[1]
        return told, np.sqrt(dx_m * dx_m + dy_m * dy_m) / self.speed_mps + TURN_S, off2

    def _rate(
        self,
        grid: CellGrid,
        bits: Mapping[int, Array],
        legs: tuple[Array, Array, Array],
        leg: int,
        x_m: Array,
        y_m: Array,
    ) -> float:
        """What a route tells per time (bit/s) that begins with a leg."""
        told, takes_s = 0.0, 0.0
        for number in range(N_LEGS):
            told, takes_s = told + float(legs[0][leg]), takes_s + float(legs[1][leg])
            if number == N_LEGS - 1:
                break
            off2 = legs[2][leg]
            bits = {one: np.where(off2 <= self.ranges_m[one] * self.ranges_m[one], 0.0, of) for one, of in bits.items()}
            legs = self._legs(grid, bits, (float(x_m[leg]), float(y_m[leg])), x_m, y_m)
            leg = int(np.argmax(legs[0] / legs[1]))
        return told / takes_s


def _off_squared(grid: CellGrid, at_m: Point, x_m: Array, y_m: Array) -> Array:
    """Square of the distance of each cell from each straight way (m2), shape (points, n_cells)."""
    east_m, north_m = (x_m - at_m[0])[:, None], (y_m - at_m[1])[:, None]
    length2 = np.maximum(east_m * east_m + north_m * north_m, 1e-9)
    dx_m, dy_m = (grid.x_m - at_m[0])[None, :], (grid.y_m - at_m[1])[None, :]
    along = np.clip((dx_m * east_m + dy_m * north_m) / length2, 0.0, 1.0)
    off_x, off_y = dx_m - along * east_m, dy_m - along * north_m
    return np.asarray(off_x * off_x + off_y * off_y)


def lawnmower_track(west_m: float, south_m: float, east_m: float, north_m: float, apart_m: float) -> tuple[Point, ...]:
    """Points of a lawnmower track along the longer side of a rectangle, lanes no farther apart than so much.

    >>> lawnmower_track(0.0, 0.0, 100.0, 40.0, 20.0)
    ((0.0, 10.0), (100.0, 10.0), (100.0, 30.0), (0.0, 30.0))
    """
    is_wide = east_m - west_m >= north_m - south_m
    begin, end, low, high = (west_m, east_m, south_m, north_m) if is_wide else (south_m, north_m, west_m, east_m)
    n = max(1, math.ceil((high - low) / apart_m - 1e-9))
    points = []
    for number in range(n):
        across = low + (number + 0.5) * (high - low) / n
        ends = (begin, end) if number % 2 == 0 else (end, begin)
        points += [(along, across) if is_wide else (across, along) for along in ends]
    return tuple(points)
