"""Compact data of a replay: one run, with mission tables as columns."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from missions.figure import Place, RunResults, Tiles
from missions.files import leaves
from missions.why import Causes
from visualisation.replay import tables as of_run
from visualisation.replay.tables import EVENTS, PLACE_STEP_M, TIME_STEP_S, Columns, Names
from visualisation.run_records import group_nodes, tracks

if TYPE_CHECKING:
    from remoras.work import Job

PLACE = ("x_m", "y_m")
KINDS = {"double": "float", "int64": "int"}  # kinds of number columns by Arrow type; all others are text


def add_own(columns: Columns, names: Names, table: Any, called: str) -> dict[str, Any]:
    """Add the earliest ``MOST_ROWS`` of a mission table with times as ``layer.called.column``; return its columns."""
    rows = table.slice(0, MOST_ROWS).to_pylist()
    kept = PLACE if set(PLACE) <= {*table.column_names} else ()
    columns.add(f"layer.{called}.time", [row["time_s"] for row in rows], 1, TIME_STEP_S)
    columns.add(f"layer.{called}.vehicle", [names.vehicle(row.get("vehicle")) for row in rows])
    for column in kept:
        columns.add(f"layer.{called}.{column}", [row[column] for row in rows], 1, PLACE_STEP_M)
    described = [
        {
            "name": field.name,
            "unit": (field.metadata or {}).get(b"unit", b"").decode(),
            "kind": (kind := KINDS.get(str(field.type), "text")),
            "values": [_shown(row[field.name], kind) for row in rows],
        }
        for field in table.schema
        if field.name not in ("time_s", "vehicle", *kept)
    ]
    return {"name": called, "n": len(rows), "total": table.num_rows, "has_places": bool(kept), "columns": described}


def _shown(value: Any, kind: str) -> Any:
    if kind == "text":
        return _text(value)
    if kind == "int" or value is None:
        return value
    return float(f"{value:.5g}") if math.isfinite(value) else None


def _text(value: Any) -> str:
    if isinstance(value, list):
        return " ".join(map(_text, value))
    return f"{value:.4g}" if isinstance(value, float) else "" if value is None else str(value)


FORM = 1
SHOWS = {
    "trajectories": "positions of the vehicles",
    "roles": "roles of the vehicles",
    "packets": "packets sent and received",
    "items": "items sent, and the knowledge of each vehicle",
    "organisation": "roles in the views of other vehicles",
    "decisions": "reasons of decisions",
    "plans": "progress of plans",
}
"""Content lost without a table."""
OWN = frozenset({*EVENTS, *SHOWS, "satisfaction", "knowledge", "deliveries", "unsaid"})
"""Common tables of runs; others belong to the mission."""
MOST_ROWS = 20_000  # maximum number of rows per mission table, the earliest


def run_data(
    results: RunResults, places: Sequence[Place] = (), jobs: Iterable[Job] = (), by_packets: bool = True
) -> bytes:
    """Return the compressed replay data of a run, reproducible byte by byte; OutputError without a readable scenario.

    A job with the name of a place is done there. ``by_packets`` is False if all vehicles share knowledge instantly.
    """
    scenario, columns = results.scenario_tables, Columns()
    vehicles = list(scenario.get("vehicle", ()))
    names = Names({vehicle["name"]: number for number, vehicle in enumerate(vehicles)}, {"": 0})
    depths_m = {vehicle["name"]: float(vehicle.get("depth_m", 0.0)) for vehicle in vehicles}
    contents: dict[str, Any] = {"form": FORM, "missing": missing(results)}
    if results.has("trajectories"):
        tracked = tracks(results)
        contents["track_rows"] = of_run.add_tracks(columns, names, tracked)
        depths_m |= {name: float(track.depth_m[-1]) for name, track in tracked.items()}
    contents["vehicles"] = [
        {
            "name": vehicle["name"], "node": vehicle.get("slot", number), "type": vehicle.get("vehicle_type", ""),
            "depth_m": depths_m[vehicle["name"]],
        }
        for number, vehicle in enumerate(vehicles)
    ]  # fmt: skip
    contents["events"] = [name for name in EVENTS if results.has(name)]
    for name in contents["events"]:
        of_run.add_events(columns, names, results.table(name), name)
    contents["groups"] = [
        {"name": node.name, "above": node.above, "is_founded": node.is_founded, "roles": node.roles}
        for node in group_nodes(scenario)
    ]
    of_run.add_causes(columns, names, Causes(results).moments())
    contents["header"] = _header(results, scenario, _add_said(columns, names, results))
    contents["world"] = _world(columns, names, results, places, {job.name: job.done for job in jobs})
    contents["by_packets"] = by_packets
    contents["milestones"] = [
        [milestone["name"], names.vehicle(milestone["vehicle"]), milestone["group"], milestone["time_s"]]
        for milestone in results.summary["milestones"]
    ]
    contents["texts"] = list(names.texts)
    return columns.block(contents)


def _add_said(columns: Columns, names: Names, results: RunResults) -> float | None:
    sent_items = of_run.SentItems()
    if results.has("packets") and results.has("items"):
        of_run.add_items(columns, names, results.rows("items"), sent_items)
        of_run.add_aside(columns, names, results.rows("knowledge"), sent_items)
    if not results.has("packets"):
        return None
    packets = results.table("packets")
    of_run.add_packets(columns, names, packets, results.rows("faults"), results.rows("refused"), sent_items)
    return of_run.slot_s_of(packets)


def _world(
    columns: Columns,
    names: Names,
    results: RunResults,
    places: Sequence[Place],
    done: Mapping[str, tuple[str, str]],
) -> dict[str, Any]:
    named = {place.name for place in places}
    world = results.scenario_tables.get("world", {})
    parts = [place.tiles for place in places if place.tiles is not None]
    columns.add("tiles.column", [column for tiles in parts for column, _ in tiles.squares], 1)
    columns.add("tiles.row", [row for tiles in parts for _, row in tiles.squares], 1)
    _add_tiles(columns, results, parts)
    known = OWN | {tiles.table for tiles in parts}
    own = {name: results.table(name) for name in results.tables if name not in known}
    return {
        "x_m": world.get("x_m"),
        "y_m": world.get("y_m"),
        "places": [
            {
                "name": place.name,
                "kind": place.kind,
                "outline_m": place.outline_m,
                "done": done.get(place.name),
                "tiles": None if place.tiles is None else {
                    "size_m": place.tiles.size_m, "attribute": place.tiles.attribute, "n": len(place.tiles.squares),
                },
            }
            for place in places
        ],
        "jobs": [{"name": name, "done": key} for name, key in done.items() if name not in named],
        "layers": [
            add_own(columns, names, table, name) for name, table in own.items() if "time_s" in table.column_names
        ],
    }  # fmt: skip


def _add_tiles(columns: Columns, results: RunResults, parts: Sequence[Tiles]) -> None:
    done: list[tuple[float, int]] = []
    first = 0
    for tiles in parts:
        numbers = {square: first + number for number, square in enumerate(tiles.squares)}
        first += len(tiles.squares)
        rows = ((row["time_s"], tuple(row[column] for column in tiles.columns)) for row in results.rows(tiles.table))
        done += [(time_s, numbers[square]) for time_s, square in rows if square in numbers]
    # In time order, so that the stored differences are small.
    done.sort()
    columns.add("done.time", [time_s for time_s, _ in done], 1, TIME_STEP_S)
    columns.add("done.tile", [tile for _, tile in done], 1)


def missing(results: RunResults) -> list[str]:
    """Return descriptions of missing content; empty with all tables."""
    return [
        content
        for name, content in SHOWS.items()
        if not results.has(name) or (name == "items" and not results.has("packets"))
    ]


def _header(results: RunResults, scenario: Mapping[str, Any], slot_s: float | None) -> dict[str, Any]:
    summary, manifest = results.summary, results.manifest
    communication, world = scenario.get("communication", {}), scenario.get("world", {})
    assumed = manifest.get("assumed")
    goal_fraction, end_s = float(summary.get("goal_fraction") or 0.0), results.ended_s
    return {
        **{key: summary.get(key, "") for key in ("scenario", "strategy", "policy")},
        "channel": " ".join([str(summary.get("channel", "")), *([f"({assumed})"] if assumed else [])]),
        "per": summary.get("per"),
        "seed": manifest.get("seed", summary.get("seed")),
        "version": manifest.get("version", ""),
        "run_id": manifest.get("run_id", ""),
        "completed": bool(summary.get("completed")),
        "is_underway": bool(summary.get("is_underway")),
        "verdict": _verdict(summary, goal_fraction),
        "end_s": end_s,
        "slot_s": slot_s,
        "frame_s": None if slot_s is None else slot_s * len(scenario.get("vehicle", ())),
        "range_m": communication.get("range_m"),
        "sound_mps": world.get("sound_speed_mps", 1500.0),
        "settings": {
            key: value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
            for key, value in leaves(scenario, first=0)
        },
    }


def _verdict(summary: Mapping[str, Any], goal_fraction: float) -> str:
    goal = f"{100.0 * goal_fraction:.4g} % of the goal"
    if summary.get("completed"):
        return f"completed, {goal}"
    if summary.get("is_underway"):
        return f"under way, {goal}"
    reason = summary.get("reason")
    return f"not completed, {goal}" + (f": {reason}" if reason else "")
