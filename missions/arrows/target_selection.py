"""Target selection: route with most information per time, less what other vehicles cover.

**Contact.** All vehicles know where the group stays and the loss over range, so each knows the area of contact.

**A leash by value.** A site is worth the time left when it is found, and again the time left when it is identified. T
is the time until the search ends. A find is identified once a report reaches an identifying vehicle and this one has
done its earlier work, b from now (``Hearers``). A vehicle finds r sites per second, returns after l, is received h
later, and loses c by the detour. Its finds i are sites with probability p_i and need a_i to be identified. Compared
with no return it gains

    sum over i of  p_i * (T - max(l + h, b) - a_i)  -  2 * r * c * (T - l - c / 2),

with negative times as 0: reported finds are identified, and later finds are both found and identified later. It takes a
leg if a return afterwards gains more than a return now, or if neither gains (``goes_on``).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from exchange.arithmetic import distance
from exchange.channel.link import Transmission
from missions.arrows.belief_map import Array, CellGrid, Chart, halved, look_information, summed, total_of
from missions.arrows.detectors import ANOMALY, unidentified
from missions.arrows.scenario import ArrowsScenario
from remoras.beliefs import Known
from remoras.picture import Peers
from remoras.work import Point

N_RANGES = 200
N_HEARD = 2  # packets received from a vehicle that imply contact in both directions


def contact_range_m(scenario: ArrowsScenario) -> float:
    """Largest range with loss of at most ``mission.contact_loss``, or else the channel's least."""
    deployment = scenario.deployment
    links = scenario.channel.link_model(deployment, 0)
    size_bits, range_m = deployment.modem.payload_bits, scenario.communication.range_m
    ranges_m = [range_m * number / N_RANGES for number in range(1, N_RANGES + 1)]
    losses = [links.p_loss(Transmission(0, 0, 0.0, size_bits), 1, one_m) for one_m in ranges_m]
    limit = max(scenario.mission.contact_loss, min(losses))
    return max(one_m for one_m, p_loss in zip(ranges_m, losses, strict=True) if p_loss <= limit)


@dataclass(frozen=True)
class Reach:
    """Area of contact around ``point_m``; limits of time out of contact on orders, and of waits for reception."""

    point_m: Point
    range_m: float
    alone_s: float
    greeting_s: float
    p_loss: float = 0.0

    def holds(self, position_m: Point) -> bool:
        """Return True inside the area."""
        return distance(position_m, self.point_m) <= self.range_m

    def home_s(self, position_m: Point, speed_mps: float) -> float:
        """Travel time back into contact (s)."""
        return max(0.0, distance(position_m, self.point_m) - self.range_m) / speed_mps

    def heard_in_s(self, position_m: Point, speed_mps: float, frame_s: float) -> float:
        """Expected time (s) until mutual reception after a return."""
        return self.home_s(position_m, speed_mps) + N_HEARD * frame_s / (1.0 - self.p_loss)


class Find(NamedTuple):
    """Site probability of a find, and the time to identify it (s)."""

    p_site: float
    takes_s: float


class Hearers:
    """Identifying vehicles: known reception of reports, and workload."""

    def __init__(self, speeds_mps: Mapping[str, float], stay_s: float) -> None:
        self._speeds_mps, self._stay_s = speeds_mps, stay_s
        self.heard_s = 0.0
        self._told: Collection[str] = ()
        self._known: Collection[str] = ()

    def note(self, facts: Known, peers: Peers) -> None:
        """Mark finds known two of their packets ago as received (``N_HEARD``)."""
        heard_s = max((peers.heard_s.get(name, 0.0) for name in self._speeds_mps), default=0.0)
        # Of two packets received after a find became known, the second shows that its report had time to arrive.
        if heard_s > self.heard_s:
            self.heard_s, self._told, self._known = heard_s, self._known, frozenset(facts.instances(ANOMALY))

    def give_up(self, facts: Known) -> None:
        """Treat all known finds as reported after a wait without reception."""
        self._told = frozenset(facts.instances(ANOMALY))

    def untold_m(self, facts: Known) -> list[Point]:
        """Places of unreported finds."""
        return [place_m for name, place_m in unidentified(facts).items() if name not in self._told]

    def takes_s(self, from_m: Point, place_m: Point) -> float:
        """Travel time to a find and time there (s)."""
        return distance(from_m, place_m) / max(self._speeds_mps.values()) + self._stay_s

    def busy_until_s(self, facts: Known, peers: Peers) -> float:
        """Expected end of their reported work, nearest find first."""
        places_m = [place_m for name, place_m in unidentified(facts).items() if name in self._told]
        last, until_s = max(self._speeds_mps, key=lambda name: peers.heard_s.get(name, 0.0)), self.heard_s
        at_m = peers.positions_m.get(last)
        while places_m:
            next_m = min(places_m, key=lambda place_m: distance(at_m or place_m, place_m))
            until_s += self.takes_s(at_m or next_m, next_m) / len(self._speeds_mps)
            places_m.remove(next_m)
            at_m = next_m
        return until_s


