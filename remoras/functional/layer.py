"""Functional layer: performs the decision with sensors, motion and energy of the vehicle."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence, Set
from typing import Any, NamedTuple, Protocol

from remoras.activities import ROOM, ActivityKind, ActivitySet, ActivityType, Wait
from remoras.behaviours import IDLE, STUCK, Behaviour, Homing, Perception, Reference, basis, distance_m
from remoras.beliefs import Key
from remoras.condition import Condition
from remoras.database import HOME_MARGIN, VehicleData
from remoras.errors import PluginError
from remoras.functional.guidance import STUCK_S, Guidance, Headway
from remoras.functional.vital import VITAL, VITAL_NAMES, VITAL_SETS
from remoras.mission_parts import FunctionalPart
from remoras.motion import Leg, Motion
from remoras.motion.attraction import GuidanceTable, Pulls
from remoras.motion.avoidance import Bounds, Neighbour, nearest_within
from remoras.motion.separation import NEAR_M
from remoras.picture import Picture
from remoras.plugins import RAISED, answer, broken_promise
from remoras.recorder import Table
from remoras.sensor import NEVER_QUIET, Observation, Pose, Quiet, QuietFrom, Sensor
from remoras.work import Point

ROUNDING = 1e-9
"""Bound on the rounding error of an advance."""
KNOWN_M = (0.0, 0.0)
"""Position error of a vehicle that knows its position."""
OBSERVATIONS = "a list of Observation"
PERCEPTION = "a Perception, stimulus 0..1, until_s no NaN"
PROGRESS = "a function of motion and picture that returns -1..1 or None"
REFERENCE = "None, or a Reference with a finite target_m and a speed_mps and holds_m of 0 or more"


def _answering(data: VehicleData, dead: Collection[str]) -> tuple[str, ...]:
    return tuple(sensor.name for sensor in data.sensors if sensor.tells_state and sensor.name not in dead)


def _exact(index: int) -> float:
    return 0.0


def _reserve_per_m(data: VehicleData, speed_mps: float) -> float:
    return HOME_MARGIN * (data.power_w(speed_mps) / speed_mps) / data.energy_j


def _refuse_unfit(
    activity_set: ActivitySet, where: str, vehicle: str, sensors: Collection[str], vital: Set[str]
) -> None:
    if not 0.0 <= activity_set.importance <= 1.0:
        raise PluginError(f"{where}: importance is {activity_set.importance}; allowed: 0 to 1")
    for activity in activity_set.activities:
        if activity.name in vital:
            raise PluginError(
                f"{where}: {activity.name!r} is the name of an activity of the vehicle itself; "
                f"give it another name, none of {', '.join(sorted(vital))}"
            )
        for name in activity.sensors:
            if name not in sensors:
                has = ", ".join(sensors) or "none"
                raise PluginError(
                    f"{where}: {activity.name} switches on the sensor {name!r}, but {vehicle} has: {has}; "
                    "give the activity only to vehicles that have the sensor"
                )


class Sensed(NamedTuple):
    """Observation with the name of its sensor and the table of its row."""

    sensor: str
    table: Table | None
    observation: Observation

    def table_of(self, vehicle: str) -> Table:
        """Return the table of the row; raise PluginError if missing or not fitting."""
        row = self.observation.row
        if self.table is None:
            raise PluginError(
                f"sensor {self.sensor} of {vehicle}: its observation has the row {row}, but its table is None; "
                "declare the table"
            )
        if len(row) + 2 != len(self.table.columns):
            names = ", ".join(self.table.column_names[2:])
            raise PluginError(
                f"sensor {self.sensor} of {vehicle}: its row {row} does not fit the columns {names} of its table "
                f"{self.table.name}"
            )
        return self.table


class Sensing:
    """Switch and read the sensors of one vehicle; ``misses``: whether one fails at a time (s)."""

    def __init__(self, vehicle: str, sensors: Mapping[str, Sensor], world: Any) -> None:
        self.looking: tuple[str, ...] = ()  # names of sensors that were on and worked in the last motion tick
        self._vehicle = vehicle
        self._sensors = sensors
        self._world = world
        self.misses: Callable[[str, float], bool] | None = None
        self._dead: frozenset[str] = frozenset()
        self._on: list[tuple[str, Sensor]] = []
        self._working: list[tuple[str, Sensor]] = []
        self._working_names: tuple[str, ...] = ()
        self.quiet = NEVER_QUIET
        """Place, time and distance without observations of all working sensors."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all sensors of the vehicle."""
        return tuple(self._sensors)

    def impair(self, dead: frozenset[str]) -> None:
        """Set the failed sensors, which stay on but yield nothing."""
        self._dead = dead
        self._working = [(name, sensor) for name, sensor in self._on if name not in dead]
        self._working_names = tuple(name for name, _ in self._working)
        self.quiet = NEVER_QUIET

    def switch_on(self, names: Collection[str]) -> tuple[str, ...]:
        """Switch on exactly these sensors; return those on, working or not."""
        self._on = [(name, sensor) for name, sensor in self._sensors.items() if name in names]
        self.impair(self._dead)
        return tuple(name for name, _ in self._on)

    def look(self, pose: Pose, now_s: float) -> list[Sensed]:
        """Return the current observations; raise PluginError on wrong sensor results."""
        working, self.looking = self._working, self._working_names
        if (misses := self.misses) is not None:
            working = [named for named in working if not misses(named[0], now_s)]
            self.looking = tuple(name for name, _ in working)
        sensed: list[Sensed] = []
        until_m = until_s = math.inf
        for name, sensor in working:
            try:
                returned = sensor.sense(pose, self._world, now_s)
                if isinstance(returned, Quiet):
                    until_m, until_s = min(until_m, max(0.0, returned.until_m)), min(until_s, returned.until_s)
                    continue
                until_m = 0.0
                if not returned and returned is not None:
                    continue
                observations = tuple(returned)
            except RAISED as error:
                raise broken_promise(self._where(name), "sense", OBSERVATIONS, error) from error
            if not all(isinstance(observation, Observation) for observation in observations):
                raise broken_promise(self._where(name), "sense", OBSERVATIONS, observations)
            sensed += [Sensed(name, sensor.table, observation) for observation in observations]
        # One that misses may observe something in the next tick.
        self.quiet = QuietFrom(until_m, until_s, pose.x_m, pose.y_m) if misses is None else NEVER_QUIET
        return sensed

    def _where(self, name: str) -> str:
        return f"sensor {name} of {self._vehicle}"


