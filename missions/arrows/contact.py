"""Contact range, and the time at which a vehicle has to return into contact.

All vehicles know where the group stays and the channel's loss over range. Each therefore knows the area of contact.

**A leash by value.** A site is worth the time left when it is found, and again the time left when it is identified. T
is the time until the search ends. A find is identified once a report reaches an identifying vehicle and this one has
done its earlier work, b from now (``Hearers``). A vehicle finds r sites per second, returns after l, is received h
later, and loses c by the detour. Its finds i are sites with probability p_i and need a_i to be identified. Compared
with no return it gains

    sum over i of  p_i * (T - max(l + h, b) - a_i)  -  2 * r * c * (T - l - c / 2),

with negative times as 0: reported finds are identified, and later finds are both found and identified later. It takes a
leg if a return afterwards gains more than a return now, or if neither gains (``choosing.goes_on``). It does not return
if reception is expected sooner anyway: a silence is expected to last as long again as so far, the median without
further knowledge (Gott, Nature 363, 1993).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from exchange.arithmetic import distance
from exchange.channel.link import Transmission
from missions.arrows.detectors import ANOMALY, unidentified
from missions.arrows.scenario import ArrowsScenario
from missions.arrows.seafloor import Array
from remoras.beliefs import Known
from remoras.picture import Peers
from remoras.work import Point

N_RANGES = 200
"""Number of tabulated ranges of the loss."""
N_HEARD = 2
"""Packets received from a vehicle that imply contact in both directions."""


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
    """Area of contact around ``point_m``.

    Attributes:
        alone_s: longest time out of contact for a vehicle on orders.
        greeting_s: longest wait for reception after a return.
        p_loss: packet loss at ``range_m``.
    """

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