class Leash:
    """Limit of range and time for a vehicle that must return for orders."""

    def __init__(self, reach: Reach) -> None:
        self._reach = reach
        self._back_s: float | None = 0.0  # start of the current contact
        self.due_s = reach.alone_s
        self.has_greeted = True

    def update(self, position_m: Point, heard_s: float, now_s: float) -> None:
        """Record the vehicle's position and its last reception."""
        if not self._reach.holds(position_m):
            self._back_s = None
            return
        if self._back_s is None:
            self._back_s, self.has_greeted = now_s, False
        self.due_s = now_s + self._reach.alone_s
        waited_s = now_s - self._back_s
        self.has_greeted = self.has_greeted or heard_s > self._back_s or waited_s >= self._reach.greeting_s

    def allows(
        self, x_m: Array, y_m: Array, position_m: Point, speed_mps: float, now_s: float
    ) -> npt.NDArray[np.bool_]:
        """Mask of points with a timely return, in the shape of ``x_m``."""
        dx_m, dy_m = x_m - self._reach.point_m[0], y_m - self._reach.point_m[1]
        from_point_m = np.sqrt(dx_m * dx_m + dy_m * dy_m)
        within = from_point_m <= self._reach.range_m
        if not self.has_greeted:
            return np.asarray(within)
        dx_m, dy_m = x_m - position_m[0], y_m - position_m[1]
        there_m = np.sqrt(dx_m * dx_m + dy_m * dy_m)
        back_s = now_s + (there_m + np.maximum(0.0, from_point_m - self._reach.range_m)) / speed_mps
        return np.asarray(within | (back_s <= self.due_s))


TURN_S = 20.0  # fixed time cost of a leg
STRIDE = 2  # lattice of possible targets, in cells
N_FIRST, N_LEGS = 5, 3  # number of candidate first legs, and of legs per route
Way = tuple[Point, Point]  # start and end of a vehicle's path


def beside(grid: CellGrid, way: Way) -> Array:
    """Distance of each cell centre from a path (m), shape (n_cells,)."""
    from_m, (to_x_m, to_y_m) = way
    return np.asarray(np.sqrt(_off_squared(grid, from_m, np.array([to_x_m]), np.array([to_y_m]))[0]))


class Leg(NamedTuple):
    """Path to a target, with the expected number of sites found and the time (s)."""

    target_m: Point
    sites: float
    takes_s: float


class _Part(NamedTuple):
    """Leg of a route: its information (bits), time (s), squared distances of all cells (m2), and end."""

    bits: float
    takes_s: float
    off2: Array
    to_m: Point

    @classmethod
    def of(cls, legs: tuple[Array, Array, Array], number: int, x_m: Array, y_m: Array) -> _Part:
        """Return the part of that number."""
        totals, takes_s, off2 = legs
        to_m = float(x_m[number]), float(y_m[number])
        return cls(float(totals[number]), float(takes_s[number]), off2[number], to_m)


class Return(NamedTuple):
    """Return into contact: time until reception (s), and extra time to resume from there (s)."""

    heard_in_s: float
    pause_s: float


def goes_on(
    leg: Leg, finds: Sequence[Find], takes_s: float, now: Return, later: Return, left_s: float, busy_s: float
) -> bool:
    """Return True if a return after a leg gains more than one now, or neither gains.

    ``finds`` are unreported, ``takes_s`` is the time to identify those of the leg. The search ends in ``left_s``, the
    identifying vehicles are free in ``busy_s``.

    >>> leg, finds, back = Leg((500.0, 0.0), 0.04, 100.0), [Find(0.9, 200.0)], Return(400.0, 400.0)
    >>> goes_on(leg, finds, 200.0, back, back, 2000.0, 0.0)
    False
    >>> goes_on(leg, finds, 200.0, back, back, 2000.0, 1000.0)  # the identifying vehicle is busy
    True
    """

    def gain(reported: Sequence[Find], after_s: float, back: Return) -> float:
        until_s = left_s - max(after_s + back.heard_in_s, busy_s)
        identified = sum(find.p_site * max(0.0, until_s - find.takes_s) for find in reported)
        missed = leg.sites / leg.takes_s * back.pause_s * max(0.0, left_s - after_s - back.pause_s / 2.0)
        # Missed sites are both found and identified later, hence the factor.
        return identified - 2.0 * missed

    return max(0.0, gain([*finds, Find(leg.sites, takes_s)], leg.takes_s, later)) >= gain(finds, 0.0, now)


