"""What there is to do, and how vehicles do it: a hole takes a certain drill, and more energy than its battery has.

Where the battery is empty the vehicle stays, says that the work is halted there, and is dissatisfied. A vehicle with a
charger that comes lies at a berth beside the hole, and energy passes over. Each goes by what its own equipment
measures: the one stays until its drill says that the hole is bored, the other one leaves once its charger says that the
battery is full, or its store is empty.
"""

from __future__ import annotations

import math
from collections.abc import Collection

from exchange.arithmetic import distance
from missions.fieldwork.energy import (
    BORED_SHARE,
    BORES,
    BORING,
    CHARGER_STATE,
    CHARGING,
    DRILL_CHARGE,
    DRILL_STATE,
    FULL,
    GIVING,
    HALTED,
    LEAST_SHARE,
    STORE_CHARGE,
    Boring,
    ChargerSettings,
    Transfer,
)
from missions.fieldwork.helping import MUCH_NEARER_M, NEWS_FRAMES, Help, HelpAwaited
from missions.meeting.staying import DONE_BY, THERE_M
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
from remoras.beliefs import Known
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.sensor import Observation
from remoras.work import Work

BRINGS, IS_HALTED = "brings", "isHalted"
"""Attributes: to which hole a vehicle has gone with energy last; whether the work at a hole is halted without it."""

IN_PLACE_M = 5.0
"""Who was heard this near to a berth or a hole lies there: where it said that it is is some seconds old."""


class Drilling(Behaviour):
    """Goes to a hole and stays until it is bored; without energy it is dissatisfied there.

    Args:
        boring: the job; others: names of those that take the same drill.
        wait_s: after so long there without getting on it gives up; data: of the vehicle.
    """

    def __init__(self, boring: Boring, others: Collection[str], wait_s: float, data: VehicleData) -> None:
        self._boring, self._others = boring, others
        self._me, self._speed_mps = data.name, data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)
        self._wait = HelpAwaited(f"energy at {boring.name}", wait_s)

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due until the hole is bored, the nearest first; it advances while the drill works or energy comes in."""
        boring, facts, now_s = self._boring, picture.facts, picture.body.now_s
        if facts.get(boring.done) is not None or facts.get((BORED_SHARE, boring.name), 0.0) >= 1.0:
            return DONE
        if boring.drill not in picture.body.answering:
            return FAILED
        to_go_m = distance_m(motion, boring.place_m)
        if performed and to_go_m <= THERE_M:
            return self._work(facts, now_s)
        self._wait.is_over()
        advance = self._approach.advance(to_go_m, now_s, performed)
        if self._waits_elsewhere(facts):
            return IDLE
        return Perception(1.0, advance) if performed else attracted(to_go_m)

    def _waits_elsewhere(self, facts: Known) -> bool:
        """True if it has too little energy, and waits for some at another hole."""
        hole = facts.get((BORES, self._me))
        if hole not in self._others or not facts.get((IS_HALTED, hole)) or facts.get((DONE_BY, hole)) is not None:
            return False
        return bool(facts.get((DRILL_CHARGE, self._me), 1.0) < LEAST_SHARE)

    def _work(self, facts: Known, now_s: float) -> Perception:
        """As the drill says that it gets on; it says whether the work is halted where that is known otherwise."""
        is_here = facts.get((BORES, self._me)) == self._boring.name
        state = facts.get((DRILL_STATE, self._me)) if is_here else None
        is_known = bool(facts.get((IS_HALTED, self._boring.name)))
        if state in (BORING, CHARGING):
            self._wait.is_over()
            goes_on = state == BORING and is_known
            return ADVANCING._replace(concludes=(self._says(False),)) if goes_on else ADVANCING
        found = self._wait.perceived(now_s)
        if found.failed:
            return FAILED._replace(concludes=(self._says(False),)) if is_known else FAILED
        says = state == HALTED and not is_known
        return found._replace(concludes=(self._says(True),)) if says else found

    def _says(self, is_halted: bool) -> Observation:
        return Observation(((self._boring.name, IS_HALTED, is_halted),))

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To the hole in transit; stay there."""
        place_m = self._boring.place_m
        return Reference(place_m, 0.0 if distance_m(motion, place_m) <= CAPTURE_M else self._speed_mps)


