"""Assembly of a fleet and its vehicles from a setup and a seed."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from exchange.channel.channel import BroadcastChannel, Channel
from exchange.manager.manager import ExchangeManager, Options
from exchange.wire.codec import renewed
from missions.feature import Joining
from missions.runs.setup import Setup, recorder_of_mission, sensors_of, world_model
from missions.scenarios.communication import value_rule_of
from missions.scenarios.faults import drawn
from missions.scenarios.organisation import groups_of
from remoras.beliefs import Beliefs
from remoras.database import AUVDatabase, VehicleData
from remoras.events import Observer, ShownTime, listening
from remoras.executive.layer import ExecutiveLayer
from remoras.faults import Fault, Faults
from remoras.fleet.fleet import Fleet
from remoras.fleet.radio import Radio, RenewedNeeds
from remoras.fleet.standalone import Solo
from remoras.fleet.traffic import Medium
from remoras.fleet.vehicle import Vehicle
from remoras.functional.layer import FunctionalLayer
from remoras.organisation.membership import Lease
from remoras.organisation.needs import GroupNeeds
from remoras.picture import Picture
from remoras.recorder import Recorder
from remoras.social.agreement import agree
from remoras.social.layer import SocialLayer
from worldmodel import WorldModel


def channel_of(setup: Setup, seed: int) -> BroadcastChannel:
    """Return the scenario's channel, with the draws of a seed."""
    scenario, deployment = setup.scenario, setup.scenario.deployment
    model = scenario.channel.settings()
    return BroadcastChannel(
        setup.modem,
        scenario.channel.link_model(deployment, seed),
        seed,
        sound_speed_mps=scenario.sound_speed_mps,
        range_m=scenario.communication.range_m,
        blackouts=scenario.channel.blackouts(setup.nodes),
        depths_m=deployment.depths_m if model.counts_depth else (),
        carries_beyond_range=model.carries_beyond_range,
    )


def faults_in(setup: Setup, seed: int) -> tuple[Fault, ...]:
    """Return the faults of the run with this seed."""
    scenario = setup.scenario
    organisation = setup.agreement.organisation
    return drawn(scenario.fault, seed, setup.database, organisation, scenario.scenario.duration_s)


@dataclass(frozen=True)
class Shared:
    """Data shared by the vehicles of one run, with its world and its run hooks (observers)."""

    setup: Setup
    seed: int
    world: Any
    recorder: Recorder
    observers: Sequence[Observer]
    vehicle: Callable[..., Vehicle] = Vehicle

    @property
    def clocks(self) -> dict[int, ShownTime]:
        """Clocks that may be wrong, by node."""
        return {node: clock for observer in self.observers for node, clock in observer.clocks.items()}


class VehicleLife(NamedTuple):
    """Incarnation of a vehicle: true data, start by its own clock, number of earlier restarts."""

    real: VehicleData
    began_s: float = 0.0
    epoch: int = 0


def actual(setup: Setup, data: VehicleData, seed: int) -> VehicleData:
    """Apply the features' deviations in the run with this seed to the data of a vehicle."""
    for feature in setup.features:
        data = feature.real(setup.scenario, data, seed)
    return data


def assemble(
    setup: Setup,
    seed: int,
    channel: Channel | None = None,
    vehicle: Callable[..., Vehicle] = Vehicle,
) -> Fleet:
    """Assemble a fleet ready to run; in tests, ``channel`` replaces the scenario's, ``vehicle`` makes the vehicles."""
    if setup.scenario.communication.key_file:
        # Several runs may share a setup: a fresh salt keeps nonces unique under the key.
        setup = replace(setup, codec=renewed(setup.codec))
    scenario, mission = setup.scenario, setup.mission
    if scenario.for_seed(seed) is not scenario:
        raise ValueError("the ground differs by seed: resolve the scenario that its for_seed returns")
    fleet = [actual(setup, data, seed) for data in setup.database.values()]
    recorder = recorder_of_mission(mission, [sensors_of(real) for real in fleet])
    if setup.strategy.declaration.sharing is not None:
        # Instant sharing is the upper bound: its vehicles know the true data of the fleet.
        setup = _known_as_it_is(setup, fleet)
    world = mission.world(seed)
    shared = Shared(setup, seed, world, recorder, feature_observers(setup, recorder, seed), vehicle)

    faults, times = faults_in(setup, seed), scenario.scenario
    carrier: Channel = channel if channel is not None else channel_of(setup, seed)
    for observer in shared.observers:
        carrier = observer.channel(carrier)
    return Fleet(
        lambda model: [vehicle_of(model, shared, VehicleLife(real)) for real in fleet],
        lambda model, before, remembers: vehicle_anew(model, shared, before, remembers),
        Medium(carrier, setup.modem, setup.schedule, shared.clocks, faults),
        mission.truth(recorder, shared.world),
        recorder,
        times.tick_s,
        times.duration_s,
        scenario.guidance.separation_m,
        (Faults(faults), *shared.observers),
        mission.nature(world),
    )


def feature_observers(setup: Setup, recorder: Recorder, seed: int, is_alone: bool = False) -> list[Observer]:
    """Return the run hooks of the features in use, and of a strategy with instant sharing."""
    joining = Joining(
        setup.scenario,
        setup.tbox,
        setup.instances,
        setup.database,
        setup.schedule,
        setup.modem.packet_s,
        recorder,
        seed,
        is_alone,
    )
    observers = [observer for feature in setup.features if (observer := feature.observer(joining)) is not None]
    sharing = setup.strategy.declaration.sharing
    return observers if sharing is None else [*observers, sharing()]


