"""Assembly: a fleet, and each of its vehicles, from a setup and a seed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from exchange.acoustics.channel import BroadcastChannel, Channel
from exchange.codec import renewed
from exchange.manager import ExchangeManager
from exchange.peers import Upkeep
from missions.runs.clocks import clocks_of, disciplines, own_recorder, timekeeper_of
from missions.runs.needs import needs_at_start, needs_of_all
from missions.runs.sea import actual, sea_of
from missions.runs.sensors import recorder_of_mission, sensors_of
from missions.runs.setup import Setup
from missions.runs.worlds import world_model
from missions.scenarios.deployment import deployment_of, sound_speed_mps
from missions.scenarios.obligations import obligations_of
from missions.scenarios.parts import groups_of
from missions.scenarios.slots import new_slots
from missions.scenarios.values import value_rule_of
from remoras.beliefs import Beliefs
from remoras.database import AUVDatabase, VehicleData
from remoras.detail import Detail
from remoras.executive.layer import ExecutiveLayer
from remoras.faults import Fault, drawn
from remoras.fleet import Fleet
from remoras.functional.layer import FunctionalLayer
from remoras.obligations import Obligations
from remoras.own_clock import OwnClock
from remoras.picture import Picture
from remoras.radio import Radio
from remoras.recorder import Recorder
from remoras.sensor import Sensor
from remoras.social.agreement import agree
from remoras.social.layer import SocialLayer
from remoras.social.needs import GroupNeeds
from remoras.social.stated_needs import NeedsInForce
from remoras.solo import Solo
from remoras.strategy import Declaration
from remoras.vehicle import Layers, Vehicle, go_on


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


def assemble(setup: Setup, seed: int, channel: Channel | None = None, salt: bytes | None = None) -> Fleet:
    """A fleet ready to run.

    Args:
        setup: the scenario resolved.
        seed: root of all draws.
        channel: replaces the scenario's, for tests and experiments.
        salt: of the packets of a scenario with a key, a fresh one if None. Never take one twice but to open what was
            sent under it.
    """
    if setup.scenario.communication.key_file:
        setup = replace(setup, codec=renewed(setup.codec, None if salt is None else lambda sender: salt))
    scenario, mission = setup.scenario, setup.mission
    fleet = [actual(data, scenario.uncertainty.speed_spread, seed) for data in setup.database.values()]
    sensors = [sensors_of(real) for real in fleet]
    recorder, clocks = recorder_of_mission(mission, sensors), clocks_of(scenario, seed)
    world = mission.world(seed)
    if setup.strategy.declaration.is_bound:
        setup = _known_as_it_is(setup, fleet)

    def make(model: Fleet) -> Sequence[Vehicle]:
        return [
            vehicle_of(model, setup, real, own, world, recorder, seed, clock)
            for real, own, clock in zip(fleet, sensors, clocks, strict=True)
        ]

    def make_anew(model: Fleet, before: Vehicle, fault: Fault) -> Vehicle:
        data, epoch, clock = before.functional.data, before.beliefs.model.epoch + 1, clocks[before.data.node]
        now_s = clock.reads(model.now_s)
        anew = vehicle_of(model, setup, data, sensors_of(data), world, recorder, seed, clock, now_s, epoch)
        go_on(anew, before, now_s, fault.keeps_memory)
        return anew

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
        make_anew,
        clocks,
        setup.stated,
        new_slots(scenario),
        seed,
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


def vehicle_of(
    fleet: Fleet | Solo,
    setup: Setup,
    real: VehicleData,
    sensors: dict[str, Sensor],
    world: Any,
    recorder: Recorder,
    seed: int,
    clock: OwnClock,
    began_s: float = 0.0,
    epoch: int = 0,
) -> Vehicle:
    """A vehicle that believes what the fleet knows of it, and moves as it really is.

    Args:
        clock: its own; began_s: when it begins, by that.
        epoch: how often it has begun anew.
    """
    data = setup.database[real.name]
    timekeeper = timekeeper_of(setup, data.node, clock, recorder)
    recorder = own_recorder(clock, recorder, disciplines(setup.scenario))
    communication, mission = setup.scenario.communication, setup.mission
    model = world_model(setup, data.node, epoch)
    picture = Picture(frame_s=setup.schedule.frame_s)
    subjects, organisation = setup.subjects, setup.agreement.organisation
    by_groups = None if subjects is None else GroupNeeds(setup.tbox, setup.urgency, subjects, organisation)
    common = by_groups or needs_of_all(setup.tbox, setup.urgency, len(setup.database))
    agreed = needs_at_start(setup.scenario, setup.stated, setup.instances, setup.nodes)
    needs = None if agreed is None else NeedsInForce(model, common, agreed, setup.on_demand)
    manager = ExchangeManager(
        data.node,
        model,
        setup.codec,
        setup.schedule,
        setup.policy,
        setup.modem.payload_bits,
        needs or common,
        communication.carrier_evidence,
        by_groups is not None,
        value_rule_of(communication.value),
        communication.queue_limit,
        upkeep=Upkeep(communication.summaries, communication.parking),
    )
    above = communication.coarse_above
    beliefs = Beliefs(model, Detail(setup.tbox, lambda: len(manager.queue), above) if above else None)
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
                sea_of(setup.scenario, data, seed, fleet.carried_m),
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
            needs or by_groups,
            {one.node: max(one.transit_speed_mps, one.survey_speed_mps) for one in setup.database.values()},
            [one for table in setup.scenario.covert if (one := table.declared()).vehicle == data.name],
        ),
        beliefs,
        recorder,
        began_s,
        timekeeper,
    )
