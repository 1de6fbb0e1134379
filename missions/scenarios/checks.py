"""What has to hold between the parts of a scenario: names that are used exist, nothing is owned twice.

Works on the raw tables, so that these faults are reported together with those of single values; where a table
is malformed its checks pass it over.
"""

from __future__ import annotations

import importlib
import json
from collections import Counter
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from typing import Any

from pydantic import ValidationError

from exchange.acoustics.modems import modems
from missions.errors import ConfigurationFault
from missions.scenarios.channel import channel_faults
from missions.scenarios.policy import policy_faults
from missions.scenarios.tables import Raw, bounds_of, entries, names_of, one_of, point_of, table_of
from remoras.errors import StrategyError
from remoras.sensors import Seabed
from remoras.strategies import configured, strategies
from worldmodel import TBox, core_ontology_paths

MAX_CELLS = 4096
"""Cells of one area that ``mappedCell`` can name."""
MAX_COORDINATE_M = 9000.0
"""The ``position`` attribute reaches somewhat farther than the world may, for vehicles that drift out of it."""


def cross_faults(raw: Raw) -> list[ConfigurationFault]:
    """All faults between the tables of ``raw``."""
    checks = (
        _names, _slots, _times, _world, _areas, _choices, channel_faults, _needs, _groups, _played_by, _vehicles,
        _mission,
    )  # fmt: skip
    return [fault for check in checks for fault in check(raw)]


def _names(raw: Raw) -> Iterator[ConfigurationFault]:
    kinds = ("vehicle", "group", "area", "rally_point")
    counted = Counter(name for kind in kinds for name in names_of(raw, kind))
    first = {name: kind for kind in reversed(kinds) for name in names_of(raw, kind)}
    for name, count in counted.items():
        if count > 1:
            allowed = f"used {count} times; vehicles, groups, areas and rally points need names of their own"
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
    places = [(f"area.{a.get('name')}.corners_m", c) for a in entries(raw, "area") for c in _points(a, "corners_m")]
    places += [
        (f"rally_point.{r.get('name')}.position_m", p)
        for r in entries(raw, "rally_point")
        for p in point_of(r, "position_m")
    ]
    places += [(f"vehicle.{v.get('name')}.start_m", p) for v in entries(raw, "vehicle") for p in point_of(v, "start_m")]
    for key, (x, y) in places:
        if not (x_min <= x <= x_max and y_min <= y <= y_max):
            yield ConfigurationFault(
                key, f"[{x}, {y}]", f"outside the world, x {x_min} to {x_max}, y {y_min} to {y_max}"
            )


def _points(entry: Raw, key: str) -> list[tuple[float, float]]:
    corners = entry.get(key, [])
    return [p for c in corners for p in point_of({"c": c}, "c")] if isinstance(corners, list) else []


