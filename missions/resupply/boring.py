"""What there is to do, and how vehicles do it: a hole takes a certain drill, and more energy than its battery has.

Where the battery is empty the vehicle stays, says that the work is halted there, and is dissatisfied. A vehicle with a
charger that comes lies at a berth beside the hole. While each sees the other at its place energy passes over. Both
count it: the one goes on boring once its battery is full, or the other one has left and there is enough to go on; the
other one leaves once the battery must be full, or its store is empty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from missions.meeting.helping import Help
from missions.meeting.staying import THERE_M, SiteSurvey
from missions.resupply.energy import (
    DRILL_CHARGE,
    LEAST_SHARE,
    STORE_CHARGE,
    ChargerSettings,
    DrillSettings,
    Gauge,
    Transfer,
    is_at,
)
from remoras.behaviours import (
    ADVANCING,
    CAPTURE_M,
    DONE,
    FAILED,
    IDLE,
    STANDING,
    Approach,
    Behaviour,
    Perception,
    Reference,
    attracted,
    distance_m,
)
from remoras.database import VehicleData
from remoras.known import Known
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.sensor import Observation

BRINGS, HALTED = "brings", "isHalted"
"""Attributes: to which hole a vehicle has gone with energy last; whether the work at a hole is halted without it."""
SURELY_M = 1.5
"""A vehicle counts on another one that it sees this near to its place."""


@dataclass(frozen=True)
class Boring(SiteSurvey):
    """A hole: a ``remoras.work.Job`` for whoever has the drill.

    Attributes:
        name: of the hole; place_m: where it is; stay_s: how long it takes to bore it.
        drill: name of the sensor that bores it.
        is_starved: nobody is able to any more, since no energy is left for it.
    """

    drill: str
    is_starved: bool = False

    def is_able(self, data: VehicleData) -> bool:
        """True for a vehicle with the drill."""
        return not self.is_starved and self.drill_of(data) is not None

    def drill_of(self, data: VehicleData) -> DrillSettings | None:
        """The drill of a vehicle that bores such holes; None without one."""
        drills = (one for one in data.sensors if isinstance(one, DrillSettings) and one.name == self.drill)
        return next(drills, None)


class Drilling(Behaviour):
    """Goes to a hole and bores it; without energy it stays there, and is dissatisfied.

    Args:
        boring: the job; others: those that take the same drill; transfer: how energy comes in.
        wait_s: after so long without any it gives up; data: of the vehicle.
    """

    def __init__(
        self, boring: Boring, others: Sequence[Boring], transfer: Transfer, wait_s: float, data: VehicleData
    ) -> None:
        self._others = others
        self._boring, self._transfer, self._wait_s = boring, transfer, wait_s
        self._drill = boring.drill_of(data) or DrillSettings()
        self._berth_m = transfer.berth(boring.place_m)
        self._gauge = Gauge(data.name, DRILL_CHARGE, self._drill.battery_j)
        self._speed_mps = data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)
        self._bored_s = 0.0
        self._last_s: float | None = None  # of the last decision at the hole
        self._halted_s: float | None = None  # since when it waits

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due until the hole is bored, the nearest first; it advances while the drill works or energy comes in."""
        boring, now_s = self._boring, picture.body.now_s
        if picture.facts.get(boring.done) is not None:
            return DONE
        if boring.drill not in picture.body.answering:
            return FAILED
        if begun := self._gauge.begun(picture.facts, now_s):
            return IDLE._replace(concludes=begun)
        to_go_m = distance_m(motion, boring.place_m)
        if performed and to_go_m <= THERE_M:
            dt_s, self._last_s = (0.0 if self._last_s is None else now_s - self._last_s), now_s
            return self._work(dt_s, picture) if to_go_m <= SURELY_M else STANDING
        self._last_s, noted = None, self._gauge.let_go()
        advance = self._approach.advance(to_go_m, now_s, performed)
        if self._halted_s is None and self._waits_elsewhere(picture.facts):
            return IDLE._replace(concludes=noted)
        return (Perception(1.0, advance) if performed else attracted(to_go_m))._replace(concludes=noted)

    def _waits_elsewhere(self, facts: Known) -> bool:
        """True if it has too little energy, and waits for some at another hole."""
        is_short = self._gauge.left_j(facts) < LEAST_SHARE * self._gauge.full_j
        return is_short and any(facts.get((HALTED, one.name)) and facts.get(one.done) is None for one in self._others)

    def _work(self, dt_s: float, picture: Picture) -> Perception:
        """Bore, or take energy in, for the time since the last decision."""
        facts, gauge = picture.facts, self._gauge
        if self._halted_s is not None:
            return self._wait(dt_s, picture, self._halted_s)
        used_j = min(self._drill.power_w * dt_s, gauge.left_j(facts))
        gauge.change(-used_j, facts)
        self._bored_s += used_j / self._drill.power_w
        if self._bored_s >= self._boring.stay_s:
            return DONE._replace(concludes=gauge.let_go())
        if gauge.left_j(facts) > 0.0:
            return ADVANCING._replace(concludes=gauge.noted())
        self._halted_s = picture.body.now_s
        return STANDING._replace(concludes=(*gauge.noted(), self._says(True)))

    def _wait(self, dt_s: float, picture: Picture, since_s: float) -> Perception:
        facts, gauge, now_s = picture.facts, self._gauge, picture.body.now_s
        left_j = gauge.left_j(facts)
        if is_at(self._berth_m, SURELY_M, picture):
            gauge.change(self._transfer.efficiency * self._transfer.power_w * dt_s, facts)
            self._halted_s = now_s
            if gauge.left_j(facts) < gauge.full_j:
                return ADVANCING._replace(concludes=gauge.noted())
        elif left_j < LEAST_SHARE * gauge.full_j:
            if now_s - since_s > self._wait_s:
                return FAILED
            is_known = facts.get((HALTED, self._boring.name))
            return STANDING if is_known else STANDING._replace(concludes=(self._says(True),))
        self._halted_s = None
        return ADVANCING._replace(concludes=(*gauge.noted(at_once=True), self._says(False)))

    def _says(self, is_halted: bool) -> Observation:
        return Observation(((self._boring.name, HALTED, is_halted),))

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To the hole in transit; stay there."""
        place_m = self._boring.place_m
        return Reference(place_m, 0.0 if distance_m(motion, place_m) <= CAPTURE_M else self._speed_mps)


class Bringing(Behaviour):
    """Brings energy to a hole at which the work of another vehicle is halted.

    Args:
        boring: the job; transfer: how energy passes over; lacks_j: energy of the battery there when it is full.
        help: whether this vehicle is of use there; charger: that it has; data: of the vehicle.
    """

    def __init__(
        self,
        boring: Boring,
        transfer: Transfer,
        lacks_j: float,
        help: Help,
        charger: ChargerSettings,
        data: VehicleData,
    ) -> None:
        self._boring, self._transfer, self._lacks_j, self._help = boring, transfer, lacks_j, help
        self._charger = charger.name
        self._berth_m = transfer.berth(boring.place_m)
        self._gauge = Gauge(data.name, STORE_CHARGE, charger.store_j)
        self._speed_mps = data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)
        self._given_j = 0.0  # since it has come
        self._last_s: float | None = None  # of the last decision at the berth

    def _is_due(self, to_go_m: float, picture: Picture, performed: bool) -> bool:
        facts = picture.facts
        is_of_use = self._help.is_of_use(self._berth_m, to_go_m, picture, performed)
        return (
            is_of_use
            and bool(facts.get((HALTED, self._boring.name)))
            and facts.get(self._boring.done) is None
            and self._charger in picture.body.answering
            and self._gauge.left_j(facts) > 0.0
        )

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due while work is halted there and no other one comes; it advances on the way, and while energy passes."""
        to_go_m, now_s = distance_m(motion, self._berth_m), picture.body.now_s
        if begun := self._gauge.begun(picture.facts, now_s):
            return IDLE._replace(concludes=begun)
        if not self._is_due(to_go_m, picture, performed):
            self._last_s, self._given_j = None, 0.0
            return IDLE._replace(concludes=self._gauge.let_go())
        if performed and to_go_m <= THERE_M:
            dt_s, self._last_s = (0.0 if self._last_s is None else now_s - self._last_s), now_s
            found = self._give(dt_s, to_go_m, picture)
        else:
            self._last_s, self._given_j, noted = None, 0.0, self._gauge.let_go()
            advance = self._approach.advance(to_go_m, now_s, performed)
            found = (Perception(1.0, advance) if performed else attracted(to_go_m))._replace(concludes=noted)
        return found._replace(concludes=(*self._help.said(), *found.concludes), ends=self._help.ends)

    def _give(self, dt_s: float, to_go_m: float, picture: Picture) -> Perception:
        if to_go_m > SURELY_M or not is_at(self._boring.place_m, THERE_M, picture):
            return STANDING
        gauge, facts = self._gauge, picture.facts
        given_j = min(self._transfer.power_w * dt_s, gauge.left_j(facts))
        gauge.change(-given_j, facts)
        self._given_j += self._transfer.efficiency * given_j
        if self._given_j < self._lacks_j:
            return ADVANCING._replace(concludes=gauge.noted())
        is_full = Observation(((self._boring.name, HALTED, False),))
        return ADVANCING._replace(concludes=(*gauge.noted(at_once=True), is_full))

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To the berth in transit; stay there."""
        return Reference(self._berth_m, 0.0 if distance_m(motion, self._berth_m) <= CAPTURE_M else self._speed_mps)
