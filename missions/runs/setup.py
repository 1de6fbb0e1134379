"""Setup: all that follows from a scenario, resolved once; a run only connects it."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from exchange.acoustics.channel import BroadcastChannel, Channel
from exchange.acoustics.modems import Modem, modems
from exchange.codec import Codec
from exchange.manager import ExchangeManager
from exchange.policies import AckPolicy
from exchange.schedule import TdmaSchedule
from missions.metric import Metric, collected
from missions.runs.metrics import CORE_METRICS
from missions.runs.needs import needs_of_all, priorities, subjects_of
from missions.runs.refusals import refuse_malformed, refuse_undivided
from missions.runs.sea import actual, sea_of
from missions.scenarios.bans import ban_words
from missions.scenarios.deployment import deployment_of, sound_speed_mps
from missions.scenarios.equipment import common_equipment
from missions.scenarios.knowledge import pruning_of
from missions.scenarios.obligations import obligations_of
from missions.scenarios.ontologies import sources_of
from missions.scenarios.parts import database_of, groups_of, mission_class, strategy_of
from missions.scenarios.policy import policy_of
from missions.scenarios.scenario import Scenario, StrategyTable
from remoras.beliefs import Beliefs
from remoras.database import AUVDatabase, VehicleData
from remoras.errors import PluginError
from remoras.executive.layer import ExecutiveLayer
from remoras.executive.satisfaction import DecisionConstants
from remoras.faults import Fault, drawn
from remoras.fleet import Fleet
from remoras.functional.layer import FunctionalLayer
from remoras.mission import Mission
from remoras.obligations import Obligations
from remoras.picture import Picture
from remoras.plugins import faults_of
from remoras.radio import Radio
from remoras.recorder import Recorder, Table
from remoras.sensor import Sensor
from remoras.social.agreement import Agreement, agree
from remoras.social.layer import SocialLayer
from remoras.social.needs import GroupNeeds, Subjects
from remoras.social.negotiation import ROLE_ATTRIBUTES
from remoras.strategy import Declaration, Strategy
from remoras.vehicle import Layers, Vehicle
from remoras.work import Point
from worldmodel import (
    Instance,
    PropertyValue,
    TBox,
    UnknownNameError,
    WorldModel,
    core_ontology_paths,
    read_tbox,
)

SPARE_ITEMS = 1024
"""Items of a vehicle beside its observations and what its strategy states in every round: assignments, findings."""


@dataclass(frozen=True)
class Setup:
    """A scenario resolved. Nothing in it changes in a run, so any number of runs may share it.

    Attributes:
        scenario: what it follows from.
        mission: the mission of the scenario; strategy: with its parameters; policy: of acknowledgement.
        tbox: core ontology and the mission's vocabulary; instances: what the whole fleet has names for.
        common_facts: what all know before the mission: which equipment is part of which vehicle.
        database: vehicles as the fleet knows them; agreement: what they agree on before the mission.
        rally_points_m: by name; bounds_m: area of operations (x_min, y_min, x_max, y_max).
        modem, schedule, codec: of the exchange.
        urgency: priority of each attribute that is exchanged, by uid; subjects: what it is told of, where needs follow
            from groups.
        decision: constants of the executive layer; metrics: of its runs, by name.
    """

    scenario: Scenario
    mission: Mission
    strategy: Strategy
    policy: AckPolicy
    tbox: TBox
    instances: tuple[Instance, ...]
    common_facts: tuple[PropertyValue, ...]
    database: AUVDatabase
    agreement: Agreement
    rally_points_m: dict[str, Point]
    bounds_m: tuple[float, float, float, float]
    modem: Modem
    schedule: TdmaSchedule
    codec: Codec
    urgency: Mapping[int, int]
    subjects: Subjects | None
    decision: DecisionConstants
    metrics: Mapping[str, Metric]

    @property
    def nodes(self) -> dict[str, int]:
        """Node of each vehicle."""
        return {name: data.node for name, data in self.database.items()}


def resolved(scenario: Scenario, strategy: Strategy | None = None) -> Setup:
    """The setup of a scenario.

    Args:
        scenario: the whole input.
        strategy: takes the place of the one that the scenario names.

    Raises:
        ConfigurationError: nobody is there to lead a group, a metric has no direction, or two have one name.
        PluginError: a sensor cannot be made, or two tables of one name have other columns.
    """
    mission_type = mission_class(scenario.scenario.mission)
    mission = mission_type.from_scenario(scenario)
    if strategy is None:
        strategy = strategy_of(scenario)
    else:
        scenario = scenario.model_copy(update={"strategy": StrategyTable(name=strategy.name)})
    policy = policy_of(scenario.communication.policy)
    given, words = sources_of(scenario.worldmodel.ontology_text), ban_words(scenario)
    tbox = read_tbox(*core_ontology_paths(), *mission.vocabulary_used, *given, *words)
    database, groups = database_of(scenario, mission_type), groups_of(scenario)
    instances = _instances(scenario, mission, tbox)
    equipment, common_facts = common_equipment(scenario, mission_type.sensors, tbox, instances)
    # nobody tells facts about equipment, so it needs no names on the wire unless new instances come behind it
    n_named = len(instances) + (len(equipment) if mission.instances_found_per_vehicle else 0)
    instances += equipment
    modem, world = modems()[scenario.communication.modem], scenario.world
    packet_s = modem.packet_s(modem.payload_bits)
    schedule = TdmaSchedule.for_range(
        len(database), packet_s, scenario.communication.range_m, sound_speed_mps(scenario)
    )
    agreement = agree(strategy, mission, database, groups, scenario.scenario.duration_s)
    refuse_malformed(scenario, agreement)
    refuse_undivided(scenario, strategy, agreement, database)
    _recorder(mission, [sensors_of(data) for data in database.values()])
    urgency = priorities(scenario, strategy, mission, tbox)
    return Setup(
        scenario=scenario,
        mission=mission,
        strategy=strategy,
        policy=policy,
        tbox=tbox,
        instances=instances,
        common_facts=common_facts,
        database=database,
        agreement=agreement,
        rally_points_m={rally.name: rally.position_m for rally in scenario.rally_point},
        bounds_m=(world.x_m[0], world.y_m[0], world.x_m[1], world.y_m[1]),
        modem=modem,
        schedule=schedule,
        codec=_codec(scenario, mission, strategy, policy, tbox, n_named, schedule, urgency),
        urgency=urgency,
        subjects=subjects_of(scenario, mission, tbox, instances, database, agreement),
        decision=scenario.decision.constants(schedule.frame_s),
        metrics=collected(scenario.scenario.mission, (*CORE_METRICS, *mission_type.metrics)),
    )


def _instances(scenario: Scenario, mission: Mission, tbox: TBox) -> tuple[Instance, ...]:
    """What the whole fleet has names for; a vehicle's uid is its node index."""
    vehicles = sorted(scenario.vehicle, key=lambda vehicle: vehicle.slot)
    named: list[tuple[str, str]] = [(v.vehicle_type, v.name) for v in vehicles]
    named += [("Group", group.name) for group in scenario.group]
    named += [("Role", f"{group.name}.{role.name}") for group in scenario.group for role in group.role]
    named += mission.instances
    named += [("RallyPoint", rally.name) for rally in scenario.rally_point]
    named += [("Mission", name) for name in mission.group_missions]
    try:
        return tuple(Instance(uid, tbox.class_named(kind).uid, name) for uid, (kind, name) in enumerate(named))
    except UnknownNameError as error:
        raise PluginError(f"mission {scenario.scenario.mission}: instances: {error}") from error


