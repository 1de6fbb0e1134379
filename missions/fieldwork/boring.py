"""Drilling, and the transfer of energy to a drill whose battery is too small.

With an empty battery the vehicle stays, reports the work as halted and is dissatisfied. A vehicle with a charger takes
the berth beside the drill site and transfers energy. Both rely on their own equipment: one stays until its drill
reports the hole finished, the other until its charger reports a full battery or an empty store.
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
    TransferTable,
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
"""Attributes: site to which a vehicle last brought energy; whether the work there is halted."""

IN_PLACE_M = 5.0
"""Distance for a received position to count as in place; it is some seconds old."""


class Drilling(Behaviour):
    """Drilling at a site until finished; dissatisfied without energy, given up after ``wait_s``."""

    def __init__(self, boring: Boring, others: Collection[str], wait_s: float, data: VehicleData) -> None:
        self._boring, self._others = boring, others
        self._me, self._speed_mps = data.name, data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)
        self._wait = HelpAwaited(f"energy at {boring.name}", wait_s)

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending until the hole is finished, nearest first; progresses while drilling or charging."""
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
        """True if it waits for energy at another drill site."""
        hole = facts.get((BORES, self._me))
        if hole not in self._others or not facts.get((IS_HALTED, hole)) or facts.get((DONE_BY, hole)) is not None:
            return False
        return bool(facts.get((DRILL_CHARGE, self._me), 1.0) < LEAST_SHARE)

    def _work(self, facts: Known, now_s: float) -> Perception:
        """Progress as reported by the drill, with a report if the halted state has changed."""
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
        """Head for the drill site in transit; hold there."""
        place_m = self._boring.place_m
        return Reference(place_m, 0.0 if distance_m(motion, place_m) <= CAPTURE_M else self._speed_mps)


class HelpAtBerth(Help):
    """Help at a berth for one vehicle: of approaching equals the first by name continues.

    Received positions are seconds old. By positions alone each vehicle would take the other to be farther, and both
    would come. A vehicle that has ceded the berth returns only if it is much nearer. A vehicle at the berth stays.
    """

    turn_frames = 2.0

    def goes_before(self, name: str, its_m: float, to_go_m: float) -> bool:
        """True if the other is at the berth, much nearer, or as near and first by name or under way."""
        if self.is_on and to_go_m <= IN_PLACE_M:
            return False
        margin_m = 2.0 * MUCH_NEARER_M if not self.is_on else MUCH_NEARER_M if name < self.me else -MUCH_NEARER_M
        return its_m <= IN_PLACE_M or its_m - margin_m <= to_go_m

    def stay_away(self, work: Work, picture: Picture) -> Collection[str]:
        """Members that wait themselves, or have no energy as far as known."""
        without = [name for name in work.members if not _has_energy(work.database[name], picture.facts)]
        return [*super().stay_away(work, picture), *without]


def _has_energy(data: VehicleData, facts: Known) -> bool:
    """True if the last reported store, or the initial one, is not empty."""
    charger = data.sensor(ChargerSettings)
    return charger is not None and facts.get((STORE_CHARGE, data.name), charger.store_j) > 0.0


class Bringing(Behaviour):
    """Transfer of energy to a drill site where the work of another vehicle is halted."""

    def __init__(
        self, boring: Boring, transfer: TransferTable, help: Help, charger: ChargerSettings, data: VehicleData
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
        """True if the job has a holder, or a vehicle (perhaps with a private claim) is at the site."""
        peers, late_s = picture.peers, picture.body.now_s - NEWS_FRAMES * picture.frame_s
        there = (name for name, at_m in peers.positions_m.items() if distance(at_m, self._boring.place_m) <= IN_PLACE_M)
        return bool(self._help.holders) or any(peers.word_s.get(name, -math.inf) >= late_s for name in there)

    def _is_giving(self, picture: Picture) -> bool:
        """True while it gives energy at another site: leaving early would soon cause another call."""
        return self._charger.name in picture.body.sensors_on and picture.facts.get((CHARGER_STATE, self._me)) == GIVING

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending while work is halted without another helper; progresses on the way and at work."""
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
        """Progress as reported by the charger; a full battery ends the wait on site."""
        state = facts.get((CHARGER_STATE, self._me))
        if state == FULL:
            return ADVANCING._replace(concludes=(Observation(((self._boring.name, IS_HALTED, False),)),))
        return ADVANCING if state == GIVING else STANDING

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Head for the berth in transit; hold there."""
        return Reference(self._berth_m, 0.0 if distance_m(motion, self._berth_m) <= CAPTURE_M else self._speed_mps)
