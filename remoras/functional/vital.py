"""What a vehicle needs to live: it keeps clear of others, comes home on its last energy and stays where it operates.

Features may add needs, which stand behind all others, see ``FunctionalLayer.needs``.

Keeping clear is no activity that is chosen: it has the last word on every motion, whatever guides, see
``remoras.avoidance``. The others are activities.

They are the vehicle's own, whatever its mission, and come before all others: while one of them has a
stimulus it is performed, the first of them in this order, whatever objectives and influence signals weigh. So a mission
can neither forget nor override them. Sending influence signals belongs here too, as what a vehicle does in any case.
"""

from __future__ import annotations

from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType
from remoras.avoidance import Bounds
from remoras.behaviours import CAPTURE_M, DUE, IDLE, Behaviour, Perception, Reference, Standing, distance_m
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.work import Point

ROUTINE_IMPORTANCE = 0.1
"""Importance of what a vehicle does in any case."""


class ReturningHome(Behaviour):
    """Goes home once no more energy is left than the way takes with a margin, and stays there."""

    def __init__(self, data: VehicleData) -> None:
        self._data = data

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due from the reserve on, and as long as it is performed."""
        return DUE if performed or picture.body.battery <= picture.body.reserve else IDLE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To where the vehicle started; stay there on arrival."""
        arrived = distance_m(motion, self._data.start_m) <= CAPTURE_M
        return Reference(self._data.start_m, 0.0 if arrived else self._data.survey_speed_mps)


class ReturningToArea(Behaviour):
    """Goes back into the area of operations.

    Args:
        centre_m: of the area of operations.
        data: of the vehicle.
    """

    def __init__(self, centre_m: Point, data: VehicleData) -> None:
        self._centre_m = centre_m
        self._data = data

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due outside the area of operations."""
        return DUE if picture.body.outside_m > 0.0 else IDLE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To the centre in transit."""
        return Reference(self._centre_m, self._data.transit_speed_mps)


def _vital(name: str) -> ActivitySet:
    return ActivitySet(None, ActivityKind.VITAL, (Activity(name, ActivityType.GUIDANCE),), 1.0)


VITAL_SETS = (
    ActivitySet(
        None,
        ActivityKind.INDIVIDUAL,
        (Activity("SendingInfluenceSignals", ActivityType.COMMUNICATION),),
        ROUTINE_IMPORTANCE,
    ),
    _vital("ReturningHome"),
    _vital("ReturningToArea"),
)
"""What every vehicle considers, in this order, before the activities of its objectives."""

VITAL_NAMES = frozenset(activity_set.name for activity_set in VITAL_SETS)
"""Names that no activity of a mission may have, beside those of the needs that features add."""


def vital_behaviour(activity: Activity, data: VehicleData, bounds_m: Bounds) -> Behaviour:
    """The behaviour of the vital set which ``activity`` leads.

    Args:
        activity: the first one of a set of ``VITAL_SETS``.
        data: of the vehicle.
        bounds_m: area of operations.
    """
    match activity.name:
        case "ReturningHome":
            return ReturningHome(data)
        case "ReturningToArea":
            x_min, y_min, x_max, y_max = bounds_m
            return ReturningToArea(((x_min + x_max) / 2.0, (y_min + y_max) / 2.0), data)
    return Standing()
