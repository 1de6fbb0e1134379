"""What all actions on a part have in common: the way there, the place held, its assessment, and how it ends."""

from __future__ import annotations

import math
from dataclasses import dataclass

from missions.pandora.assessment import ActionMonitor, as_observations
from missions.pandora.scenario import Flow, PandoraSettings
from missions.pandora.structure import PlannedPart
from remoras.behaviours import Approach, Behaviour, Perception, Reference, attracted, distance_m
from remoras.database import VehicleData
from remoras.known import Known
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.sensor import Fact, Observation
from remoras.work import Point

RAISE, RAISE_S, MOST_GAIN, LOW_QUALITY = 1.25, 30.0, 4.0, 0.8
"""A vehicle that holds its place badly asks for so much more speed from then on, so often and so far."""
NEAR_M = 1.5
"""A vehicle this near to its place holds it."""
STEADY_M = 12.0
"""Nearer to its place a vehicle slows down, so that its speed says nothing."""
MARGIN_S, MARGIN_SHARE = 30.0, 0.25
"""What the plan adds to the time of every action: for turns and for braking."""


@dataclass(frozen=True)
class ActingContext:
    """What all actions of a run go by.

    Attributes:
        settings: of the mission.
        foretold: the current by the plan; None where the water is to stand.
    """

    settings: PandoraSettings
    foretold: Flow | None

    @property
    def assesses(self) -> bool:
        """True if actions are assessed."""
        return self.settings.adaptation != "none"

    @property
    def repairs(self) -> bool:
        """True if plans are repaired."""
        return self.settings.adaptation == "all"


