"""Setup: all that follows from a scenario, resolved once; a run only connects it."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from exchange.acoustics.models import Deployment
from exchange.acoustics.modems import Modem
from exchange.policies import AckPolicy
from exchange.schedule import TdmaSchedule
from exchange.wire.codec import Codec, Framing, Widths
from missions.feature import Feature
from missions.metric import Metric
from missions.runs.metrics import metrics_of, own_metrics
from missions.runs.needs import needs_of_all, priorities, subjects_of
from missions.runs.refusals import refuse_malformed, refuse_undivided
from missions.runs.sensors import recorder_of_mission, sensors_of
from missions.scenarios.deployment import deployment_of, scenario_sound_speed_mps
from missions.scenarios.equipment import common_equipment
from missions.scenarios.extending import used_in
from missions.scenarios.guard import guard_s
from missions.scenarios.ontologies import sources_of
from missions.scenarios.parts import database_of, groups_of, mission_class, strategy_of
from missions.scenarios.policy import key_of, policy_of
from missions.scenarios.scenario import Scenario, StrategyTable
from remoras.database import AUVDatabase
from remoras.errors import PluginError
from remoras.executive.satisfaction import DecisionConstants
from remoras.mission import Mission
from remoras.social.agreement import Agreement, agree
from remoras.social.needs import Subjects
from remoras.social.succession import ROLE_ATTRIBUTES
from remoras.strategy import Declaration, Strategy
from remoras.work import Point
from worldmodel import (
    Instance,
    NeedsIndex,
    PropertyValue,
    TBox,
    UnknownNameError,
    core_ontology_paths,
    reaching,
    read_tbox,
)

REACH_SHARE = 1.1
"""Places can be said this much farther from the origin than the border of the world: vehicles may be carried off."""
SPARE_ITEMS = 1024
"""Items of a vehicle beside its observations and what its strategy states in every round: assignments, findings."""


@dataclass(frozen=True)
class Setup:
    """A scenario resolved. Nothing in it changes in a run, so any number of runs may share it.

    Attributes:
        scenario: what it follows from.
        mission: the mission of the scenario; strategy: with its parameters; policy: of acknowledgement.
        tbox: core ontology and the mission's vocabulary; instances: what the whole fleet has names for.
        common_facts: what all know before the mission: which equipment is part of which vehicle, and what ontology
            files say of the things that they name.
        database: vehicles as the fleet knows them; agreement: what they agree on before the mission.
        rally_points_m: by name; bounds_m: area of operations (x_min, y_min, x_max, y_max).
        deployment: vehicles as channel models know them; sound_speed_mps: in the water.
        modem, schedule, codec: of the exchange.
        urgency: priority of each attribute that all exchange, by uid.
        subjects: what it is told of, where needs follow from groups.
        decision: constants of the executive layer; metrics: of its runs, by name.
        own_metrics: of these, what the scenario names itself, by what it names them.
        features: that the scenario uses.
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
    deployment: Deployment
    sound_speed_mps: float
    modem: Modem
    schedule: TdmaSchedule
    codec: Codec
    urgency: Mapping[int, int]
    subjects: Subjects | None
    decision: DecisionConstants
    metrics: Mapping[str, Metric]
    own_metrics: Mapping[str, Metric]
    features: tuple[Feature, ...]

    @cached_property
    def common_needs(self) -> NeedsIndex:
        """Who needs what, where every vehicle needs all that is exchanged."""
        return needs_of_all(self.tbox, self.urgency, len(self.database))

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
    used = used_in(scenario)
    mission_type = mission_class(scenario.scenario.mission)
    mission = mission_type.from_scenario(scenario)
    if strategy is None:
        strategy = strategy_of(scenario)
    else:
        scenario = scenario.model_copy(update={"strategy": StrategyTable(name=strategy.name)})
    for feature in used:
        strategy = feature.strategy(scenario, strategy)
    policy = policy_of(scenario.communication.policy)
    own_files, words = (
        sources_of(scenario.worldmodel.ontology_text),
        [path for feature in used for path in feature.words(scenario)],
    )
    tbox = read_tbox(*core_ontology_paths(), *mission.vocabulary_used, *own_files, *words)
    tbox = reaching(tbox, REACH_SHARE * max(map(abs, (*scenario.world.x_m, *scenario.world.y_m))))
    database, groups, deployment = database_of(scenario, mission_type), groups_of(scenario), deployment_of(scenario)
    instances = _instances(scenario, mission, tbox, used)
    equipment, common_facts = common_equipment(scenario, deployment.modem, mission_type.sensors, tbox, instances)
    # nobody tells facts about equipment, so it needs no names on the wire unless new instances come behind it
    n_named = len(instances) + (len(equipment) if mission.instances_found_per_vehicle else 0)
    instances += equipment
    common_facts += _stated_facts(tbox, instances)
    modem, world = deployment.modem, scenario.world
    packet_s = modem.packet_s(modem.payload_bits)
    schedule = TdmaSchedule(len(database), packet_s, guard_s(scenario))
    agreement = agree(strategy, mission, database, groups, scenario.scenario.duration_s)
    refuse_malformed(scenario, agreement)
    refuse_undivided(scenario, strategy, agreement, database)
    recorder_of_mission(mission, [sensors_of(data) for data in database.values()])
    own = own_metrics(scenario)
    urgency = priorities(scenario, strategy, mission, tbox)
    on_demand = [name for feature in used for name in feature.on_demand(scenario)]
    ahead_s = max([feature.ahead_s(scenario) for feature in used], default=0.0)
    exchanged = {*urgency, *(tbox.attribute_named(name).uid for name in on_demand)}
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
        deployment=deployment,
        sound_speed_mps=scenario_sound_speed_mps(scenario),
        modem=modem,
        schedule=schedule,
        codec=_codec(scenario, mission, strategy, policy, tbox, n_named, schedule, exchanged, ahead_s),
        urgency=urgency,
        subjects=subjects_of(scenario, mission, tbox, instances, database, agreement),
        decision=scenario.decision.constants(schedule.frame_s),
        metrics=metrics_of(scenario, mission_type, own),
        own_metrics=own,
        features=used,
    )


