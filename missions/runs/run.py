"""From a scenario to a fleet, and one run of it."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from exchange.acoustics import loss
from exchange.acoustics.channel import BroadcastChannel, Channel
from exchange.acoustics.modems import modems
from exchange.codec import Codec
from exchange.manager import ExchangeManager
from exchange.schedule import TdmaSchedule
from missions.errors import ConfigurationError, ConfigurationFault
from missions.mapping.survey import Point
from missions.scenarios.checks import named_object
from missions.scenarios.policy import policy_of
from missions.scenarios.scenario import Scenario, VehicleTable
from remoras.beliefs import Beliefs
from remoras.database import AUVDatabase, VehicleData
from remoras.executive.layer import ExecutiveLayer
from remoras.fleet import Fleet
from remoras.functional.layer import FunctionalLayer
from remoras.mission import Milestone, Mission
from remoras.organisation import Group, Organisation, RoleSpecification
from remoras.recorder import Recorder
from remoras.sensors import MappingSensor, Seabed
from remoras.social.agreement import agree
from remoras.social.layer import SocialLayer
from remoras.social.negotiation import negotiated_attributes
from remoras.strategies import Strategy, configured, strategies
from remoras.vehicle import Vehicle
from worldmodel import InformationNeed, Instance, NeedsIndex, TBox, WorldModel, core_ontology_paths

STATUS_PER_FRAME = 2
"""Status blocks (position, battery) that a vehicle records in a TDMA frame."""
SPARE_BLOCKS = 1024
"""Blocks of a vehicle that are neither status nor mapped cells: assignments, findings."""


@dataclass(frozen=True)
class Run:
    """A finished run, before anything is written."""

    scenario: Scenario
    seed: int
    recorder: Recorder
    milestones: tuple[Milestone, ...]
    completed: bool
    reason: str
    end_s: float
    n_false_beliefs: int
    distance_m: float
    wall_s: float


def vehicle_data(table: VehicleTable, j_per_bit: float) -> VehicleData:
    """Static data of a vehicle from its table; without a sensor it maps nothing."""
    fields = table.model_dump(exclude={"sensor", "slot"})
    sensor = table.sensor
    return VehicleData(
        **fields,
        node=table.slot,
        transmit_j_per_bit=j_per_bit,
        swath_m=sensor.swath_m if sensor else 0.0,
        sensor_speed_mps=sensor.speed_limit_mps if sensor else table.survey_speed_mps,
    )


def transmit_j_per_bit(scenario: Scenario) -> float:
    """Energy of the modem for each bit that it sends: its power while it sends over its bit rate."""
    return scenario.communication.transmit_power_w / modems()[scenario.communication.modem].rate_bps


def groups_of(scenario: Scenario) -> tuple[Group, ...]:
    """Groups with the demands of their roles."""
    return tuple(
        Group(
            group.name,
            tuple(
                RoleSpecification(
                    role.name,
                    role.minimum,
                    role.maximum,
                    role.head,
                    role.founding,
                    role.area,
                    (role.played_by.split(".")[0], role.played_by.split(".")[1]) if role.played_by else None,
                    role.influences,
                )
                for role in group.role
            ),
            group.rally_point,
            group.mission,
        )
        for group in scenario.group
    )


def mission_of(scenario: Scenario) -> Mission:
    """The mission that the scenario names, made from its parts."""
    factory = named_object(scenario.scenario.mission)
    world = scenario.world
    places = {
        (group.name, role.name): role.position
        for group in scenario.group
        for role in group.role
        if role.position is not None
    }
    mission: Mission = factory(
        factory.Settings.model_validate(scenario.mission),
        groups_of(scenario),
        places,
        {area.name: area.corners_m for area in scenario.area},
        {rally.name: rally.position_m for rally in scenario.rally_point},
        (world.x_m[0], world.y_m[0], world.x_m[1], world.y_m[1]),
        world.cell_m,
    )
    return mission


def strategy_of(scenario: Scenario) -> Strategy:
    name = scenario.strategy.name
    strategy: Strategy = named_object(name) if ":" in name else strategies()[name]
    return configured(strategy, scenario.strategy.parameters)


def actual(data: VehicleData, spread: float, seed: int) -> VehicleData:
    """The vehicle as it really is in the run with that seed: somewhat slower or faster than its data.

    The draw is keyed by seed and node, in a stream of its own: no strategy, policy or channel changes it.
    """
    if spread == 0.0:
        return data
    factor = 1.0 + spread * (2.0 * loss.uniform(seed, loss.SPEEDS, data.node, 0, 0) - 1.0)
    return replace(
        data,
        transit_speed_mps=factor * data.transit_speed_mps,
        survey_speed_mps=factor * data.survey_speed_mps,
        sensor_speed_mps=factor * data.sensor_speed_mps,
    )


def instances_of(scenario: Scenario, tbox: TBox, missions: Sequence[str]) -> tuple[Instance, ...]:
    """What the whole fleet has names for; a vehicle's uid is its node index."""
    vehicles = sorted(scenario.vehicle, key=lambda vehicle: vehicle.slot)
    named: list[tuple[str, str]] = [(v.vehicle_type, v.name) for v in vehicles]
    named += [("Group", group.name) for group in scenario.group]
    named += [("Role", f"{group.name}.{role.name}") for group in scenario.group for role in group.role]
    named += [("Area", area.name) for area in scenario.area]
    named += [("RallyPoint", rally.name) for rally in scenario.rally_point]
    named += [("Mission", mission) for mission in missions]
    return tuple(Instance(uid, tbox.class_named(kind).uid, name) for uid, (kind, name) in enumerate(named))


