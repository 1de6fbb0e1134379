"""Functional layer: performs the decision with this vehicle's sensors, motion and energy."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

from remoras.activities import Activity, ActivitySet, ActivityType
from remoras.behaviours import Behaviour, Perception, Picture
from remoras.database import VehicleData
from remoras.motion import Motion, advance
from remoras.sensors import Cell, MappingSensor, Neighbour, time_to_collision_s

SAFETY_M = 5.0
"""Distance that two vehicles at one depth keep."""
HORIZON_S = 30.0
"""A collision farther ahead than this is not yet a concern."""
RESERVE_MARGIN = 1.25
"""Energy kept for the way home, as a multiple of what the way takes."""

Bounds = tuple[float, float, float, float]
BehaviourFactory = Callable[[Activity, VehicleData], Behaviour]


class FunctionalLayer:
    """Sensors, integrity monitoring, guidance and control of one vehicle.

    Args:
        data: static data of the vehicle.
        sensor: its mapping sensor.
        bounds_m: area of operations (x_min, y_min, x_max, y_max).
        behaviour_for: makes the behaviour that carries an activity out.
        frame_s: length of a TDMA frame.
    """

    def __init__(
        self,
        data: VehicleData,
        sensor: MappingSensor,
        bounds_m: Bounds,
        behaviour_for: BehaviourFactory,
        frame_s: float = math.inf,
    ) -> None:
        self.data = data
        self.motion = Motion(*data.start_m)
        self.picture = Picture(frame_s=frame_s)
        self._sensor = sensor
        self._bounds_m = bounds_m
        self._behaviour_for = behaviour_for
        speed_mps = data.survey_speed_mps
        home_j_per_m = (data.hotel_w + data.drag_w_per_mps3 * speed_mps**3) / speed_mps
        self._reserve_per_m = RESERVE_MARGIN * home_j_per_m / data.energy_j
        self._of_set: dict[ActivitySet, Behaviour] = {}
        self._behaviours: list[Behaviour] = []
        self._guiding: Behaviour | None = None
        self._mapping = False

    def transmitted(self, size_bits: int) -> None:
        """Account for the energy of a packet."""
        self.motion.energy_j = min(self.data.energy_j, self.motion.energy_j + size_bits * self.data.transmit_j_per_bit)

    @property
    def exhausted(self) -> bool:
        """The battery is empty: the vehicle does nothing any more."""
        return self.motion.energy_j >= self.data.energy_j

    @property
    def must_go_home(self) -> bool:
        """No more energy is left than the way home takes, with a margin."""
        return self.picture.battery <= self.picture.reserve

    def prepare(self, sets: Sequence[ActivitySet]) -> None:
        """Get ready to perform ``sets``; what was under way goes on where it was."""
        self._of_set = {
            activity_set: self._of_set.get(activity_set) or self._behaviour_for(activity_set.activities[0], self.data)
            for activity_set in sets
        }
        self._behaviours = [self._of_set[activity_set] for activity_set in sets]
        self._guiding = None
        self._mapping = False

    def sense(self, now_s: float, neighbours: Iterable[Neighbour]) -> list[Cell]:
        """Integrity monitoring and mapping; returns the cells newly mapped."""
        motion, picture, data = self.motion, self.picture, self.data
        picture.now_s = now_s
        picture.battery = 1.0 - motion.energy_j / data.energy_j
        home_m = math.hypot(motion.x_m - data.start_m[0], motion.y_m - data.start_m[1])
        picture.reserve = home_m * self._reserve_per_m
        x_min, y_min, x_max, y_max = self._bounds_m
        picture.outside_m = max(x_min - motion.x_m, motion.x_m - x_max, y_min - motion.y_m, motion.y_m - y_max, 0.0)
        picture.collision = self._collision(neighbours)
        if not self._mapping:
            return []
        return self._sensor.sense(motion.x_m, motion.y_m, motion.speed_mps)

    def _collision(self, neighbours: Iterable[Neighbour]) -> tuple[float, float] | None:
        worst: tuple[float, float] | None = None
        motion = self.motion
        for neighbour in neighbours:
            time_s = time_to_collision_s(neighbour, *motion.velocity_mps, SAFETY_M, HORIZON_S)
            if time_s is not None and (worst is None or 1.0 - time_s / HORIZON_S > worst[1]):
                worst = math.atan2(neighbour.dy_m, neighbour.dx_m), 1.0 - time_s / HORIZON_S
        return worst

    def perceive(self, performed: Sequence[int]) -> list[Perception]:
        """Stimulus and progress of every activity set; ``performed`` are the indices in the decision."""
        motion, picture = self.motion, self.picture
        return [
            behaviour.perceive(motion, picture, index in performed) for index, behaviour in enumerate(self._behaviours)
        ]

    def perform(self, sets: Sequence[ActivitySet], decision: Sequence[int]) -> None:
        """Take on the activities of ``decision``."""
        self._guiding = None
        self._mapping = False
        for index in decision:
            for activity in sets[index].activities:
                if activity.type is ActivityType.GUIDANCE:
                    self._guiding = self._behaviours[index]
                elif activity.type is ActivityType.PRODUCTIVE:
                    self._mapping = True

    def act(self, dt_s: float) -> None:
        """Move for ``dt_s`` as guidance refers; without guidance, slow down to a stop."""
        reference = self._guiding.reference(self.motion, self.picture) if self._guiding is not None else None
        if reference is None:
            advance(self.motion, self.data, self.motion.position_m, 0.0, dt_s)
        else:
            advance(self.motion, self.data, reference.target_m, reference.speed_mps, dt_s)
        if self.exhausted:
            self.motion.energy_j = self.data.energy_j
            self.motion.speed_mps = 0.0