def _codec(
    scenario: Scenario,
    mission: Mission,
    strategy: Strategy,
    policy: AckPolicy,
    tbox: TBox,
    n_instances: int,
    schedule: TdmaSchedule,
    exchanged: Collection[int],
) -> Codec:
    """The codec that all vehicles of the scenario share; its numbers are as wide as the whole mission needs them."""
    duration_s, resolution_s = scenario.scenario.duration_s, scenario.communication.time_resolution_s
    horizon_s = resolution_s * (int(duration_s / resolution_s) + 1)
    n_frames = int(duration_s / schedule.frame_s) + 1
    stated = _items_per_round(strategy.declaration, tbox) * max(1, len(mission.jobs))
    n_items = stated * n_frames + mission.most_observations + SPARE_ITEMS
    n_names = n_instances + schedule.n_nodes * mission.instances_found_per_vehicle
    return Codec(tbox, n_names, schedule.n_nodes, policy, n_items, round(horizon_s, 9), resolution_s, exchanged)


def _items_per_round(declaration: Declaration, tbox: TBox) -> int:
    """Items that a vehicle states in a round for each job; none if all it states there beside roles is status."""
    own = [a for a in tbox.attributes if a.name in declaration.messages and a.name not in ROLE_ATTRIBUTES]
    return 0 if own and all(attribute.latest_only for attribute in own) else declaration.blocks_per_round