class Positioning(Protocol):
    """Position fixes of a vehicle that may err about its position."""

    need: ActivitySet
    """Activity that obtains a fix, after all others."""

    @property
    def behaviour(self) -> Behaviour:
        """Behaviour of that activity."""

    def before_decision(self, guiding: Behaviour | None) -> None:
        """Prepare for a decision; ``guiding`` is the behaviour in control."""

    def after_motion(self, neighbours: Sequence[Neighbour], dt_s: float) -> None:
        """Update after motion for ``dt_s``; ``neighbours`` are sonar contacts."""

    def restart(self) -> None:
        """Restart at the same place."""

    def pose(self, pose: Pose) -> Pose:
        """Return the pose with the error of the believed position."""


class FunctionalLayer:
    """Sensors, integrity monitoring, guidance and control of one vehicle.

    ``data`` and ``motion`` are true in this run; ``believed`` is the vehicle's belief, the same object as ``motion`` if
    it knows its position. ``guidance`` may be replaced by features that add to motion. ``positioning`` is the source of
    position fixes, None if the position is known; ``sigma_m`` the standard deviation per axis (m), if a real body
    reports it. ``held``: last reference of the guiding behaviour, while valid. ``progress``: by activity set, the last
    value of a ``Perception.advance`` that is a function. ``has_events``: a perception is done, has failed or concludes.
    ``stranded``: activity without headway, if vital or on the way to a rally point; else empty. Only this class writes
    the part ``body`` of ``picture``.
    """

    def __init__(
        self,
        data: VehicleData,
        mission: FunctionalPart,
        world: Any,
        sensors: Mapping[str, Sensor],
        bounds_m: Bounds,
        picture: Picture,
        constants: GuidanceTable | None = None,
    ) -> None:
        self.data = data
        self.motion = Motion(*data.start_m)
        self.exhausted = False
        """True once the battery is empty; the vehicle then stops permanently."""
        self.is_on = True
        """True while energy remains and no fault has removed the vehicle."""
        self.believed = self.motion
        self.depth_m = data.depth_m
        self.picture = picture
        self._sound_target_m = self._allowed_m = data.start_m
        self._settled_m: Point = data.start_m
        self._mission = mission
        self.sensors = Sensing(data.name, sensors, world)
        self.guidance = Guidance(self.motion, data, bounds_m, constants or GuidanceTable())
        self.positioning: Positioning | None = None
        self.sigma_m = 0.0
        self._bounds_m = bounds_m
        self._reserve_per_m = _reserve_per_m(data, data.survey_speed_mps)
        self._sets: tuple[ActivitySet, ...] = ()
        self._of_set: dict[ActivitySet, Behaviour] = {}
        self._behaviours: list[Behaviour] = []
        self._guiding: int | None = None
        self.held: Reference | None = None
        self._leg: Leg | None = None  # steady motion that goes on, until one of these:
        self._n_ticks = math.inf  # as many motion ticks
        self._most_j = 0.0  # so much energy consumed
        self._beside: Sequence[Neighbour] = ()  # other vehicles than these within sonar range
        self._seen_m: Sequence[Point] = ()  # other sonar contacts, as behaviours see them
        self.headway, self.stranded = Headway(), ""
        self._perceived: list[Perception] = []
        self.has_events = False
        self._read: list[Set[Key]] = []  # facts that each perception depends on
        self._rests_on: tuple[Any, ...] | None = None  # what else all depend on, as they saw it
        self._until_s = -math.inf  # the first deadline
        self._peers: list[tuple[int, str, int]] = []  # sets that wait for news of a peer, and its number of positions
        self._asked_at_m: dict[int, Point] = {}  # sets whose perception is valid near this place
        self._advancing: list[int] = []  # sets whose advance is a function
        self.progress: dict[int, float | None] = {}
        picture.body.answering = _answering(data, ())
        self._drain_w = 0.0

    # Faults --------------------------------------------------------------------------------------

    def impair(self, condition: Condition) -> None:
        """Apply the effects of all active faults, replacing earlier ones."""
        speed_factor, dead_sensors = condition.speed_factor, condition.dead_sensors
        self._drain_w = condition.drain_w
        self.guidance.slow_down(speed_factor)
        self.picture.body.answering = _answering(self.data, dead_sensors)
        # The way home takes longer at the remaining speed.
        self._reserve_per_m = _reserve_per_m(self.data, speed_factor * self.data.survey_speed_mps)
        self._rests_on = self._leg = None
        self.sensors.impair(dead_sensors)

    def stop(self) -> None:
        """Stop motion and sensors until the next tick."""
        self.motion.speed_mps = 0.0
        self.sensors.looking = ()

    # Energy --------------------------------------------------------------------------------------

    def transmitted(self, size_bits: int) -> None:
        """Subtract the energy of a packet."""
        self.motion.energy_j += self.data.transmit_j_per_packet + size_bits * self.data.transmit_j_per_bit
        if self.motion.energy_j >= self.data.energy_j:
            self._be_exhausted()

    def _be_exhausted(self) -> None:
        self.motion.energy_j = self.data.energy_j
        self.exhausted, self.is_on = True, False

    @property
    def guiding(self) -> Behaviour | None:
        """Guiding behaviour, or None."""
        return None if self._guiding is None else self._behaviours[self._guiding]

    @property
    def is_at_rest(self) -> bool:
        """True while it stays where it is, whatever nearby vehicles signal."""
        return self._leg is not None and self._leg.way_m == 0.0

    @property
    def waits(self) -> Wait | None:
        """Room to move, or the condition the guiding behaviour waited for at the last decision, or None."""
        guiding, stopped_s = self._guiding, self.guidance.stopped_s
        if stopped_s >= STUCK_S:
            return Wait(ROOM, math.inf, self.picture.body.now_s - stopped_s)
        return None if guiding is None or not self._perceived else self._perceived[guiding].waits

    # Activities ----------------------------------------------------------------------------------

    def prepare(self, sets: Sequence[ActivitySet]) -> tuple[ActivitySet, ...]:
        """Return vital sets and ``sets``, known ones with their state; PluginError for an unfit one."""
        own = () if self.positioning is None else (self.positioning.need,)
        vital = VITAL_NAMES | {need.name for need in own}
        for activity_set in sets:
            _refuse_unfit(activity_set, self._where(activity_set), self.data.name, self.sensors.names, vital)
        self._sets = (*VITAL_SETS, *sets, *own)
        known = self._of_set
        self._of_set = {
            activities: known[activities] if activities in known else _behaviour(self, activities)
            for activities in self._sets
        }
        self._behaviours = [self._of_set[activity_set] for activity_set in self._sets]
        self._perceived = []
        self._asked_at_m = {}
        self.perform(())
        return self._sets

    def _broken(self, index: int, hook: str, expected: str, result: object) -> PluginError:
        return broken_promise(self._where(self._sets[index]), hook, expected, result)

    def _where(self, activity_set: ActivitySet) -> str:
        return f"mission {type(self._mission).__name__}, activity {activity_set.name}"

    def perform(self, decision: Sequence[int]) -> None:
        """Start the activities of ``decision``: set the guiding one and switch sensors."""
        self._guiding = self.held = self._leg = self._rests_on = None
        named: set[str] = set()
        for index in decision:
            for activity in self._sets[index].activities:
                named.update(activity.sensors)
                if activity.type is ActivityType.GUIDANCE:
                    self._guiding = index
        self.picture.body.sensors_on = self.sensors.switch_on(named)

    # Every tick and every decision ---------------------------------------------------------------

    def sense(self, now_s: float, neighbours: Sequence[Neighbour]) -> list[Sensed]:
        """Monitor the vehicle and read the sensors that are on; raise PluginError on wrong results."""
        motion, body = self.believed, self.picture.body
        x_m, y_m = motion.x_m, motion.y_m
        body.now_s = now_s
        body.battery = 1.0 - motion.energy_j / self.data.energy_j
        body.contacts_m = _contacts_m(x_m, y_m, neighbours) if neighbours else ()
        at_x_m, at_y_m = self._settled_m
        dx_m, dy_m = x_m - at_x_m, y_m - at_y_m
        if dx_m * dx_m + dy_m * dy_m > NEAR_M * NEAR_M:
            self._settled_m, body.settled_s = (x_m, y_m), now_s
        if not body.sensors_on:
            self.sensors.looking = ()
            return []
        true_motion = self.motion
        if self.sensors.quiet.holds(true_motion.x_m, true_motion.y_m, now_s):
            return []
        how = motion.heading_rad, motion.speed_mps, KNOWN_M, self.guidance.flow_mps, 0.0, self.sigma_m
        pose = Pose(true_motion.x_m, true_motion.y_m, self.depth_m, *how)
        if self.positioning is not None:
            pose = self.positioning.pose(pose)
        sensed = self.sensors.look(pose, now_s)
        for one in sensed:
            if one.observation.facts:
                body.yields_s[one.sensor] = now_s
        return sensed

    def perceive(self, performed: Sequence[int], spare: Callable[[int], float] = _exact) -> list[Perception]:
        """Return perceptions of all sets, asking only where due; PluginError for a wrong answer.

        ``spare``: by how much the stimulus of a set may deviate.
        """
        # The same objects are returned while only deadlines change.
        body, reference = self.picture.body, self.held
        self._look_after_itself()
        if self.positioning is not None:
            self.positioning.before_decision(self.guiding)
        waits = self.guidance.withdraws or self.guidance.queues
        rests_on = basis(self.picture, performed)
        if due := self._due(rests_on, spare):
            self._ask(due, performed)
        self._rests_on = None if waits else rests_on
        if self._advancing and not _are_close(progress := self._progress(), self.progress):
            self.progress = progress
        is_hindered = waits or body.contacts_m  # by another vehicle, which will move
        is_stuck = self.headway.is_missing(None if is_hindered else reference, self.believed, body.now_s)
        if is_stuck and self._guiding is not None:
            guiding = self._sets[self._guiding]
            if guiding.kind is ActivityKind.INDIVIDUAL:
                self._replace(self._guiding, STUCK)
            # On its last way there is no job to leave.
            elif guiding.kind is ActivityKind.VITAL or isinstance(self.guiding, Homing):
                self.stranded = guiding.name
        if waits and self._guiding is not None:  # yielding or queueing is no setback
            self._replace(self._guiding, self._perceived[self._guiding]._replace(advance=None))
        body.decided_s = body.now_s
        return self._perceived

    def _look_after_itself(self) -> None:
        body, motion = self.picture.body, self.believed
        body.reserve = distance_m(motion, self.data.start_m) * self._reserve_per_m
        x_m, y_m, (x_min, y_min, x_max, y_max) = motion.x_m, motion.y_m, self._bounds_m
        is_inside = x_min <= x_m <= x_max and y_min <= y_m <= y_max
        body.outside_m = 0.0 if is_inside else max(x_min - x_m, x_m - x_max, y_min - y_m, y_m - y_max)

    def renew(self, performed: Sequence[int]) -> list[Perception]:
        """Return the perceptions here, asking again for stimuli that ``spare`` has left as they were elsewhere."""
        progress, here_m = self.progress, self.believed.position_m
        if due := [index for index, at_m in self._asked_at_m.items() if at_m != here_m]:
            self._ask(due, performed)
            self.progress = progress
        return self._perceived

    def _due(self, rests_on: tuple[Any, ...], spare: Callable[[int], float]) -> Sequence[int]:
        """Return the sets whose last perception is no longer valid."""
        changed = self.picture.facts.take_changed()
        if self._rests_on is None or rests_on != self._rests_on:
            return range(len(self._behaviours))
        now_s, due, reference = self.picture.body.now_s, list[int](), self.held
        if now_s >= self._until_s:
            due = [index for index, perceived in enumerate(self._perceived) if now_s >= perceived.until_s]
        is_on_leg = reference is not None and distance_m(self.believed, reference.target_m) > reference.holds_m
        if self._guiding is not None and not is_on_leg and self._guiding not in due:
            due.append(self._guiding)
        if changed:
            due += [index for index, read in enumerate(self._read) if index not in due and not read.isdisjoint(changed)]
        n_positions = self.picture.peers.n_positions
        for index, peer, n in self._peers:
            if n_positions.get(peer, 0) != n and index not in due:
                due.append(index)
        for index, at_m in self._asked_at_m.items():
            if (moved_m := distance_m(self.believed, at_m)) > 0.0 and index not in due:
                perceived = self._perceived[index]
                if not (moved_m < perceived.until_m and perceived.per_m * moved_m < spare(index)):
                    due.append(index)
        return due

    def _ask(self, due: Collection[int], performed: Sequence[int]) -> None:
        motion, picture = self.believed, self.picture
        is_new = not self._perceived
        perceptions = [IDLE] * len(self._behaviours) if is_new else [*self._perceived]
        self._read = [frozenset()] * len(perceptions) if is_new else self._read
        if self._guiding in due:
            self.held = self._leg = None
        picture.facts.take_read()
        for index in due:
            try:
                perceived = self._behaviours[index].perceive(motion, picture, index in performed)
            except RAISED as error:
                raise self._broken(index, "perceive", PERCEPTION, error) from error
            if not (
                isinstance(perceived, Perception) and _is_share(perceived.stimulus) and _is_time(perceived.until_s)
            ):
                raise self._broken(index, "perceive", PERCEPTION, perceived)
            self._read[index] = picture.facts.take_read()
            if perceived.until_m < math.inf or perceived.per_m > 0.0:
                self._asked_at_m[index] = motion.position_m
            elif index in self._asked_at_m:
                del self._asked_at_m[index]
            if perceived != (before := perceptions[index]):
                is_new |= perceived._replace(until_s=before.until_s, until_m=before.until_m) != before
                perceptions[index] = perceived
        self._until_s = min([p.until_s for p in perceptions])
        if is_new:
            self._perceived = perceptions
            self._advancing = [index for index, p in enumerate(perceptions) if callable(p.advance)]
            self.has_events = bool([p for p in perceptions if p.done or p.failed or p.concludes])
            self.progress = {}
        else:  # the same list says that nothing but deadlines has changed
            self._perceived[:] = perceptions
        n_positions = picture.peers.n_positions
        self._peers = [(n, peer, n_positions.get(peer, 0)) for n, p in enumerate(perceptions) for peer in p.peers]

    def _progress(self) -> dict[int, float | None]:
        progress: dict[int, float | None] = {}
        for index in self._advancing:
            try:
                progress[index] = self._perceived[index].progress(self.believed, self.picture)
            except RAISED as error:
                raise self._broken(index, "the advance of perceive", PROGRESS, error) from error
        return progress

    def _replace(self, index: int, perception: Perception) -> None:
        # Another list, since the same one means that only deadlines have changed.
        self._perceived = [*self._perceived]
        self._perceived[index] = perception
        self.has_events |= perception.failed
        self.progress.pop(index, None)
        self._rests_on = None

    def act(self, dt_s: float, neighbours: Sequence[Neighbour] = (), since_s: float = 0.0) -> None:
        """Move for ``dt_s`` as guidance and neighbours allow; PluginError for a wrong reference."""
        reference, believed, motion = self.held, self.believed, self.motion
        leg, contacts_m = self._leg, self.picture.body.contacts_m
        is_same = neighbours == self._beside and contacts_m == self._seen_m
        if leg is not None and is_same and self._n_ticks > 0 and motion.energy_j < self._most_j:
            self._n_ticks -= 1
            leg.go(motion)
            return
        if reference is not None:
            (x_m, y_m), speed_mps, holds_m, _ = reference
            dx_m, dy_m = x_m - believed.x_m, y_m - believed.y_m
            # Only from there on may the behaviour state another reference, so it is not asked before. A vehicle that
            # brakes, or keeps its place in a current, may still leave it.
            is_adrift = speed_mps == 0.0 and motion.speed_mps > 0.0
            if neighbours or contacts_m or is_adrift or math.sqrt(dx_m * dx_m + dy_m * dy_m) <= holds_m:
                reference = None
        if reference is None and self._guiding is not None:
            reference = self.held = self._reference(self._guiding)
        self._leg = leg = self.guidance.move(reference, neighbours, self.picture.peers.positions_m, since_s, dt_s)
        if leg is not None:
            self._beside, self._seen_m = neighbours, contacts_m
            self._n_ticks, self._most_j = self._until(leg, reference)
        if self._drain_w:
            motion.energy_j += self._drain_w * dt_s
        if motion.energy_j >= self.data.energy_j:
            self._be_exhausted()
            motion.speed_mps = 0.0
        if self.positioning is not None:
            self.positioning.after_motion(neighbours, dt_s)

    def _until(self, leg: Leg, reference: Reference | None) -> tuple[float, float]:
        """Return the ticks and the energy (J) up to which a leg surely changes neither reference nor needs."""
        data, body, way_m = self.data, self.picture.body, leg.way_m
        if self.positioning is not None or self._drain_w:
            return 0.0, 0.0
        if reference is None:
            is_held = self._guiding is None
        else:
            is_held = reference.holds_m < math.inf and (way_m > 0.0 or reference.speed_mps == 0.0)
        if not is_held:
            return 0.0, 0.0
        n_ticks, home_m = math.inf, distance_m(self.believed, data.start_m)
        if way_m > 0.0 and reference is not None:
            n_ticks = (distance_m(self.believed, reference.target_m) - reference.holds_m) / way_m - 2.0
            home_m += max(0.0, n_ticks) * way_m
        # Up to the reserve for the way home from anywhere on the leg; below it, at rest, to the last.
        is_low = body.battery <= body.reserve
        share = 1.0 if is_low else 1.0 - self._reserve_per_m * home_m
        return 0.0 if is_low and way_m > 0.0 else n_ticks, share * data.energy_j - 2.0 * leg.energy_j

    def heed(self, pulls: Pulls) -> None:
        """Set attraction and repulsion inputs until the next decision."""
        self.guidance.heed(pulls, self.picture.peers)

    def _reference(self, index: int) -> Reference | None:
        try:
            reference = self._behaviours[index].reference(self.believed, self.picture)
            if reference is None:
                return None
            sound = reference.__class__ is Reference and 0.0 <= reference[1] < math.inf and reference[2] >= 0.0
            if sound and reference[0] is not self._sound_target_m:  # usually unchanged from tick to tick
                x_m, y_m = self._sound_target_m = reference[0]
                sound = math.isfinite(x_m + y_m)
                self._allowed_m = nearest_within(self._bounds_m, self._sound_target_m)
        except RAISED as error:
            raise self._broken(index, "reference", REFERENCE, error) from error
        if not sound:
            raise self._broken(index, "reference", REFERENCE, reference)
        allowed_m = self._allowed_m
        return reference if allowed_m is reference[0] else reference._replace(target_m=allowed_m)