class Acting(Behaviour):
    """What all actions have in common: the way there, the place held, its assessment, and how it ends.

    Args:
        part: that it is on; data: of the vehicle; orders: of the run.
    """

    def __init__(self, part: PlannedPart, data: VehicleData, orders: ActingContext) -> None:
        self._part, self._data, self._orders = part, data, orders
        self._monitor = ActionMonitor(data, orders.settings, part, orders.foretold)
        self._approach = Approach(data.transit_speed_mps)
        self._gain, self._raised_s = 1.0, -math.inf
        self._seen_s: float | None = None
        self._taken_s, self._there_s = 0.0, 0.0
        self._expected_s: float | None = None
        self._status = "proceeding"
        self._waits = False
        self._is_done, self._has_failed = False, False
        self._is_beyond_it = False  # it has failed at this part, and is fit for others

    # What a step says of itself ------------------------------------------------------------------

    def place_m(self, facts: Known) -> Point:
        """Where to be now."""
        at_m: Point = facts.get(("placedAt", self._part.of), self._part.place_m)
        return at_m

    def work_s(self) -> float:
        """How long the work takes on site, as planned."""
        raise NotImplementedError

    def work(self, facts: Known) -> list[Fact]:
        """Take note of what has become of the work; what is to be concluded of it."""
        raise NotImplementedError

    def resign(self) -> list[Fact]:
        """The action has failed: the plan is to go another way, or it ends where plans are not repaired."""
        self._has_failed = self._is_beyond_it = self._orders.repairs
        self._is_done = not self._orders.repairs
        return [(self._part.of, "outcome", "failed")]

    # The seam of behaviours ----------------------------------------------------------------------

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due until it is done or has failed; it concludes what assessment finds."""
        if self._is_done:
            return Perception(0.0, done=True)
        if self._has_failed:
            return Perception(0.0, failed=True, is_beyond_it=self._is_beyond_it)
        facts, now_s = picture.facts, picture.body.now_s
        to_go_m = distance_m(motion, self.place_m(facts))
        advance = self._approach.advance(to_go_m, now_s, performed)
        if not performed:
            self._seen_s = None
            self._monitor.pause()
            return attracted(to_go_m)
        dt_s, self._seen_s = (0.0 if self._seen_s is None else now_s - self._seen_s), now_s
        self._taken_s += 0.0 if self._waits else dt_s
        if self._expected_s is None:
            time_s = to_go_m / self._data.transit_speed_mps + self.work_s()
            self._expected_s = MARGIN_S + (1.0 + MARGIN_SHARE) * time_s
        is_there = to_go_m <= NEAR_M
        self._there_s += dt_s if is_there else 0.0
        found = self._carry_on(motion, picture, to_go_m, dt_s) if self._orders.assesses else self._by_the_clock()
        return replace_ends(
            Perception(1.0, 1.0 if is_there else advance, concludes=as_observations(found) + self.created()),
            self._is_done, self._has_failed, self._is_beyond_it,
        )  # fmt: skip

    def created(self) -> tuple[Observation, ...]:
        """Instances that it asserts; none."""
        return ()

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """On the way in transit, then held with the speed that is planned, or learnt."""
        target_m = self.place_m(picture.facts)
        if distance_m(motion, target_m) > NEAR_M:
            return Reference(target_m, self._data.transit_speed_mps)
        planned_mps = self._orders.settings.hold_speed_mps
        if self._orders.assesses:
            planned_mps = self._monitor.hold_speed_mps(picture.facts, picture.body.now_s, planned_mps, self._gain)
        return Reference(target_m, planned_mps)

    # Without assessment, and with it -------------------------------------------------------------

    def _by_the_clock(self) -> list[Fact]:
        """Without assessment the plan alone says when the action is over."""
        self._is_done = self._expected_s is not None and self._taken_s >= self._expected_s
        return []

    def _carry_on(self, motion: Motion, picture: Picture, to_go_m: float, dt_s: float) -> list[Fact]:
        facts, now_s, settings = picture.facts, picture.body.now_s, self._orders.settings
        is_there = to_go_m <= NEAR_M
        if is_there:
            self._monitor.hold(to_go_m, settings.tolerance_m, dt_s)
            if self._monitor.quality < LOW_QUALITY and now_s - self._raised_s >= RAISE_S:
                self._raised_s, self._gain = now_s, min(MOST_GAIN, RAISE * self._gain)
        found = self._monitor.assess(motion, picture, self._asked_mps(to_go_m))
        said = dict.fromkeys((attribute for _, attribute, *_ in found))
        if "cameraDead" in said or facts.get(("cameraDead", self._data.name)):
            self._has_failed = True
            return found
        if self._monitor.must_return(motion, facts, picture.body.battery):
            self._has_failed = True
            return [*found, (self._data.name, "returns", True)]
        found += self._wait(facts, now_s)
        found += self.work(facts)
        if not (self._is_done or self._has_failed):
            found += self._time()
        return found

    def _asked_mps(self, to_go_m: float) -> float:
        return self._data.transit_speed_mps if to_go_m > STEADY_M else 0.0

    def _wait(self, facts: Known, now_s: float) -> list[Fact]:
        """In a current that it cannot stem the vehicle does not expect to get on, where plans are repaired."""
        waits = self._orders.repairs and self._monitor.is_overpowered(facts, now_s)
        if waits == self._waits:
            return []
        self._waits = waits
        return [(self._data.name, "overpowered", waits)]

    def _time(self) -> list[Fact]:
        """Compare the time that the action has taken with the one expected."""
        settings, expected_s = self._orders.settings, self._expected_s or math.inf
        if self._taken_s > settings.failed_factor * expected_s:
            return self._failed()
        status = "late" if self._taken_s > settings.late_factor * expected_s else "proceeding"
        if status == self._status:
            return []
        self._status = status
        return [(self._data.name, "actionStatus", status)]

    def _failed(self) -> list[Fact]:
        self._status = "failed"
        return [*self.resign(), (self._data.name, "actionStatus", "failed")]


def replace_ends(perceived: Perception, is_done: bool, has_failed: bool, is_beyond_it: bool) -> Perception:
    """The perception of an action that has come to its end, if it has."""
    if is_done or has_failed:
        failed = has_failed and not is_done
        return perceived._replace(stimulus=0.0, done=is_done, failed=failed, is_beyond_it=failed and is_beyond_it)
    return perceived
