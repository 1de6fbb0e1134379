"""Search by own choice, along lanes or on orders, and identification of anomalies."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from exchange.arithmetic import distance
from missions.arrows.belief_map import Chart, summed
from missions.arrows.detectors import ANOMALY, SAME_M, shown_of, unidentified
from missions.arrows.scenario import UNKNOWN, ArrowsScenario
from missions.arrows.target_selection import Choosing, Find, Hearers, Leash, Leg, Reach, Return, Trail, Way, goes_on
from remoras.behaviours import (
    ADVANCING,
    DONE,
    DUE,
    IDLE,
    Approach,
    Behaviour,
    Perception,
    Reference,
    Standing,
    distance_m,
)
from remoras.beliefs import Known
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.sensor import Observation
from remoras.work import Point

TARGET = "searchTarget"
ARRIVED_M = 10.0
STALE_S = 240.0  # time after which a target is chosen again, reached or not
HELD_S = STALE_S + 60.0  # age at which another vehicle's target expires: a newer one would have been received
ORDERS_S = 10.0
HOVER_M = 2.0
ENOUGH_IMAGES = 12  # images after which an unidentified anomaly stays unknown


class Held:
    """Received targets of other vehicles; they expire after ``HELD_S``."""

    def __init__(self, others: Sequence[str]) -> None:
        self._others = others
        self._since_s: dict[str, tuple[Point, float]] = {}

    def note(self, facts: Known, now_s: float) -> None:
        """Record targets received since the last call."""
        for other in self._others:
            target_m = facts.get((TARGET, other))
            if target_m is not None and (other not in self._since_s or self._since_s[other][0] != target_m):
                self._since_s[other] = target_m, now_s

    def ways(self, positions_m: Mapping[str, Point], now_s: float) -> list[Way]:
        """Return paths from each last received position, or the target itself, to the target."""
        lately = ((name, target_m) for name, (target_m, at_s) in self._since_s.items() if now_s - at_s <= HELD_S)
        return [(positions_m.get(name, target_m), target_m) for name, target_m in lately]


class Searching(Behaviour):
    """Search by own choice and map; without ``hearers`` it never returns into contact to report."""

    def __init__(
        self,
        chart: Chart,
        choosing: Choosing,
        reach: Reach,
        others: Sequence[str],
        hearers: Hearers | None,
        data: VehicleData,
        until_s: float,
    ) -> None:
        self._chart, self._choosing, self._reach, self._hearers = chart, choosing, reach, hearers
        self._others, self._held = others, Held(others)
        self._track = Trail(choosing, chart.grid)
        self._data, self._until_s = data, until_s
        self._target_m: Point | None = None
        self._chosen_s = -math.inf
        self._is_returning = False
        self._back_s: float | None = None  # start of the wait in contact

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending until the search ends; publishes each new target."""
        now_s = picture.body.now_s
        if now_s >= self._until_s:
            return DONE
        at_m = motion.position_m
        self._held.note(picture.facts, now_s)
        if self._hearers is not None:
            self._hearers.note(picture.facts, picture.peers)
        if not performed:
            return DUE
        self._track.note(at_m, now_s)
        if self._is_returning and self._hearers is not None and self._has_to_tell(self._hearers, picture, at_m, now_s):
            return ADVANCING
        is_due = self._is_returning or now_s - self._chosen_s > STALE_S
        if self._target_m is not None and not is_due and distance_m(motion, self._target_m) > ARRIVED_M:
            return ADVANCING
        self._target_m = self._choose(picture, at_m, now_s)
        self._chosen_s = now_s
        return Perception(1.0, 1.0, concludes=(Observation(((self._data.name, TARGET, self._target_m),)),))

    def _has_to_tell(self, hearers: Hearers, picture: Picture, at_m: Point, now_s: float) -> bool:
        if not self._reach.holds(at_m):
            self._back_s = None
        elif self._back_s is None:
            self._back_s = now_s
        elif now_s - self._back_s >= self._reach.greeting_s:
            hearers.give_up(picture.facts)
            return False
        return bool(hearers.untold_m(picture.facts))

    def _choose(self, picture: Picture, at_m: Point, now_s: float) -> Point:
        self._chart.update(picture.facts, (self._data.name, *self._others))
        held = self._held.ways(picture.peers.positions_m, now_s)
        leg = self._choosing.choose(self._chart, held, self._track, at_m, None, now_s)
        assert leg is not None  # no leash, so a leg exists
        self._is_returning, self._back_s = self._comes_back(leg, picture, at_m, now_s), None
        return self._reach.point_m if self._is_returning else leg.target_m

    def _comes_back(self, leg: Leg, picture: Picture, at_m: Point, now_s: float) -> bool:
        if (hearers := self._hearers) is None:
            return False
        facts, reach, speed_mps = picture.facts, self._reach, self._choosing.speed_mps
        back_s = reach.heard_in_s(at_m, speed_mps, picture.frame_s)
        # A silence is expected to last as long again as so far, the median without further knowledge (Gott, Nature 363,
        # 1993). If that ends sooner, a return gains nothing.
        if now_s - hearers.heard_s <= back_s:
            return False
        finds = []
        for place_m in hearers.untold_m(facts):
            cell = self._chart.grid.cell_at(place_m)
            p_site = 0.0 if cell is None else float(self._chart.sites(self._chart.shares[:, cell]))
            finds.append(Find(p_site, hearers.takes_s(reach.point_m, place_m)))
        busy_s = hearers.busy_until_s(facts, picture.peers) - now_s
        takes_s = hearers.takes_s(reach.point_m, leg.target_m)
        out_s, direct_s = reach.home_s(leg.target_m, speed_mps), distance(at_m, leg.target_m) / speed_mps
        later_s = reach.heard_in_s(leg.target_m, speed_mps, picture.frame_s)
        now, later = Return(back_s, max(0.0, back_s + out_s - direct_s)), Return(later_s, later_s + out_s)
        return not goes_on(leg, finds, takes_s, now, later, self._until_s - now_s, busy_s)

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return None if self._target_m is None else Reference(self._target_m, self._choosing.speed_mps)


