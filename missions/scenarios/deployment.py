"""Equipment of vehicles, and the deployment that a channel is asked about."""

from __future__ import annotations

from typing import TYPE_CHECKING

from exchange.acoustics.models import Deployment
from missions.errors import ConfigurationFault
from missions.scenarios.modem import modem_named
from missions.scenarios.tables import used_in

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


ROUNDING_S = 1e-6


def most_apart_s(scenario: Scenario) -> float:
    """The most by which two clocks differ that guard and tolerances cover (s)."""
    return max([feature.apart_s(scenario) for feature in used_in(scenario)], default=0.0)


def least_guard_s(scenario: Scenario) -> float:
    """The time in which a packet travels over the whole range, and by which two clocks may differ (s)."""
    return scenario.communication.range_m / scenario_sound_speed_mps(scenario) + most_apart_s(scenario)


def guard_s(scenario: Scenario) -> float:
    """The guard of a slot: as given, or the least (s)."""
    given_s = scenario.communication.guard_s
    return least_guard_s(scenario) if given_s is None else given_s


def guard_faults(scenario: Scenario) -> list[ConfigurationFault]:
    """A guard in which packets of one slot run into the next."""
    given_s, least_s = scenario.communication.guard_s, least_guard_s(scenario)
    if given_s is None or given_s >= least_s - ROUNDING_S:
        return []
    range_m, speed_mps = scenario.communication.range_m, scenario_sound_speed_mps(scenario)
    apart_s = most_apart_s(scenario)
    allowed = (
        f"{least_s:.4g} s or more: communication.range_m = {range_m:g} at {speed_mps:g} m/s takes "
        f"{range_m / speed_mps:.4g} s, and clocks differ by communication.clocks.apart_s = {apart_s:g} s; "
        "leave the key out, or lower one of these"
    )
    return [ConfigurationFault("communication.guard_s", f"{given_s:g}", allowed)]
