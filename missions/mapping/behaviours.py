"""Behaviours of the mapping mission: row by row, over the cells not known to be mapped (``docs/model/mapping.md``)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from exchange.arithmetic import distance
from missions.mapping.jobs import Survey, SurveyJob, Way
from missions.mapping.scenario import MappingScenario
from missions.mapping.sensors import mapping_sensor, mapping_speed_mps, swath_m
from remoras.behaviours import (
    CAPTURE_M,
    DONE,
    FAILED,
    FAR_M,
    Approach,
    Behaviour,
    Perception,
    Positioning,
    Reference,
    Working,
    attracted,
    distance_m,
)
from remoras.beliefs import Known
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.motion.avoidance import clearance_m
from remoras.picture import Body, Picture
from remoras.work import Point

ROOM = 1.25  # factor on the leader's clearance for formation places: it has moved since its last report


def formation_of(scenario: MappingScenario) -> dict[tuple[str, str], tuple[str, str]]:
    """Return (row, side) of positional roles by (group, role)."""
    roles = [(group.name, role) for group in scenario.group for role in group.role]
    return {(group, role.name): role.position for group, role in roles if role.position is not None}


def room_of(vehicles: Iterable[VehicleData], separation_m: float) -> dict[str, float]:
    """Least distance (m) of formation places from each vehicle, clear of its transit."""
    return {
        data.name: ROOM * clearance_m(separation_m, data.transit_speed_mps, data.turn_rate_radps) for data in vehicles
    }


def positioning(
    place: tuple[str, str],
    leaders: Sequence[str],
    group: str,
    data: VehicleData,
    spacing_m: float,
    room_m: Mapping[str, float],
) -> Positioning:
    """Return the behaviour that holds a formation place; the middle is behind the leader.

    Places keep ``spacing_m``, or the largest ``room_m`` of the leaders and of the vehicle itself if that is more.
    """
    spacing_m = max(spacing_m, room_m[data.name], *(room_m[name] for name in leaders))
    row, side = place
    ahead_m = -spacing_m * ((row == "bottom") + (side == "middle"))
    left_m = spacing_m * ((side == "left") - (side == "right"))
    others = tuple(name for name in leaders if name != data.name)
    return Positioning(others, group, (ahead_m, left_m), data)


DEAD_ROWS = 2  # whole rows without yield after which a sensor is presumed dead
BRAKING_S = 2.0  # margin by which braking starts early
LONG_LINK = 2.0  # distance to the next row, in swaths, above which the vehicle goes at transit speed


WORTH_FINISHING = 0.42  # stimulus of the last remaining work: above homing (0.6 to 0.3), so that it is resumed


def braking_m(data: VehicleData, slow_mps: float) -> float:
    """Distance in which the vehicle slows down from transit speed, with a margin."""
    fast_mps = data.transit_speed_mps
    way_m = (fast_mps - slow_mps) * (fast_mps + slow_mps) / (2.0 * data.acceleration_mps2)
    return max(0.0, way_m) + BRAKING_S * fast_mps


def due(share_left: float, half_left: float) -> float:
    """Stimulus of remaining work: 0 if none is left, else between ``WORTH_FINISHING`` and 1.

    ``half_left`` is the share at which it is midway between these bounds; 0 for a constant stimulus.
    """
    if share_left <= 0.0:
        return 0.0
    return WORTH_FINISHING + (1.0 - WORTH_FINISHING) * share_left / (share_left + half_left)


class WorkLeft:
    """Largest remaining share of any area: one area is finished before the next is started."""

    def __init__(self, jobs: Sequence[SurveyJob], half_left: float) -> None:
        self._jobs = jobs
        self._half_left = half_left

    def stimulus(self, facts: Known) -> float:
        """Stimulus of the area with the largest remaining share, see ``due``."""
        return facts.derived(self, lambda: due(self._greatest(facts), self._half_left))

    def _greatest(self, facts: Known) -> float:
        most = 0.0
        for job in self._jobs:
            if most < 1.0 and (share := job.left(facts).share_left) > most and not facts.values(job.done):
                most = share
        return most


@dataclass(slots=True)
class _Passage:
    row: int
    begin_m: Point
    end_m: Point
    cells: int
    speed_mps: float
    since_s: float | None = None
    sensed: bool = True
    target_m: Point = field(init=False)

    def __post_init__(self) -> None:
        self.target_m = self.begin_m


class ZigzagExploring(Behaviour):
    """Survey of the remaining cells of an area, row by row; its stimulus falls with the remaining ``work``."""

    def __init__(self, job: SurveyJob, data: VehicleData, work: WorkLeft, others: Sequence[str] = ()) -> None:
        self._job, self._data, self._work, self._others = job, data, work, others
        self._swath_m, self._sensor = swath_m(data), mapping_sensor(data)
        self._speed_mps = mapping_speed_mps(data)
        self._braking_m = braking_m(data, self._speed_mps)
        self._passage: _Passage | None = None
        self._begun = False
        self._tried = 0
        self._given_up = 0
        self._n_dead = 0
        self._n_fixes, self._fixed_s = 0, -math.inf
        self._left = job.bits
        self._sure_m = 0.0  # distance within which the planned passage surely stays the best
        self._ahead: Reference | None = None
        self._approach = Approach(self._speed_mps)

    @property
    def _survey(self) -> Survey:
        return self._job.on.survey(self._swath_m)

    # Perception and action -----------------------------------------------------------------------

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        facts = picture.facts
        left = self._job.left(facts).bits
        if not left:
            return DONE
        # Before the start the choice of the row depends on the positions of the others, which move.
        if not performed or (self._others and not self._begun):
            self._passage = None
        if left != self._left:
            self._hear(left, motion, picture.body.now_s - picture.body.decided_s)
        if performed:
            if picture.body.n_fixes != self._n_fixes:
                self._note_fixes(picture)
            self._follow(motion, picture)
        elif self._passage is None:
            self._plan(motion, picture)
        if self._passage is None:
            return FAILED
        stimulus = self._work.stimulus(facts)
        until_s = math.inf if self._begun or not self._others else -math.inf
        if performed:
            return Perception(stimulus, self._progress, until_s=until_s)
        to_go_m = distance_m(motion, self._passage.target_m)
        self._approach.advance(to_go_m, picture.body.now_s, performed)
        if self._begun:
            return Perception(stimulus, until_s=until_s, until_m=self._sure_m)
        near = attracted(to_go_m).stimulus
        return Perception(stimulus * near, until_s=until_s, until_m=self._sure_m, per_m=stimulus / FAR_M)

    def _progress(self, motion: Motion, picture: Picture) -> float | None:
        to_go_m = math.inf if self._passage is None else distance_m(motion, self._passage.target_m)
        advance = self._approach.advance(to_go_m, picture.body.now_s, True)
        # During the turn between two rows the distance to the target grows, which is progress too.
        return None if advance is None else abs(advance)

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Head for the begin of the next row, then its end; None if no cell can be mapped."""
        to_go_m, passage = self._follow(motion, picture), self._passage
        if passage is None:
            return None
        if passage.since_s is None and to_go_m > (brake_m := self._brake_m(passage)):
            holds_m, is_link = max(brake_m, CAPTURE_M), passage.speed_mps == self._speed_mps
            return Reference(passage.begin_m, passage.speed_mps, holds_m, is_over_ground=is_link)
        # The sensor's speed limit holds over ground, hence with the current included.
        if self._ahead is None or self._ahead.target_m is not passage.target_m:
            self._ahead = Reference(passage.target_m, self._speed_mps, CAPTURE_M, is_over_ground=True)
        return self._ahead

    def accuracy_m(self, motion: Motion, picture: Picture) -> float:
        """Largest allowed position error (m) on a row and at its begin: slack less capture radius."""
        passage = self._passage
        if passage is None or (passage.since_s is None and distance_m(motion, passage.begin_m) > CAPTURE_M):
            return math.inf
        return self._accuracy_m

    @property
    def _accuracy_m(self) -> float:
        return self._survey.slack_m - CAPTURE_M

    def _brake_m(self, passage: _Passage) -> float:
        # Braking on the first half swath of a row loses no cell: the slowed sensor reaches back as far.
        least_m = min(self._swath_m / 2.0, distance(passage.begin_m, passage.end_m))
        return self._braking_m if least_m < self._braking_m else 0.0

    # Row by row ----------------------------------------------------------------------------------

    def _follow(self, motion: Motion, picture: Picture) -> float:
        """Advance past reached points and plan the next row; return the distance (m) to the target."""
        body = picture.body
        if self._passage is None:
            self._plan(motion, picture)
        # A row of one point is reached as soon as it is begun, so several rows may pass in one call.
        for _ in range(2 * len(self._job.on.cells) + 2):
            passage = self._passage
            if passage is None:
                return math.inf
            if not body.sensors_on:
                passage.sensed = False
            if (to_go_m := distance_m(motion, passage.target_m)) > CAPTURE_M:
                return to_go_m
            self._approach = Approach(self._speed_mps)
            if passage.since_s is None:
                passage.since_s, passage.sensed, self._begun = body.now_s, bool(body.sensors_on), True
                passage.target_m = passage.end_m
            else:
                self._note_passed(passage, picture)
                self._plan(motion, picture)
        return math.inf if self._passage is None else distance_m(motion, self._passage.target_m)

    def _plan(self, motion: Motion, picture: Picture) -> None:
        self._passage = None
        if self._n_dead >= DEAD_ROWS:
            return
        left = self._job.left(picture.facts).bits & ~self._given_up
        part = self._job.of(left & ~self._tried)
        way = self._way(part, motion, picture)
        if way is None:
            self._passage, self._sure_m = self._over_a_missed_cell(left & self._survey.reach, motion), 0.0
            return
        # A link between neighbouring rows is too short to be worth accelerating to transit speed.
        is_far = not self._begun or distance_m(motion, way.first_m) > LONG_LINK * self._swath_m
        speed_mps = self._data.transit_speed_mps if is_far else self._speed_mps
        cells = part.bits & self._survey.rows[way.row].cells
        self._passage = _Passage(way.row, *way.ends_m, cells, speed_mps)
        self._approach = Approach(speed_mps)

    def _over_a_missed_cell(self, missed: int, motion: Motion) -> _Passage | None:
        """Return a passage over the nearest missed cell: repeating its row would miss it again."""
        cells = [index for index in range(missed.bit_length()) if missed >> index & 1]
        if not cells:
            return None
        index = min(cells, key=lambda cell: distance_m(motion, self._job.on.centre_m(cell)))
        row = next(number for number, row in enumerate(self._survey.rows) if row.cells >> index & 1)
        centre_m = self._job.on.centre_m(index)
        self._approach = Approach(self._speed_mps)
        return _Passage(row, centre_m, centre_m, 1 << index, self._speed_mps)

    def _way(self, part: SurveyJob, motion: Motion, picture: Picture) -> Way | None:
        """Return the fastest path; before the start, that from the row farthest from ``others``."""
        survey, positions_m = self._survey, picture.peers.positions_m
        others_m = [survey.across_m(positions_m[name]) for name in self._others if name in positions_m]
        if self._begun or not others_m:
            speeds_mps = self._data.transit_speed_mps, self._speed_mps
            way, self._sure_m = part.fastest(motion.position_m, self._swath_m, *speeds_mps)
            return way

        def preference(way: Way) -> tuple[float, float]:
            off_m = min(abs(survey.across_m(way.first_m) - across_m) for across_m in others_m)
            # In whole swaths, so that rows about equally far from the others compete by the distance to their start.
            return round(off_m / self._swath_m), -distance_m(motion, way.first_m)

        return max(survey.ways(part.bits), key=preference, default=None)

    def _yield_s(self, body: Body) -> float:
        """Time (s) of the last facts of the mapping sensor: those of others do not show that it works."""
        return body.yields_s.get(self._sensor, -math.inf)

    def _note_fixes(self, picture: Picture) -> None:
        """Count successive fixes with nothing mapped in between: the position is too uncertain."""
        body = picture.body
        # The first fix ends no interval between two fixes.
        is_futile = self._n_fixes > 0 and self._yield_s(body) < self._fixed_s
        self._n_dead = self._n_dead + 1 if is_futile else 0
        self._n_fixes, self._fixed_s = body.n_fixes, body.now_s

    def _note_passed(self, passage: _Passage, picture: Picture) -> None:
        if not passage.sensed or passage.since_s is None:
            return
        missed = passage.cells & self._job.left(picture.facts).bits
        # With an uncertain position the missed cells say nothing about the sensor.
        is_sure = picture.body.uncertainty_m <= max(0.0, self._accuracy_m)
        again = missed & self._tried if is_sure else 0
        self._given_up |= again
        self._tried |= missed
        if self._yield_s(picture.body) >= passage.since_s:
            self._n_dead = 0
        elif missed and is_sure and not again:
            # Only a row of which most cells were open tests the sensor; a short remainder may be missed by chance.
            self._n_dead += 2 * missed.bit_count() >= self._survey.rows[passage.row].cells.bit_count()

    # Updates received from others ----------------------------------------------------------------

    def _hear(self, left: int, motion: Motion, since_s: float) -> None:
        """Shorten or replace the row if others have mapped cells of it ahead."""
        news, self._left = self._left & ~left, left
        moved_m, passage = self._data.transit_speed_mps * since_s, self._passage
        if passage is None or not (news & passage.cells):
            return
        # Cells within the vehicle's own reach since the last decision are its own yield, not an update.
        mapped = self._not_near(news & passage.cells, motion, self._swath_m / 2.0 + moved_m + CAPTURE_M)
        if not mapped:
            return
        if passage.since_s is None:
            self._passage = None
            return
        passage.cells &= ~mapped
        survey = self._survey
        here_m, end_m = survey.along_m(motion.position_m), survey.along_m(passage.end_m)
        onwards = 1.0 if end_m >= survey.along_m(passage.begin_m) else -1.0
        span_m = survey.span_m(passage.row, passage.cells)
        if span_m is None:
            self._passage = None
            return
        last_m = span_m[1] if onwards > 0.0 else span_m[0]
        if (last_m - here_m) * onwards > 0.0:
            passage.end_m = passage.target_m = survey.point_m(passage.row, last_m)
        # No remaining cell lies ahead; at the end of the row itself ``_follow`` would replan anyway.
        elif (end_m - here_m) * onwards > 0.0:
            self._passage = None

    def _not_near(self, cells: int, motion: Motion, reach_m: float) -> int:
        far = 0
        while cells:
            bit = cells & -cells
            cells ^= bit
            if distance_m(motion, self._job.on.centre_m(bit.bit_length() - 1)) > reach_m:
                far |= bit
        return far


class MappingAlong(Working):
    """Productive mapping while exploring; its stimulus falls with the remaining work."""

    def __init__(self, patience_s: float, work: WorkLeft, sensor: str) -> None:
        super().__init__(patience_s, sensor)
        self._work = work

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending while work remains; progress is that of all productive work."""
        return super().perceive(motion, picture, performed)._replace(stimulus=self._work.stimulus(picture.facts))