class Trail:
    """Recent track of a vehicle: cells observed a moment ago, reported or not."""

    def __init__(self, choosing: Choosing, grid: CellGrid) -> None:
        self._choosing, self._grid = choosing, grid
        self._passed_s = {range_m: np.full(grid.n_cells, -math.inf) for range_m in choosing.ranges_m}

    def note(self, at_m: Point, now_s: float) -> None:
        """Record the current position."""
        dx_m, dy_m = self._grid.x_m - at_m[0], self._grid.y_m - at_m[1]
        off2 = dx_m * dx_m + dy_m * dy_m
        for detector, range_m in self._choosing.ranges_m.items():
            self._passed_s[detector][off2 <= range_m * range_m] = now_s

    def is_fresh(self, detector: int, now_s: float) -> npt.NDArray[np.bool_]:
        """Cells that a detector has just observed, shape (n_cells,)."""
        return np.asarray(now_s - self._passed_s[detector] < self._choosing.again_s[detector])


@dataclass(frozen=True)
class Choosing:
    """Target selection; observations repeated within ``again_s`` are worthless, ``leaves_finds`` skips detections."""

    ranges_m: Mapping[int, float]
    again_s: Mapping[int, float]
    speed_mps: float
    repulsion: float
    repulsion_m: float
    leaves_finds: bool = False

    def information(self, chart: Chart, held: Sequence[Way], track: Trail, now_s: float) -> dict[int, Array]:
        """Expected information (bits) by detector and cell, less that on paths ``held`` by others."""
        left = self._left(chart, held)
        return {
            d: np.where(track.is_fresh(d, now_s), 0.0, left * look_information(chart.shares, chart.rates[d]))
            for d in self.ranges_m
        }

    def _left(self, chart: Chart, held: Sequence[Way]) -> Array:
        """Share of each cell not left to other vehicles, shape (n_cells,)."""
        left = np.where(chart.holds_find, 0.0, 1.0) if self.leaves_finds else np.ones(chart.grid.n_cells)
        for way in held:
            left *= 1.0 - self.repulsion * np.maximum(0.0, 1.0 - beside(chart.grid, way) / self.repulsion_m)
        return left

    def _sites(self, chart: Chart, left: Array, track: Trail, off2: Array, now_s: float) -> float:
        """Expected number of sites found on a path; ``off2`` are squared cell distances (m2)."""
        missed = np.ones_like(chart.shares)
        for detector, range_m in self.ranges_m.items():
            looked = (off2 <= range_m * range_m) & ~track.is_fresh(detector, now_s)
            missed *= 1.0 - chart.rates[detector][:, None] * looked
        return summed(left * chart.sites((1.0 - missed) * chart.shares))

    def choose(
        self, chart: Chart, held: Sequence[Way], track: Trail, at_m: Point, leash: Leash | None, now_s: float
    ) -> Leg | None:
        """Return the first leg of the best route, or None if the ``leash``, unless it is None, permits no point."""
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
        # Rollout of the greedy choice (Bertsekas, Tsitsiklis and Wu, Journal of Heuristics 3, 1997): each of the best
        # targets starts a route that is continued greedily. The stable sort keeps ties in the order of cells.
        firsts = np.argsort(-legs[0] / legs[1], kind="stable")[:N_FIRST]
        rates = [self._rate(grid, bits, _Part.of(legs, first, x_m, y_m), x_m, y_m) for first in firsts]
        best = int(firsts[int(np.argmax(rates))])
        sites = self._sites(chart, self._left(chart, held), track, legs[2][best], now_s)
        return Leg((float(x_m[best]), float(y_m[best])), sites, float(legs[1][best]))

    def _legs(
        self, grid: CellGrid, bits: Mapping[int, Array], at_m: Point, x_m: Array, y_m: Array
    ) -> tuple[Array, Array, Array]:
        total, off2 = np.zeros(len(x_m)), _off_squared(grid, at_m, x_m, y_m)
        for detector, gains in bits.items():
            range_m = self.ranges_m[detector]
            total += halved(np.where(off2 <= range_m * range_m, gains, 0.0))
        return total, self._takes_s(at_m, x_m, y_m), off2

    def _takes_s(self, at_m: Point, x_m: Array, y_m: Array) -> Array:
        dx_m, dy_m = x_m - at_m[0], y_m - at_m[1]
        return np.asarray(np.sqrt(dx_m * dx_m + dy_m * dy_m) / self.speed_mps + TURN_S)

    def _rate(self, grid: CellGrid, bits: Mapping[int, Array], part: _Part, x_m: Array, y_m: Array) -> float:
        total, takes_s = part.bits, part.takes_s
        for _ in range(N_LEGS - 1):
            bits = {d: np.where(part.off2 <= self.ranges_m[d] * self.ranges_m[d], 0.0, of) for d, of in bits.items()}
            part = self._next(grid, bits, part.to_m, x_m, y_m)
            total, takes_s = total + part.bits, takes_s + part.takes_s
        return total / takes_s

    def _next(self, grid: CellGrid, bits: Mapping[int, Array], at_m: Point, x_m: Array, y_m: Array) -> _Part:
        """Return the first leg with most information per time; sum only legs that may have it."""
        most = total_of([_most_along(grid, of, self.ranges_m[d], at_m, x_m, y_m) for d, of in bits.items()])
        rates = most / self._takes_s(at_m, x_m, y_m)
        likely = int(np.argmax(rates))
        totals, takes_s, _ = self._legs(grid, bits, at_m, x_m[likely : likely + 1], y_m[likely : likely + 1])
        may_win = rates >= totals[0] / takes_s[0]
        x_m, y_m = x_m[may_win], y_m[may_win]
        legs = self._legs(grid, bits, at_m, x_m, y_m)
        return _Part.of(legs, int(np.argmax(legs[0] / legs[1])), x_m, y_m)


