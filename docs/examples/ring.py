import math

from missions.mapping import MappingMission
from remoras import IDLE, Approach, Behaviour, Perception, Reference, distance_m


class Ring(Behaviour):
    """Wait at a place on a circle around the rally point, another one for each vehicle."""

    def __init__(self, centre_m, radius_m, group, data):
        angle_rad = 2.4 * data.node  # the golden angle: places differ
        self._place_m = centre_m[0] + radius_m * math.cos(angle_rad), centre_m[1] + radius_m * math.sin(angle_rad)
        self._group, self._speed_mps = group, data.transit_speed_mps
        self._approach = Approach(self._speed_mps)

    def perceive(self, motion, picture, performed):
        if self._group in picture.groups.gathered:
            return IDLE
        return Perception(1.0, self._progress if performed else None, until_s=math.inf)

    def _progress(self, motion, picture):  # called at every decision
        return self._approach.advance(distance_m(motion, self._place_m), picture.body.now_s, True)

    def reference(self, motion, picture):
        arrived = distance_m(motion, self._place_m) <= 1.0
        return Reference(self._place_m, 0.0 if arrived else self._speed_mps)


class RingMission(MappingMission):
    def behaviour_for(self, activity, data):
        if activity.name == "Homing":
            point_m, group, _ = activity.parameters  # third: groups that meet before
            return Ring(point_m, 12.0, group, data)
        return super().behaviour_for(activity, data)
