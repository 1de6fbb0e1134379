"""Conformance check of missions, by class and scenario, raising ``AssertionError``."""

import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import tomli_w

from missions.metric import NOT_APPLICABLE
from missions.runs.assembly import assemble
from missions.runs.metrics import metrics_of
from missions.runs.results import summary
from missions.runs.run import Run, result_of
from missions.runs.setup import Setup, resolved
from missions.scenarios import Scenario, load
from missions.scenarios.parts import mission_class
from remoras.activities import Activity, Objective
from remoras.database import VehicleData
from remoras.errors import PluginError
from remoras.fleet.fleet import Fleet
from remoras.htn import NoPlan, Task, plan
from remoras.mission import FleetView, Milestone, Mission
from remoras.plugins import plugin_folders
from remoras.recorder import TABLES, Recorder
from remoras.social.planning import Pursuit
from remoras.testing.behaviours import check as check_behaviour
from remoras.testing.behaviours import difference, parts_of
from remoras.testing.sensors import check_rows
from worldmodel import UnknownNameError

SEED = 1
OPERATORS = {"AllocateRoles", "GiveMission", "AssignObjective"}

Rows = dict[str, list[tuple[Any, ...]]]


def check(mission: type[Mission], scenario: Scenario) -> None:
    """Check a mission against its protocol; AssertionError if it violates it."""
    for _ in _passed(mission, scenario):
        pass


def conforms(name: str) -> Iterator[str]:
    """Run all checks of the mission of a scenario and yield their descriptions; AssertionError if one fails."""
    scenario = load(name)
    return _passed(mission_class(scenario.scenario.mission), scenario)


def _passed(mission: type[Mission], scenario: Scenario) -> Iterator[str]:
    reference = f"{mission.__module__}:{mission.__qualname__}"
    try:
        mission_class(reference)
    except PluginError as error:
        raise AssertionError(f"{reference}: {error}") from error
    table = scenario.scenario.model_copy(update={"mission": reference})
    scenario = scenario.model_copy(update={"scenario": table}).for_seed(SEED)
    assert isinstance(scenario, mission.Scenario), f"the scenario is no {mission.Scenario.__name__}"
    yield "has all compulsory parts"
    setup = resolved(scenario)
    check_words(setup)
    yield "its words are in the ontology"
    check_jobs(setup)
    yield "some vehicle can do each job"
    polled, waiting = check_activities(setup)
    yield "every activity has a behaviour, and each kind of them conforms"
    if waiting:
        yield f"not checked, since they have no activity before some fact is known: {', '.join(waiting)}"
    if polled:
        yield f"asked at every decision, since they state no deadline (until_s): {', '.join(polled)}"
    first, last = check_repeats(setup, scenario)
    yield "the mission does not change, and two missions of one scenario behave alike"
    check_truth_only_watches(setup, first)
    yield "truth does not affect vehicles"
    check_results(last)
    yield "results are complete: metrics, tables, completion or the reason why not"
    check_free_of_hashes(scenario)
    yield "the same seed gives the same rows in another process"


# Before a run


def check_words(setup: Setup) -> None:
    """Check names against the ontology, and the classes of objective arguments."""
    mission, tbox = setup.mission, setup.tbox
    for name in mission.needs:
        _attribute(setup, name, "needs")
    names = {instance.name: instance.class_uid for instance in setup.instances}
    founding, assigned = mission.founding_objectives(), assigned_objectives(setup)
    for objective in dict.fromkeys((*founding, *assigned)):
        assert objective.argument in names, f"objective {objective}: {objective.argument!r} is no instance"
        word = f"objective{objective.name}"
        if objective not in assigned and word not in {known.name for known in tbox.attributes}:
            continue  # all know it from the start, so none states it
        attribute = _attribute(setup, word, f"objective {objective}")
        kind = names[objective.argument]
        wanted = tbox.classes[attribute.range_class]
        fits = tbox.is_a(kind, attribute.range_class)
        assert fits, f"objective {objective}: {objective.argument} is a {tbox.classes[kind].name}, not a {wanted.name}"
    for job in mission.jobs.values():
        _attribute(setup, job.done[0], f"job {job.name}, done")


