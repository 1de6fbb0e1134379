"""Conformance check of sensors: ``check(settings, data, world)`` raises ``AssertionError``."""

import math
import random
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from exchange.arithmetic import distance
from missions.errors import OutputError
from missions.runs.setup import resolved
from missions.runs.tables import arrow_table
from missions.scenarios import load
from missions.scenarios.fleet import sensor_settings
from remoras.beliefs import Beliefs
from remoras.database import VehicleData
from remoras.errors import PluginError
from remoras.plugins import RAISED, named_error
from remoras.recorder import TABLES, TIME, VEHICLE, Row, Table
from remoras.sensor import Observation, Pose, Quiet, Sensor, SensorSettings
from remoras.testing.behaviours import difference, parts_of
from worldmodel import Instance, TBox, WorldModel, WorldModelError, core_ontology_paths, read_tbox

FIELD_M = 400.0
"""Half-width of the sampled square around the start of the vehicle."""
MOST_FOUND = 1000
"""Instances that a sensor may create along the track."""

Way = Sequence[tuple[Pose, float]]


def way(data: VehicleData, places_m: Sequence[tuple[float, float]] = (), seed: int = 1) -> Way:
    """Return a track, tick by tick: random, at varying speed, through all ``places_m``."""
    draw = random.Random(seed)
    x_m, y_m = data.start_m
    corners = [(x_m + draw.uniform(-FIELD_M, FIELD_M), y_m + draw.uniform(-FIELD_M, FIELD_M)) for _ in range(20)]
    targets = [*places_m, *corners]
    draw.shuffle(targets)
    ticks, now_s = [], 0.0
    for target in targets:
        speed_mps, heading_rad = draw.uniform(0.0, data.transit_speed_mps), draw.uniform(-math.pi, math.pi)
        for share in (0.5, 0.9, 0.98, 0.99, 1.0, 1.0):
            place = x_m + share * (target[0] - x_m), y_m + share * (target[1] - y_m)
            now_s += 1.0
            ticks.append((Pose(*place, data.depth_m, heading_rad, speed_mps), now_s))
        x_m, y_m = target
    return ticks


def check(
    settings: SensorSettings,
    data: VehicleData,
    world: Any,
    instances: Iterable[tuple[str, str]] = (),
    vocabulary: Sequence[Path] = (),
    places_m: Sequence[tuple[float, float]] = (),
) -> int:
    """Check the observations of a sensor along a track; return their number.

    ``instances`` are (class, name) of possible subjects besides the vehicle, ``vocabulary`` Turtle files besides the
    core ontology, ``places_m`` waypoints with something to observe. Raises AssertionError for invalid observations,
    rows or facts, nondeterminism, a modified world, or an observation that a ``Quiet`` excludes.
    """
    ticks = way(data, places_m)
    before = parts_of(world, "world")
    first, second = _made(settings, data), _made(settings, data)
    table = _checked_table(first)
    tbox = read_tbox(*core_ontology_paths(), *vocabulary)
    beliefs = _beliefs(data, tbox, instances)
    answers: list[list[Observation]] = []
    for pose, now_s in ticks:
        sensed, _ = _sensed(first, pose, world, now_s)
        for observation in sensed:
            assert table is not None or not observation.row, (
                f"t = {now_s} s: row {observation.row}, but its table is None"
            )
            _check_facts(observation, beliefs, now_s)
        answers.append(sensed)
    if table is not None:
        timed = zip(ticks, answers, strict=True)
        check_rows(
            table, [(now_s, data.name, *seen.row) for (_, now_s), sensed in timed for seen in sensed if seen.row]
        )
    # The second sensor looks after the first has finished, so state that both share shows.
    from_m, quiet = data.start_m, Quiet(0.0)
    for (pose, now_s), answer in zip(ticks, answers, strict=True):
        if now_s < quiet.until_s and distance(from_m, (pose.x_m, pose.y_m)) < quiet.until_m:
            assert not answer, f"t = {now_s} s: observed {answer}, but had stated {quiet} at {from_m}"
            continue
        other, quiet = _sensed(second, pose, world, now_s)
        from_m = pose.x_m, pose.y_m
        assert other == answer, f"t = {now_s} s: two sensors made alike answer {answer} and {other}"
    changed = difference(before, parts_of(world, "world"))
    assert not changed, f"the sensor changed the world, which all vehicles and runs share: {changed}"
    return sum(map(len, answers))


def conforms(name: str) -> Iterator[str]:
    """Check a named kind of sensors on a vehicle of ``mapping-rendezvous``; yield the number of its observations."""
    setup = resolved(load("mapping-rendezvous"))
    try:
        settings = sensor_settings({"type": name}, setup.mission.sensors)
    except ValidationError as error:
        keys = ", ".join(str(fault["loc"][0]) for fault in error.errors())
        raise PluginError(f"{keys} without a default; allowed: a default each") from None
    n = check(settings, setup.database["AUV01"], setup.mission.world(1), vocabulary=setup.mission.vocabulary)
    yield f"{n} observations along a track are valid and reproducible, and leave the world as it is"


def _made(settings: SensorSettings, data: VehicleData) -> Sensor:
    made = settings.make(data)
    assert callable(getattr(made, "sense", None)), f"make returned {made!r}, which has no sense(pose, world, now_s)"
    assert hasattr(made, "table"), f"{type(made).__name__} has no table: name its Table, or None if it writes no rows"
    return made


def _checked_table(sensor: Sensor) -> Table | None:
    table = sensor.table
    if table is None:
        return None
    assert isinstance(table, Table), f"table is {table!r}, expected a Table or None"
    assert table.columns[:2] == (TIME, VEHICLE), f"table {table.name}: its first columns must be TIME and VEHICLE"
    assert table.name not in {table.name for table in TABLES}, f"table {table.name}: the name of a table of every run"
    return table


def _sensed(sensor: Sensor, pose: Pose, world: Any, now_s: float) -> tuple[list[Observation], Quiet]:
    try:
        sensed = sensor.sense(pose, world, now_s)
    except RAISED as error:
        raise AssertionError(f"t = {now_s} s: sense raised {named_error(error)}") from error
    is_list = isinstance(sensed, Sequence) and all(isinstance(observation, Observation) for observation in sensed)
    assert is_list, f"t = {now_s} s: sense returned {sensed!r}, expected a list of Observation or a Quiet"
    return list(sensed), sensed if isinstance(sensed, Quiet) else Quiet(0.0)


def check_rows(table: Table, rows: Sequence[Row]) -> None:
    """Check that rows fit the columns of their table."""
    try:
        arrow_table(table, rows)
    except OutputError as error:
        raise AssertionError(str(error)) from None


def _check_facts(observation: Observation, beliefs: Beliefs, now_s: float) -> None:
    if not (observation.facts or observation.found):
        return
    try:
        beliefs.model.record(beliefs.facts_of(observation), now_s)
    except WorldModelError as error:
        raise AssertionError(f"t = {now_s} s: {observation} cannot be recorded: {error}") from error


def _beliefs(data: VehicleData, tbox: TBox, instances: Iterable[tuple[str, str]]) -> Beliefs:
    named = [(data.vehicle_type, data.name), *instances]
    known = tuple(Instance(uid, tbox.class_named(kind).uid, name) for uid, (kind, name) in enumerate(named))
    return Beliefs(WorldModel(tbox, 0, known, 0.1, n_origins=1, run_time_instances_per_origin=MOST_FOUND))
