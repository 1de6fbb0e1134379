"""What a channel model may know of a scenario: the fleet that transmits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from exchange.acoustics.models import Deployment
from missions.scenarios.modem import modem_named

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario


def deployment_of(scenario: Scenario) -> Deployment:
    """The fleet of a scenario, as channel models know it."""
    by_node = sorted(scenario.vehicle, key=lambda table: table.slot)
    return Deployment(
        nodes={table.name: table.slot for table in by_node},
        depths_m=tuple(table.depth_m for table in by_node),
        modem=modem_named(scenario.communication.modem, scenario.modem),
        range_m=scenario.communication.range_m,
        duration_s=scenario.scenario.duration_s,
    )


def scenario_sound_speed_mps(scenario: Scenario) -> float:
    """Speed of sound in a scenario: what its channel makes of the water, or that of its world."""
    speed_mps = scenario.channel.sound_speed_mps(deployment_of(scenario))
    return scenario.world.sound_speed_mps if speed_mps is None else speed_mps