def _most_along(grid: CellGrid, gains: Array, range_m: float, at_m: Point, x_m: Array, y_m: Array) -> Array:
    """Upper bound of the sum of ``gains`` within ``range_m`` of each straight path, shape (points,).

    In each row of cells the path is within two parallels of it and within its rectangle, both wider by the range.
    """
    sums = np.zeros((grid.n_rows, grid.n_columns + 1))
    np.cumsum(gains.reshape(grid.n_rows, grid.n_columns), axis=1, out=sums[:, 1:])
    range_m *= 1.0 + 1e-6  # more than errors of rounding, as the last term
    east_m, north_m = (x_m - at_m[0])[:, None], (y_m - at_m[1])[:, None]
    up_m = (grid.y_m[:: grid.n_columns] - at_m[1])[None, :]
    # A path along a row, or of length 0, has parallels that meet it nowhere.
    slope = np.where(north_m == 0.0, 1e-9, north_m)
    half_m = range_m * np.maximum(np.sqrt(east_m * east_m + north_m * north_m), 1e-9) / np.abs(slope)
    middle_m = up_m * east_m / slope
    west_m = np.maximum(middle_m - half_m, np.minimum(east_m, 0.0) - range_m) + (at_m[0] - grid.west_m)
    until_m = np.minimum(middle_m + half_m, np.maximum(east_m, 0.0) + range_m) + (at_m[0] - grid.west_m)
    first = np.clip(np.ceil(west_m / grid.cell_m - 0.5), 0, grid.n_columns).astype(int)
    end = np.clip(np.floor(until_m / grid.cell_m + 0.5), first, grid.n_columns).astype(int)
    is_beside = (up_m < np.minimum(north_m, 0.0) - range_m) | (up_m > np.maximum(north_m, 0.0) + range_m)
    rows = np.arange(grid.n_rows)[None, :]
    within = np.where(is_beside, 0.0, sums[rows, end] - sums[rows, first])
    return halved(within) + 1e-9 * summed(sums[:, -1])


def _off_squared(grid: CellGrid, at_m: Point, x_m: Array, y_m: Array) -> Array:
    """Squared distance of each cell from each straight path (m2), shape (points, n_cells)."""
    east_m, north_m = (x_m - at_m[0])[:, None], (y_m - at_m[1])[:, None]
    # A path of length 0 has no direction; the floor avoids 0 / 0.
    length2 = np.maximum(east_m * east_m + north_m * north_m, 1e-9)
    dx_m, dy_m = (grid.x_m - at_m[0])[None, :], (grid.y_m - at_m[1])[None, :]
    along = np.clip((dx_m * east_m + dy_m * north_m) / length2, 0.0, 1.0)
    off_x, off_y = dx_m - along * east_m, dy_m - along * north_m
    return np.asarray(off_x * off_x + off_y * off_y)
