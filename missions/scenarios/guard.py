"""The guard of a slot: the silence in which a packet travels to whoever is farthest, by clocks that may differ."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.errors import ConfigurationFault
from missions.scenarios.deployment import scenario_sound_speed_mps
from missions.scenarios.extending import used_in

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario

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
