"""Scenarios: the input of a run, read from TOML and validated."""

from missions.files import shipped
from missions.scenarios.loading import load
from missions.scenarios.scenario import GroupTable, Role, Scenario, VehicleTable, World
from remoras.table import Name, NotNegative, PointM, Positive, Probability, Section

__all__ = [
    "GroupTable", "Name", "NotNegative", "PointM", "Positive", "Probability", "Role", "Scenario", "Section",
    "VehicleTable", "World", "load", "shipped",
]  # fmt: skip
