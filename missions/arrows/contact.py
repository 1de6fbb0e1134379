"""Contact: where a vehicle is within reach of the others, and when it has to be back there.

All know where the group keeps together, and what the channel loses over range. So each knows on its own where contact
is, and that it has left it; nobody has to tell it when to come back.

**A leash by value.** A site is worth more the sooner it is found, and once more the sooner it is identified: until the
search ends, T from now, each is worth the time that is left. What a vehicle has found is identified once it has told
who can identify it, and that one is done with all it has heard of before, b from now (``Hearers``). So a vehicle that
finds r sites per second, comes back after a time l, is heard h later, and is c later than it would be on its way for
that, gains over one that never comes back, with finds i, each a site by p_i and a_i from being identified,

    sum over i of  p_i * (T - max(l + h, b) - a_i)  -  2 * r * c * (T - l - c / 2),

with each time that is left taken as 0 once it is past: what it tells of is identified, and what it goes on to find is
found later, and identified later. It goes on a leg if coming back after that gains more than coming back now, or
neither gains anything (``choosing.goes_on``). Nor does it come back where it expects to be heard sooner anyway: it
expects a silence to last as long again as it has lasted, its median where nothing else is known of it (Gott, Nature
363, 1993).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from exchange.acoustics.link import Transmission
from exchange.arithmetic import distance
from missions.arrows.detectors import ANOMALY, unidentified
from missions.arrows.scenario import ArrowsScenario
from missions.arrows.seafloor import Array
from missions.scenarios.deployment import deployment_of
from remoras.beliefs import Known
from remoras.picture import Peers
from remoras.work import Point

N_RANGES = 200
"""Ranges at which the loss is looked up."""
N_HEARD = 2
"""Who has heard so many packets of another one has been heard by it; one may come through from afar."""


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
        alone_s: how long a vehicle that waits for orders may be out of contact.
        greeting_s: who is back stays until it is heard, for so long at most.
        p_loss: share of packets that is lost at that range.
    """

    point_m: Point
    range_m: float
    alone_s: float
    greeting_s: float
    p_loss: float = 0.0

    def holds(self, position_m: Point) -> bool:
        """True within it."""
        return distance(position_m, self.point_m) <= self.range_m

    def home_s(self, position_m: Point, speed_mps: float) -> float:
        """How long the way back into contact takes."""
        return max(0.0, distance(position_m, self.point_m) - self.range_m) / speed_mps

    def heard_in_s(self, position_m: Point, speed_mps: float, frame_s: float) -> float:
        """How long it takes until who comes back has heard, and been heard by, another one that is there."""
        return self.home_s(position_m, speed_mps) + N_HEARD * frame_s / (1.0 - self.p_loss)


class Find(NamedTuple):
    """What a vehicle has found: the probability that it is a site, and how long it takes to identify it (s)."""

    p_site: float
    takes_s: float


class Hearers:
    """Those who identify finds: what they have heard of, as far as one vehicle can know, and have to do.

    Args:
        speeds_mps: of who identifies, by name.
        stay_s: how long one stays at a find.
    """

    def __init__(self, speeds_mps: Mapping[str, float], stay_s: float) -> None:
        self._speeds_mps, self._stay_s = speeds_mps, stay_s
        self.heard_s = 0.0
        self._told: Collection[str] = ()
        self._known: Collection[str] = ()

    def note(self, facts: Known, peers: Peers) -> None:
        """Of what was known before two packets of theirs they have heard (``N_HEARD``)."""
        heard_s = max((peers.heard_s.get(name, 0.0) for name in self._speeds_mps), default=0.0)
        if heard_s > self.heard_s:
            self.heard_s, self._told, self._known = heard_s, self._known, frozenset(facts.instances(ANOMALY))

    def give_up(self, facts: Known) -> None:
        """Nobody came to hear of what is known: it is as good as told."""
        self._told = frozenset(facts.instances(ANOMALY))

    def untold_m(self, facts: Known) -> list[Point]:
        """Where finds lie of which they have not heard."""
        return [place_m for name, place_m in unidentified(facts).items() if name not in self._told]

    def takes_s(self, from_m: Point, place_m: Point) -> float:
        """How long the way to a find takes, and what is done there."""
        return distance(from_m, place_m) / max(self._speeds_mps.values()) + self._stay_s

    def busy_until_s(self, facts: Known, peers: Peers) -> float:
        """When they will be done with all they have heard of, if each time they go to what is nearest."""
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
    """How far and for how long one vehicle may go that has to come back for orders.

    Args:
        reach: where it is in contact.
    """

    def __init__(self, reach: Reach) -> None:
        self._reach = reach
        self._back_s: float | None = 0.0  # since when it is in contact again
        self.due_s = reach.alone_s
        self.has_greeted = True

    def update(self, position_m: Point, heard_s: float, now_s: float) -> None:
        """Note where the vehicle is, and when it was heard last."""
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
        """Which points the vehicle may go to, and be back in contact when it has to: shape of ``x_m``."""
        dx_m, dy_m = x_m - self._reach.point_m[0], y_m - self._reach.point_m[1]
        from_point_m = np.sqrt(dx_m * dx_m + dy_m * dy_m)
        within = from_point_m <= self._reach.range_m
        if not self.has_greeted:
            return np.asarray(within)
        dx_m, dy_m = x_m - position_m[0], y_m - position_m[1]
        there_m = np.sqrt(dx_m * dx_m + dy_m * dy_m)
        back_s = now_s + (there_m + np.maximum(0.0, from_point_m - self._reach.range_m)) / speed_mps
        return np.asarray(within | (back_s <= self.due_s))
