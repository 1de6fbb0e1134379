"""Uncertainty, ``[uncertainty]``: missed readings, and speeds that differ from the data.

Draws are keyed by seed and node in separate streams: strategy, policy and channel do not change them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import Field

from exchange.channel import loss
from missions.feature import Feature, Joining
from remoras.events import Observer
from remoras.table import Section

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario
    from remoras.database import VehicleData
    from remoras.fleet.vehicle import Vehicle

KEY, SPREAD = "uncertainty", "speed_spread"


class UncertaintyTable(Section):
    """The table ``[uncertainty]``."""

    p_miss: float = Field(
        0.0, ge=0.0, lt=1.0, description="probability that a sensor fails to observe, per motion tick"
    )
    speed_spread: float = Field(
        0.0,
        ge=0.0,
        le=0.5,
        description="largest deviation of a vehicle's speed from its data, as a share, drawn uniformly once per run",
    )


def slower(scenario: Scenario) -> tuple[float, str]:
    """Return the greatest relative loss of speed, and the key that sets it."""
    return scenario.of_feature(KEY).speed_spread, f"{KEY}.{SPREAD}"


def real(scenario: Scenario, data: VehicleData, seed: int) -> VehicleData:
    """Return the true data of a vehicle in the run with this seed: a drawn speed factor applied."""
    spread = scenario.of_feature(KEY).speed_spread
    if spread == 0.0:
        return data
    return data.faster(1.0 + spread * (2.0 * loss.uniform(seed, loss.SPEEDS, data.node, 0, 0) - 1.0))


class Misses(Observer):
    """Run hooks that make the sensors of all vehicles miss."""

    def __init__(self, joining: Joining) -> None:
        self._p_miss: float = joining.scenario.of_feature(KEY).p_miss
        self._seed, self._tick_s = joining.seed, joining.scenario.scenario.tick_s

    def on_vehicle(self, vehicle: Vehicle) -> None:
        node = vehicle.data.node
        numbers = {settings.name: number for number, settings in enumerate(vehicle.real.sensors)}

        def misses(sensor: str, now_s: float) -> bool:
            tick = round(now_s / self._tick_s)
            return loss.uniform(self._seed, loss.MISSES, tick, node, numbers[sensor]) < self._p_miss

        if self._p_miss:
            vehicle.functional.sensors.misses = misses


FEATURE = Feature({"": {KEY: (UncertaintyTable, UncertaintyTable.usual())}}, Misses, real=real, slower=slower)