def _instances(scenario: Scenario, mission: Mission, tbox: TBox, used: Iterable[Feature]) -> tuple[Instance, ...]:
    """What the whole fleet has names for; a vehicle's uid is its node index."""
    vehicles = sorted(scenario.vehicle, key=lambda vehicle: vehicle.slot)
    named: list[tuple[str, str]] = [(vehicle.vehicle_type, vehicle.name) for vehicle in vehicles]
    named += [("Group", group.name) for group in scenario.group]
    named += [("Role", f"{group.name}.{role.name}") for group in scenario.group for role in group.role]
    named += mission.instances
    named += [("RallyPoint", rally.name) for rally in scenario.rally_point]
    named += [("Mission", name) for name in mission.group_missions]
    named += [instance for feature in used for instance in feature.instances(scenario)]
    named += [(tbox.classes[individual.class_uid].name, individual.name) for individual in tbox.individuals]
    try:
        return tuple(Instance(uid, tbox.class_named(kind).uid, name) for uid, (kind, name) in enumerate(named))
    except UnknownNameError as error:
        raise PluginError(f"mission {scenario.scenario.mission}: instances: {error}") from error


def _stated_facts(tbox: TBox, instances: Sequence[Instance]) -> tuple[PropertyValue, ...]:
    """What the ontology says of the things that it names."""
    if not tbox.individuals:
        return ()
    uids = {instance.name: instance.uid for instance in instances}
    return tuple(
        PropertyValue(uids[individual.name], attribute, value)
        for individual in tbox.individuals
        for attribute, value in (*((a, uids[name]) for a, name in individual.links), *individual.values)
    )


def _codec(
    scenario: Scenario,
    mission: Mission,
    strategy: Strategy,
    policy: AckPolicy,
    tbox: TBox,
    n_instances: int,
    schedule: TdmaSchedule,
    exchanged: Collection[int],
    ahead_s: float,
) -> Codec:
    """The codec that all vehicles of the scenario share; its numbers are as wide as the whole mission needs them."""
    duration_s, resolution_s = scenario.scenario.duration_s, scenario.communication.time_resolution_s
    horizon_s = resolution_s * (int((duration_s + ahead_s) / resolution_s) + 1)
    n_frames = int(duration_s / schedule.frame_s) + 1
    stated = _items_per_round(strategy.declaration, tbox) * max(1, len(mission.jobs))
    n_items = stated * n_frames + mission.most_observations + SPARE_ITEMS
    n_names = n_instances + schedule.n_nodes * mission.instances_found_per_vehicle
    return Codec(
        tbox,
        n_names,
        schedule.n_nodes,
        policy,
        n_items,
        round(horizon_s, 9),
        Widths(resolution_s, exchanged, schedule.frame_s),
        Framing(scenario.communication.crc_bits, key_of(scenario.communication.key_file)),
    )


def _items_per_round(declaration: Declaration, tbox: TBox) -> int:
    """Items that a vehicle states in a round for each job; none if all it states there beside roles is status."""
    own = [a for a in tbox.attributes if a.name in declaration.messages and a.name not in ROLE_ATTRIBUTES]
    return 0 if own and all(attribute.latest_only for attribute in own) else declaration.blocks_per_round
