"""Actions on parts of a structure."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import ClassVar

from exchange.arithmetic import distance
from missions.pandora.assessment import ActionMonitor
from missions.pandora.scenario import PandoraScenario
from missions.pandora.structure import CameraSettings, PlannedPart, WrenchSettings
from remoras.behaviours import BEYOND_IT, DONE, FAILED, FAR_M, Approach, Behaviour, Perception, Reference, distance_m
from remoras.beliefs import Known
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.sensor import SELF, Fact, Observation
from remoras.work import Point

RAISE, RAISE_S, MOST_GAIN, LOW_QUALITY = 1.25, 30.0, 4.0, 0.8
"""Speed increase for poor station keeping: factor, interval (s), limit; quality below which."""
NEAR_M = 1.5
MARGIN_S, MARGIN_SHARE = 30.0, 0.25  # margin of the expected duration, absolute and relative, for turns and braking


class Acting(Behaviour):
    """Base of actions: travel, station keeping, assessment and end."""

    _steady_m = 12.0  # distance within which the vehicle slows down and its speed is not assessed

    def __init__(self, part: PlannedPart, data: VehicleData, scenario: PandoraScenario) -> None:
        self._part, self._data, self._settings = part, data, scenario.mission
        self._monitor = ActionMonitor(data, scenario.mission, part, scenario.foretold)
        self._approach = Approach(data.transit_speed_mps)
        self._gain, self._raised_s = 1.0, -math.inf
        self._seen_s: float | None = None
        self._taken_s, self._there_s = 0.0, 0.0
        self._expected_s: float | None = None
        self._status = "proceeding"
        self._waits = False
        self._end: Perception | None = None  # once it is over
        self._found: tuple[Observation, ...] = ()  # new instances, until they are concluded

    # Interface for actions -----------------------------------------------------------------------

    def place_m(self, facts: Known) -> Point:
        """Current destination."""
        at_m: Point = facts.get(("placedAt", self._part.of), self._part.place_m)
        return at_m

    def work_s(self) -> float:
        """Planned work on site (s)."""
        raise NotImplementedError

    def work(self, facts: Known) -> list[Fact]:
        """Check the progress of the work; return the facts concluded."""
        raise NotImplementedError

    # Behaviour interface -------------------------------------------------------------------------

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending until done or failed; concludes the findings of the assessment."""
        if self._end is not None:
            return self._end
        facts, now_s = picture.facts, picture.body.now_s
        to_go_m = distance_m(motion, self.place_m(facts))
        perceived = self._approach.perceived(to_go_m, now_s, performed)
        if not performed:
            self._seen_s = None
            self._monitor.pause()
            facts.values(("placedAt", self._part.of))  # another place is another distance
            return perceived._replace(until_s=math.inf, per_m=1.0 / FAR_M)
        dt_s, self._seen_s = (0.0 if self._seen_s is None else now_s - self._seen_s), now_s
        # A wait for a weaker current is no delay of the action.
        self._taken_s += 0.0 if self._waits else dt_s
        if self._expected_s is None:
            time_s = to_go_m / self._data.transit_speed_mps + self.work_s()
            self._expected_s = MARGIN_S + (1.0 + MARGIN_SHARE) * time_s
        is_there = to_go_m <= NEAR_M
        self._there_s += dt_s if is_there else 0.0
        news = self._carry_on(motion, picture, to_go_m, dt_s) if self._settings.assesses else self._by_the_clock()
        observations = (Observation(tuple(news)),) if news else ()
        concludes, self._found = observations + self._found, ()
        advance = 1.0 if is_there else perceived.advance
        return (self._end or perceived)._replace(advance=advance, concludes=concludes)

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        target_m = self.place_m(picture.facts)
        if distance_m(motion, target_m) > NEAR_M:
            return Reference(target_m, self._data.transit_speed_mps)
        planned_mps = self._settings.hold_speed_mps
        if self._settings.assesses:
            planned_mps = self._monitor.hold_speed_mps(picture.facts, picture.body.now_s, planned_mps, self._gain)
        return Reference(target_m, planned_mps)

    # Progress without and with assessment --------------------------------------------------------

    def _by_the_clock(self) -> list[Fact]:
        if self._expected_s is not None and self._taken_s >= self._expected_s:
            self._end = DONE
        return []

    def _carry_on(self, motion: Motion, picture: Picture, to_go_m: float, dt_s: float) -> list[Fact]:
        facts, now_s, settings = picture.facts, picture.body.now_s, self._settings
        is_there = to_go_m <= NEAR_M
        if is_there:
            self._monitor.hold(to_go_m, settings.tolerance_m, dt_s)
            if self._monitor.quality < LOW_QUALITY and now_s - self._raised_s >= RAISE_S:
                self._raised_s, self._gain = now_s, min(MOST_GAIN, RAISE * self._gain)
        asked_mps = self._data.transit_speed_mps if to_go_m > self._steady_m else 0.0
        news = self._monitor.assess(motion, picture, asked_mps)
        attributes = dict.fromkeys((attribute for _, attribute, *_ in news))
        if "cameraDead" in attributes or facts.get(("cameraDead", self._data.name)):
            self._end = FAILED
            return news
        if self._monitor.must_return(motion, facts, picture.body.battery):
            self._end = FAILED
            return [*news, (self._data.name, "returns", True)]
        news += self._wait(facts, now_s)
        news += self.work(facts)
        if self._end is None:
            news += self._time()
        return news

    def _wait(self, facts: Known, now_s: float) -> list[Fact]:
        waits = self._settings.repairs and self._monitor.is_overpowered(facts, now_s)
        if waits == self._waits:
            return []
        self._waits = waits
        return [(self._data.name, "overpowered", waits)]

    def _time(self) -> list[Fact]:
        settings, expected_s = self._settings, self._expected_s or math.inf
        if self._taken_s > settings.failed_factor * expected_s:
            return self._failed()
        status = "late" if self._taken_s > settings.late_factor * expected_s else "proceeding"
        if status == self._status:
            return []
        self._status = status
        return [(self._data.name, "actionStatus", status)]

    def _failed(self, is_final: bool = True) -> list[Fact]:
        """Fail: the plan takes another alternative, or ends if plans are not repaired.

        A failure that is not final leaves the outcome to the alternative.
        """
        repairs, self._status = self._settings.repairs, "failed"
        # Without plan repair no alternative exists, so the action ends as if done.
        self._end = BEYOND_IT if repairs else DONE
        outcome: list[Fact] = [(self._part.of, "outcome", "failed")] if is_final or not repairs else []
        return [*outcome, (self._data.name, "actionStatus", "failed")]