def _lease(shared: Shared) -> Lease:
    setup = shared.setup
    communication, frame_s = setup.scenario.communication, setup.schedule.frame_s
    declaration = setup.strategy.declaration
    if declaration.sharing is not None:
        return Lease(declaration.sharing.lease_frames * frame_s, frame_s)
    frames = communication.lease_frames if declaration.communicates else math.inf
    return Lease(frames * frame_s, frame_s, communication.false_absence if frames < math.inf else 0.0)


def _known_as_it_is(setup: Setup, fleet: Sequence[VehicleData]) -> Setup:
    database, scenario = AUVDatabase(tuple(fleet)), setup.scenario
    agreement = agree(setup.strategy, setup.mission, database, groups_of(scenario), scenario.scenario.duration_s)
    return replace(setup, database=database, agreement=agreement)


def vehicle_anew(host: Fleet | Solo, shared: Shared, before: Vehicle, remembers: bool) -> Vehicle:
    """Restart a vehicle now; ``remembers`` is False if its memory is lost."""
    now_s = host.shown_s(before)
    anew = vehicle_of(host, shared, VehicleLife(before.real, now_s, before.beliefs.model.epoch + 1))
    anew.go_on(before, now_s, remembers)
    return anew


def vehicle_of(host: Fleet | Solo, shared: Shared, life: VehicleLife) -> Vehicle:
    """Assemble a vehicle that believes the fleet's data of it and moves by its true data."""
    setup = shared.setup
    data, names = setup.database[life.real.name], setup.database.names
    clock = shared.clocks.get(data.node)
    recorder = shared.recorder if clock is None else clock.recording(shared.recorder)
    picture = Picture(frame_s=setup.schedule.frame_s)
    beliefs = Beliefs(world_model(setup, data.node, life.epoch))
    manager, needs = _manager(shared, beliefs.model)
    sharing = setup.strategy.declaration.sharing
    radio = (Radio if sharing is None else sharing.radio)(
        names,
        setup.agreement.groups,
        setup.strategy.declaration,
        manager,
        beliefs,
        picture.peers,
        recorder,
        needs,
        {
            fleet_data.node: max(fleet_data.transit_speed_mps, fleet_data.survey_speed_mps)
            for fleet_data in setup.database.values()
        },
    )
    return shared.vehicle(
        host,
        data,
        _social(shared, data.name, beliefs, picture),
        _executive(setup, data.name),
        _functional(shared, life.real, picture),
        radio,
        beliefs,
        recorder,
        life.began_s,
        listening(shared.observers, "on_vehicle"),
    )


def _executive(setup: Setup, vehicle: str) -> ExecutiveLayer:
    working: set[tuple[str, str]] = set()
    equals: dict[tuple[str, str], set[tuple[str, str]]] = {}
    for group in setup.agreement.groups:
        by_name = {role.name: role for role in group.roles}
        for role in group.roles:
            if role.job and role.influences:
                working.add((group.name, role.name))
            for other in role.influences:  # roles that address each other or themselves, at least one with a job
                to = by_name.get(other, role)
                if role.name in to.influences and (role.job or to.job):
                    equals.setdefault((group.name, role.name), set()).add((group.name, other))
    passes_on = not setup.scenario.guidance.keeps_calls
    decision = setup.scenario.decision.constants(setup.schedule.frame_s)
    return ExecutiveLayer(decision, vehicle, working, equals, passes_on)


def _manager(shared: Shared, model: WorldModel) -> tuple[ExchangeManager, RenewedNeeds | None]:
    setup = shared.setup
    communication = setup.scenario.communication
    subjects, organisation = setup.subjects, setup.agreement.organisation
    by_groups = None if subjects is None else GroupNeeds(setup.tbox, setup.urgency, subjects, organisation)
    common = by_groups or setup.common_needs
    stated = next((needs for o in shared.observers if (needs := o.needs(model, common)) is not None), None)
    manager = ExchangeManager(
        model.owner,
        model,
        setup.codec,
        setup.schedule,
        setup.policy,
        setup.modem.payload_bits,
        stated or common,
        Options(
            communication.carrier_evidence,
            by_groups is not None,
            value_rule_of(communication.value),
            communication.queue_limit,
        ),
    )
    return manager, stated or by_groups


def _social(shared: Shared, name: str, beliefs: Beliefs, picture: Picture) -> SocialLayer:
    setup = shared.setup
    return SocialLayer(
        name,
        setup.database,
        beliefs,
        setup.mission,
        setup.strategy,
        setup.agreement,
        {rally.name: rally.position_m for rally in setup.scenario.rally_point},
        picture,
        _lease(shared),
        setup.scenario.scenario.duration_s,
    )


def _functional(shared: Shared, real: VehicleData, picture: Picture) -> FunctionalLayer:
    setup = shared.setup
    scenario, sensors = setup.scenario, sensors_of(real)
    bounds_m = scenario.world.box_m
    return FunctionalLayer(real, setup.mission, shared.world, sensors, bounds_m, picture, scenario.guidance)
