"""Line surveys, some with an escort.

A vehicle surveys a line from its first end to its second. On some lines the holder carries a source and advances only
while its obstacle sonar shows a vehicle within ``within_m``. The escort carries the receiver. It goes to the last
received position of the holder and, with sonar contact, keeps abreast of it, out of its way. No messages are needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from exchange.arithmetic import distance
from missions.fieldwork.helping import Help, HelpAwaited
from missions.meeting.staying import AnyonesJob
from remoras.behaviours import (
    ADVANCING,
    BEYOND_IT,
    DONE,
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
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.work import Outlook, Point

ESCORTS = "escorts"
ON_LINE_M = 3.0
"""Largest distance from the line that counts as on it."""
ABREAST = 0.5
"""Station of the escort as share of the largest distance; the rest covers its reaction time."""


@dataclass(frozen=True)
class SurveyLine(AnyonesJob):
    """A line: a ``remoras.work.Job``; ``is_escorted`` lines need a second vehicle."""

    place_m: Point
    to_m: Point
    is_escorted: bool

    @property
    def n_helpers(self) -> int:
        """Vehicles needed besides the holder."""
        return 1 if self.is_escorted else 0

    @property
    def n_vehicles(self) -> int:
        """Vehicles needed at once."""
        return 1 + self.n_helpers

    @cached_property
    def length_m(self) -> float:
        """Length of the line."""
        return distance(self.place_m, self.to_m)

    def at(self, along_m: float) -> Point:
        """Point at a distance from the start."""
        share = along_m / self.length_m
        (x_m, y_m), (to_x_m, to_y_m) = self.place_m, self.to_m
        return x_m + share * (to_x_m - x_m), y_m + share * (to_y_m - y_m)

    def along_m(self, position_m: Point) -> float:
        """Distance from the start to the nearest point of the line.

        >>> SurveyLine("line 1", (0.0, 0.0), (100.0, 0.0), False).along_m((40.0, 7.0))
        40.0
        """
        (x_m, y_m), (to_x_m, to_y_m) = self.place_m, self.to_m
        inner = (position_m[0] - x_m) * (to_x_m - x_m) + (position_m[1] - y_m) * (to_y_m - y_m)
        return min(self.length_m, max(0.0, inner / self.length_m))

    def beside(self, position_m: Point, aside_m: float) -> Point:
        """Point abreast of another, ``aside_m`` to the left of the line's direction.

        >>> SurveyLine("line 1", (0.0, 0.0), (100.0, 0.0), True).beside((40.0, 1.0), 10.0)
        (40.0, 11.0)
        """
        (x_m, y_m), (to_x_m, to_y_m), share = self.place_m, self.to_m, aside_m / self.length_m
        return position_m[0] - share * (to_y_m - y_m), position_m[1] + share * (to_x_m - x_m)

    def is_left(self, position_m: Point) -> bool:
        """Return True for a point left of the line's direction."""
        (x_m, y_m), (to_x_m, to_y_m) = self.place_m, self.to_m
        return (to_x_m - x_m) * (position_m[1] - y_m) >= (to_y_m - y_m) * (position_m[0] - x_m)

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook:
        """Return the outlook after the survey, without a wait for an escort."""
        way_s = distance(outlook.position_m, self.place_m) / data.transit_speed_mps
        return Outlook(outlook.free_s + way_s + self.length_m / data.survey_speed_mps, self.to_m)


def is_seen(at_m: Point, within_m: float, picture: Picture) -> bool:
    """Return True if the obstacle sonar shows a vehicle within ``within_m`` of a place."""
    return any(distance(at_m, contact_m) <= within_m for contact_m in picture.body.contacts_m)


