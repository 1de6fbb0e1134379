"""Vehicles and activity sets that tests of the package start from; what matters in a test is given in it."""

from dataclasses import fields
from typing import Any

from missions.mapping.sensors import SwathSettings
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.database import AUVDatabase, VehicleData
from remoras.organisation import Group, RoleSpecification

AUV = VehicleData(
    name="AUV00",
    vehicle_type="AUV",
    node=0,
    social_layer=True,
    start_m=(0.0, 0.0),
    depth_m=20.0,
    depth_limit_m=100.0,
    transit_speed_mps=2.0,
    survey_speed_mps=1.5,
    turn_rate_radps=0.5,
    acceleration_mps2=0.5,
    energy_j=1.0e6,
    hotel_w=40.0,
    drag_w_per_mps3=15.0,
    transmit_j_per_bit=0.01,
    playable_roles=("Cartographer",),
    sensors=(SwathSettings(swath_m=25.0, speed_limit_mps=1.25),),
)


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
) -> ActivitySet:
    """A set of activities by name and type, for an objective of ``role`` (None: for no objective)."""
    return ActivitySet(
        None if role is None else objective(role),
        kind,
        tuple(Activity(name, of_type) for name, of_type in activities),
        importance,
        needs,
    )


GROUPS = (
    Group("Coordination", (RoleSpecification("Tactician", 1, 1, founding=True),)),
    Group(
        "Operational",
        (
            RoleSpecification("Coordinator", 1, 1, head=True, founding=True, played_by=("Coordination", "Tactician")),
            RoleSpecification("Performer", 1, founding=True),
            RoleSpecification("Cartographer", 1),
            RoleSpecification("LeftWinger", 1, 1, job="left"),
            RoleSpecification("RightWinger", 1, 1, job="right"),
        ),
    ),
)
LEADER = ("Tactician", "Coordinator", "Cartographer", "LeftWinger", "RightWinger")
WORKER = ("Performer", "Cartographer", "LeftWinger", "RightWinger")
