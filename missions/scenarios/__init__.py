"""Scenarios: the input of a run, read from TOML and validated."""

from missions.files import shipped
from missions.scenarios.fleet import VehicleTable
from missions.scenarios.loading import load
from missions.scenarios.organisation import GroupTable, Role
from missions.scenarios.scenario import Scenario, World
from remoras.table import Name, NotNegative, PointM, Positive, Probability, Section

__all__ = [
    "GroupTable", "Name", "NotNegative", "PointM", "Positive", "Probability", "Role", "Scenario", "Section",
    "VehicleTable", "World", "load", "shipped",
]  # fmt: skip
