"""Contact: where a vehicle is within reach of the others, and when it has to be back there.

All know the rally point, around which the group keeps together, and what the channel loses over range. So each knows on
its own where contact is, and that it has left it; nobody has to tell it when to come back.

**A leash by value.** What is found is worth more the sooner others hear of it: until the search ends at T, they can act
on it, so each bit that is told at t is worth T - t, and nothing from T on. A vehicle that holds U bits which nobody has
heard of, is h from contact, and could go on a leg that takes L, may tell g bits and ends h' from contact, goes on while

    g * (T - now - L - h')  >=  U * ((T - now - h) - (T - now - L - h')),

with each time to the end taken as 0 once it is past: while what it expects to be told is worth more than what it holds
loses by being told later (``choosing.goes_on``). It comes back sooner the more it has found, and lastly before the end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from exchange.acoustics.link import Transmission
from exchange.arithmetic import distance
from missions.arrows.grid import Array
from missions.arrows.scenario import ArrowsScenario
from missions.scenarios.deployment import deployment_of
from remoras.work import Point

N_RANGES = 200
"""Ranges at which the loss is looked up."""
LATELY_S = 60.0
"""Who has heard others twice within so long is in contact; one packet may come through from afar."""


def contact_range_m(scenario: ArrowsScenario) -> float:
    """The farthest range at which a full packet is lost no more often than ``mission.contact_loss``.

    On a channel that is worse than that everywhere nothing is gained by coming nearer than where it is at its best.
    """
    deployment = deployment_of(scenario)
    links = scenario.channel.link_model(deployment, 0)
    size_bits, range_m = deployment.modem.payload_bits, scenario.communication.range_m
    ranges_m = [range_m * number / N_RANGES for number in range(1, N_RANGES + 1)]
    losses = [links.p_loss(Transmission(0, 0, 0.0, size_bits), 1, one_m) for one_m in ranges_m]
    limit = max(scenario.mission.contact_loss, min(losses))
    return max(one_m for one_m, p_loss in zip(ranges_m, losses, strict=True) if p_loss <= limit)


@dataclass(frozen=True)
class Reach:
    """Where and how long.

    Attributes:
        point_m: the middle of where all are in contact.
        range_m: a vehicle within it is in contact.
        alone_s: how long a vehicle may be out of contact; infinite where that is not bounded.
        greeting_s: who is back stays until it hears somebody, for so long at most.
    """

    point_m: Point
    range_m: float
    alone_s: float
    greeting_s: float

    def holds(self, position_m: Point) -> bool:
        """True within it."""
        return distance(position_m, self.point_m) <= self.range_m

    def home_s(self, position_m: Point, speed_mps: float) -> float:
        """How long the way back into contact takes."""
        return max(0.0, distance(position_m, self.point_m) - self.range_m) / speed_mps


class Leash:
    """Whether one vehicle is in contact, and how far and for how long it may still go.

    Args:
        reach: where it is in contact.
    """

    def __init__(self, reach: Reach) -> None:
        self._reach = reach
        self._back_s: float | None = None  # since when it is in contact again
        self._heard_s = -math.inf, -math.inf  # when it heard last who acts on what it tells, and before
        self.due_s = reach.alone_s
        self.has_greeted = True

    def update(self, position_m: Point, heard_s: float, now_s: float, acting_s: float = -math.inf) -> None:
        """Note where the vehicle is, when it heard anybody last, and when anybody who acts on what it tells."""
        if acting_s > self._heard_s[0]:
            self._heard_s = acting_s, self._heard_s[0]
        if not self._reach.holds(position_m):
            self._back_s = None
            return
        if self._back_s is None:
            self._back_s = now_s
            self.has_greeted = now_s == 0.0
        self.due_s = now_s + self._reach.alone_s
        waited_s = now_s - self._back_s
        self.has_greeted = self.has_greeted or heard_s > self._back_s or waited_s >= self._reach.greeting_s

    def is_in_contact(self, now_s: float) -> bool:
        """True for who has lately heard twice who acts on it, or is back and has heard anybody or waited for long."""
        return self._heard_s[1] >= now_s - LATELY_S or (self._back_s is not None and self.has_greeted)

    def allows(
        self, x_m: Array, y_m: Array, position_m: Point, speed_mps: float, now_s: float
    ) -> npt.NDArray[np.bool_]:
        """Which points the vehicle may go to, and be back in contact when it has to: shape of ``x_m``."""
        dx_m, dy_m = x_m - self._reach.point_m[0], y_m - self._reach.point_m[1]
        from_point_m = np.sqrt(dx_m * dx_m + dy_m * dy_m)
        within = from_point_m <= self._reach.range_m
        if not self.has_greeted:
            return np.asarray(within)
        if self._reach.alone_s == math.inf:
            return np.ones(len(x_m), dtype=bool)
        dx_m, dy_m = x_m - position_m[0], y_m - position_m[1]
        there_m = np.sqrt(dx_m * dx_m + dy_m * dy_m)
        back_s = now_s + (there_m + np.maximum(0.0, from_point_m - self._reach.range_m)) / speed_mps
        return np.asarray(within | (back_s <= self.due_s))
