"""A vehicle in one run as it really is, and the sea around it, with the draws of a seed."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from exchange.acoustics import loss
from exchange.arithmetic import TAU
from missions.scenarios.scenario import Scenario
from remoras.database import VehicleData
from remoras.navigation import Beacon, Navigation, NavigationConstants
from remoras.sea import Sea
from remoras.work import Point

CarriedM = Callable[[str, str | None], Point | None]


def actual(data: VehicleData, spread: float, seed: int) -> VehicleData:
    """The vehicle as it really is in the run with that seed: somewhat slower or faster than its data.

    The draw is keyed by seed and node, in a stream of its own: no strategy, policy or channel changes it.
    """
    if spread == 0.0:
        return data
    return data.faster(1.0 + spread * (2.0 * loss.uniform(seed, loss.SPEEDS, data.node, 0, 0) - 1.0))


def sea_of(scenario: Scenario, data: VehicleData, seed: int, carried_m: CarriedM) -> Sea:
    """The sea around a vehicle; draws are keyed by seed and node, in streams of their own.

    Args:
        scenario: the whole input.
        data: of the vehicle.
        seed: root of all draws.
        carried_m: where a beacon is that a vehicle carries, see ``Fleet.carried_m``.
    """
    return Sea(
        scenario.current.water(seed), _navigation(scenario, data, seed, carried_m), _misses(scenario, data, seed)
    )


def _navigation(scenario: Scenario, data: VehicleData, seed: int, carried_m: CarriedM) -> Navigation | None:
    table = scenario.navigation
    if table.drift == 0.0:
        return None
    beacons = tuple(
        Beacon(
            beacon.position_m or partial(carried_m, beacon.vehicle or "", beacon.sensor),
            beacon.range_m,
            beacon.vehicle or "",
        )
        for beacon in scenario.beacon
        if beacon.vehicle != data.name
    )

    def direction_rad(n_way: int) -> float:
        return TAU * loss.uniform(seed, loss.DRIFTS, n_way, data.node, 0)

    constants = NavigationConstants(table.drift, table.fix_s, beacons, table.vertical_speed_mps)
    return Navigation(constants, data.depth_m, direction_rad)


def _misses(scenario: Scenario, data: VehicleData, seed: int) -> Callable[[str, float], bool] | None:
    p_miss, tick_s = scenario.uncertainty.p_miss, scenario.scenario.tick_s
    if p_miss == 0.0:
        return None
    numbers = {settings.name: number for number, settings in enumerate(data.sensors)}

    def misses(sensor: str, now_s: float) -> bool:
        return loss.uniform(seed, loss.MISSES, round(now_s / tick_s), data.node, numbers[sensor]) < p_miss

    return misses
