"""Contact: where a vehicle is within reach of the others, and when it has to be back there.

All know the rally point, around which the group keeps together, and what the channel loses over range. So each knows on
its own where it may leave contact, that it has left it, and when and where it must come back; nobody has to tell it.
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
        alone_s: how long a vehicle may be out of contact; infinite if it need not care.
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
    """How far and for how long one vehicle may still go.

    Args:
        reach: where it is in contact.
    """

    def __init__(self, reach: Reach) -> None:
        self._reach = reach
        self._back_s: float | None = None  # since when it is in contact again
        self.due_s = reach.alone_s
        self.has_greeted = True

    def update(self, position_m: Point, heard_s: float, now_s: float) -> None:
        """Note where the vehicle is, and when it heard anybody last."""
        if not self._reach.holds(position_m):
            self._back_s = None
            return
        if self._back_s is None:
            self._back_s = now_s
            self.has_greeted = now_s == 0.0
        self.due_s = now_s + self._reach.alone_s
        waited_s = now_s - self._back_s
        self.has_greeted = self.has_greeted or heard_s > self._back_s or waited_s >= self._reach.greeting_s

    def must_return(self, position_m: Point, speed_mps: float, now_s: float) -> bool:
        """True if it is out of contact and has to set out for it now."""
        return not self._reach.holds(position_m) and now_s + self._reach.home_s(position_m, speed_mps) >= self.due_s

    def allows(
        self, x_m: Array, y_m: Array, position_m: Point, speed_mps: float, now_s: float
    ) -> npt.NDArray[np.bool_]:
        """Which points the vehicle may go to, and be back in contact when it has to: shape of ``x_m``."""
        if self._reach.alone_s == math.inf:
            return np.ones(len(x_m), dtype=bool)
        dx_m, dy_m = x_m - self._reach.point_m[0], y_m - self._reach.point_m[1]
        from_point_m = np.sqrt(dx_m * dx_m + dy_m * dy_m)
        within = from_point_m <= self._reach.range_m
        if not self.has_greeted:
            return np.asarray(within)
        dx_m, dy_m = x_m - position_m[0], y_m - position_m[1]
        there_m = np.sqrt(dx_m * dx_m + dy_m * dy_m)
        back_s = now_s + (there_m + np.maximum(0.0, from_point_m - self._reach.range_m)) / speed_mps
        return np.asarray(within | (back_s <= self.due_s))
