"""Behaviours of plan steps; each detects its own failure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence, Set
from typing import NamedTuple

from exchange.arithmetic import distance
from missions.meeting.meeting import NEWS_FRAMES
from missions.meeting.survey import rows, runs_along_x
from missions.trident.jobs import SHARE_USED, is_to_be_surveyed, survey_speed_mps
from missions.trident.services import EffectorSettings, FinderSettings, SeabedBlock, SurveyorSettings
from remoras.behaviours import (
    ADVANCING,
    BEYOND_IT,
    CAPTURE_M,
    DONE,
    DUE,
    FAILED,
    IDLE,
    UNDUE,
    Approach,
    Behaviour,
    Perception,
    Reference,
    Standing,
    attracted,
    distance_m,
)
from remoras.beliefs import Known
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.sensor import Observation
from remoras.work import Point

CREEP_MPS, NEAR_M, IN_PLACE_M = 0.3, 8.0, 0.1
"""Final approach: speed, distance at which it starts, and distance at which it ends."""
LOOKS_S = 300.0  # time without a decision after which a reacquisition fails
ATTEMPTS = 12  # possible attempts after which an effector step fails
MARGIN_S = 60.0  # time on site in addition to the attempts


class AwaitingPartner(Standing):
    """Wait for the service of another vehicle."""

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        return UNDUE


class Escorting(Behaviour):
    """Escort of the first listed vehicle received beyond ``radius_m`` of ``home_m``, on the side of its home."""

    def __init__(
        self, escorted: Sequence[str], home_m: Point, radius_m: float, distance_m: float, data: VehicleData
    ) -> None:
        self._escorted, self._home_m, self._radius_m = escorted, home_m, radius_m
        self._distance_m = distance_m
        self._speed_mps = data.transit_speed_mps

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending while an escorted vehicle is out; never without progress."""
        if self._place(picture) is None:
            return IDLE
        return ADVANCING if performed else DUE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        place = self._place(picture)
        if place is None:
            return None
        return Reference(place, 0.0 if distance_m(motion, place) <= CAPTURE_M else self._speed_mps)

    def _place(self, picture: Picture) -> Point | None:
        peers, late_s = picture.peers, picture.body.now_s - NEWS_FRAMES * picture.frame_s
        for name in self._escorted:
            at_m = peers.positions_m.get(name)
            if at_m is None or peers.heard_s.get(name, -math.inf) < late_s:
                continue
            if (to_home_m := distance(at_m, self._home_m)) > self._radius_m:
                share = min(1.0, self._distance_m / to_home_m)
                return (
                    at_m[0] + share * (self._home_m[0] - at_m[0]),
                    at_m[1] + share * (self._home_m[1] - at_m[1]),
                )
        return None


class Missing(Standing):
    """Report that a candidate is absent, after all services failed to find it."""

    def __init__(self, candidate: str) -> None:
        self._candidate = candidate

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        if not performed:
            return DUE
        return ADVANCING._replace(concludes=(Observation(((self._candidate, "verdict", "absent"),)),))


class Lane(NamedTuple):
    """Straight part of a survey, with the numbers of the tiles along it."""

    begin_m: Point
    end_m: Point
    tiles: frozenset[int]