def _areas(raw: Raw) -> Iterator[ConfigurationFault]:
    cell_m = table_of(raw, "world").get("cell_m")
    for area in entries(raw, "area"):
        corners = _points(area, "corners_m")
        key = f"area.{area.get('name')}.corners_m"
        if len(corners) < 3:
            continue
        turns = [
            (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
            for a, b, c in zip(corners, corners[1:] + corners[:1], corners[2:] + corners[:2], strict=True)
        ]
        if not (all(turn > 0 for turn in turns) or all(turn < 0 for turn in turns)):
            yield ConfigurationFault(key, "", "not the corners of a convex polygon in order")
        elif isinstance(cell_m, int | float) and cell_m > 0:
            n_cells = _n_cells(corners, float(cell_m))
            if not 1 <= n_cells <= MAX_CELLS:
                yield ConfigurationFault(
                    key, f"{n_cells} cells of {cell_m} m", f"allowed: 1 to {MAX_CELLS}; change world.cell_m"
                )


def _n_cells(corners: Sequence[tuple[float, float]], cell_m: float) -> int:
    """Cells of an area; where there are far too many, about how many."""
    xs, ys = [x for x, _ in corners], [y for _, y in corners]
    in_box = (max(xs) - min(xs)) * (max(ys) - min(ys)) / cell_m**2
    return int(in_box) if in_box > 4 * MAX_CELLS else len(Seabed.of_areas(cell_m, {"": tuple(corners)}).cells)


def _choices(raw: Raw) -> Iterator[ConfigurationFault]:
    communication = table_of(raw, "communication")
    yield from one_of("communication.modem", communication.get("modem"), list(modems()))
    yield from policy_faults(raw)
    strategy = table_of(raw, "strategy").get("name")
    if isinstance(strategy, str) and ":" in strategy:
        needed = ("name", "declaration", "form", "adapt", "negotiator")
        faults = list(_object_faults("strategy.name", strategy, needed))
    else:
        faults = list(one_of("strategy.name", strategy, list(strategies())))
    yield from faults
    settings = table_of(table_of(raw, "strategy"), "parameters")
    if settings and isinstance(strategy, str) and not faults:
        found = named_object(strategy) if ":" in strategy else strategies()[strategy]
        for name, value in settings.items():
            try:
                configured(found, {name: value})
            except StrategyError as error:
                yield ConfigurationFault(f"strategy.parameters.{name}", json.dumps(value), error.allowed)


def _object_faults(key: str, reference: str, needed: Sequence[str]) -> Iterator[ConfigurationFault]:
    try:
        found = named_object(reference)
        missing = [name for name in needed if not hasattr(found, name)]
        if missing:
            yield ConfigurationFault(key, f'"{reference}"', f"an object that has {', '.join(missing)}")
        elif isinstance(found, type) and key == "strategy.name":
            yield ConfigurationFault(key, f'"{reference}"', "a class; name an object of it, such as STRATEGY = Class()")
    except Exception as error:  # it is somebody else's module: anything may be wrong with it
        what = f"{type(error).__name__}: {error}"
        yield ConfigurationFault(key, f'"{reference}"', f"package.module:object that can be imported ({what})")


def named_object(reference: str) -> Any:
    """The object named ``package.module:object``; raises ImportError, AttributeError or ValueError."""
    module, colon, name = reference.partition(":")
    if not (module and colon and name):
        raise ValueError("expected package.module:object")
    return getattr(importlib.import_module(module), name)


def _needs(raw: Raw) -> Iterator[ConfigurationFault]:
    needs = table_of(table_of(raw, "communication"), "needs")
    known = [attribute.name for attribute in TBox.read(*core_ontology_paths()).attributes]
    for name in needs:
        for fault in one_of(f"communication.needs.{name}", name, known):
            yield ConfigurationFault(fault.key, "", f"no attribute of the ontology; {fault.allowed}")


def _groups(raw: Raw) -> Iterator[ConfigurationFault]:
    vehicles = entries(raw, "vehicle")
    areas, rallies = names_of(raw, "area"), names_of(raw, "rally_point")
    all_roles = [f"{g.get('name')}.{name}" for g in entries(raw, "group") for name in names_of(g, "role")]
    for group in entries(raw, "group"):
        prefix = f"group.{group.get('name')}"
        yield from one_of(f"{prefix}.rally_point", group.get("rally_point"), rallies)
        roles = entries(group, "role")
        names = names_of(group, "role")
        heads = [role for role in roles if role.get("head")]
        if len(heads) != 1 or not heads[0].get("founding"):
            yield ConfigurationFault(
                f"{prefix}.role", f"{len(heads)} heads", "one role must be head = true and founding = true"
            )
        for role in roles:
            key = f"{prefix}.role.{role.get('name')}"
            yield from one_of(f"{key}.area", role.get("area"), areas)
            yield from one_of(f"{key}.played_by", role.get("played_by"), all_roles)
            influences = role.get("influences", [])
            for influenced in influences if isinstance(influences, list) else []:
                yield from one_of(f"{key}.influences", influenced, names)
            yield from _role_players(key, role, vehicles)


def _played_by(raw: Raw) -> Iterator[ConfigurationFault]:
    """A role that the holder of another must play needs a vehicle that is able to play both."""
    for group in entries(raw, "group"):
        for role in entries(group, "role"):
            other = role.get("played_by")
            if not isinstance(other, str) or "." not in other:
                continue
            names = {str(role.get("name")), other.split(".", 1)[1]}
            if not any(names <= set(map(str, v.get("playable_roles") or ())) for v in entries(raw, "vehicle")):
                key = f"group.{group.get('name')}.role.{role.get('name')}.played_by"
                yield ConfigurationFault(key, f'"{other}"', "no vehicle is able to play both roles")


def _role_players(key: str, role: Raw, vehicles: Sequence[Raw]) -> Iterator[ConfigurationFault]:
    able = [
        v for v in vehicles if isinstance(v.get("playable_roles"), list) and role.get("name") in v["playable_roles"]
    ]
    minimum, maximum = role.get("minimum", 0), role.get("maximum")
    if not able:
        yield ConfigurationFault(key, "", "no vehicle is able to play it: list it in playable_roles of one")
    elif isinstance(minimum, int) and len(able) < minimum:
        yield ConfigurationFault(f"{key}.minimum", str(minimum), f"only {len(able)} vehicles are able to play it")
    if isinstance(minimum, int) and isinstance(maximum, int) and minimum > maximum:
        yield ConfigurationFault(f"{key}.minimum", str(minimum), f"allowed: 0 to maximum = {maximum}")
    if role.get("head") and able and not any(v.get("social_layer", True) for v in able):
        names = ", ".join(str(v.get("name")) for v in able)
        yield ConfigurationFault(
            key,
            "",
            f"the group has no vehicle with the social layer to lead it: set social_layer = true for one of {names}",
        )
    if role.get("area") and able and not any(isinstance(v.get("sensor"), dict) for v in able):
        yield ConfigurationFault(key, "", "explores an area, but no vehicle able to play it has a [vehicle.sensor]")


def _vehicles(raw: Raw) -> Iterator[ConfigurationFault]:
    roles = sorted({name for group in entries(raw, "group") for name in names_of(group, "role")})
    founding = sorted(
        str(role.get("name"))
        for group in entries(raw, "group")
        for role in entries(group, "role")
        if role.get("founding")
    )
    for vehicle in entries(raw, "vehicle"):
        prefix = f"vehicle.{vehicle.get('name')}"
        playable = vehicle.get("playable_roles", [])
        for role in playable if isinstance(playable, list) else []:
            yield from one_of(f"{prefix}.playable_roles", role, roles)
        if isinstance(playable, list) and not set(founding).intersection(map(str, playable)):
            allowed = f"plays no founding role, so it would belong to no group; founding: {', '.join(founding)}"
            yield ConfigurationFault(f"{prefix}.playable_roles", "", allowed)
        depth, limit = vehicle.get("depth_m", 0.0), vehicle.get("depth_limit_m", 0.0)
        if isinstance(depth, int | float) and isinstance(limit, int | float) and depth > limit:
            yield ConfigurationFault(f"{prefix}.depth_m", str(depth), f"allowed: 0 to depth_limit_m = {limit}")
        slow, fast = vehicle.get("survey_speed_mps"), vehicle.get("transit_speed_mps")
        if isinstance(slow, int | float) and isinstance(fast, int | float) and slow > fast:
            yield ConfigurationFault(
                f"{prefix}.survey_speed_mps", str(slow), f"allowed: up to transit_speed_mps = {fast}"
            )


def _mission(raw: Raw) -> Iterator[ConfigurationFault]:
    reference = table_of(raw, "scenario").get("mission")
    if not isinstance(reference, str):
        return
    faults = list(
        _object_faults("scenario.mission", reference, ("Settings", "MISSIONS", "DELEGATING_MISSION", "NEEDS", "truth"))
    )
    if faults:
        yield from faults
        return
    mission = named_object(reference)
    try:
        mission.Settings.model_validate_json(json.dumps(table_of(raw, "mission"), default=str), strict=True)
    except ValidationError as error:
        for detail in error.errors():
            key = ".".join(["mission", *map(str, detail["loc"])])
            given = "" if detail["type"] == "missing" else str(detail.get("input"))
            known = list(mission.Settings.model_fields)
            unknown = detail["type"] == "extra_forbidden"
            nearest = get_close_matches(str(detail["loc"][-1]), known, n=1) if unknown else []
            hint = f"; did you mean {nearest[0]!r}?" if nearest else ""
            allowed = f"unknown key, allowed here: {', '.join(known)}{hint}" if unknown else str(detail["msg"])
            yield ConfigurationFault(key, given, allowed)
    for kind in ("vehicle", "group", "area", "rally_point"):
        for name in names_of(raw, kind):
            if name in mission.MISSIONS:
                yield ConfigurationFault(f"{kind}.{name}.name", f'"{name}"', "is the name of a mission")
    for group in entries(raw, "group"):
        yield from one_of(f"group.{group.get('name')}.mission", group.get("mission"), list(mission.MISSIONS))
    idle = [group.get("name") for group in entries(raw, "group") if group.get("mission") is None]
    if idle and all(group.get("mission") != mission.DELEGATING_MISSION for group in entries(raw, "group")):
        allowed = f'nobody gives the group its mission: one group must have mission = "{mission.DELEGATING_MISSION}"'
        yield ConfigurationFault(f"group.{idle[0]}.mission", "", allowed)
    missing = [name for name in mission.NEEDS if name not in table_of(table_of(raw, "communication"), "needs")]
    if missing:
        allowed = f"missing: {', '.join(missing)}; without them nobody learns what the mission needs"
        yield ConfigurationFault("communication.needs", "", allowed)
    roles = [name for group in entries(raw, "group") for name in names_of(group, "role")]
    for key in table_of(table_of(raw, "mission"), "importance"):
        if "." in key:
            yield from one_of(f"mission.importance.{key}", key.split(".")[0], roles)
