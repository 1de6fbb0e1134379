"""Checks of mapping: covered cells, by time and vehicle, and their share of the goal.

A cell is covered if its centre is within half a swath of a vehicle with an active, working mapping sensor, whose ground
speed does not exceed the sensor's limit (docs/model/mapping.md, "Survey rows").
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from missions.verification.motion import over_ground_mps
from missions.verification.record import (
    ANGLE_STEP_RAD,
    PLACE_STEP_M,
    SPEED_STEP_MPS,
    Array,
    Cell,
    CheckReport,
    Record,
    Track,
)

SENSING = {"Mapping", "Inspecting"}  # activities during which sensors are on
REACH_M = PLACE_STEP_M  # rounding tolerance of a distance to a cell centre (m)
SHARE = 2e-9


class MappingSwath(NamedTuple):
    """Mapping sensor with half its swath and its maximum speed."""

    name: str
    reach_m: float
    limit_mps: float


def cells_of(record: Record) -> dict[Cell, str]:
    """Return the first area of each cell with its centre inside or on a west or south border."""
    size_m = float(record.of("world")["cell_m"])
    area_of: dict[Cell, str] = {}
    for area in record.scenario.get("area", []):
        corners = np.array(area["corners_m"], dtype=float)
        low, high = np.floor(corners.min(0) / size_m).astype(int), np.ceil(corners.max(0) / size_m).astype(int)
        x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]), indexing="ij")
        centre_x, centre_y = (x + 0.5) * size_m, (y + 0.5) * size_m
        inside = np.zeros(x.shape, dtype=bool)
        # Even-odd rule with a ray to the east; sides include their lower end only, so that a corner counts once.
        for sides in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            (ax, ay), (bx, by) = sorted(sides, key=lambda corner: float(corner[1]))
            level = (ay <= centre_y) & (centre_y < by)
            inside ^= level & (ax + (centre_y - ay) / (by - ay or 1.0) * (bx - ax) > centre_x)
        for column, row in zip(x[inside].tolist(), y[inside].tolist(), strict=True):
            area_of.setdefault((column, row), area["name"])
    return area_of


def mapping_swaths(data: dict[str, Any]) -> list[MappingSwath]:
    """Return the mapping sensors of a vehicle."""
    return [
        MappingSwath(s.get("name") or s.get("type") or "mapping", s["swath_m"] / 2.0, s["speed_limit_mps"])
        for s in data.get("sensor", [])
        if "swath_m" in s
    ]


def sensor_was_on(record: Record, name: str, times_s: Array) -> tuple[Array, Array]:
    """Return for each tick if the sensors were possibly on, and if certainly on.

    The last decision before a tick counts. A received packet may end an activity without a row until the next decision,
    so certainty needs all decisions of the following period. Rows do not separate decisions at one time: any of them
    makes on possible, only all of them certain.
    """
    perhaps, surely = dict[float, bool](), dict[float, bool]()
    for time_s, vehicle, rows in record.decisions:
        if vehicle == name:
            is_on = any(row.chosen and not SENSING.isdisjoint(row.activities) for row in rows)
            perhaps[time_s] = perhaps.get(time_s, False) | is_on
            surely[time_s] = surely.get(time_s, True) & is_on
    for spell in record.spells:
        if spell.vehicle == name and spell.kind == "restarts":
            perhaps[spell.from_s] = surely[spell.from_s] = False
    when = np.array(sorted(perhaps))
    certain = np.array([False, *(surely[index] for index in when)])
    since = np.searchsorted(when, times_s, side="left")
    until = np.searchsorted(when, times_s + record.without_decision_s, side="right")
    n_off = np.concatenate(([0], np.cumsum(~certain)))  # cumulative number of decisions that are not certain
    return np.array([False, *(perhaps[index] for index in when)])[since], n_off[until + 1] == n_off[since]


def check_ground(record: Record, report: CheckReport) -> None:
    """Check covered cells against tracks in both directions, and the goal against both."""
    cells = cells_of(record)
    stated: dict[str, dict[Cell, float]] = {name: {} for name in record.vehicles}
    columns = "time_s vehicle cell_x cell_y"
    for wrong, time_s, vehicle, x, y in report.each("coverage", record, "coverage", columns):
        if (x, y) not in cells:
            wrong(f"cell ({x}, {y})", "none: it lies in no area")
        elif (x, y) in stated[vehicle]:
            wrong(f"cell ({x}, {y})", f"none: covered at {stated[vehicle][x, y]:g} s")
        else:
            stated[vehicle][x, y] = time_s
    for name, track in record.tracks.items():
        _check_vehicle(record, name, track, cells, stated[name], report)
    _check_goal(record, cells, report)


def _check_vehicle(
    record: Record,
    name: str,
    track: Track,
    cells: dict[Cell, str],
    stated: dict[Cell, float],
    report: CheckReport,
) -> None:
    time_s = track.time_s
    was_on, was_surely_on = sensor_was_on(record, name, time_s)
    awake = was_on & ~record.away(name, time_s)
    ground_mps, error_mps = over_ground_mps(record, track)
    surely: dict[Cell, float] = {}
    perhaps: dict[Cell, list[float]] = {}
    for swath in mapping_swaths(record.vehicles[name]):
        dead = [spell for spell in record.spells if spell.vehicle == name and swath.name in spell.dead_sensors]
        on = awake & ~record.lasting(dead, time_s)
        # Tolerances widen what is possible and narrow what is certain.
        most_mps = swath.limit_mps * (1.0 + record.spread)
        slow = ground_mps <= most_mps * 1.000001 + error_mps
        is_slow = ground_mps < swath.limit_mps * (1.0 - record.spread) * 1.000001 - error_mps / 2.0
        if not (record.spread or record.of("current")):  # else rounded headings hide the ground speed
            is_slow |= _is_steady(track, swath.limit_mps)
        is_sure = (is_slow & was_surely_on).tolist()
        for row, cell, distance_m in _below(record, track, np.flatnonzero(on & slow), swath.reach_m + REACH_M, cells):
            perhaps.setdefault(cell, []).append(time_s[row])
            if is_sure[row] and distance_m < swath.reach_m - REACH_M:
                surely[cell] = min(surely.get(cell, math.inf), float(time_s[row]))
    report.look("swath", len(stated) + len(surely))
    for cell, at_s in stated.items():
        if at_s not in perhaps.get(cell, []):
            report.add("swath", "coverage", at_s, name, f"cell {cell}", "none: no working swath of it was over it then")
    if record.of("uncertainty").get("p_miss"):
        report.skip("cells that must be covered", "in which ticks sensors miss is drawn by the seed")
        return
    for cell, at_s in sorted(surely.items(), key=lambda item: item[1]):
        if cell not in stated:
            report.add("swath", "coverage", at_s, name, f"no row of cell {cell}", "it was below its working swath")
        elif stated[cell] > at_s:
            first = f"cell {cell} first at {stated[cell]:g} s"
            report.add("swath", "coverage", stated[cell], name, first, f"{at_s:g} s")


def _is_steady(track: Track, speed_mps: float) -> Array:
    turned_rad = (np.diff(track.heading_rad) + math.pi) % (2.0 * math.pi) - math.pi
    steady: Array = np.abs(track.speed_mps - speed_mps) <= SPEED_STEP_MPS / 2.0
    steady[1:] &= steady[:-1].copy() & (np.abs(turned_rad) <= 2.0 * ANGLE_STEP_RAD)
    return steady


def _below(
    record: Record, track: Track, rows: Array, reach_m: float, cells: dict[Cell, str]
) -> Iterable[tuple[int, Cell, float]]:
    if not cells or not len(rows):
        return
    size_m = float(record.of("world")["cell_m"])
    listed = np.array(list(cells))
    low = listed.min(0)
    grid = np.zeros(listed.max(0) - low + 1, dtype=bool)
    grid[tuple((listed - low).T)] = True
    x_m, y_m = track.x_m[rows], track.y_m[rows]
    column, line = np.floor(x_m / size_m).astype(int), np.floor(y_m / size_m).astype(int)
    around = range(-math.ceil(reach_m / size_m) - 1, math.ceil(reach_m / size_m) + 2)
    for dx in around:
        for dy in around:
            to_x, to_y = column + dx - low[0], line + dy - low[1]
            apart_m = np.hypot((column + dx + 0.5) * size_m - x_m, (line + dy + 0.5) * size_m - y_m)
            near = (apart_m <= reach_m) & (to_x >= 0) & (to_y >= 0) & (to_x < grid.shape[0]) & (to_y < grid.shape[1])
            near[near] = grid[to_x[near], to_y[near]]
            within = zip((to_x[near] + low[0]).tolist(), (to_y[near] + low[1]).tolist(), strict=True)
            yield from zip(rows[near].tolist(), within, apart_m[near].tolist(), strict=True)


def find_weight(record: Record) -> float:
    """Return the weight of a feature: cells that an able vehicle maps in a mean dwell."""
    finds, size_m = record.of("finds"), float(record.of("world")["cell_m"])
    depth_m = {area["name"]: float(area.get("depth_m") or 0.0) for area in record.scenario["area"]}
    surveys = [(key, depth_m[role["job"]]) for key, role in record.declared_roles.items() if role.get("job") in depth_m]
    cell_s = [
        size_m * size_m / (2.0 * swath.reach_m * min(data["survey_speed_mps"], swath.limit_mps))
        for name, data in record.vehicles.items()
        if any(record.is_able(name, role) and data["depth_limit_m"] >= deep_m for role, deep_m in surveys)
        for swath in mapping_swaths(data)[:1]
    ]
    stay_s = (finds["shortest_stay_s"] + finds["longest_stay_s"]) / 2.0
    return stay_s * len(cell_s) / math.fsum(cell_s) if cell_s else 1.0


def _check_goal(record: Record, cells: dict[Cell, str], report: CheckReport) -> None:
    n_finds = int(record.of("finds").get("number", 0))
    weight = find_weight(record) if n_finds else 0.0
    whole = len(cells) + weight * n_finds
    if not whole:
        return
    first = record.covered
    inspected_s = [stone["time_s"] for stone in record.milestones("inspected")]
    goal = float(record.of("mission")["goal"])
    table = record["goal"]
    stated_s = np.append(np.asarray(table["time_s"]), math.inf)
    gains = sorted(
        [(first[cell][0], 1.0) for cell in cells if cell in first] + [(at_s, weight) for at_s in inspected_s]
    )
    when, done = np.array([at_s for at_s, _ in gains]), np.cumsum([gain for _, gain in gains])
    n_done = np.searchsorted(when, stated_s + TIME_S, side="right")
    share = np.concatenate([[0.0], done]) / whole
    follows = np.minimum(1.0, share[n_done] / goal)
    report.look("goal", len(table) + 1)
    for row in np.flatnonzero(np.abs(np.asarray(table["goal_fraction"]) - follows[:-1]) > SHARE):
        stated = f"goal_fraction {table['goal_fraction'][row]:.9g}"
        report.add("goal", "goal", stated_s[row], "", stated, f"{follows[row]:.9g}, by what is covered of all")
    times_s = np.unique(when)
    before = share[np.searchsorted(when, times_s - TIME_S)]
    for at_s in times_s[(before < goal) & (np.abs(stated_s - times_s[:, None]).min(1, initial=math.inf) > TIME_S)]:
        report.add("goal", "goal", at_s, "", "no row", "one: the share of the goal changed")
    last = round(float(follows[-1]), 6)
    report.same("goal", "summary", "goal_fraction", record.summary.get("goal_fraction"), last, 1.1e-6)


TIME_S = 2.0**-11  # tolerance of two roundings of one time (s)