class Surveying(Behaviour):
    """Survey along the uncharted lanes of a block; ``asked`` are service and recovery of a survey on request."""

    def __init__(
        self,
        block: SeabedBlock,
        settings: SurveyorSettings,
        data: VehicleData,
        patience_s: float,
        asked: tuple[str, str] | None = None,
    ) -> None:
        self._block, self._patience_s, self._asked = block, patience_s, asked
        self._reach_m = settings.reach_m
        self._n_again = 0  # number of the current repetition
        self._transit_mps, self._survey_mps = data.transit_speed_mps, survey_speed_mps(data, settings)
        self._approach = Approach(self._transit_mps)
        self._left = list(survey_lanes(block, settings.reach_m))
        self._lane: Lane | None = None
        self._is_on_lane = False
        self._blank_s = 0.0

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending while lanes remain; fails if passed tiles stay blank."""
        if self._asked is not None and not self._is_asked(picture.facts, *self._asked):
            was_requested = self._asked[0] in picture.facts.values(("requestedOf", self._block.name))
            return IDLE if was_requested else UNDUE
        now_s, charted = picture.body.now_s, self._charted(picture.facts)
        self._follow(motion, charted, performed)
        if self._lane is None:
            # The end of a first survey follows from the map, which a repeated one does not change.
            if self._n_again:
                return DUE._replace(concludes=(Observation(((self._block.name, "surveyedAgain", self._n_again),)),))
            return DONE if self._asked is None else IDLE
        if performed and self._is_on_lane and not self._n_again:
            self._note_yield(motion, charted, now_s - picture.body.decided_s)
        if self._blank_s > self._patience_s:
            return BEYOND_IT
        if self._is_on_lane and performed:
            return ADVANCING
        to_go_m = distance_m(motion, self._lane.begin_m)
        return Perception(attracted(to_go_m).stimulus, self._approach.advance(to_go_m, now_s, performed))

    def _charted(self, facts: Known) -> Set[int]:
        return frozenset() if self._n_again else facts.values(("chartedTile", self._block.name))

    def _is_asked(self, facts: Known, service: str, recovery: str) -> bool:
        block = self._block.name
        if facts.get(("requestedOf", block)) != service or not is_to_be_surveyed(facts, block, recovery):
            return False
        n_again = int(facts.get(("surveysAgain", recovery), 0))
        if n_again > self._n_again:
            self._n_again, self._lane, self._is_on_lane = n_again, None, False
            self._left = list(survey_lanes(self._block, self._reach_m))
        return True

    def _note_yield(self, motion: Motion, charted: Set[int], dt_s: float) -> None:
        if self._lane is None:
            return
        near = [n for n in self._lane.tiles if distance_m(motion, self._block.centre_of(n)) <= self._block.tile_m]
        if near:
            self._blank_s = self._blank_s + dt_s if charted.isdisjoint(near) else 0.0

    def _follow(self, motion: Motion, charted: Set[int], performed: bool) -> None:
        """Advance from lane to lane; an interrupted lane restarts."""
        if self._lane is not None and self._is_on_lane:
            if distance_m(motion, self._lane.end_m) <= CAPTURE_M:
                self._lane, self._is_on_lane = None, False
            elif not performed:
                self._left.append(self._lane)
                self._lane, self._is_on_lane = None, False
        if self._lane is None:
            self._left = [lane for lane in self._left if not lane.tiles <= charted]
            ways = [way for lane in self._left for way in (lane, Lane(lane.end_m, lane.begin_m, lane.tiles))]
            if ways:
                self._lane = min(ways, key=lambda way: distance_m(motion, way.begin_m))
                self._left = [lane for lane in self._left if lane.tiles != self._lane.tiles]
        if self._lane is not None and distance_m(motion, self._lane.begin_m) <= CAPTURE_M:
            self._is_on_lane = True

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Head for the lane in transit, then along it at survey speed."""
        if self._lane is None:
            return None
        if self._is_on_lane or distance_m(motion, self._lane.begin_m) <= CAPTURE_M:
            return Reference(self._lane.end_m, self._survey_mps, is_over_ground=True)
        return Reference(self._lane.begin_m, self._transit_mps)


def survey_lanes(block: SeabedBlock, reach_m: float) -> Iterator[Lane]:
    """Yield lanes along the longer side of a block, dense enough to leave no gap; a tile counts by its centre.

    ``reach_m`` is the module's range to both sides.
    """
    lanes = rows(block.outline_m, 2.0 * SHARE_USED * reach_m, 0.0)
    across = 1 if runs_along_x(block.outline_m) else 0
    # The margin gives a tile midway between two lanes to both.
    half_m = block.sides_m[across] / len(lanes) / 2.0 + 1e-6
    for begin_m, end_m in lanes:
        tiles = frozenset(
            number
            for number, tile in enumerate(block.tiles)
            if abs((tile[across] + 0.5) * block.tile_m - begin_m[across]) <= half_m
        )
        yield Lane(begin_m, end_m, tiles)


class Ranging(Behaviour):
    """Travel to the transponder and wait for a fix, at most ``patience_s`` on site."""

    def __init__(self, place_m: Point, data: VehicleData, patience_s: float) -> None:
        self._place_m, self._data, self._patience_s = place_m, data, patience_s
        self._approach = Approach(data.transit_speed_mps)
        self._since_s: float | None = None

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        if picture.facts.get(("fixedOn", self._data.name)):
            return IDLE
        now_s, to_go_m = picture.body.now_s, distance_m(motion, self._place_m)
        if to_go_m > NEAR_M:
            return Perception(attracted(to_go_m).stimulus, self._approach.advance(to_go_m, now_s, performed))
        self._since_s = now_s if self._since_s is None else self._since_s
        return BEYOND_IT if now_s - self._since_s > self._patience_s else ADVANCING

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return Reference(
            self._place_m, 0.0 if distance_m(motion, self._place_m) <= 2.0 else self._data.transit_speed_mps
        )


