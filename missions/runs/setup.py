"""Setup of runs: everything derived from a scenario, resolved once; initial world models."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

from exchange.channel.modems import Modem
from exchange.policy.policies import AckPolicy
from exchange.schedule import TdmaSchedule
from exchange.wire.codec import Codec, Framing, Widths
from missions.errors import ConfigurationError, ConfigurationFault
from missions.feature import Feature
from missions.metric import Metric
from missions.runs.metrics import metrics_of, own_metrics
from missions.scenarios.channel import guard_s, most_apart_s
from missions.scenarios.communication import key_of, modem_named, policy_of
from missions.scenarios.features import features, used_in
from missions.scenarios.fleet import common_equipment, database_of
from missions.scenarios.knowledge import pruning_of, sources_of
from missions.scenarios.organisation import groups_of
from missions.scenarios.parts import mission_class, strategy_of
from missions.scenarios.scenario import BY_GROUPS, HELD, Scenario, StrategyTable
from remoras.authority import CONSULTING
from remoras.database import AUVDatabase, VehicleData
from remoras.errors import PluginError
from remoras.fleet.run_log import DELIVERIES, UNSAID
from remoras.group_hierarchy import Defect, specification_faults
from remoras.mission import Mission
from remoras.organisation import Group, Organisation
from remoras.organisation.leadership import ROLE_ATTRIBUTES
from remoras.organisation.needs import Path, Subjects
from remoras.plugins import answer, faults_of, refuse
from remoras.recorder import Recorder, Table
from remoras.sensor import Sensor
from remoras.social.agreement import Agreement, agree
from remoras.social.negotiation import negotiated_attributes
from remoras.social.view import FORMATION_ATTRIBUTES
from remoras.social.workload import SENSORS_WORK
from remoras.strategy import Declaration, Strategy
from worldmodel import (
    InformationNeed,
    Instance,
    Keeping,
    NeedsIndex,
    PropertyValue,
    TBox,
    UnknownNameError,
    WorldModel,
    core_ontology_paths,
    reaching,
    read_tbox,
)


def sensors_of(data: VehicleData) -> dict[str, Sensor]:
    """Create the sensors of a vehicle, by name; raise PluginError for an invalid one."""
    made: dict[str, Sensor] = {}
    for settings in data.sensors:
        where = f"sensor {settings.name} of {data.name}"
        sensor: Sensor = answer(where, "make(data)", "a remoras.Sensor", object, partial(settings.make, data))
        faults = list(faults_of(sensor, Sensor, ("table", "sense")))
        if not faults and not isinstance(sensor.table, Table | None):
            faults = [f"table is {type(sensor.table).__name__}; expected a remoras.Table, or None if it writes none"]
        refuse(where, faults)
        made[settings.name] = sensor
    return made


def recorder_of_mission(mission: Mission, sensors: Sequence[Mapping[str, Sensor]]) -> Recorder:
    """Create a recorder with the tables of the mission and of all sensors."""
    tables = [sensor.table for of_one in sensors for sensor in of_one.values() if sensor.table is not None]
    return Recorder([*mission.tables, *tables, DELIVERIES, UNSAID])


def _malformed(founding: Organisation) -> Iterator[ConfigurationFault]:
    headless = set[str]()
    for group, of_group in founding.groups.items():
        if not founding.heads(group):
            headless.add(key := f"group.{group}.role.{of_group.head_role}")
            yield ConfigurationFault(key, "", "no vehicle is assigned to it before the mission")
    for defect in specification_faults(founding):
        if defect.key.rpartition(".")[0] not in headless and defect.defect is not Defect.SUBGROUPS:  # may form later
            allowed = f"no initial assignment meets its requirements: {defect.allowed}"
            yield ConfigurationFault(defect.key, defect.given, allowed)


def _undivided(strategy: Strategy, agreement: Agreement, database: AUVDatabase) -> Iterator[ConfigurationFault]:
    if strategy.declaration.authorities.isdisjoint(CONSULTING):
        return
    remedy = "set social_layer = true for one of them, or name a strategy whose leaders assign jobs, such as central"
    for name, group in agreement.organisation.groups.items():
        for role in group.roles:
            able = database.able_to_play(name, role.name) if role.job is not None else ()
            if able and not any(data.social_layer for data in able):
                names = ", ".join(data.name for data in able)
                why = f"under {strategy.name} vehicles with the social layer divide jobs, {names} has none: {remedy}"
                yield ConfigurationFault(f"group.{name}.role.{role.name}.job", f'"{role.job}"', why)


SOCIAL_ATTRIBUTES = ("available", "headedBy", "headTerm", SENSORS_WORK)
"""Attributes that vehicles state under every strategy."""


def priorities(scenario: Scenario, strategy: Strategy, mission: Mission, tbox: TBox) -> dict[int, int]:
    """Return the priority by uid of each exchanged attribute; those of strategy, leadership and jobs are highest."""
    known = {attribute.name for attribute in tbox.attributes}
    listed = {name: priority for name, priority in scenario.communication.needs.items() if name in known}
    formation = [name for name in FORMATION_ATTRIBUTES if name in known]
    ordered = [name for feature in features().values() for name in feature.states if name in known]
    stated = (*negotiated_attributes(strategy, mission.jobs, tbox), *SOCIAL_ATTRIBUTES, *formation, *ordered)
    strategic = dict.fromkeys(stated, max(listed.values(), default=1))
    return {tbox.attribute_named(name).uid: priority for name, priority in {**strategic, **listed}.items()}


def subjects_of(setup: Setup) -> Subjects | None:
    """Return the groups, roles and jobs that each instance concerns; None if every vehicle needs all attributes.

    They determine needs, see ``communication.needs_follow``. Raises PluginError for an invalid ``groups_of`` of the
    mission.
    """
    scenario, mission, tbox, agreement = setup.scenario, setup.mission, setup.tbox, setup.agreement
    if scenario.communication.needs_follow != BY_GROUPS:
        return None
    groups = agreement.groups
    uid = {instance.name: instance.uid for instance in setup.instances}
    paths = {group.path(role.name): (group.name, role.name) for group in groups for role in group.roles}
    own = {name: _of_job(name, mission, groups) for _, name in mission.instances}
    for_all = {name for feature in features().values() for name in feature.for_all}
    return Subjects(
        setup.database.names,
        {uid[group.name]: group.name for group in groups},
        {uid[path]: role for path, role in paths.items()},
        {uid[name]: concerned for name, concerned in own.items() if concerned},
        frozenset((uid[job.done[1]], tbox.attribute_named(job.done[0]).uid) for job in mission.jobs.values()),
        [(superior, name) for superior, inferiors in agreement.meets_after.items() for name in inferiors],
        frozenset(group.name for group in scenario.group if group.information == HELD),
        agreement.at_sea,
        frozenset(attribute.uid for attribute in tbox.attributes if attribute.name in for_all),
    )


def _of_job(name: str, mission: Mission, groups: Sequence[Group]) -> Collection[Path]:
    names = [group.name for group in groups]

    def is_expected(answered: object) -> bool:
        return answered is None or (isinstance(answered, Collection) and set(answered) <= set(names))

    expected = f"groups of the scenario ({', '.join(names)}), or None"
    answered = answer(
        f"mission {type(mission).__name__}", "groups_of", expected, is_expected, lambda: mission.groups_of(name)
    )
    if answered is not None:
        return [(group, "") for group in answered]
    jobs = {job.name for job in mission.jobs.values() if name in (job.name, job.done[1])}
    return [(group.name, role.name) for group in groups for role in group.roles if role.job in jobs]


REACH_SHARE = 1.1  # margin of position ranges beyond the world's border, for vehicles carried off
SPARE_ITEMS = 1024  # items of a vehicle besides observations and the strategy's rounds: assignments, findings


@dataclass(frozen=True)
class Setup:
    """Resolved scenario, immutable during runs, so that any number of runs may share it.

    Attributes:
        instances: those with names common to the fleet.
        common_facts: known to all before the mission: equipment of vehicles, and facts of ontology files.
        database: vehicles as the fleet knows them.
        urgency: priority of each attribute exchanged by all, by uid.
        subjects: of instances, where needs follow from groups; else None.
        own_metrics: named by the scenario itself, by reference.
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
    schedule: TdmaSchedule
    codec: Codec
    urgency: Mapping[int, int]
    metrics: Mapping[str, Metric]
    own_metrics: Mapping[str, Metric]
    features: tuple[Feature, ...]
    subjects: Subjects | None = None

    @cached_property  # 0.4 to 1 ms, asked for each vehicle
    def common_needs(self) -> NeedsIndex:
        """Needs by which every vehicle needs all exchanged attributes."""
        domains = self.tbox.attributes
        needs = [InformationNeed(uid, value, class_uid=domains[uid].domain) for uid, value in self.urgency.items()]
        return NeedsIndex(self.tbox, dict.fromkeys(range(len(self.database)), tuple(needs)))

    @property
    def modem(self) -> Modem:
        """Modem of all vehicles."""
        return modem_named(self.scenario.communication.modem, self.scenario.modem)

    @property
    def nodes(self) -> dict[str, int]:
        """Node of each vehicle."""
        return {name: data.node for name, data in self.database.items()}