LOOK_S = 120.0
SETTLED_S = 45.0  # time on site before a place is reported, for the estimate of the camera offset
DISPLACED_M = 1.0  # distance above which a part is displaced, well above camera errors
NO_ADVANCE_SHARE = 0.5  # share of the planned work without progress after which the part resists
SPACING_SHARE, ROUNDS = 1.5, 2  # search pattern: spacing in camera ranges, and repetitions (an image may be blank)
SEEKING_M = 3.0  # capture radius of the search pattern's corners


class Looking(Acting):
    """Look for a part at its planned place; report its place, or a focus area for a search."""

    def __init__(self, part: PlannedPart, data: VehicleData, scenario: PandoraScenario) -> None:
        super().__init__(part, data, scenario)
        self._has_said = False

    def place_m(self, facts: Known) -> Point:
        return self._part.place_m

    def work_s(self) -> float:
        return LOOK_S

    def work(self, facts: Known) -> list[Fact]:
        """Report place and anomalies of a seen part; fail if unseen."""
        part = self._part
        seen_m = facts.get(("seenAt", part.of))
        if seen_m is not None:
            return self._placed(facts, seen_m) if self._there_s >= SETTLED_S else []
        if self._there_s < LOOK_S:
            return []
        if self._settings.repairs:
            focus: tuple[Fact, ...] = (
                (SELF, "centre", part.place_m), (SELF, "radius", self._settings.focus_radius_m),
                (part.of, "focusArea", SELF),
            )  # fmt: skip
            self._found = (Observation(focus, found="FocusArea"),)
        return [(part.of, "anomaly", "missing"), *self._failed(is_final=False)]

    def _placed(self, facts: Known, seen_m: Point) -> list[Fact]:
        if self._has_said:
            return []
        part, at_m, self._has_said = self._part, self._monitor.corrected(facts, seen_m), True
        displaced: list[Fact] = []
        if distance(at_m, part.place_m) > DISPLACED_M:
            displaced = [(part.of, "anomaly", "displaced")]
        # A valve that is closed already needs no work, and a second turn would open it.
        if facts.get(("isOpen", part.of)) is False:
            self._end = DONE
            return [*displaced, (part.of, "anomaly", "turned"), (part.of, "outcome", "done")]
        return [*displaced, (part.of, "placedAt", at_m)]


