"""Sampling: what seeds draw for single settings of a scenario, as values by dotted key."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import combinations, pairwise
from typing import Any

from exchange.acoustics.acoustic import AcousticChannel
from exchange.acoustics.network import shipped
from missions.feature import USUAL_S, Draws, Sample
from missions.scenarios.deployment import deployment_of
from missions.scenarios.parts import strategy_of
from missions.scenarios.scenario import Scenario, VehicleTable
from remoras.strategies import parameters, strategies
from stress.ways import NEARLY_CUT

Drawn = Mapping[str, Any]
"""Values by dotted key; empty where the scenario has nothing that could be set."""


def choice_of(key: str, *values: Any) -> Sample:
    """Draws one value of a key."""
    return lambda draws, scenario: {key: draws.one_of(values)}


def _vehicle(draws: Draws, scenario: Scenario) -> VehicleTable:
    return draws.one_of(sorted(scenario.vehicle, key=lambda vehicle: vehicle.slot))


def channel(draws: Draws, scenario: Scenario) -> Drawn:
    """A loss model with its settings."""
    match draws.one_of(("bernoulli", "bernoulli", "gilbert-elliott", "acoustic", "matrix", "perfect")):
        case "bernoulli":
            return {"channel.name": "bernoulli", "channel.per": draws.even(0.05, 0.8)}
        case "gilbert-elliott":
            return {
                "channel.name": "gilbert-elliott",
                "channel.p_good_to_bad": draws.even(0.02, 0.3),
                "channel.p_bad_to_good": draws.even(0.05, 0.5),
                "channel.per_good": draws.even(0.0, 0.2),
                "channel.per_bad": draws.even(0.5, 1.0),
            }
        case "acoustic":
            return {
                "channel.name": "acoustic",
                "channel.wind_mps": draws.even(0.0, 15.0),
                "channel.shipping": draws.even(0.0, 1.0),
                "channel.fading": draws.one_of(("bit", "frame", "packet", "none")),
            }
        case "matrix":
            pairs = [
                (name, other) for name in scenario.names_by_slot for other in scenario.names_by_slot if name != other
            ]
            links = [
                {"sender": one, "receiver": other, "per": draws.even(0.0, 0.9)}
                for one, other in draws.some_of(pairs, 1 + int(draws.uniform() * len(pairs)))
            ]
            return {"channel.name": "matrix", "channel.per": draws.even(0.0, 0.3), "channel.link": links}
    return {"channel.name": "perfect"}


def topology(draws: Draws, scenario: Scenario) -> Drawn:
    """A sea in which links are nearly cut for the whole run, while news gets to all by some way."""
    names = draws.some_of(scenario.names_by_slot, len(scenario.vehicle))
    if len(names) < FEWEST_WITH_A_WAY:
        return {}
    shape = draws.one_of(("link", "links", "line", "halves", "star", "network"))
    fitting = [network for network in shipped().values() if len(network.nodes) >= len(names)]
    if shape == "network" and fitting:
        network = draws.one_of(fitting)
        nodes = dict(zip(names, draws.some_of(sorted(network.nodes), len(names)), strict=True))
        return {"channel.name": "network", "channel.network": network.name, "channel.nodes": nodes}
    line, half = [*pairwise(names)], {*names[: len(names) // 2]}
    beside = [pair for pair in combinations(names, 2) if pair not in line]
    cut = {
        "link": draws.some_of(beside, 1),
        "links": draws.some_of(beside, 1 + int(draws.uniform() * len(beside))),
        "halves": [pair for pair in beside if len(half.intersection(pair)) == 1],
        "star": [pair for pair in combinations(names, 2) if names[0] not in pair],
    }.get(shape, beside)
    links = []
    for one, other in cut:
        ways = [(one, other), (other, one)]
        for sender, receiver in (
            ways if shape not in ("link", "links") or draws.uniform() < 0.5 else draws.some_of(ways, 1)
        ):
            per = draws.one_of((1.0, draws.even(NEARLY_CUT, 1.0), draws.even(NEARLY_CUT, 1.0)))
            links.append({"sender": sender, "receiver": receiver, "per": per})
    return {"channel.name": "matrix", "channel.per": draws.even(0.0, 0.3), "channel.link": links}


def site(draws: Draws, scenario: Scenario) -> Drawn:
    """A site, where the channel is acoustic, with sources so faint that it matters on the ways of this ground."""
    channel = scenario.channel.settings()
    if not isinstance(channel, AcousticChannel) or not scenario.rally_point:
        return {}
    ways_m = [
        math.dist(vehicle.start_m, point.position_m) for vehicle in scenario.vehicle for point in scenario.rally_point
    ]
    heard = channel.model_copy(update={"source_level_db": LOUD_DB, "acoustic_power_w": None})
    snr_db = heard.budget(deployment_of(scenario)).snr_db(max(*ways_m, 1.0))
    return {
        "channel.source_level_db": round(max(FAINTEST_DB, LOUD_DB - snr_db + draws.even(-12.0, 3.0)), 1),
        "channel.site.spread_db": draws.even(1.0, 12.0),
        "channel.site.distance_m": draws.scaled(20.0, 500.0),
        "channel.site.time_h": draws.scaled(0.02, 2.0),
        "channel.site.receiver_db": draws.one_of((0.0, draws.even(1.0, 6.0))),
    }


LOUD_DB, FAINTEST_DB = 170.0, 100.0
"""Source levels: one from which others are counted, and the least that a scenario may have."""
FEWEST_WITH_A_WAY = 3
"""Vehicles of which two may be joined by a third."""


def blackout(draws: Draws, scenario: Scenario) -> Drawn:
    """A time without communication, of all or of a vehicle."""
    from_s = draws.even(0.0, USUAL_S)
    blackout: dict[str, Any] = {"from_s": from_s, "until_s": from_s + draws.even(10.0, 200.0)}
    if draws.uniform() < 0.5:
        blackout["vehicle"] = draws.one_of(scenario.names_by_slot)
    return {"channel.blackout": [blackout]}


def size(draws: Draws, scenario: Scenario) -> Drawn:
    """Copies of a vehicle."""
    found: dict[str, Any] = {"fleet.size": len(scenario.vehicle) + 1 + int(draws.uniform() * 4)}
    copied = [vehicle.name for vehicle in scenario.vehicle if vehicle.sensor] or scenario.names_by_slot
    return {**found, "fleet.copies_of": draws.one_of(copied), "fleet.layers": draws.uniform() < 0.7}


def speeds(draws: Draws, scenario: Scenario) -> Drawn:
    """A vehicle half to twice as fast."""
    one, factor = _vehicle(draws, scenario), draws.scaled(0.5, 2.0)
    return {
        f"vehicle.{one.name}.transit_speed_mps": round(one.transit_speed_mps * factor, 3),
        f"vehicle.{one.name}.survey_speed_mps": round(one.survey_speed_mps * factor, 3),
    }


def steering(draws: Draws, scenario: Scenario) -> Drawn:
    """A vehicle that turns and gains speed otherwise."""
    one = _vehicle(draws, scenario)
    return {
        f"vehicle.{one.name}.turn_rate_radps": draws.scaled(0.1, 1.0),
        f"vehicle.{one.name}.acceleration_mps2": draws.scaled(0.05, 1.0),
    }


def sensors(draws: Draws, scenario: Scenario) -> Drawn:
    """A vehicle without its sensors, if others have some."""
    able = [vehicle.name for vehicle in scenario.vehicle if vehicle.sensor]
    return {f"vehicle.{draws.one_of(able)}.sensor": []} if len(able) > 1 else {}


def energy(draws: Draws, scenario: Scenario) -> Drawn:
    """A battery for a tenth to four times a mission at survey speed."""
    one = _vehicle(draws, scenario)
    power_w = one.hotel_w + one.drag_w_per_mps3 * one.survey_speed_mps**3
    return {f"vehicle.{one.name}.energy_j": float(f"{power_w * USUAL_S * draws.scaled(0.1, 4.0):.3g}")}


def starts(draws: Draws, scenario: Scenario) -> Drawn:
    """A vehicle that starts elsewhere."""
    one, ((west_m, east_m), (south_m, north_m)) = _vehicle(draws, scenario), (scenario.world.x_m, scenario.world.y_m)
    at_m = [round(draws.between(0.8 * low + 0.2 * high, 0.6 * low + 0.4 * high)) for low, high in
            ((west_m, east_m), (south_m, north_m))]  # fmt: skip
    return {f"vehicle.{one.name}.start_m": at_m}


def social(draws: Draws, scenario: Scenario) -> Drawn:
    """A vehicle without the social layer; not where they tell nothing, so that nobody succeeds a head without it."""
    if not strategy_of(scenario).declaration.tells:
        return {}
    return {f"vehicle.{_vehicle(draws, scenario).name}.social_layer": False}


def draw_priorities(draws: Draws, scenario: Scenario) -> Drawn:
    """Other priorities of three attributes."""
    names = sorted(scenario.communication.needs)
    return {f"communication.needs.{name}": 1 + int(draws.uniform() * 60) for name in draws.some_of(names, 3)}


def information(draws: Draws, scenario: Scenario) -> Drawn:
    """What groups know of their jobs is held by their heads."""
    groups = sorted(group.name for group in scenario.group if any(role.job for role in group.role))
    held = {f'group."{name}".information': "held by head" for name in groups}
    return {"communication.needs_follow": "groups", **held}


def decision(draws: Draws, scenario: Scenario) -> Drawn:
    """One or two numbers of the decision."""
    choices: dict[str, tuple[float, ...]] = {
        "decision.period_s": (1.0, 4.0, 8.0), "decision.weight_external": (0.0, 1.0, 4.0),
        "decision.weight_continuing": (0.0, 0.3), "decision.signal_memory_frames": (1.0, 30.0),
    }  # fmt: skip
    return {key: draws.one_of(choices[key]) for key in draws.some_of(sorted(choices), 1 + int(2 * draws.uniform()))}


def guidance(draws: Draws, scenario: Scenario) -> Drawn:
    """How vehicles keep apart and draw each other."""
    return {
        "guidance.separation_m": draws.one_of((2.0, 5.0, 8.0, 12.0)),
        "guidance.attraction": draws.one_of((0.0, 1.0, 3.0)),
        "guidance.repulsion": draws.one_of((0.0, 2.0, 5.0)),
    }


def of_mission(key: str, low: float, high: float) -> Sample:
    """Draws a key of ``[mission]`` around its value, where the mission has it."""

    def draw(draws: Draws, scenario: Scenario) -> Drawn:
        value = getattr(scenario.mission, key, None)
        return {f"mission.{key}": float(f"{value * draws.scaled(low, high):.3g}")} if value else {}

    return draw


def parameter(draws: Draws, scenario: Scenario) -> Drawn:
    """One number of the strategy, half or twice as much."""
    own = strategies().get(scenario.strategy.name)
    numbers = [(declared.name, declared.default) for declared in parameters(own)] if own is not None else []
    numbers = [(name, value) for name, value in numbers if type(value) in (int, float)]
    if not numbers:
        return {}
    name, usual = draws.one_of(numbers)
    value = float(usual) * draws.one_of((0.5, 2.0))
    return {f"strategy.parameters.{name}": max(1, int(value)) if type(usual) is int else value}