class Obeying(Behaviour):
    """Search on orders of the leader; without a new order the vehicle returns into contact."""

    def __init__(self, reach: Reach, data: VehicleData, until_s: float) -> None:
        self._reach, self._data, self._until_s = reach, data, until_s
        self._done_m: Point | None = None

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        if picture.body.now_s >= self._until_s:
            return DONE
        target_m = picture.facts.get((TARGET, self._data.name))
        if performed and target_m is not None and distance_m(motion, target_m) <= ARRIVED_M:
            self._done_m = target_m
        return ADVANCING if performed else DUE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Head for the target; else return into contact and wait there."""
        target_m, speed_mps = picture.facts.get((TARGET, self._data.name)), self._data.survey_speed_mps
        if target_m is None or target_m == self._done_m:
            is_back = self._reach.holds(motion.position_m)
            return Reference(motion.position_m if is_back else self._reach.point_m, 0.0 if is_back else speed_mps)
        return Reference(target_m, speed_mps)


class Directing(Standing):
    """Central search: the leader orders each vehicle's next target by its own map."""

    def __init__(
        self,
        chart: Chart,
        choosing: Mapping[str, Choosing],
        reach: Reach,
        starts_m: Mapping[str, Point],
        until_s: float,
    ) -> None:
        self._chart, self._choosing, self._until_s = chart, choosing, until_s
        self._leashes = {name: Leash(reach) for name in choosing}
        self._tracks = {name: Trail(own, chart.grid) for name, own in choosing.items()}
        self._starts_m = starts_m
        self._ordered: dict[str, tuple[Point, float]] = {}
        self._awake_s = 0.0

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        now_s = picture.body.now_s
        if now_s < self._awake_s or now_s >= self._until_s:
            return IDLE
        self._awake_s = now_s + ORDERS_S
        orders = tuple(self._orders(picture, now_s))
        return IDLE._replace(concludes=orders)

    def _orders(self, picture: Picture, now_s: float) -> Iterator[Observation]:
        at_m = {name: picture.peers.positions_m.get(name, self._starts_m[name]) for name in self._choosing}
        for name, leash in self._leashes.items():
            leash.update(at_m[name], picture.peers.heard_s.get(name, -math.inf), now_s)
            self._tracks[name].note(at_m[name], now_s)
        idle = [name for name in self._choosing if self._needs_order(name, at_m[name], now_s)]
        if not idle:
            return
        self._chart.update(picture.facts, tuple(self._choosing))
        for name in idle:
            held = [(at_m[other], target_m) for other, (target_m, _) in self._ordered.items() if other != name]
            leg = self._choosing[name].choose(
                self._chart, held, self._tracks[name], at_m[name], self._leashes[name], now_s
            )
            if leg is not None:
                self._ordered[name] = leg.target_m, now_s
                yield Observation(((name, TARGET, leg.target_m),))

    def _needs_order(self, name: str, at_m: Point, now_s: float) -> bool:
        target_m, ordered_s = self._ordered.get(name, (None, 0.0))
        # Positions arrive late, so the next order is due before the vehicle is seen to arrive.
        near_m = ARRIVED_M + 2.0 * ORDERS_S * self._choosing[name].speed_mps
        return target_m is None or distance(at_m, target_m) <= near_m or now_s - ordered_s > STALE_S


class Sweeping(Behaviour):
    """Search along fixed lanes, repeated until the search ends."""

    def __init__(self, points_m: Sequence[Point], data: VehicleData, until_s: float) -> None:
        self._points_m, self._next = points_m, 0
        self._data, self._until_s = data, until_s

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        if picture.body.now_s >= self._until_s:
            return DONE
        if performed and distance_m(motion, self._points_m[self._next]) <= ARRIVED_M:
            self._next = (self._next + 1) % len(self._points_m)
        return ADVANCING if performed else DUE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return Reference(self._points_m[self._next], self._data.survey_speed_mps)


