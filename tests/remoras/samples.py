"""Sample vehicles and activity sets; each test states the values that matter."""

from dataclasses import fields
from typing import Any

from sample_vehicles import AUV

from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.database import AUVDatabase, VehicleData


def auv(name: str = "AUV00", **changes: Any) -> VehicleData:
    """``AUV`` with some of its data changed; the node follows from the name unless it is given."""
    values = {field.name: getattr(AUV, field.name) for field in fields(AUV)}
    return VehicleData(**{**values, "name": name, "node": int(name[-2:]), **changes})


def database(*vehicles: VehicleData) -> AUVDatabase:
    return AUVDatabase(vehicles)


def objective(role: str = "Cartographer", name: str = "Mapping", argument: str = "middle") -> Objective:
    return Objective("Operational", role, name, argument)


def activity_set(
    *activities: tuple[str, ActivityType],
    importance: float = 0.5,
    role: str | None = "Cartographer",
    kind: ActivityKind = ActivityKind.COLLECTIVE,
    needs: str | None = None,
    sensors: tuple[str, ...] = (),
) -> ActivitySet:
    """A set of activities by name and type, for an objective of ``role`` (None: for no objective)."""
    return ActivitySet(
        None if role is None else objective(role),
        kind,
        tuple(Activity(name, of_type, (), sensors) for name, of_type in activities),
        importance,
        needs,
    )


LEADER = ("Tactician", "Coordinator", "Cartographer", "LeftWinger", "RightWinger")
WORKER = ("Performer", "Cartographer", "LeftWinger", "RightWinger")