def needs_of(scenario: Scenario, tbox: TBox) -> NeedsIndex:
    """Every vehicle needs every listed attribute of every instance of its domain.

    What the strategy says is needed most if it is not listed.
    """
    listed = scenario.communication.needs
    strategic = dict.fromkeys(negotiated_attributes(strategy_of(scenario), tbox), max(listed.values()))
    attributes = [(tbox.attribute_named(name), priority) for name, priority in {**strategic, **listed}.items()]
    needs = tuple(InformationNeed(a.uid, priority, class_uid=a.domain) for a, priority in attributes)
    return NeedsIndex(tbox, {vehicle.slot: needs for vehicle in scenario.vehicle})


def schedule_of(scenario: Scenario) -> TdmaSchedule:
    communication = scenario.communication
    modem = modems()[communication.modem]
    return TdmaSchedule.for_range(
        len(scenario.vehicle),
        modem.packet_s(modem.payload_bits),
        communication.range_m,
        scenario.world.sound_speed_mps,
    )


def seabed_of(scenario: Scenario) -> Seabed:
    """The cells of all areas."""
    return _seabed(scenario.world.cell_m, tuple((area.name, area.corners_m) for area in scenario.area))


@lru_cache(maxsize=8)
def _seabed(cell_m: float, corners_m: tuple[tuple[str, tuple[Point, ...]], ...]) -> Seabed:
    """The runs of a study share their ground."""
    return Seabed.of_areas(cell_m, dict(corners_m))


def channel_of(scenario: Scenario, seed: int) -> BroadcastChannel:
    nodes = {vehicle.name: vehicle.slot for vehicle in scenario.vehicle}
    return BroadcastChannel(
        modems()[scenario.communication.modem],
        scenario.channel.link_model(nodes, seed),
        seed,
        sound_speed_mps=scenario.world.sound_speed_mps,
        range_m=scenario.communication.range_m,
        blackouts=scenario.channel.blackouts(nodes),
    )


def codec_of(scenario: Scenario, tbox: TBox, instances: Sequence[Instance]) -> Codec:
    """The codec that all vehicles of the scenario share."""
    communication = scenario.communication
    resolution_s = communication.time_resolution_s
    horizon_s = resolution_s * (int(scenario.scenario.duration_s / resolution_s) + 1)
    policy = policy_of(communication.policy)
    n_frames = int(scenario.scenario.duration_s / schedule_of(scenario).frame_s) + 1
    seabed = seabed_of(scenario)
    stated = strategy_of(scenario).declaration.blocks_per_round * max(1, len(scenario.area))
    n_blocks = (STATUS_PER_FRAME + stated) * n_frames + len(seabed.cells) + SPARE_BLOCKS
    return Codec(tbox, len(instances), len(scenario.vehicle), policy, n_blocks, round(horizon_s, 9), resolution_s)