def _contacts_m(x_m: float, y_m: float, neighbours: Sequence[Neighbour]) -> tuple[Point, ...]:
    return tuple([(x_m + neighbour.dx_m, y_m + neighbour.dy_m) for neighbour in neighbours])


def _behaviour(layer: FunctionalLayer, activity_set: ActivitySet) -> Behaviour:
    activity = activity_set.activities[0]
    if layer.positioning is not None and activity_set is layer.positioning.need:
        return layer.positioning.behaviour
    if activity_set in VITAL:
        return VITAL[activity_set](layer.data, layer._bounds_m)
    return answer(
        layer._where(activity_set),
        "behaviour_for",
        "a Behaviour",
        lambda made: callable(getattr(made, "perceive", None)) and callable(getattr(made, "reference", None)),
        lambda: layer._mission.behaviour_for(activity, layer.data),
    )


def _are_close(progress: Mapping[int, float | None], other: Mapping[int, float | None]) -> bool:
    if progress.keys() != other.keys():
        return False
    for index, now in progress.items():
        before = other[index]
        if now is not before and (now is None or before is None or abs(now - before) >= ROUNDING):
            return False
    return True


def _is_time(value: object) -> bool:
    return isinstance(value, float | int) and not math.isnan(value)


def _is_share(value: object) -> bool:
    return isinstance(value, float | int) and 0.0 <= value <= 1.0


def embody(layer: FunctionalLayer, before: FunctionalLayer) -> None:
    """Give a restarted vehicle its previous motion and energy."""
    layer.motion.take(before.motion)
    layer.picture.body.battery = before.picture.body.battery  # told in a slot before the next motion tick
    layer.exhausted = before.exhausted
    layer.is_on = layer.is_on and not layer.exhausted
    if layer.positioning is not None:
        layer.positioning.restart()