class SurveyingLine(Behaviour):
    """Survey of a line, resumed after a stop; waits, dissatisfied, for a required escort."""

    def __init__(self, line: SurveyLine, within_m: float, wait_s: float, data: VehicleData) -> None:
        self._line, self._within_m = line, within_m
        self._wait = HelpAwaited(f"an escort on {line.name}", wait_s)
        self._transit_mps, self._survey_mps = data.transit_speed_mps, data.survey_speed_mps
        self._approach = Approach(data.transit_speed_mps)
        self._surveyed_m = 0.0

    def _goes_on(self, motion: Motion, picture: Picture) -> bool:
        return not self._line.is_escorted or is_seen(motion.position_m, self._within_m, picture)

    def _is_on_line(self, motion: Motion) -> bool:
        """True on the line within one second of the surveyed end, so that no stretch is skipped."""
        line, along_m = self._line, self._line.along_m(motion.position_m)
        is_next = abs(along_m - self._surveyed_m) <= max(ON_LINE_M, self._survey_mps)
        return is_next and distance_m(motion, line.at(along_m)) <= ON_LINE_M

    def _survey(self, motion: Motion, picture: Picture) -> bool:
        """Extend the surveyed part to the current position; return False without an escort."""
        if self._goes_on(motion, picture):
            self._surveyed_m = max(self._surveyed_m, self._line.along_m(motion.position_m))
            return True
        return False

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending until the line is surveyed, nearest first; progresses under way and on the line."""
        line = self._line
        if picture.facts.get(line.done) is not None:
            return DONE
        if self._wait.is_given_up:
            return BEYOND_IT
        if performed and self._is_on_line(motion):
            if not self._survey(motion, picture):
                return self._wait.perceived(picture.body.now_s)
            self._wait.is_over()
            return DONE if line.length_m - self._surveyed_m <= ON_LINE_M / 2.0 else ADVANCING
        self._wait.is_over()
        to_go_m = distance_m(motion, line.at(self._surveyed_m))
        advance = self._approach.advance(to_go_m, picture.body.now_s, performed)
        return Perception(1.0, advance) if performed else attracted(to_go_m)

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Head for the surveyed end in transit, then along the line; hold without an escort."""
        if not self._is_on_line(motion):
            return Reference(self._line.at(self._surveyed_m), self._transit_mps)
        if not self._survey(motion, picture):
            return Reference(motion.position_m, 0.0)
        return Reference(self._line.to_m, self._survey_mps)


class FollowingSource(Behaviour):
    """Escort of a line's holder; waits at the line's start until the holder is near the line."""

    def __init__(self, line: SurveyLine, within_m: float, help: Help, data: VehicleData) -> None:
        self._line, self._within_m, self._help = line, within_m, help
        self._speed_mps = data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)

    def _source_m(self, picture: Picture) -> Point:
        """Position of the holder by sonar or as received; else the start of the line."""
        line, within_m = self._line, self._within_m
        for name in self._help.holders:
            heard_m = picture.peers.positions_m.get(name)
            if heard_m is not None and distance(line.at(line.along_m(heard_m)), heard_m) <= within_m:
                seen_m = [at_m for at_m in picture.body.contacts_m if distance(at_m, heard_m) <= within_m]
                return min(seen_m, key=lambda at_m: distance(at_m, heard_m), default=heard_m)
        return line.place_m

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending while the line is open and needs an escort; progresses while approaching or near."""
        source_m = self._source_m(picture)
        to_go_m = distance_m(motion, source_m)
        is_of_use = self._help.is_of_use(source_m, to_go_m, picture, performed)
        if not self._help.holders or not is_of_use or picture.facts.get(self._line.done) is not None:
            return IDLE
        if not performed:
            self._approach.advance(to_go_m, picture.body.now_s, False)
            return attracted(to_go_m)._replace(ends=self._help.ends)
        if to_go_m <= self._within_m:
            near = ADVANCING if picture.body.contacts_m else STANDING
            return near._replace(concludes=self._help.said(), ends=self._help.ends)
        advance = self._approach.advance(to_go_m, picture.body.now_s, True)
        return Perception(1.0, advance, concludes=self._help.said(), ends=self._help.ends)

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Head for the nearer side of the holder; hold there."""
        aside_m = ABREAST * self._within_m
        abreast_m = self._line.beside(
            self._source_m(picture), aside_m if self._line.is_left(motion.position_m) else -aside_m
        )
        return Reference(abreast_m, 0.0 if distance_m(motion, abreast_m) <= ON_LINE_M else self._speed_mps)
