"""Vital needs of a vehicle: return home on its last energy, stay in the area of operations.

While one has a stimulus, the first of them in this order is performed, whatever objectives and influence signals weigh.
A mission can neither omit nor override them; features may add needs that rank last. Keeping clear of others is no
activity: it has the last word on every motion (``remoras.motion.avoidance``).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType
from remoras.behaviours import ALWAYS_DUE, CAPTURE_M, UNDUE, Behaviour, Perception, Reference, Standing, distance_m
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.motion.avoidance import Bounds
from remoras.picture import Picture

ROUTINE_IMPORTANCE = 0.1
"""Importance of permanent activities."""


class ReturningHome(Behaviour):
    """Go home once energy falls to the reserve for the way, and stay there."""

    def __init__(self, data: VehicleData) -> None:
        self._data = data

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        return ALWAYS_DUE if performed or picture.body.battery <= picture.body.reserve else UNDUE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        arrived = distance_m(motion, self._data.start_m) <= CAPTURE_M
        if arrived:
            return Reference(self._data.start_m, 0.0, 0.0)
        return Reference(self._data.start_m, self._data.survey_speed_mps, CAPTURE_M)


class ReturningToArea(Behaviour):
    """Return to the centre of the area of operations."""

    def __init__(self, bounds_m: Bounds, data: VehicleData) -> None:
        x_min, y_min, x_max, y_max = bounds_m
        self._centre_m = (x_min + x_max) / 2.0, (y_min + y_max) / 2.0
        self._data = data

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        return ALWAYS_DUE if picture.body.outside_m > 0.0 else UNDUE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return Reference(self._centre_m, self._data.transit_speed_mps)


def _vital(name: str) -> ActivitySet:
    return ActivitySet(None, ActivityKind.VITAL, (Activity(name, ActivityType.GUIDANCE),), 1.0)


VITAL: Mapping[ActivitySet, Callable[[VehicleData, Bounds], Behaviour]] = {
    ActivitySet(
        None,
        ActivityKind.INDIVIDUAL,
        (Activity("SendingInfluenceSignals", ActivityType.COMMUNICATION),),
        ROUTINE_IMPORTANCE,
    ): lambda data, bounds_m: Standing(),
    _vital("ReturningHome"): lambda data, bounds_m: ReturningHome(data),
    _vital("ReturningToArea"): lambda data, bounds_m: ReturningToArea(bounds_m, data),
}
"""Behaviours of every vehicle's vital sets, which precede those of its objectives in order."""
VITAL_SETS = tuple(VITAL)
VITAL_NAMES = frozenset(activity_set.name for activity_set in VITAL)
"""Names reserved for vital activities, besides those of needs added by features."""
