"""Cross-checks between well-formed tables of a scenario. Each check is next to its subject."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from typing import Any

from missions.errors import ConfigurationFault, one_of
from missions.figure import Figure, Layer, Mark
from missions.scenarios.channel import channel_faults
from missions.scenarios.communication import communication_faults, modem_faults
from missions.scenarios.faults import draw_faults, fault_table_faults, own_faults
from missions.scenarios.features import used_in
from missions.scenarios.fleet import database_of, equipment_faults, start_faults
from missions.scenarios.knowledge import vocabulary_faults
from missions.scenarios.organisation import (
    formation_faults,
    groups_of,
    organisation_faults,
    playable_faults,
    player_faults,
)
from missions.scenarios.parts import metric_faults, strategy_named
from missions.scenarios.scenario import BY_GROUPS, HELD, Scenario
from remoras.activities import Objective
from remoras.beliefs import NOTHING_KNOWN
from remoras.database import AUVDatabase
from remoras.errors import PluginError
from remoras.htn import Domain
from remoras.mission import ELEMENTARY_TASKS, Mission
from remoras.plugins import RAISED, answer, named_error
from remoras.recorder import Recorder
from remoras.strategies import faults_of_settings
from remoras.work import Job, Outlook, jobs_left, vehicles_taken

Faults = Iterator[ConfigurationFault]


def cross_faults(scenario: Scenario, mission: type[Mission]) -> Faults:
    """Yield all faults between the tables of a scenario."""
    for check in CHECKS:
        yield from check(scenario)
    for check_of in (*(feature.checks for feature in used_in(scenario)), *CHECKS_OF_MISSION):
        yield from check_of(scenario, mission)
    yield from own_faults("scenario.mission", "check", lambda: mission.check(scenario))


def job_faults(scenario: Scenario, mission: type[Mission]) -> Faults:
    """Yield the faults between roles and jobs, for a scenario without other faults."""
    try:
        made = mission.from_scenario(scenario)
        jobs: Mapping[str, Job] = made.jobs
    except RAISED as error:
        cause = f"raised {named_error(error)}"
        allowed = f"its from_scenario and jobs must take every scenario that passes its checks, but {cause}"
        yield ConfigurationFault("scenario.mission", "", allowed)
        return
    # The checks below call these hooks and would raise.
    if faults := list(hook_faults(scenario.scenario.mission, made)):
        yield from faults
        return
    database, groups = database_of(scenario, mission), {group.name: group for group in groups_of(scenario)}
    yield from _role_jobs(scenario, database, jobs)
    yield from _order_of(jobs)
    yield from own_faults("scenario.mission", "jobs", lambda: _unfit_jobs(scenario, jobs, database))
    yield from draw_faults(scenario.fault, database, groups)
    for feature in used_in(scenario):
        yield from feature.made_checks(scenario, made)


def _role_jobs(scenario: Scenario, database: AUVDatabase, jobs: Mapping[str, Job]) -> Faults:
    for (group, name), role in scenario.roles.items():
        if role.job is None:
            continue
        key, able = f"group.{group}.role.{name}.job", database.able_to_play(group, name)
        yield from one_of(key, role.job, list(jobs))
        if role.job in jobs and able and not any(jobs[role.job].is_able(data) for data in able):
            names = ", ".join(data.name for data in able)
            yield ConfigurationFault(key, "", f"none of those able to play the role, {names}, is able to do the job")
        elif role.job in jobs and (n_taken := vehicles_taken(jobs[role.job])) > len(database):
            allowed = f"the job takes {n_taken} vehicles at once, the fleet has {len(database)}"
            yield ConfigurationFault(key, f'"{role.job}"', allowed)


def _order_of(jobs: Mapping[str, Job]) -> Faults:
    for name, job in jobs.items():
        for needed in job.needs:
            yield from one_of(f"job.{name}.needs", needed, list(jobs))
    try:
        TopologicalSorter({name: job.needs for name, job in jobs.items()}).prepare()
    except CycleError as error:
        cycle = error.args[1][1:]
        yield ConfigurationFault(f"job.{cycle[0]}.needs", "", f"need each other: {', '.join(cycle)}")


def _names(scenario: Scenario) -> Faults:
    kinds = ("vehicle", "group", "rally_point")
    counted = Counter(entry.name for kind in kinds for entry in getattr(scenario, kind))
    for name, kind in scenario.taken_names().items():
        if counted[name] > 1:
            allowed = f"used {counted[name]} times; vehicles, groups and rally points need names of their own"
            yield ConfigurationFault(f"{kind}.{name}.name", "", allowed)


def _slots(scenario: Scenario) -> Faults:
    owners: dict[int, list[str]] = {}
    for vehicle in scenario.vehicle:
        owners.setdefault(vehicle.slot, []).append(vehicle.name)
    for slot, names in sorted(owners.items()):
        if len(names) > 1:
            allowed = f"owned by {' and '.join(names)}; one owner per slot"
            yield ConfigurationFault(f"vehicle.{names[1]}.slot", "", allowed)
        elif slot >= len(scenario.vehicle):
            allowed = f"allowed: 0 to {len(scenario.vehicle) - 1}, one for each vehicle"
            yield ConfigurationFault(f"vehicle.{names[0]}.slot", "", allowed)


def _unfit_jobs(scenario: Scenario, jobs: Mapping[str, Job], database: AUVDatabase) -> Faults:
    # The place of a job that is yet to be discovered has no meaning.
    known, _ = jobs_left(jobs, NOTHING_KNOWN)
    places = [(f"job.{name}.place_m", job.place_m) for name, job in known.items() if job.place_m is not None]
    if outside := list(scenario.world.outside(places)):
        yield from outside
        return
    for name, job in known.items():
        able = next((data for data in database.values() if job.is_able(data)), None)
        if able is None:
            continue
        after = job.after(Outlook(0.0, able.start_m), able)
        if after is not None and not after.free_s >= 0.0:
            of = f"the time (s) at which a vehicle that begins it at 0 s ends it ({able.name}); allowed: 0 or more"
            yield ConfigurationFault(f"job.{name}", f"{after.free_s:g}", of)


def _places(scenario: Scenario) -> Faults:
    period_s, tick_s = scenario.decision.period_s, scenario.scenario.tick_s
    if period_s < tick_s:
        yield ConfigurationFault("decision.period_s", "", f"allowed: scenario.tick_s = {tick_s} or more")
    places = [(f"rally_point.{point.name}.position_m", point.position_m) for point in scenario.rally_point]
    yield from scenario.world.outside(places)


def _strategy(scenario: Scenario) -> Faults:
    name, settings = scenario.strategy.name, scenario.strategy.parameters
    try:
        strategy = strategy_named(name)
    except PluginError as error:
        yield ConfigurationFault("strategy.name", "", str(error))
        return
    for fault in faults_of_settings(strategy, settings):
        yield ConfigurationFault(f"strategy.parameters.{fault.key}", json.dumps(settings[fault.key]), fault.allowed)


def _information(scenario: Scenario) -> Faults:
    for group in scenario.group if scenario.communication.needs_follow != BY_GROUPS else ():
        if group.information == HELD:
            allowed = f'every vehicle needs everything: set communication.needs_follow = "{BY_GROUPS}", or leave it out'
            yield ConfigurationFault(f"group.{group.name}.information", "", allowed)


def _needs(scenario: Scenario, mission: type[Mission]) -> Faults:
    listed = {*scenario.communication.needs}.union(*(feature.needed(scenario) for feature in used_in(scenario)))
    if missing := [name for name in mission.needs if name not in listed]:
        allowed = f"missing: {', '.join(missing)}; without them vehicles do not receive what the mission needs"
        yield ConfigurationFault("communication.needs", "", allowed)


def _missions(scenario: Scenario, mission: type[Mission]) -> Faults:
    for name, kind in scenario.taken_names().items():
        if name in mission.group_missions:
            yield ConfigurationFault(f"{kind}.{name}.name", "", "is the name of a mission")
    for group in scenario.group:
        yield from one_of(f"group.{group.name}.mission", group.mission, list(mission.group_missions))
    idle = [group for group in scenario.group if group.mission is None and group.formed_by is None]
    delegating = mission.delegating_mission
    if idle and delegating is None:
        allowed = f"missing: which of {', '.join(mission.group_missions)} the group has"
        yield ConfigurationFault(f"group.{idle[0].name}.mission", "", allowed)
        return
    by_name = {group.name: group for group in scenario.group}
    for group in idle:
        line = [group]
        # A group without a mission gets it from the leader of its outermost group.
        while (outer := by_name.get(line[-1].within or "")) is not None and outer not in line:
            line.append(outer)
        givers: Iterable[object] = [line[-1]] if len(line) > 1 else scenario.group
        if all(getattr(giver, "mission", None) != delegating for giver in givers):
            source = f"{line[-1].name}, which it is within," if len(line) > 1 else "one group"
            allowed = f'no leader gives the group its mission: {source} must have mission = "{delegating}"'
            yield ConfigurationFault(f"group.{group.name}.mission", "", allowed)
            return


CHECKS: tuple[Callable[[Scenario], Faults], ...] = (
    _names, _slots, _places, _strategy, _information, modem_faults, communication_faults, metric_faults,
    channel_faults, start_faults, organisation_faults, playable_faults,
)  # fmt: skip
CHECKS_OF_MISSION: tuple[Callable[[Scenario, type[Mission]], Faults], ...] = (
    player_faults, fault_table_faults, vocabulary_faults, _needs, _missions, formation_faults, equipment_faults,
)  # fmt: skip


PARTS_OF_JOB = ("name", "place_m", "needs", "done", "is_able", "after")
PARTS_OF_TRUTH = ("milestones", "goal_fraction", "is_over", "observe", "close")


def hook_faults(reference: str, made: Mission) -> Iterator[ConfigurationFault]:
    """Yield faults: hooks of a mission that raise or return an unexpected value."""
    jobs = f"objects by name, each with {', '.join(PARTS_OF_JOB)}"
    tasks = f"a remoras.htn.Domain whose elementary tasks are among {', '.join(ELEMENTARY_TASKS)}"
    figures = "a tuple of Figure, Layer and Mark of missions.figure"
    world = cache(lambda: made.world(0))
    hooks: tuple[tuple[str, str, Callable[[Any], bool], Callable[[], Any]], ...] = (
        ("jobs", jobs, lambda value: all(_has(job, PARTS_OF_JOB) for job in value.values()), lambda: made.jobs),
        ("social_domain", tasks, _is_domain, lambda: made.social_domain),
        ("founding_objectives", "a list of Objective", _all_are(Objective), made.founding_objectives),
        ("activity_domain", "a remoras.htn.Domain, or None", _is_none_or(Domain), lambda: made.activity_domain),
        ("instances", "pairs of class and name", _are_pairs, lambda: made.instances),
        ("instances_found_per_vehicle", "0 or more", _is_count, lambda: made.instances_found_per_vehicle),
        ("most_observations", "0 or more", _is_count, lambda: made.most_observations),
        ("nature", "a function, or None", _is_none_or(Callable), lambda: made.nature(world())),
        ("figures", figures, _all_are(Figure, Layer, Mark), lambda: made.figures),
        (
            "truth",
            f"an object with {', '.join(PARTS_OF_TRUTH)}",
            lambda value: _has(value, PARTS_OF_TRUTH),
            lambda: made.truth(Recorder(made.tables), world()),
        ),
    )
    for hook, expected, is_expected, asked in hooks:
        try:
            answer("its", hook, expected, is_expected, asked)
        except PluginError as error:
            yield ConfigurationFault("scenario.mission", f'"{reference}"', str(error).removeprefix("its: "))


def _all_are(*kinds: type) -> Callable[[Any], bool]:
    return lambda values: all(isinstance(value, kinds) for value in values)


def _is_none_or(kind: Any) -> Callable[[Any], bool]:
    return lambda value: value is None or isinstance(value, kind)


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and value >= 0


def _are_pairs(values: Any) -> bool:
    return all(isinstance(text, str) for kind, name in values for text in (kind, name))


def _has(value: Any, parts: Iterable[str]) -> bool:
    return all(hasattr(value, part) for part in parts)


def _is_domain(value: Any) -> bool:
    return isinstance(value, Domain) and value.operators.keys() <= set(ELEMENTARY_TASKS)