def _attribute(setup: Setup, name: str, where: str) -> Any:
    try:
        return setup.tbox.attribute_named(name)
    except UnknownNameError as error:
        raise AssertionError(f"{where}: the ontology has no attribute {name}; add it to the vocabulary") from error


def assigned_objectives(setup: Setup) -> list[Objective]:
    """Return the objectives that plans without any knowledge assign."""
    mission, goals = setup.mission, list[Objective]()
    for group in setup.agreement.organisation.groups:
        for task_name in mission.group_missions:
            planned = plan(mission.social_domain, {}, Task(task_name, (group,)))
            if isinstance(planned, NoPlan):
                continue
            for task in planned.tasks:
                assert task.name in OPERATORS, f"{task} is none of the tasks {', '.join(sorted(OPERATORS))}"
                if task.name == "AssignObjective":
                    goals.append(Objective(*task.args))
    return goals


def check_jobs(setup: Setup) -> None:
    """Check that every job belongs to a role with a vehicle able to do both."""
    for name, job in setup.mission.jobs.items():
        assert job.name == name, f"job {name!r} calls itself {job.name!r}"
        # Of groups yet to form, too.
        roles = [place for place, role in setup.scenario.roles.items() if role.job == name]
        able = [d for d in setup.database.values() if job.is_able(d) and any(d.can_play(*role) for role in roles)]
        assert able, f"job {name!r}: no vehicle able to play a role with it is able to do it"


class InitialFacts:
    """Facts known before any event: members of roles and instances of classes."""

    def __init__(self, setup: Setup) -> None:
        self._setup, self._organisation = setup, setup.agreement.organisation

    def get(self, key: Any, default: Any = None, /) -> Any:
        """Return members or instances; other facts are unknown."""
        if key[0] == "instances":
            tbox = self._setup.tbox
            wanted = tbox.class_named(key[1]).uid
            return tuple(instance.name for instance in self._setup.instances if tbox.is_a(instance.class_uid, wanted))
        return self._organisation.members(*key[1].split(".")) if key[0] == "members" else default


def check_activities(setup: Setup) -> tuple[list[str], list[str]]:
    """Check the activity sets; return names of sets without deadlines, and of objectives that wait for a fact."""
    mission, knowledge, polled, waiting = setup.mission, InitialFacts(setup), set[str](), set[str]()
    kinds = set[tuple[object, ...]]()  # each is checked once, with one argument
    for objective in dict.fromkeys((*mission.founding_objectives(), *assigned_objectives(setup))):
        players = [data for data in setup.database.values() if data.can_play(objective.group, objective.role)]
        pursuits = [Pursuit(data, mission) for data in players]
        pursued = [
            pursuit.sets([objective], knowledge, data.start_m) for pursuit, data in zip(pursuits, players, strict=True)
        ]
        if not any(pursued):
            assert any(p.rests_on for p in pursuits), f"objective {objective}: no vehicle has an activity for it"
            waiting.add(objective.name)
        for data, sets in zip(players, pursued, strict=True):
            for activities in sets:
                types = [activity.type for activity in activities.activities]
                assert len(set(types)) == len(types), f"{objective}, {activities.name}: two activities of one type"
                others = tuple(name for name in setup.database.names if name != data.name)
                groups = tuple(setup.agreement.organisation.groups)
                try:
                    made = partial(_behaviour, mission, activities.activities[0], data)
                    kind = objective.name, activities.name, data, type(made())
                    if kind not in kinds and not check_behaviour(made, data, others, groups):
                        polled.add(activities.name)
                    kinds.add(kind)
                except AssertionError as error:
                    raise AssertionError(f"{objective}, activity {activities.name} of {data.name}: {error}") from error
    return sorted(polled), sorted(waiting)


def _behaviour(mission: Mission, activity: Activity, data: VehicleData) -> Any:
    made = mission.behaviour_for(activity, data)
    assert hasattr(made, "perceive"), f"behaviour_for returned {made!r}, expected a Behaviour"
    return made


# Runs