class HelpAtBerth(Help):
    """Help where one alone has room: of those on their way about as near the first by name goes on; who is there stays.

    Positions heard are some seconds old, so who went by them alone would take the other one to be farther away, and so
    would that one: both would lie about the berth. Who has left it to another one comes only if it gets much nearer.
    """

    turn_frames = 2.0

    def goes_before(self, name: str, its_m: float, to_go_m: float) -> bool:
        """True if the other one is there, or much nearer; or as near, and first by name or alone on its way."""
        if self.is_on and to_go_m <= IN_PLACE_M:
            return False
        margin_m = 2.0 * MUCH_NEARER_M if not self.is_on else MUCH_NEARER_M if name < self.me else -MUCH_NEARER_M
        return its_m <= IN_PLACE_M or its_m - margin_m <= to_go_m

    def stay_away(self, work: Work, picture: Picture) -> Collection[str]:
        """Those who wait themselves, and those who have no energy to give, as far as is known."""
        without = [name for name in work.members if not _has_energy(work.database[name], picture.facts)]
        return [*super().stay_away(work, picture), *without]


def _has_energy(data: VehicleData, facts: Known) -> bool:
    """True if a vehicle has something in its store, as it has said last, or as it had at the start."""
    charger = data.sensor(ChargerSettings)
    return charger is not None and facts.get((STORE_CHARGE, data.name), charger.store_j) > 0.0


class Bringing(Behaviour):
    """Brings energy to a hole at which the work of another vehicle is halted.

    Args:
        boring: the job; transfer: how energy passes over.
        help: whether this vehicle is of use there; charger: that it has; data: of the vehicle.
    """

    def __init__(
        self, boring: Boring, transfer: Transfer, help: Help, charger: ChargerSettings, data: VehicleData
    ) -> None:
        self._boring, self._help, self._charger, self._data = boring, help, charger, data
        self._berth_m = transfer.berth(boring.place_m)
        self._me, self._speed_mps = data.name, data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)

    def _is_due(self, to_go_m: float, picture: Picture, performed: bool) -> bool:
        facts = picture.facts
        is_halted = bool(facts.get((IS_HALTED, self._boring.name)))
        return (
            self._help.is_of_use(self._berth_m if is_halted else None, to_go_m, picture, performed)
            and facts.get(self._boring.done) is None
            and self._charger.name in picture.body.answering
            and _has_energy(self._data, facts)
            and (performed or not self._is_giving(picture))
            and self._is_awaited(picture)
        )

    def _is_awaited(self, picture: Picture) -> bool:
        """True if somebody is to bore the hole, or lies there: who claims jobs for itself alone is known by that."""
        peers, late_s = picture.peers, picture.body.now_s - NEWS_FRAMES * picture.frame_s
        there = (name for name, at_m in peers.positions_m.items() if distance(at_m, self._boring.place_m) <= IN_PLACE_M)
        return bool(self._help.holders) or any(peers.word_s.get(name, -math.inf) >= late_s for name in there)

    def _is_giving(self, picture: Picture) -> bool:
        """True while it gives energy at another hole: who left before the battery is full would soon be called anew."""
        return self._charger.name in picture.body.sensors_on and picture.facts.get((CHARGER_STATE, self._me)) == GIVING

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due while work is halted there and no other one comes; it advances on the way, and while energy passes."""
        to_go_m, now_s = distance_m(motion, self._berth_m), picture.body.now_s
        if not self._is_due(to_go_m, picture, performed):
            return IDLE
        if performed and to_go_m <= THERE_M:
            found = self._give(picture.facts)
        else:
            advance = self._approach.advance(to_go_m, now_s, performed)
            found = Perception(1.0, advance) if performed else attracted(to_go_m)
        return found._replace(concludes=(*self._help.said(), *found.concludes), ends=self._help.ends)

    def _give(self, facts: Known) -> Perception:
        """As the charger says that energy passes; a battery that it finds full ends the wait there."""
        state = facts.get((CHARGER_STATE, self._me))
        if state == FULL:
            return ADVANCING._replace(concludes=(Observation(((self._boring.name, IS_HALTED, False),)),))
        return ADVANCING if state == GIVING else STANDING

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To the berth in transit; stay there."""
        return Reference(self._berth_m, 0.0 if distance_m(motion, self._berth_m) <= CAPTURE_M else self._speed_mps)