def _refuse_headless(scenario: Scenario, founding: Organisation) -> None:
    """A group without a head would wait for a mission for ever."""
    faults = [
        ConfigurationFault(f"group.{group}.role.{of_group.head_role}", "", "nobody came to play it before the mission")
        for group, of_group in founding.groups.items()
        if not founding.heads(group)
    ]
    if faults:
        raise ConfigurationError(scenario.scenario.name, faults)


def assemble(scenario: Scenario, seed: int, channel: Channel | None = None) -> Fleet:
    """A fleet ready to run. ``channel`` replaces the scenario's, for tests and experiments."""
    tbox = TBox.read(*core_ontology_paths())
    mission = mission_of(scenario)
    factory = named_object(scenario.scenario.mission)
    instances = instances_of(scenario, tbox, factory.MISSIONS)
    schedule = schedule_of(scenario)
    n_nodes = schedule.n_nodes
    policy = policy_of(scenario.communication.policy)
    resolution_s = scenario.communication.time_resolution_s
    codec = codec_of(scenario, tbox, instances)
    needs = needs_of(scenario, tbox)
    modem = modems()[scenario.communication.modem]
    j_per_bit = transmit_j_per_bit(scenario)
    database = AUVDatabase(tuple(vehicle_data(table, j_per_bit) for table in scenario.vehicle))
    strategy = strategy_of(scenario)
    agreement = agree(strategy, mission, database, groups_of(scenario))
    _refuse_headless(scenario, agreement.organisation)
    seabed = seabed_of(scenario)
    recorder = Recorder()
    world = scenario.world
    bounds_m = (world.x_m[0], world.y_m[0], world.x_m[1], world.y_m[1])

    def make_vehicle(fleet: Fleet, data: VehicleData) -> Vehicle:
        model = WorldModel(tbox, data.node, instances, resolution_s, n_origins=n_nodes, run_time_instances_per_origin=0)
        beliefs = Beliefs(model)
        real = actual(data, scenario.uncertainty.speed_spread, seed)
        sensor = MappingSensor(seabed, real.swath_m, real.sensor_speed_mps)
        return Vehicle(
            fleet,
            data,
            SocialLayer(data.name, database, beliefs, mission, strategy, agreement),
            ExecutiveLayer(scenario.decision.constants(schedule.frame_s)),
            FunctionalLayer(real, sensor, bounds_m, mission.behaviour_for, schedule.frame_s),
            beliefs,
            ExchangeManager(
                data.node,
                model,
                codec,
                schedule,
                policy,
                modem.payload_bits,
                needs,
                scenario.communication.carrier_evidence,
            ),
            seabed,
            recorder,
        )

    return Fleet(
        lambda fleet: [make_vehicle(fleet, data) for data in database.values()],
        channel if channel is not None else channel_of(scenario, seed),
        schedule,
        mission.truth(),
        recorder,
        scenario.scenario.tick_s,
        scenario.scenario.duration_s,
    )


def run(
    scenario: Scenario,
    seed: int = 1,
    channel: Channel | None = None,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Run a scenario to its end; ``progress`` is told the mission time now and then."""
    began = time.perf_counter()
    fleet = assemble(scenario, seed, channel)
    fleet.run(progress)
    result = Run(
        scenario,
        seed,
        fleet.recorder,
        tuple(fleet.truth.milestones),
        fleet.completed,
        fleet.reason,
        fleet.now_s if fleet.completed else fleet.duration_s,
        fleet.n_false_beliefs,
        sum(vehicle.functional.motion.distance_m for vehicle in fleet.vehicles),
        time.perf_counter() - began,
    )
    fleet.close()
    return result
