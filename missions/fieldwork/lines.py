"""Lines as jobs, and how vehicles survey them and follow each other.

A vehicle surveys a line from its first end to its second. Of some lines that takes a source and a receiver: the holder
has the source, and goes on only while its obstacle sonar sees a vehicle within ``within_m``. Whoever follows has the
receiver. It goes to where the holder was last heard, and once its sonar sees it there, keeps abreast of it: on the line
it would be in its way. Nothing is said between the two.
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
"""A vehicle this near to the line is on it."""
ABREAST = 0.5
"""Share of the greatest distance at which an escort keeps abreast: the rest is for the time until it is under way."""


@dataclass(frozen=True)
class SurveyLine(AnyonesJob):
    """A line: a ``remoras.work.Job``.

    Attributes:
        name: of the line; place_m: where it begins; to_m: where it ends.
        is_escorted: it takes a second vehicle that follows.
    """

    place_m: Point
    to_m: Point
    is_escorted: bool

    @property
    def n_helpers(self) -> int:
        """How many vehicles it takes beside whoever has it."""
        return 1 if self.is_escorted else 0

    @property
    def n_vehicles(self) -> int:
        """How many vehicles it takes at once."""
        return 1 + self.n_helpers

    @cached_property
    def length_m(self) -> float:
        """Its length."""
        return distance(self.place_m, self.to_m)

    def at(self, along_m: float) -> Point:
        """The place so far from its beginning."""
        share = along_m / self.length_m
        (x_m, y_m), (to_x_m, to_y_m) = self.place_m, self.to_m
        return x_m + share * (to_x_m - x_m), y_m + share * (to_y_m - y_m)

    def along_m(self, position_m: Point) -> float:
        """How far from its beginning the nearest place of the line is.

        >>> SurveyLine("line 1", (0.0, 0.0), (100.0, 0.0), False).along_m((40.0, 7.0))
        40.0
        """
        (x_m, y_m), (to_x_m, to_y_m) = self.place_m, self.to_m
        inner = (position_m[0] - x_m) * (to_x_m - x_m) + (position_m[1] - y_m) * (to_y_m - y_m)
        return min(self.length_m, max(0.0, inner / self.length_m))

    def beside(self, position_m: Point, aside_m: float) -> Point:
        """A place abreast of another one, so far to the left of the line's direction.

        >>> SurveyLine("line 1", (0.0, 0.0), (100.0, 0.0), True).beside((40.0, 1.0), 10.0)
        (40.0, 11.0)
        """
        (x_m, y_m), (to_x_m, to_y_m), share = self.place_m, self.to_m, aside_m / self.length_m
        return position_m[0] - share * (to_y_m - y_m), position_m[1] + share * (to_x_m - x_m)

    def is_left(self, position_m: Point) -> bool:
        """True of a place to the left of the line's direction."""
        (x_m, y_m), (to_x_m, to_y_m) = self.place_m, self.to_m
        return (to_x_m - x_m) * (position_m[1] - y_m) >= (to_y_m - y_m) * (position_m[0] - x_m)

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook:
        """When and where the vehicle will be free if it surveys the line next, and need not wait for an escort."""
        way_s = distance(outlook.position_m, self.place_m) / data.transit_speed_mps
        return Outlook(outlook.free_s + way_s + self.length_m / data.survey_speed_mps, self.to_m)


def is_seen(at_m: Point, within_m: float, picture: Picture) -> bool:
    """True if the obstacle sonar sees a vehicle so near to a place."""
    return any(distance(at_m, contact_m) <= within_m for contact_m in picture.body.contacts_m)


class SurveyingLine(Behaviour):
    """Goes along a line; alone on one that takes an escort it stands still, and is dissatisfied.

    Who is called away goes on later where it stopped.

    Args:
        line: the job; within_m: greatest distance of an escort; data: of the vehicle.
        wait_s: after so long without an escort it gives up.
    """

    def __init__(self, line: SurveyLine, within_m: float, wait_s: float, data: VehicleData) -> None:
        self._line, self._within_m = line, within_m
        self._wait = HelpAwaited(f"an escort on {line.name}", wait_s)
        self._transit_mps, self._survey_mps = data.transit_speed_mps, data.survey_speed_mps
        self._approach = Approach(data.transit_speed_mps)
        self._surveyed_m = 0.0

    def _goes_on(self, motion: Motion, picture: Picture) -> bool:
        return not self._line.is_escorted or is_seen(motion.position_m, self._within_m, picture)

    def _is_on_line(self, motion: Motion) -> bool:
        """True on the line where it stopped, or no farther ahead than it goes in a second: no stretch is left out."""
        line, along_m = self._line, self._line.along_m(motion.position_m)
        is_next = abs(along_m - self._surveyed_m) <= max(ON_LINE_M, self._survey_mps)
        return is_next and distance_m(motion, line.at(along_m)) <= ON_LINE_M

    def _survey(self, motion: Motion, picture: Picture) -> bool:
        """Survey on from where it is; False if nobody follows."""
        if self._goes_on(motion, picture):
            self._surveyed_m = max(self._surveyed_m, self._line.along_m(motion.position_m))
            return True
        return False

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due, the nearest first, until the line is surveyed; it advances on the way, and while it goes on."""
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
        """In transit to where it stopped; then along the line, or stay while nobody follows."""
        if not self._is_on_line(motion):
            return Reference(self._line.at(self._surveyed_m), self._transit_mps)
        if not self._survey(motion, picture):
            return Reference(motion.position_m, 0.0)
        return Reference(self._line.to_m, self._survey_mps)


class FollowingSource(Behaviour):
    """Follows the holder of a line that takes an escort.

    As long as the holder is not near the line it waits where the line begins.

    Args:
        line: the job; within_m: greatest distance of an escort.
        help: whether this vehicle is of use there; data: of the vehicle.
    """

    def __init__(self, line: SurveyLine, within_m: float, help: Help, data: VehicleData) -> None:
        self._line, self._within_m, self._help = line, within_m, help
        self._speed_mps = data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)

    def _source_m(self, picture: Picture) -> Point:
        """Where the holder is, as far as it is seen or was heard; else where the line begins."""
        line, within_m = self._line, self._within_m
        for name in self._help.holders:
            heard_m = picture.peers.positions_m.get(name)
            if heard_m is not None and distance(line.at(line.along_m(heard_m)), heard_m) <= within_m:
                seen_m = [at_m for at_m in picture.body.contacts_m if distance(at_m, heard_m) <= within_m]
                return min(seen_m, key=lambda at_m: distance(at_m, heard_m), default=heard_m)
        return line.place_m

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due as long as the line is not surveyed and another one is needed; it advances while it comes or is near."""
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
        """To the side of the holder on which it is, and stay there."""
        aside_m = ABREAST * self._within_m
        abreast_m = self._line.beside(
            self._source_m(picture), aside_m if self._line.is_left(motion.position_m) else -aside_m
        )
        return Reference(abreast_m, 0.0 if distance_m(motion, abreast_m) <= ON_LINE_M else self._speed_mps)