def sensors_of(data: VehicleData) -> dict[str, Sensor]:
    """The sensors of a vehicle by name, made anew.

    Raises:
        PluginError: one cannot be made, or lacks a part of the seam.
    """
    made: dict[str, Sensor] = {}
    for settings in data.sensors:
        where = f"sensor {settings.name} of {data.name}"
        try:
            sensor = settings.make(data)
        except Exception as error:  # it may be somebody else's class
            raise PluginError(f"{where}: make(data) raised {type(error).__name__}: {error}") from error
        faults = list(faults_of(sensor, Sensor, ("table", "sense")))
        if not faults and not isinstance(sensor.table, Table | None):
            faults = [f"table is {type(sensor.table).__name__}; expected a remoras.Table, or None if it writes none"]
        if faults:
            raise PluginError(f"{where}: {'; '.join(faults)}")
        made[settings.name] = sensor
    return made


def _recorder(mission: Mission, sensors: Iterable[Mapping[str, Sensor]]) -> Recorder:
    """A recorder with the tables of the mission and its sensors."""
    tables = [sensor.table for of_one in sensors for sensor in of_one.values() if sensor.table is not None]
    return Recorder([*mission.tables, *tables])


def channel_of(setup: Setup, seed: int) -> BroadcastChannel:
    """The channel of the scenario, with the draws of a seed."""
    scenario, deployment = setup.scenario, deployment_of(setup.scenario)
    model = scenario.channel.settings()
    return BroadcastChannel(
        setup.modem,
        scenario.channel.link_model(deployment, seed),
        seed,
        sound_speed_mps=sound_speed_mps(scenario),
        range_m=scenario.communication.range_m,
        blackouts=scenario.channel.blackouts(setup.nodes),
        depths_m=deployment.depths_m if model.counts_depth else (),
        carries_beyond_range=model.carries_beyond_range,
    )


def faults_in(setup: Setup, seed: int) -> tuple[Fault, ...]:
    """What befalls the vehicles in the run with that seed."""
    scenario = setup.scenario
    declared = [table.declared() for table in scenario.fault]
    organisation = setup.agreement.organisation
    return drawn(declared, seed, setup.database, organisation, scenario.scenario.duration_s)


def assemble(setup: Setup, seed: int, channel: Channel | None = None) -> Fleet:
    """A fleet ready to run.

    Args:
        setup: the scenario resolved.
        seed: root of all draws.
        channel: replaces the scenario's, for tests and experiments.
    """
    scenario, mission = setup.scenario, setup.mission
    fleet = [actual(data, scenario.uncertainty.speed_spread, seed) for data in setup.database.values()]
    sensors = [sensors_of(real) for real in fleet]
    recorder = _recorder(mission, sensors)
    world = mission.world(seed)
    if setup.strategy.declaration.is_bound:
        setup = _known_as_it_is(setup, fleet)

    def make(model: Fleet) -> Sequence[Vehicle]:
        return [
            _vehicle(model, setup, real, own, world, recorder, seed) for real, own in zip(fleet, sensors, strict=True)
        ]

    return Fleet(
        make,
        channel if channel is not None else channel_of(setup, seed),
        setup.modem,
        setup.schedule,
        mission.truth(recorder, world),
        recorder,
        scenario.scenario.tick_s,
        scenario.scenario.duration_s,
        faults_in(setup, seed),
        scenario.guidance.separation_m,
        Obligations(owed, mission.jobs, recorder) if (owed := obligations_of(scenario)) else None,
        [table.declared() for table in scenario.ban],
    )