class Reacquiring(Behaviour):
    """Search around the expected place of the chosen candidate, then observation at close range."""

    def __init__(
        self,
        job: str,
        candidate: str,
        settings: FinderSettings,
        data: VehicleData,
        search_m: float,
        patience_s: float,
    ) -> None:
        self._job, self._candidate, self._data = job, candidate, data
        self._search_mps = min(data.survey_speed_mps, settings.speed_limit_mps)
        self._step_m, self._patience_s = 1.5 * settings.range_m, patience_s
        self._n_corners = 4 * math.ceil(search_m / self._step_m)
        self._approach = Approach(data.transit_speed_mps)
        self._corner = -1
        self._places: int | None = None  # number of sightings
        self._first_s = self._last_s = math.inf
        self._at_m: Point | None = None  # place of the sighting at close range

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending until class and place are known; fails if unseen or undecided."""
        if self._is_known(picture.facts):
            return IDLE
        place_m = picture.facts.get(("chosenAt", self._job))
        if place_m is None:
            return IDLE
        now_s = picture.body.now_s
        self._note_look(picture.facts, now_s)
        if self._at_m is not None:
            return FAILED if now_s - self._first_s > LOOKS_S else ADVANCING
        to_go_m = distance_m(motion, self._next(place_m))
        if performed and to_go_m <= CAPTURE_M:
            self._corner += 1
            if self._corner > self._n_corners:
                return BEYOND_IT
        if self._corner < 0:
            return Perception(attracted(to_go_m).stimulus, self._approach.advance(to_go_m, now_s, performed))
        return ADVANCING if performed else attracted(to_go_m)

    def _is_known(self, facts: Known) -> bool:
        verdict, by = facts.get(("verdict", self._candidate)), facts.get(("reacquiredBy", self._candidate))
        return verdict in ("decoy", "absent") or (verdict == "target" and by == self._data.name)

    def _note_look(self, facts: Known, now_s: float) -> None:
        places = len(facts.values(("location", self._candidate)))
        # Each sighting adds a value of the location.
        if self._places is not None and places > self._places:
            self._first_s, self._last_s = min(now_s, self._first_s), now_s
            self._at_m = self._at_m or facts.get(("location", self._candidate))
        elif now_s - self._last_s > self._patience_s:
            self._at_m = None
        self._places = places

    def _next(self, place_m: Point) -> Point:
        x_m, y_m = place_m
        if self._corner < 0:
            return place_m
        ring, side = self._corner // 4 + 1, self._corner % 4
        out_m = self._step_m * ring
        east, north = ((1, 1), (-1, 1), (-1, -1), (1, -1))[side]
        return x_m + east * out_m, y_m + north * out_m

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Head there in transit, then at the finder's speed."""
        place_m = picture.facts.get(("chosenAt", self._job))
        if place_m is None:
            return None
        if self._at_m is not None:
            return Reference(self._at_m, min(CREEP_MPS, self._search_mps), is_over_ground=True)
        target_m = self._next(place_m)
        is_far = self._corner < 0 and distance_m(motion, target_m) > 2.0 * self._step_m
        if is_far:
            return Reference(target_m, self._data.transit_speed_mps)
        return Reference(target_m, self._search_mps, is_over_ground=True)


class Intervening(Behaviour):
    """Hold at the candidate while an effector tries to hold or handle it."""

    def __init__(self, job: str, candidate: str, settings: EffectorSettings, data: VehicleData) -> None:
        self._job, self._candidate, self._data = job, candidate, data
        self._done = "heldBy" if settings.does == "hold" else "handledBy"
        self._ends = settings.does == "handle"
        self._longest_s = ATTEMPTS * settings.attempt_s + MARGIN_S
        self._approach = Approach(data.transit_speed_mps)
        self._since_s: float | None = None

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending until the effector succeeds; fails after the time of ``ATTEMPTS``."""
        by = picture.facts.get((self._done, self._candidate))
        # A hold by another vehicle does not keep this one in place.
        if by is not None and (self._ends or by == self._data.name):
            return DONE if self._ends else IDLE
        place_m = picture.facts.get(("location", self._candidate))
        if place_m is None:
            return IDLE
        now_s, to_go_m = picture.body.now_s, distance_m(motion, place_m)
        if to_go_m > CAPTURE_M:
            return Perception(attracted(to_go_m).stimulus, self._approach.advance(to_go_m, now_s, performed))
        self._since_s = now_s if self._since_s is None else self._since_s
        return BEYOND_IT if now_s - self._since_s > self._longest_s else ADVANCING

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        place_m = picture.facts.get(("location", self._candidate))
        if place_m is None:
            return None
        to_go_m = distance_m(motion, place_m)
        if to_go_m <= IN_PLACE_M:
            return Reference(place_m, 0.0)
        if to_go_m <= NEAR_M:
            return Reference(place_m, CREEP_MPS, is_over_ground=True)
        return Reference(place_m, self._data.transit_speed_mps)