class Identifying(Behaviour):
    """Identification of anomalies by map and images, most site probability per time first; sites are photographed.

    ``crew`` are the vehicles with relevant observations; ``reach`` None means no return into contact.
    """

    def __init__(
        self,
        chart: Chart,
        scenario: ArrowsScenario,
        crew: Sequence[str],
        searchers: Sequence[str],
        data: VehicleData,
        reach: Reach | None = None,
    ) -> None:
        self._chart, self._settings, self._reach = chart, scenario.mission, reach
        self._optical, self._crew, self._searchers, self._data = scenario.detector.optical, crew, searchers, data
        self._names, self._stay_s = chart.names, scenario.stay_s
        self._approach = Approach(data.transit_speed_mps)
        self._at: str | None = None
        self._place_m: Point | None = None
        self._since_s: float | None = None

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending while an anomaly is open, or while a return into contact is due."""
        facts, now_s = picture.facts, picture.body.now_s
        if now_s >= self._settings.search_s:
            return DONE
        if self._at is None:
            self._at = self._next(motion, facts)
            if self._at is None:
                return self._listen(motion, picture, performed)
            self._place_m, self._since_s = facts.get(("location", self._at)), None
        assert self._place_m is not None
        to_go_m = distance_m(motion, self._place_m)
        if not performed:
            return DUE
        if to_go_m > HOVER_M:
            self._since_s = None
            return Perception(1.0, self._approach.advance(to_go_m, now_s, performed))
        if self._since_s is None:
            self._since_s = now_s
        return Perception(1.0, 1.0, concludes=tuple(self._concluded(self._at, facts, now_s)))

    def _listen(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        heard_s, at_m, speed_mps = picture.peers.heard_s, motion.position_m, self._data.transit_speed_mps
        silent_s = picture.body.now_s - min(heard_s.get(name, 0.0) for name in self._searchers)
        self._place_m = None
        if (reach := self._reach) is None or reach.holds(at_m):
            return IDLE
        if silent_s <= reach.heard_in_s(at_m, speed_mps, picture.frame_s):
            return IDLE
        self._place_m = reach.point_m
        return ADVANCING if performed else DUE

    def _concluded(self, anomaly: str, facts: Known, now_s: float) -> Iterator[Observation]:
        """Conclude the class once clear or out of images; then report the photographs of a site."""
        if facts.get(("identity", anomaly)) is None:
            shown, shares = self._shown(anomaly, facts), self._shares(anomaly, facts)
            best = int(np.argmax(shares))
            if shown and shares[best] >= self._settings.sure:
                probability = min(0.99, float(shares[best]))
                self._since_s = now_s
                yield Observation(((anomaly, "identity", self._names[best], probability),))
            elif len(shown) >= ENOUGH_IMAGES:
                self._at = None
                yield Observation(((anomaly, "identity", UNKNOWN),))
            return
        assert self._since_s is not None
        if anomaly not in facts.instances("ArchaeologicalSite"):
            self._at = None
        elif now_s - self._since_s >= self._settings.picture_s:
            self._at = None
            yield Observation(((anomaly, "picturedBy", self._data.name),))

    def _next(self, motion: Motion, facts: Known) -> str | None:
        self._chart.update(facts, self._crew)
        gains = []
        for name, place_m in unidentified(facts).items():
            p_site = float(self._chart.sites(self._shares(name, facts)))
            way_s = distance_m(motion, place_m) / self._data.transit_speed_mps
            gains.append((p_site / (way_s + self._stay_s), name))
        # Ties go by name, not by the order in which anomalies became known.
        return max(gains, key=lambda weighed: (weighed[0], weighed[1]))[1] if gains else None

    def _shown(self, anomaly: str, facts: Known) -> list[int]:
        at_m = facts.get(("location", anomaly))
        places_m = {name: facts.get(("location", name)) for name in facts.instances(ANOMALY)}
        same = [name for name, place_m in places_m.items() if place_m is not None and distance(place_m, at_m) <= SAME_M]
        return sorted(shown_of(int(code)) for name in same for code in facts.values(("shown", name)))

    def _shares(self, anomaly: str, facts: Known) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        """Class probabilities by the map and by images; shape (1 + kinds,)."""
        cell = self._chart.grid.cell_at(facts.get(("location", anomaly)))
        n_kinds, p_wrong = len(self._names), self._optical.p_false
        shares = np.full(n_kinds, 1.0 / n_kinds) if cell is None else self._chart.shares[:, cell].copy()
        for kind in self._shown(anomaly, facts):
            # A wrong image shows each other kind with the same probability.
            likelihood = np.full(n_kinds, p_wrong / max(1, n_kinds - 1))
            likelihood[kind] = 1.0 - p_wrong
            shares *= likelihood
            shares /= summed(shares)
        return shares

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        if self._place_m is None:
            return None
        to_go_m = distance_m(motion, self._place_m)
        return Reference(self._place_m, 0.0 if to_go_m <= HOVER_M else self._data.transit_speed_mps)