def check_repeats(setup: Setup, scenario: Scenario) -> tuple[Rows, Run]:
    """Check determinism of repeated runs and of a second mission object, and its immutability.

    Return the rows, and the run of the second mission object.
    """
    first = recorded_rows(finished(setup).recorder)
    before = parts_of(setup.mission, "mission")
    again = recorded_rows(finished(setup).recorder)
    changed = difference(before, parts_of(setup.mission, "mission"))
    assert not changed, f"a run changes the mission, which all vehicles and runs share: {changed}"
    _same(first, again, "two runs of one mission object differ")
    another = resolved(scenario)
    fleet = finished(another)
    _same(first, recorded_rows(fleet.recorder), "from_scenario makes two missions of one scenario that differ")
    return first, result_of(another, SEED, fleet, 0.0)


def finished(setup: Setup, truth: Any = None) -> Fleet:
    """Return the fleet after a run, optionally with another referee."""
    fleet = assemble(setup, SEED)
    if truth is not None:
        fleet.truth = truth
    fleet.run()
    return fleet


def recorded_rows(recorder: Recorder) -> Rows:
    """Return all recorded rows."""
    return {name: list(recorder.rows(name)) for name in recorder.tables}


def _same(rows: Rows, others: Rows, claim: str) -> None:
    for name in rows:
        assert rows[name] == others[name], f"{claim}, first in table {name}"


@dataclass
class Unseeing:
    """Referee without observations; the run lasts until ``end_s``."""

    end_s: float
    milestones: list[Milestone] = field(default_factory=list)
    goal_fraction: float = 1.0
    is_over: bool = False

    def observe(self, fleet: FleetView, now_s: float) -> bool:
        """Ignore the fleet; True at ``end_s``."""
        return now_s >= self.end_s

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Return no reason."""
        return ""


def check_truth_only_watches(setup: Setup, watched: Rows) -> None:
    """Check that the mission's referee does not affect vehicles."""
    end_s = watched["trajectories"][-1][0]
    unwatched = recorded_rows(finished(setup, Unseeing(end_s)).recorder)
    for table in TABLES:
        column = table.column_names.index("time_s")
        own = [row for row in watched[table.name] if row[column] < end_s]
        others = [row for row in unwatched[table.name] if row[column] < end_s]
        assert own == others, f"truth changes what vehicles do: table {table.name} differs without observer"


def check_results(finished_run: Run) -> None:
    """Check metrics, table rows, milestone order, and the reason of an incomplete run."""
    mission, recorder = finished_run.mission, finished_run.recorder
    assert finished_run.completed or finished_run.reason, "the mission did not complete, and truth has no reason"
    try:
        values = summary(finished_run)
    except PluginError as error:
        raise AssertionError(str(error)) from error
    for name, metric in metrics_of(finished_run.scenario).items():
        applies = name in values or metric.of(finished_run) is NOT_APPLICABLE
        assert applies, f"metric {name} is missing in the summary though it applies"
    for table in mission.tables:
        assert table.name in recorder.tables, f"table {table.name} was not declared to the recorder"
        check_rows(table, recorder.rows(table.name))
    times_s = [milestone.time_s for milestone in finished_run.milestones]
    assert times_s == sorted(times_s), "milestones are not in time order"


HASH_SEEDS = ("1", "2")


def check_free_of_hashes(scenario: Scenario) -> None:
    """Check that processes with different hash seeds record equal rows, with equal import paths."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scenario.toml"
        tables = scenario.model_dump(mode="json", exclude_none=True)
        file.write_text(tomli_w.dumps(tables), encoding="utf-8")
        program = (
            f"import sys; sys.path[:0] = {sys.path!r}\n"
            f"from remoras.plugins import look_in\nlook_in({plugin_folders()!r})\n"
            f"from remoras.testing.missions import mission_digest\nprint(mission_digest({str(file)!r}))"
        )
        started = [
            subprocess.Popen(
                [sys.executable, "-c", program],
                env={**os.environ, "PYTHONHASHSEED": seed},
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
            for seed in HASH_SEEDS
        ]
        outputs = [process.communicate() for process in started]
    assert all(process.returncode == 0 for process in started), f"cannot be run in another process: {outputs[0][1]}"
    digests = {digest for digest, _ in outputs}
    assert len(digests) == 1, "results depend on the order of a set, on hash() or on id()"


def mission_digest(scenario: str) -> str:
    """Return a digest of all rows of a run of a scenario file."""
    rows = recorded_rows(finished(resolved(load(scenario))).recorder)
    return hashlib.sha256(json.dumps(rows).encode()).hexdigest()
