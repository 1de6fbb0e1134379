"""What has to hold between the tables of the mapping mission; malformed tables are passed over, as everywhere."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TypeGuard

from missions.errors import ConfigurationFault
from missions.mapping.finds import find_names, number_of
from missions.mapping.ground import grounds_of
from missions.mapping.scenario import FindsTable, MappingSettings
from missions.mapping.sensors import Seabed
from missions.mapping.survey import overlap
from missions.mapping.tasks import INSPECTION
from missions.scenarios.abilities import able_to_play, can_play
from missions.scenarios.tables import (
    Raw,
    entries,
    names_of,
    one_of,
    outside_faults,
    point_of,
    table_of,
)

MAX_CELLS = 4096
"""Cells of one area that ``mappedCell`` can name."""


def mapping_faults(raw: Raw, missions: Sequence[str]) -> Iterator[ConfigurationFault]:
    """All faults of areas, of roles that explore them, of importances, and of the goal.

    Args:
        raw: the tables as TOML has them.
        missions: names of missions, which no area may have.
    """
    found = list(_of_tables(raw, missions))
    yield from found or [*_overlaps(raw), *_goal(raw)]


def _of_tables(raw: Raw, missions: Sequence[str]) -> Iterator[ConfigurationFault]:
    """Faults of everything but overlaps and the goal, which can be judged only where there are none."""
    yield from _names(raw, missions)
    corners = [(f"area.{a.get('name')}.corners_m", c) for a in entries(raw, "area") for c in _corners(a)]
    yield from outside_faults(raw, corners)
    yield from _areas(raw)
    yield from _explorers(raw)
    yield from _mappers(raw)
    yield from _finds(raw)
    listed = [(group.get("name"), name) for group in entries(raw, "group") for name in names_of(group, "role")]
    for key in table_of(table_of(raw, "mission"), "importance"):
        role, dot, _ = key.rpartition(".")
        names = [f"{group}.{name}" if "." in role else name for group, name in listed]
        if dot:
            yield from one_of(f"mission.importance.{key}", role, names)


def _names(raw: Raw, missions: Sequence[str]) -> Iterator[ConfigurationFault]:
    forms_groups = any("formed_by" in entry for entry in entries(raw, "group"))
    for kind in ("vehicle", "group", "rally_point", "area") if forms_groups else ():
        if INSPECTION in names_of(raw, kind):
            yield ConfigurationFault(f"{kind}.{INSPECTION}.name", f'"{INSPECTION}"', "is the name of a mission")
    others = {name for kind in ("vehicle", "group", "rally_point") for name in names_of(raw, kind)}
    for name, count in Counter(names_of(raw, "area")).items():
        if count > 1 or name in others:
            allowed = f"used {count + (name in others)} times; areas need names of their own"
            yield ConfigurationFault(f"area.{name}.name", f'"{name}"', allowed)
        if name in missions:
            yield ConfigurationFault(f"area.{name}.name", f'"{name}"', "is the name of a mission")


def _corners(area: Raw) -> list[tuple[float, float]]:
    corners = area.get("corners_m", [])
    return [p for c in corners for p in point_of({"c": c}, "c")] if isinstance(corners, list) else []


def _areas(raw: Raw) -> Iterator[ConfigurationFault]:
    cell_m = table_of(raw, "world").get("cell_m")
    for area in entries(raw, "area"):
        corners = _corners(area)
        key = f"area.{area.get('name')}.corners_m"
        depth_m, vehicles = area.get("depth_m"), entries(raw, "vehicle")
        if _is_number(depth_m) and vehicles and not any(_stands(v, depth_m) for v in vehicles if v.get("sensor")):
            deepest = max((v.get("depth_limit_m", 0.0) for v in vehicles if v.get("sensor")), default=0.0)
            allowed = f"too deep for every vehicle with a sensor: allowed: above 0 to depth_limit_m = {deepest:g}"
            yield ConfigurationFault(f"area.{area.get('name')}.depth_m", str(depth_m), allowed)
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


def _overlaps(raw: Raw) -> Iterator[ConfigurationFault]:
    """Areas on the same ground: its cells would be work twice over, and each would be mapped for two areas."""
    areas = [(str(area.get("name")), _corners(area)) for area in entries(raw, "area")]
    for number, (name, corners) in enumerate(areas):
        for other, others in areas[:number]:
            if len(corners) >= 3 and len(others) >= 3 and overlap(corners, others):
                allowed = f"on the same ground as {other}: areas may share a border, and no more; move one of them"
                yield ConfigurationFault(f"area.{name}.corners_m", "", allowed)


def _n_cells(corners: Sequence[tuple[float, float]], cell_m: float) -> int:
    """Cells of an area; where there are far too many, about how many."""
    xs, ys = [x for x, _ in corners], [y for _, y in corners]
    in_box = (max(xs) - min(xs)) * (max(ys) - min(ys)) / (cell_m * cell_m)
    return int(in_box) if in_box > 4 * MAX_CELLS else len(Seabed.of_areas(cell_m, {"": tuple(corners)}).cells)


def _explorers(raw: Raw) -> Iterator[ConfigurationFault]:
    """Roles whose area is not there, or that nobody with a mapping sensor is able to play."""
    for group in entries(raw, "group"):
        for role in entries(group, "role"):
            key = f"group.{group.get('name')}.role.{role.get('name')}"
            word = "job" if "job" in role else "area"
            if word not in role:
                continue
            yield from one_of(f"{key}.{word}", role[word], [*names_of(raw, "area"), *find_names(number_of(raw))])
            able = able_to_play(raw, group.get("name"), role.get("name"))
            if able and not any(v.get("sensor") for v in able):
                allowed = "explores an area, but no vehicle able to play it has a [vehicle.sensor]"
                yield ConfigurationFault(key, "", allowed)


def _mappers(raw: Raw) -> Iterator[ConfigurationFault]:
    """Groups with fewer places for those who map than vehicles that may explore: somebody would explore in vain.

    Whoever has a role without a job, which none has from the start, maps what it explores.
    """
    for group in entries(raw, "group"):
        roles = entries(group, "role")
        exploring = [role.get("name") for role in roles if "area" in role or "job" in role]
        mapping = [role for role in roles if role.get("name") not in exploring and role.get("founding") is not True]
        limits = [limit for role in mapping if type(limit := role.get("maximum")) is int]
        able = [
            vehicle
            for vehicle in entries(raw, "vehicle")
            if vehicle.get("sensor") and any(can_play(vehicle, group.get("name"), name) for name in exploring)
        ]
        if not mapping or len(limits) < len(mapping):
            continue
        n_places = sum(limits)
        if n_places < len(able):
            key = f"group.{group.get('name')}.role.{mapping[-1].get('name')}.maximum"
            allowed = (
                f"allowed: {len(able) - n_places + limits[-1]} or more, or none; "
                f"{len(able)} vehicles may explore, and only the holder of such a role maps"
            )
            yield ConfigurationFault(key, str(limits[-1]), allowed)


def _finds(raw: Raw) -> Iterator[ConfigurationFault]:
    """More finds than there are cells, names that are taken, and limits that contradict each other."""
    given = table_of(raw, "finds")
    defaults = {key: field.default for key, field in FindsTable.model_fields.items()}
    number, cell_m = number_of(raw), table_of(raw, "world").get("cell_m")
    shortest_s, longest_s, radius_m = (
        given.get(key, defaults[key]) for key in ("shortest_stay_s", "longest_stay_s", "close_radius_m")
    )
    if given and _is_number(shortest_s) and _is_number(longest_s) and longest_s < shortest_s:
        yield ConfigurationFault(
            "finds.longest_stay_s", str(longest_s), f"allowed: shortest_stay_s = {shortest_s:g} or more"
        )
    if not number or not _is_number(cell_m) or cell_m <= 0:
        return
    if _is_number(radius_m) and radius_m > cell_m:
        allowed = f"allowed: 2 to world.cell_m = {cell_m:g}; a find may lie as far from where it was seen"
        yield ConfigurationFault("finds.close_radius_m", str(radius_m), allowed)
    areas = {str(area.get("name")): tuple(_corners(area)) for area in entries(raw, "area") if len(_corners(area)) >= 3}
    n_cells = sum(_n_cells(corners, float(cell_m)) for corners in areas.values())
    if number > n_cells:
        allowed = f"allowed: 0 to {n_cells}, the cells of all areas, each of which holds one at most"
        yield ConfigurationFault("finds.number", str(number), allowed)
    finds = find_names(number)
    roles = {role.get("job"): group for group in entries(raw, "group") for role in entries(group, "role")}
    if areas and any(find not in roles for find in finds):
        allowed = "nobody would inspect them: give a group a role with an area, and no role of its own named Inspector1"
        yield ConfigurationFault("finds.number", str(number), allowed)
    for kind in ("area", "vehicle", "group", "rally_point"):
        for name in names_of(raw, kind):
            if name in finds:
                yield ConfigurationFault(f"{kind}.{name}.name", f'"{name}"', "is the name of a find; rename it")


def _goal(raw: Raw) -> Iterator[ConfigurationFault]:
    """A goal that asks for more cells than the areas have that some vehicle is able to map."""
    goal = table_of(raw, "mission").get("goal", MappingSettings.model_fields["goal"].default)
    cell_m = table_of(raw, "world").get("cell_m")
    areas = [(str(area.get("name")), tuple(_corners(area))) for area in entries(raw, "area")]
    if not (_is_number(goal) and _is_number(cell_m) and cell_m > 0 and all(len(c) >= 3 for _, c in areas) and areas):
        return
    n_cells = {name: len(ground.cells) for name, ground in grounds_of(float(cell_m), tuple(areas)).items()}
    lacking = [name for name in n_cells if not _is_able_to_map(raw, name)]
    n_all = sum(n_cells.values())
    n_reached = n_all - sum(n_cells[name] for name in lacking)
    if n_reached < goal * n_all:
        allowed = (
            f"out of reach: no vehicle with a sensor is able to play a role with the job {', '.join(lacking)}; "
            f"allowed: above 0 to {math.floor(1000.0 * n_reached / n_all) / 1000.0:g}, the share of the other areas"
        )
        yield ConfigurationFault("mission.goal", str(goal), allowed)


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_able_to_map(raw: Raw, area: str) -> bool:
    """True if a vehicle with a sensor that stands its depth is able to play a role with the area."""
    roles = [
        (group.get("name"), role.get("name"))
        for group in entries(raw, "group")
        for role in entries(group, "role")
        if area in (role.get("job"), role.get("area"))
    ]
    depth_m = next((entry.get("depth_m", 0.0) for entry in entries(raw, "area") if entry.get("name") == area), 0.0)
    able = (vehicle for role in roles for vehicle in able_to_play(raw, *role) if vehicle.get("sensor"))
    return any(_stands(vehicle, depth_m) for vehicle in able)


def _stands(vehicle: Raw, depth_m: object) -> bool:
    """True if a vehicle stands a depth, or if one of the two is malformed."""
    limit_m = vehicle.get("depth_limit_m", 0.0)
    return not (_is_number(limit_m) and _is_number(depth_m)) or limit_m >= depth_m