class Seeking(Looking):
    """Search for a part along squares around the centre of its focus area."""

    _steady_m = math.inf  # too many turns

    def __init__(self, part: PlannedPart, data: VehicleData, scenario: PandoraScenario) -> None:
        super().__init__(part, data, scenario)
        camera = data.sensor(CameraSettings)
        range_m, every_s = (NEAR_M, 1.0) if camera is None else (camera.range_m, camera.every_s)
        self._spacing_m = SPACING_SHARE * range_m
        # At least one image per camera range of the path.
        self._speed_mps = min(data.survey_speed_mps, range_m / every_s)
        self._corners: list[Point] | None = None

    def place_m(self, facts: Known) -> Point:
        if self._corners is None:
            focus = facts.get(("focusArea", self._part.of))
            centre_m = self._part.place_m if focus is None else facts.get(("centre", focus), self._part.place_m)
            radius_m = 0.0 if focus is None else facts.get(("radius", focus), 0.0)
            self._corners = ROUNDS * squares(centre_m, radius_m, self._spacing_m)
        return self._corners[0] if self._corners else self._part.place_m

    def work_s(self) -> float:
        corners = self._corners or []
        return math.fsum(distance(*pair) for pair in pairwise(corners)) / self._speed_mps

    def work(self, facts: Known) -> list[Fact]:
        """Report a seen part; fail after the last corner."""
        seen_m = facts.get(("seenAt", self._part.of))
        if seen_m is not None:
            return self._placed(facts, seen_m)
        return [] if self._corners else self._failed()

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Perceive as any action; drop reached corners."""
        if performed and self._corners and distance_m(motion, self._corners[0]) <= SEEKING_M:
            self._corners.pop(0)
        return super().perceive(motion, picture, performed)

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return Reference(self.place_m(picture.facts), self._speed_mps)


def squares(centre_m: Point, radius_m: float, spacing_m: float) -> list[Point]:
    """Corners of squares around a centre, inside out, covering all within half a spacing.

    >>> squares((0.0, 0.0), 4.0, 4.0)
    [(4.0, 4.0), (-4.0, 4.0), (-4.0, -4.0), (4.0, -4.0), (4.0, 4.0)]
    """
    (x_m, y_m), corners, n_rings = centre_m, [], math.ceil(radius_m / spacing_m)
    for ring in range(1, n_rings + 1):
        side_m = ring * radius_m / n_rings
        turns = (1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1)
        corners += [(x_m + east * side_m, y_m + north * side_m) for east, north in turns]
    return corners


class WorkingOnPart(Acting):
    """Work on a part with a tool until it senses the end."""

    tool: ClassVar[str] = "arm"
    _pace = 1.0  # relative to plan

    def __init__(self, part: PlannedPart, data: VehicleData, scenario: PandoraScenario) -> None:
        super().__init__(part, data, scenario)
        self._share: float | None = None  # last known, of any tool
        self._felt_there_s: float | None = None  # time on site at its last change
        self._dead = self.tool

    def work_s(self) -> float:
        return self._part.work_s / self._pace

    def work(self, facts: Known) -> list[Fact]:
        """Done when the tool senses the end; the part resists if the tool senses nothing while on station."""
        part, share = self._part, facts.get(("workedShare", self._part.of))
        if self._felt_there_s is None or share != self._share:
            self._share, self._felt_there_s = share, self._there_s
        if facts.get(("toolDead", self._data.name)) not in (None, self._dead):
            self._dead = "both"
        if share is not None and share >= 1.0:
            self._end = DONE
            return [(part.of, "outcome", "done")]
        least_s = NO_ADVANCE_SHARE * self.work_s()
        # A wrench turns any valve, so only the arm can meet resistance. The tool touches the part only while the place
        # is held, hence the factor.
        if self.tool == "wrench" or share != 0.0 or self._there_s * self._monitor.quality < least_s:
            return self._placed_anew(facts)
        return [(part.of, "anomaly", "resists"), *self._failed(is_final=False)]

    def _failed(self, is_final: bool = True) -> list[Fact]:
        """Fail; a tool without progress for the planned duration is dead at a final failure."""
        dead: Fact = self._data.name, "toolDead", self._dead
        felt_nothing_s = self._there_s - (self._felt_there_s or 0.0)
        is_dead = is_final and self._settings.repairs and felt_nothing_s > self.work_s()
        return [*super()._failed(is_final), *([dead] if is_dead else [])]

    def _placed_anew(self, facts: Known) -> list[Fact]:
        was_m, seen_m = (facts.get((attribute, self._part.of)) for attribute in ("placedAt", "seenAt"))
        if was_m is None or seen_m is None or facts.get(("workedShare", self._part.of)):
            return []
        at_m = self._monitor.corrected(facts, seen_m)
        return [(self._part.of, "placedAt", at_m)] if distance(at_m, was_m) > DISPLACED_M else []


class Wrenching(WorkingOnPart):
    """Work with a wrench."""

    tool = "wrench"

    def __init__(self, part: PlannedPart, data: VehicleData, scenario: PandoraScenario) -> None:
        super().__init__(part, data, scenario)
        wrench = data.sensor(WrenchSettings)
        self._pace = 1.0 if wrench is None else wrench.pace


class InspectingPart(Acting):
    """Hold the camera on each point of a part long enough."""

    def __init__(self, part: PlannedPart, data: VehicleData, scenario: PandoraScenario) -> None:
        super().__init__(part, data, scenario)
        self._nth = 0
        self._at_s = 0.0

    def place_m(self, facts: Known) -> Point:
        return self._part.points_m[min(self._nth, len(self._part.points_m) - 1)]

    def work_s(self) -> float:
        return self._part.work_there_s(self._data)

    def work(self, facts: Known) -> list[Fact]:
        """Advance to the next uninspected point."""
        seen = facts.values(("inspectedPoint", self._part.of))
        while self._nth < len(self._part.points_m) and self._nth in seen:
            self._nth += 1
        if self._nth < len(self._part.points_m):
            return []
        self._end = DONE
        return [(self._part.of, "outcome", "done")]

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Perceive as any action; without assessment time alone advances to the next point."""
        if performed and not self._settings.assesses and self._nth + 1 < len(self._part.points_m):
            is_there = distance_m(motion, self.place_m(picture.facts)) <= NEAR_M
            self._at_s = (self._at_s or picture.body.now_s) if is_there else 0.0
            if is_there and picture.body.now_s - self._at_s >= self._part.work_s:
                self._nth, self._at_s = self._nth + 1, 0.0
        return super().perceive(motion, picture, performed)
