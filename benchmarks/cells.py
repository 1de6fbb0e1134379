"""The mapping mission many times over, side by side in one sea: a scenario of as many cells as are asked for."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import tomli_w

from missions.document import Document
from missions.scenarios import Scenario, load
from missions.scenarios.loading import scenario_from

BASE = "mapping-rendezvous"
PITCH_M = 1100.0
"""From a cell to the next; the waters of one are 900 m wide."""
MARGIN_M = 100.0
SLOTS = 10
GATEWAY = "Gateway"
PLACED = ("start_m", "position_m", "corners_m")


def _moved(value: Any, by_m: tuple[float, float]) -> Any:
    """A place, or a list of places, somewhere else."""
    if isinstance(value[0], list):
        return [_moved(place, by_m) for place in value]
    return [round(value[0] + by_m[0], 3), round(value[1] + by_m[1], 3)]


def _named(entry: dict[str, Any], rename: dict[str, str], by_m: tuple[float, float]) -> dict[str, Any]:
    """A vehicle, area or rally point of another cell."""
    found = deepcopy(entry)
    found["name"] = rename[found["name"]]
    for key in PLACED:
        if key in found:
            found[key] = _moved(found[key], by_m)
    return found


def _group(entry: dict[str, Any], rename: dict[str, str]) -> dict[str, Any]:
    """A group of another cell; its roles are called alike."""
    found = deepcopy(entry)
    found["name"], found["rally_point"] = rename[found["name"]], rename[found["rally_point"]]
    for role in found["role"]:
        if role.get("job") in rename:
            role["job"] = rename[role["job"]]
        if "played_by" in role:
            group, _, name = role["played_by"].partition(".")
            role["played_by"] = f"{rename[group]}.{name}"
    return found


def raw_of(columns: int, rows: int, size: int = SLOTS, joined: bool = True, hops: int = 2) -> dict[str, Any]:
    """Tables of a scenario with cells in columns and rows, each with its own mission, and gateways between neighbours.

    Args:
        columns, rows: of cells; those of a row are joined in line, and the first of each row with the next row's.
        size: vehicles of a cell, addresses of gateways among them.
        joined: True for gateways.
        hops: gateways that facts pass at most.
    """
    pairs = [((column, row), (column + 1, row)) for row in range(rows) for column in range(columns - 1)]
    pairs += [((0, row), (0, row + 1)) for row in range(rows - 1)]
    at = [(column, row) for row in range(rows) for column in range(columns)]
    n_addresses = {cell: sum(cell in pair for pair in pairs) if joined else 0 for cell in at}
    largest = load(BASE, [("--set", f"fleet.size={size}")])
    base = largest.model_dump(mode="json", exclude_none=True)
    kinds = ("vehicle", "area", "rally_point")
    found: dict[str, Any] = {**base, "cell": [], **{kind: [] for kind in (*kinds, "group")}}
    (west, east), (south, north) = base["world"]["x_m"], base["world"]["y_m"]
    found["world"]["x_m"] = [west - columns // 2 * PITCH_M, west + (columns + 1) // 2 * PITCH_M]
    found["world"]["y_m"] = [south - rows // 2 * PITCH_M, south + (rows + 1) // 2 * PITCH_M]
    for column, row in at:
        name, by_m = f"c{column}r{row}", ((column - columns // 2) * PITCH_M, (row - rows // 2) * PITCH_M)
        own = size - n_addresses[column, row]
        rename = {entry["name"]: f"{entry['name']} {name}" for kind in (*kinds, "group") for entry in base[kind]}
        vehicles = [_named(entry, rename, by_m) for entry in base["vehicle"][:own]]
        for kind in kinds[1:]:
            found[kind] += [_named(entry, rename, by_m) for entry in base[kind]]
        found["group"] += [_group(entry, rename) for entry in base["group"]]
        found["vehicle"] += vehicles
        found["cell"].append(
            {
                "name": name,
                "vehicles": [vehicle["name"] for vehicle in vehicles],
                "groups": [rename[entry["name"]] for entry in base["group"]],
                "x_m": [west + by_m[0], east + by_m[0]],
                "y_m": [south + by_m[1], north + by_m[1]],
            }
        )
    number = {cell: n for n, cell in enumerate(at)}
    found["gateway"] = []
    for one, other in pairs if joined else ():
        _join(found, base["vehicle"][0], number[one], number[other])
    if joined and pairs:
        found["cells"] = {"relays": ["areaDone"], "hops": hops, "interference_m": 1000.0}
    for slot, vehicle in enumerate(found["vehicle"]):
        vehicle["slot"] = slot
    return {key: value for key, value in found.items() if value not in ([], None)}


def _join(found: dict[str, Any], like: dict[str, Any], one: int, other: int) -> None:
    """Add a gateway between two cells: it stands at the border of the first, where the second begins."""
    here, there = found["cell"][one], found["cell"][other]
    x_m = here["x_m"][1] - MARGIN_M / 2 if there["x_m"] != here["x_m"] else sum(here["x_m"]) / 2
    y_m = here["y_m"][1] - MARGIN_M / 2 if there["y_m"] != here["y_m"] else sum(here["y_m"]) / 2
    pair = []
    for cell, beyond in ((here, there), (there, here)):
        name = f"{GATEWAY} {cell['name']} to {beyond['name']}"
        table = {**deepcopy(like), "name": name, "start_m": [x_m, y_m], "playable_roles": [], "sensor": []}
        found["vehicle"].append(table)
        cell["vehicles"].append(name)
        pair.append(name)
    found["gateway"].append({"vehicles": pair})


def scenario_of(raw: dict[str, Any], *settings: str) -> Scenario:
    """The scenario that tables are, with settings ``KEY=VALUE`` on top."""
    document = Document.of_text(tomli_w.dumps(raw), "cells.toml")
    return scenario_from(document, [("--set", setting) for setting in settings])