def _lease_frames(declaration: Declaration, lease_frames: int) -> float:
    """TDMA frames after which a silent vehicle is taken to have left: at once in a bound, never where nobody speaks."""
    if declaration.is_bound:
        return 2.0
    return lease_frames if declaration.communicates else math.inf


def _known_as_it_is(setup: Setup, fleet: Sequence[VehicleData]) -> Setup:
    """The setup of a bound: all know how fast each vehicle really is, and have agreed on that."""
    database, scenario = AUVDatabase(tuple(fleet)), setup.scenario
    agreement = agree(setup.strategy, setup.mission, database, groups_of(scenario), scenario.scenario.duration_s)
    return replace(setup, database=database, agreement=agreement)


def world_model(setup: Setup, node: int) -> WorldModel:
    """The world model of the vehicle with that node, before it knows anything."""
    kept = setup.scenario.worldmodel
    return WorldModel(
        setup.tbox,
        node,
        setup.instances,
        setup.scenario.communication.time_resolution_s,
        n_origins=setup.schedule.n_nodes,
        run_time_instances_per_origin=setup.mission.instances_found_per_vehicle,
        common_facts=setup.common_facts,
        clock_tolerance_s=setup.scenario.communication.clock_tolerance_s,
        waiting_s=kept.waiting_s,
        waiting_blocks=kept.waiting_blocks,
        pruning=pruning_of(setup.scenario, setup.tbox),
    )


def _vehicle(
    fleet: Fleet,
    setup: Setup,
    real: VehicleData,
    sensors: dict[str, Sensor],
    world: Any,
    recorder: Recorder,
    seed: int,
) -> Vehicle:
    """A vehicle that believes what the fleet knows of it, and moves as it really is."""
    data = setup.database[real.name]
    communication, mission = setup.scenario.communication, setup.mission
    model = world_model(setup, data.node)
    beliefs, picture = Beliefs(model), Picture(frame_s=setup.schedule.frame_s)
    subjects, organisation = setup.subjects, setup.agreement.organisation
    by_groups = None if subjects is None else GroupNeeds(setup.tbox, setup.urgency, subjects, organisation)
    manager = ExchangeManager(
        data.node,
        model,
        setup.codec,
        setup.schedule,
        setup.policy,
        setup.modem.payload_bits,
        by_groups or needs_of_all(setup.tbox, setup.urgency, len(setup.database)),
        communication.carrier_evidence,
        by_groups is not None,
    )
    declaration = setup.strategy.declaration
    return Vehicle(
        fleet,
        data,
        Layers(
            SocialLayer(
                data.name,
                setup.database,
                beliefs,
                mission,
                setup.strategy,
                setup.agreement,
                setup.rally_points_m,
                picture,
                _lease_frames(declaration, communication.lease_frames) * setup.schedule.frame_s,
                setup.scenario.scenario.duration_s,
            ),
            ExecutiveLayer(setup.decision),
            FunctionalLayer(
                real,
                mission,
                world,
                sensors,
                setup.bounds_m,
                picture,
                setup.scenario.guidance.constants(),
                sea_of(setup.scenario, data, seed),
            ),
        ),
        Radio(
            setup.database.names,
            setup.agreement.groups,
            declaration,
            manager,
            beliefs,
            picture.peers,
            recorder,
            by_groups,
        ),
        beliefs,
        recorder,
    )
