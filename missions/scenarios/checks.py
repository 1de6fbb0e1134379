"""What has to hold between the parts of a scenario: names that are used exist, nothing is owned twice.

Works on the raw tables, so that these faults are reported together with those of single values; where a table
is malformed its checks pass it over.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping

from missions.errors import ConfigurationFault
from missions.files import is_named
from missions.scenarios.channel import channel_faults
from missions.scenarios.communication import key_faults, policy_faults, value_faults
from missions.scenarios.copies import start_faults
from missions.scenarios.equipment import equipment_faults, gear_of
from missions.scenarios.faults import draw_faults, fault_table_faults
from missions.scenarios.hooks import hook_faults, information_faults
from missions.scenarios.knowledge import knowledge_faults, ontology_faults, words_of
from missions.scenarios.modem import modem_faults, modem_in
from missions.scenarios.named import metric_faults
from missions.scenarios.organisation import formation_faults, organisation_faults
from missions.scenarios.parts import database_of, groups_of, strategy_named
from missions.scenarios.scenario import Scenario
from missions.scenarios.tables import (
    Raw,
    bounds_of,
    entries,
    is_number,
    named_in,
    names_of,
    one_of,
    outside_faults,
    point_of,
    table_of,
    text_at,
    used_in,
)
from remoras.errors import PluginError
from remoras.executive.satisfaction import DecisionConstants
from remoras.mission import Mission
from remoras.strategies import faults_of_settings
from remoras.work import Job
from worldmodel import OntologyError

MAX_COORDINATE_M = 100_000.0
"""So far out the map is a plane still, and modems have their longest operating range."""
MAX_LATITUDE_DEG = 89.0
"""Nearer to a pole, east and north are no directions of a plane."""


def cross_faults(raw: Raw, mission: type[Mission] | None) -> list[ConfigurationFault]:
    """All faults between the tables of ``raw``.

    Args:
        raw: the tables as TOML has them.
        mission: class of the mission, which has checks of its own; None if it cannot be had.
    """
    if not entries(raw, "vehicle"):  # which is told with the tables; that nobody is able to do a thing follows from it
        return [fault for check in (_names, _times, _world, _origin, _weights) for fault in check(raw)]
    checks = (
        _names, _slots, _times, _world, _origin, _choices, _weights, channel_faults,
        _vehicles, start_faults, information_faults,
    )  # fmt: skip
    faults = [fault for check in checks for fault in check(raw)]
    gear = gear_of(raw, mission)
    faults += [fault for feature in named_in(raw) for fault in feature.checks(raw, mission)]
    faults += [*organisation_faults(raw, gear), *fault_table_faults(raw, mission)]
    if mission is not None:
        faults += [*_needs(raw, mission), *_missions(raw, mission), *formation_faults(raw, mission)]
        faults += [*knowledge_faults(raw, mission), *ontology_faults(raw, mission)]
        faults += _own_faults(raw, mission)
        faults += equipment_faults(raw, mission)
    return faults


def _weights(raw: Raw) -> Iterator[ConfigurationFault]:
    """Weights under which a vehicle could never leave what it performs, whatever is due and whoever calls."""
    constants = DecisionConstants()
    continuing, external = (
        table_of(raw, "decision").get(key, getattr(constants, key)) for key in ("weight_continuing", "weight_external")
    )
    if not (is_number(continuing) and is_number(external)):
        return
    if continuing >= 1.0 + external:
        allowed = (
            f"must be below {1.0 + external:g} = 1 + weight_external; else a vehicle could never leave what it "
            "performs, whatever is due and whoever calls"
        )
        yield ConfigurationFault("decision.weight_continuing", str(continuing), allowed)


def _own_faults(raw: Raw, mission: type[Mission]) -> list[ConfigurationFault]:
    """What the mission itself finds wrong."""
    try:
        found = list(mission.check(raw))
    except Exception as error:  # it may be somebody else's class
        reference = table_of(raw, "scenario").get("mission")
        allowed = f"its check must pass malformed values over, but raised {type(error).__name__}: {error}"
        return [ConfigurationFault("scenario.mission", f'"{reference}"', allowed)]
    if all(isinstance(fault, ConfigurationFault) for fault in found):
        return found
    reference = table_of(raw, "scenario").get("mission")
    allowed = f"its check must give missions.errors.ConfigurationFault values, but gave {found!r}"
    return [ConfigurationFault("scenario.mission", f'"{reference}"', allowed)]


def job_faults(scenario: Scenario, mission: type[Mission]) -> list[ConfigurationFault]:
    """What is wrong between roles and the jobs of a scenario that has no other faults."""
    try:
        made = mission.from_scenario(scenario)
        jobs: Mapping[str, Job] = made.jobs
    except Exception as error:  # it is somebody else's class: anything may be wrong with it
        what = f"{type(error).__name__}: {error}"
        allowed = f"its from_scenario and jobs must take every scenario that passes its checks, but raised {what}"
        return [ConfigurationFault("scenario.mission", f'"{scenario.scenario.mission}"', allowed)]
    if faults := list(hook_faults(scenario.scenario.mission, made)):
        return faults
    groups = {group.name: group for group in groups_of(scenario)}
    brought = [fault for feature in used_in(scenario) for fault in feature.made_checks(scenario, made)]
    draws = draw_faults(scenario.fault, database_of(scenario, mission), groups)
    return [*_role_jobs(scenario, mission, jobs), *_order_of(jobs), *draws, *brought]


def _role_jobs(scenario: Scenario, mission: type[Mission], jobs: Mapping[str, Job]) -> Iterator[ConfigurationFault]:
    database = database_of(scenario, mission)
    for group in groups_of(scenario):
        for role in group.roles:
            key = f"group.{group.name}.role.{role.name}"
            if role.job is None:
                continue
            yield from one_of(f"{key}.job", role.job, list(jobs))
            able = database.able_to_play(group.name, role.name)
            if role.job in jobs and able and not any(jobs[role.job].is_able(data) for data in able):
                names = ", ".join(data.name for data in able)
                yield ConfigurationFault(
                    f"{key}.job",
                    f'"{role.job}"',
                    f"none of those able to play the role, {names}, is able to do the job",
                )


def _order_of(jobs: Mapping[str, Job]) -> Iterator[ConfigurationFault]:
    """Jobs that need each other, or one that is not there."""
    for name, job in jobs.items():
        for needed in job.needs:
            yield from one_of(f"job.{name}.needs", needed, list(jobs))
    before = {name: {needed for needed in job.needs if needed in jobs} for name, job in jobs.items()}
    while free := [name for name, needed in before.items() if not needed & before.keys()]:
        for name in free:
            del before[name]
    if before:
        yield ConfigurationFault(f"job.{next(iter(before))}.needs", "", f"need each other: {', '.join(before)}")


def _names(raw: Raw) -> Iterator[ConfigurationFault]:
    kinds = ("vehicle", "group", "rally_point")
    counted = Counter(name for kind in kinds for name in names_of(raw, kind))
    first = {name: kind for kind in reversed(kinds) for name in names_of(raw, kind)}
    for name, count in counted.items():
        if count > 1:
            allowed = f"used {count} times; vehicles, groups and rally points need names of their own"
            yield ConfigurationFault(f"{first[name]}.{name}.name", f'"{name}"', allowed)
    for group in entries(raw, "group"):
        for name, count in Counter(names_of(group, "role")).items():
            if count > 1:
                yield ConfigurationFault(f"group.{group.get('name')}.role.{name}", "", f"listed {count} times")


def _slots(raw: Raw) -> Iterator[ConfigurationFault]:
    owners: dict[int, list[str]] = {}
    vehicles = entries(raw, "vehicle")
    for vehicle in vehicles:
        if isinstance(vehicle.get("slot"), int):
            owners.setdefault(vehicle["slot"], []).append(str(vehicle.get("name")))
    for slot, names in sorted(owners.items()):
        if len(names) > 1:
            yield ConfigurationFault(
                f"vehicle.{names[1]}.slot", str(slot), f"owned by {' and '.join(names)}; one owner per slot"
            )
        elif slot >= len(vehicles):
            yield ConfigurationFault(
                f"vehicle.{names[0]}.slot",
                str(slot),
                f"allowed: 0 to {len(vehicles) - 1}, one for each vehicle",
            )


def _times(raw: Raw) -> Iterator[ConfigurationFault]:
    period, tick = table_of(raw, "decision").get("period_s"), table_of(raw, "scenario").get("tick_s", 1.0)
    if isinstance(period, int | float) and isinstance(tick, int | float) and period < tick:
        yield ConfigurationFault("decision.period_s", str(period), f"allowed: scenario.tick_s = {tick} or more")


def _origin(raw: Raw) -> Iterator[ConfigurationFault]:
    for latitude_deg, longitude_deg in point_of(table_of(raw, "world"), "origin_deg"):
        if abs(latitude_deg) > MAX_LATITUDE_DEG or abs(longitude_deg) > 180.0:
            allowed = f"allowed: latitude {-MAX_LATITUDE_DEG:.0f} to {MAX_LATITUDE_DEG:.0f}, longitude -180 to 180"
            yield ConfigurationFault("world.origin_deg", f"[{latitude_deg}, {longitude_deg}]", allowed)


def _world(raw: Raw) -> Iterator[ConfigurationFault]:
    bounds = bounds_of(raw)
    if bounds is None:
        return
    x_min, y_min, x_max, y_max = bounds
    if x_min >= x_max:
        yield ConfigurationFault("world.x_m", f"[{x_min}, {x_max}]", "west border must be below east border")
    if y_min >= y_max:
        yield ConfigurationFault("world.y_m", f"[{y_min}, {y_max}]", "south border must be below north border")
    if x_min >= x_max or y_min >= y_max:
        return
    for key, (low, high) in (("world.x_m", (x_min, x_max)), ("world.y_m", (y_min, y_max))):
        if low < -MAX_COORDINATE_M or high > MAX_COORDINATE_M:
            allowed = f"allowed: {-MAX_COORDINATE_M:.0f} to {MAX_COORDINATE_M:.0f}"
            yield ConfigurationFault(key, f"[{low}, {high}]", allowed)
    places = [
        (f"rally_point.{r.get('name')}.position_m", p)
        for r in entries(raw, "rally_point")
        for p in point_of(r, "position_m")
    ]
    places += [(f"vehicle.{v.get('name')}.start_m", p) for v in entries(raw, "vehicle") for p in point_of(v, "start_m")]
    yield from outside_faults(raw, places)


def _choices(raw: Raw) -> Iterator[ConfigurationFault]:
    communication = table_of(raw, "communication")
    yield from modem_faults(raw)
    modem = modem_in(raw)
    counts = communication.get("count_listening") is True and "receive_power_w" not in communication
    if counts and modem is not None and modem.receive_w is None:
        allowed = f"the profile {modem.name} has no receive_w; set communication.receive_power_w (W)"
        yield ConfigurationFault("communication.count_listening", "true", allowed)
    yield from policy_faults(raw)
    yield from key_faults(raw)
    yield from value_faults(raw)
    yield from metric_faults(raw)
    name = table_of(raw, "strategy").get("name")
    if not isinstance(name, str):
        return
    try:
        strategy = strategy_named(name)
    except PluginError as error:
        prefix = "" if is_named(name) else "allowed: "
        yield ConfigurationFault("strategy.name", f'"{name}"', f"{prefix}{error}")
        return
    settings = table_of(table_of(raw, "strategy"), "parameters")
    for fault in faults_of_settings(strategy, settings):
        yield ConfigurationFault(f"strategy.parameters.{fault.key}", json.dumps(settings[fault.key]), fault.allowed)


def _needs(raw: Raw, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    needs = table_of(table_of(raw, "communication"), "needs")
    try:
        tbox = words_of(raw, mission)
    except (OntologyError, OSError) as error:
        if table_of(table_of(raw, "worldmodel"), "ontology_text"):
            return  # reported with these files
        reference = table_of(raw, "scenario").get("mission")
        yield ConfigurationFault("scenario.mission", f'"{reference}"', f"its vocabulary cannot be read: {error}")
        return
    known = [attribute.name for attribute in tbox.attributes]
    for name in needs:
        for fault in one_of(f"communication.needs.{name}", name, known):
            yield ConfigurationFault(fault.key, "", f"no attribute of the ontology; {fault.allowed}")
    listed = {*needs, *(name for feature in named_in(raw) for name in feature.needed(raw))}
    missing = [name for name in mission.needs if name not in listed]
    if missing:
        allowed = f"missing: {', '.join(missing)}; without them nobody learns what the mission needs"
        yield ConfigurationFault("communication.needs", "", allowed)


def _vehicles(raw: Raw) -> Iterator[ConfigurationFault]:
    listed = [(group.get("name"), name) for group in entries(raw, "group") for name in names_of(group, "role")]
    roles = sorted({name for _, name in listed})
    paths = [*roles, *(f"{group}.{role}" for group, role in listed)]
    for vehicle in entries(raw, "vehicle"):
        prefix = f"vehicle.{vehicle.get('name')}"
        playable = vehicle.get("playable_roles", [])
        for role in playable if isinstance(playable, list) else []:
            if role not in paths:
                yield from one_of(f"{prefix}.playable_roles", role, paths if "." in str(role) else roles)
        depth, limit = vehicle.get("depth_m", 0.0), vehicle.get("depth_limit_m", 0.0)
        if isinstance(depth, int | float) and isinstance(limit, int | float) and depth > limit:
            yield ConfigurationFault(f"{prefix}.depth_m", str(depth), f"allowed: 0 to depth_limit_m = {limit}")
        slow, fast = vehicle.get("survey_speed_mps"), vehicle.get("transit_speed_mps")
        if isinstance(slow, int | float) and isinstance(fast, int | float) and slow > fast:
            yield ConfigurationFault(
                f"{prefix}.survey_speed_mps", str(slow), f"allowed: up to transit_speed_mps = {fast}"
            )


def _missions(raw: Raw, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Missions of groups."""
    groups = entries(raw, "group")
    for kind in ("vehicle", "group", "rally_point"):
        for name in names_of(raw, kind):
            if name in mission.group_missions:
                yield ConfigurationFault(f"{kind}.{name}.name", f'"{name}"', "is the name of a mission")
    for group in groups:
        yield from one_of(f"group.{group.get('name')}.mission", group.get("mission"), list(mission.group_missions))
    idle = [group.get("name") for group in groups if group.get("mission") is None and not group.get("formed_by")]
    delegating = mission.delegating_mission
    if idle and delegating is None:
        allowed = f"missing: which of {', '.join(mission.group_missions)} the group has"
        yield ConfigurationFault(f"group.{idle[0]}.mission", "", allowed)
        return
    by_name = {str(group.get("name")): group for group in groups}
    for name in map(str, idle):
        line = [by_name[name]]
        while (outer := by_name.get(text_at(line[-1], "within") or "")) is not None and outer not in line:
            line.append(outer)
        givers = [line[-1]] if len(line) > 1 else groups
        if all(group.get("mission") != delegating for group in givers):
            who = f"{line[-1].get('name')}, which it is within," if len(line) > 1 else "one group"
            allowed = f'nobody gives the group its mission: {who} must have mission = "{delegating}"'
            yield ConfigurationFault(f"group.{name}.mission", "", allowed)
            return
