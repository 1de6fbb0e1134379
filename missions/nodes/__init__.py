"""Vehicles of a scenario in separate processes that communicate by packets only."""

from missions.nodes.alone import LoneVehicle, NodePlan, alone
from missions.nodes.frontseat import Disciplined, Fix, Frontseat, OwnBody, Reading, UtcClock
from missions.nodes.logs import NodeLog, Played, play, read_log
from missions.nodes.node import NodeOutcome, VehicleNode
from missions.nodes.swarm import Swarm, swarm

__all__ = [
    "Disciplined",
    "Fix",
    "Frontseat",
    "LoneVehicle",
    "NodeLog",
    "NodeOutcome",
    "NodePlan",
    "OwnBody",
    "Played",
    "Reading",
    "Swarm",
    "UtcClock",
    "VehicleNode",
    "alone",
    "play",
    "read_log",
    "swarm",
]