def resolved(scenario: Scenario, strategy: Strategy | None = None) -> Setup:
    """Resolve a scenario; ``strategy`` replaces its own.

    Raises ConfigurationError for a malformed organisation or duplicate metrics, PluginError for an invalid sensor or
    tables of one name with different columns.
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
    own_files = sources_of(scenario.worldmodel.ontology_text)
    words = [path for feature in used for path in feature.words(scenario)]
    tbox = read_tbox(
        *core_ontology_paths(), *mission.vocabulary_used, *strategy.declaration.vocabulary, *own_files, *words
    )
    tbox = reaching(tbox, REACH_SHARE * max(map(abs, (*scenario.world.x_m, *scenario.world.y_m))))
    database, groups = database_of(scenario, mission_type), groups_of(scenario)
    modem = modem_named(scenario.communication.modem, scenario.modem)
    instances = _instances(scenario, mission, tbox, used)
    equipment, common_facts = common_equipment(scenario, modem, mission_type.sensors, tbox, instances)
    # equipment facts are not exchanged, so equipment needs no names on the wire unless new instances follow it
    n_named = len(instances) + (len(equipment) if mission.instances_found_per_vehicle else 0)
    instances += equipment
    common_facts += _stated_facts(tbox, instances)
    schedule = TdmaSchedule(len(database), modem.packet_s(modem.payload_bits), guard_s(scenario))
    agreement = agree(strategy, mission, database, groups, scenario.scenario.duration_s)
    if faults := [*_malformed(agreement.organisation), *_undivided(strategy, agreement, database)]:
        raise ConfigurationError(scenario.scenario.name, faults)
    # Only for its errors: sensors and tables fail here, before any run.
    recorder_of_mission(mission, [sensors_of(data) for data in database.values()])
    own = own_metrics(scenario)
    urgency = priorities(scenario, strategy, mission, tbox)
    ahead_s = max([feature.ahead_s(scenario) for feature in used], default=0.0)
    needed = [name for feature in used for name in feature.needed(scenario)]
    exchanged = {*urgency, *(tbox.attribute_named(name).uid for name in needed)}
    setup = Setup(
        scenario=scenario,
        mission=mission,
        strategy=strategy,
        policy=policy,
        tbox=tbox,
        instances=instances,
        common_facts=common_facts,
        database=database,
        agreement=agreement,
        schedule=schedule,
        codec=_codec(scenario, mission, strategy, policy, tbox, n_named, schedule, exchanged, ahead_s),
        urgency=urgency,
        metrics=metrics_of(scenario, mission_type, own),
        own_metrics=own,
        features=used,
    )
    return replace(setup, subjects=subjects_of(setup))


def _instances(scenario: Scenario, mission: Mission, tbox: TBox, used: Iterable[Feature]) -> tuple[Instance, ...]:
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
    duration_s, resolution_s = scenario.scenario.duration_s, scenario.communication.time_resolution_s
    # A whole number of steps beyond the end, so that no time of the mission needs an escape.
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
        # Without the error of the product, since the definition hash covers it.
        round(horizon_s, 9),
        Widths(resolution_s, exchanged, schedule.frame_s),
        Framing(scenario.communication.crc_bits, key_of(scenario.communication.key_file)),
    )


def _items_per_round(declaration: Declaration, tbox: TBox) -> int:
    own = [a for a in tbox.attributes if a.name in declaration.messages and a.name not in ROLE_ATTRIBUTES]
    return 0 if own and all(attribute.latest_only for attribute in own) else declaration.blocks_per_round


def world_model(setup: Setup, node: int, epoch: int = 0) -> WorldModel:
    """Create the initial world model of a vehicle; ``epoch`` counts its restarts."""
    kept, communication = setup.scenario.worldmodel, setup.scenario.communication
    return WorldModel(
        setup.tbox,
        node,
        setup.instances,
        communication.time_resolution_s,
        epoch=epoch,
        n_origins=len(setup.database),
        run_time_instances_per_origin=setup.mission.instances_found_per_vehicle,
        keeping=Keeping(
            max(communication.clock_tolerance_s, most_apart_s(setup.scenario)),
            kept.waiting_s,
            kept.waiting_blocks,
            pruning_of(kept, setup.tbox),
            setup.common_facts,
        ),
    )
