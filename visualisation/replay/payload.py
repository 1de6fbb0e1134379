"""The data of a replay: one run, as compact as a page needs it."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Protocol

from missions.figure import Place, RunResults
from visualisation.errors import DrawingError
from visualisation.replay import tables as of_run
from visualisation.replay.columns import Columns
from visualisation.replay.own_tables import add_own
from visualisation.replay.tables import EVENTS, TIME_STEP_S, Names, Tables

FORM = 1
"""Form of the data; the page says so where it cannot read it."""
CONTENTS = ("arrivals_s", "item_uids", "status_uids", "signal_roles", "signal_addressed", "signal_values")
SHOWS = {
    "trajectories": "where the vehicles were",
    "roles": "who played what",
    "packets": "what was sent and heard",
    "items": "what was said, and what each vehicle knew of it",
    "organisation": "who played what in the eyes of the others",
    "decisions": "why a vehicle chose what it did",
}
"""What cannot be shown without a table, or without its newer columns."""
OWN = frozenset({*EVENTS, *SHOWS, "satisfaction", "knowledge", "facts"})
"""Tables that every run may have; those beside them are its mission's."""
MOST_ROWS = 20_000
"""Of a mission's own table no more rows are shown, the earliest."""


class Job(Protocol):
    """What is shown of a ``remoras.work.Job``."""

    @property
    def name(self) -> str:
        """Name of the job."""

    @property
    def done(self) -> tuple[str, str]:
        """The fact that says that it is done: attribute and subject."""


def run_data(
    results: RunResults, places: Sequence[Place] = (), jobs: Iterable[Job] = (), is_bound: bool = False
) -> bytes:
    """All that a replay shows of a run, compressed; the same bytes for the same results.

    Args:
        results: of the run; older ones may lack tables, and the page says what it cannot show for that.
        places: that its mission declares.
        jobs: of the mission; one that is called like a place is done there.
        is_bound: whether the strategy is a bound under which all know at once what any vehicle says.

    Raises:
        DrawingError: the manifest of the run holds no scenario that can be read.
    """
    scenario = _scenario(results)
    vehicles = list(scenario.get("vehicle", ()))
    names = Names({vehicle["name"]: number for number, vehicle in enumerate(vehicles)}, {"": 0})
    columns, tables = Columns(), Tables(results)
    about: dict[str, Any] = {"form": FORM, "header": _header(results, scenario, _slot_s(tables.find("packets")))}
    about["vehicles"] = [
        {"name": vehicle["name"], "node": vehicle.get("slot", number), "type": vehicle.get("vehicle_type", "")}
        for number, vehicle in enumerate(vehicles)
    ]
    about["missing"] = _missing(tables)
    if (track := tables.find("trajectories")) is not None:
        about["track_rows"] = of_run.add_tracks(columns, names, track)
        for vehicle, depth_m in zip(about["vehicles"], _depths_m(track, vehicles), strict=True):
            vehicle["depth_m"] = depth_m
    about["events"] = []
    for name, kinds in EVENTS.items():
        if (table := tables.find(name, kinds)) is not None:
            of_run.add_events(columns, names, table, name, kinds)
            about["events"].append(name)
    _add_said(columns, names, tables)
    about["world"] = _world(columns, names, tables, scenario, places, jobs)
    about["is_bound"] = is_bound
    about["milestones"] = [
        [one["name"], names.vehicle(one["vehicle"]), one["group"], one["time_s"]]
        for one in results.summary["milestones"]
    ]
    about["texts"] = list(names.texts)
    return columns.block(about)


def _scenario(results: RunResults) -> dict[str, Any]:
    try:
        return tomllib.loads(results.manifest["scenario"])
    except (tomllib.TOMLDecodeError, TypeError) as error:
        raise DrawingError(f"{results!r}: the scenario in its manifest is damaged: {error}") from None


def missing(results: RunResults) -> list[str]:
    """What cannot be shown of a run, in words; empty for one that recorded all that this version records."""
    return _missing(Tables(results))


def _missing(tables: Tables) -> list[str]:
    lacking = {name for name in SHOWS if tables.find(name) is None}
    if tables.find("packets") is not None and tables.find("packets", CONTENTS) is None:
        lacking.add("items")
    return [what for name, what in SHOWS.items() if name in lacking]


def _header(results: RunResults, scenario: Mapping[str, Any], slot_s: float | None) -> dict[str, Any]:
    summary, manifest = results.summary, results.manifest
    communication, world = scenario.get("communication", {}), scenario.get("world", {})
    goal_fraction, end_s = float(summary.get("goal_fraction") or 0.0), float(summary.get("mission_time_s") or 0.0)
    return {
        **{key: summary.get(key, "") for key in ("scenario", "strategy", "policy", "channel")},
        "per": summary.get("per"),
        "seed": manifest.get("seed", summary.get("seed")),
        "version": manifest.get("version", ""),
        "run_id": manifest.get("run_id", ""),
        "completed": bool(summary.get("completed")),
        "goal_fraction": goal_fraction,
        "verdict": _verdict(summary, goal_fraction),
        "end_s": end_s,
        "duration_s": float(scenario.get("scenario", {}).get("duration_s", end_s)),
        "slot_s": slot_s,
        "frame_s": None if slot_s is None else slot_s * len(scenario.get("vehicle", ())),
        "range_m": communication.get("range_m"),
        "sound_mps": world.get("sound_speed_mps", 1500.0),
        "datum": world.get("origin_deg"),
        "settings": dict(_settings(scenario)),
    }


def _settings(value: Any, key: str = "") -> Iterator[tuple[str, str]]:
    """The scenario as settings, key and value as one gives them to ``--set``."""
    if isinstance(value, Mapping):
        parts: Iterable[tuple[str, Any]] = value.items()
    elif isinstance(value, list) and any(isinstance(one, Mapping) for one in value):
        parts = ((str(one.get("name", number)), one) for number, one in enumerate(value))
    else:
        yield key, value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
        return
    for name, part in parts:
        yield from _settings(part, f"{key}.{name}" if key else name)


def _verdict(summary: Mapping[str, Any], goal_fraction: float) -> str:
    """Completed or not, how much of the goal, and why not."""
    goal = f"{100.0 * goal_fraction:.4g} % of the goal"
    if summary.get("completed"):
        return f"completed, {goal}"
    reason = summary.get("reason")
    return f"not completed, {goal}" + (f": {reason}" if reason else "")


def _slot_s(packets: Any) -> float | None:
    """Length of a TDMA slot, as the packets tell it; None without two of them."""
    if packets is None or packets.num_rows < 2:
        return None
    slots, starts_s = of_run.array(packets["slot"]), of_run.array(packets["time_s"])
    return float((starts_s[-1] - starts_s[0]) / (slots[-1] - slots[0])) if slots[-1] > slots[0] else None


def _depths_m(track: Any, vehicles: Sequence[Mapping[str, Any]]) -> list[float]:
    """Depth of each vehicle: as it was recorded, else as the scenario has it."""
    depths_m = [float(vehicle.get("depth_m", 0.0)) for vehicle in vehicles]
    if "depth_m" in track.column_names:
        recorded = dict(zip(track["vehicle"].to_pylist(), track["depth_m"].to_pylist(), strict=True))
        depths_m = [recorded.get(one["name"], depth_m) for one, depth_m in zip(vehicles, depths_m, strict=True)]
    return depths_m


def _add_said(columns: Columns, names: Names, tables: Tables) -> None:
    """Packets, and the items that they carried."""
    items: dict[str, int] = {}
    has_contents = tables.find("packets", CONTENTS) is not None
    if has_contents and (recorded := tables.find("items")) is not None:
        items = of_run.add_items(columns, names, recorded.to_pylist())
    elif (knowledge := tables.find("knowledge")) is not None:
        of_run.add_heard(columns, names, knowledge.to_pylist())
    if (packets := tables.find("packets")) is not None:
        of_run.add_packets(columns, names, packets, tables.find("faults"), items)


def _world(
    columns: Columns,
    names: Names,
    tables: Tables,
    scenario: Mapping[str, Any],
    places: Sequence[Place],
    jobs: Iterable[Job],
) -> dict[str, Any]:
    done = {job.name: tuple(job.done) for job in jobs}
    named = {place.name for place in places}
    world = scenario.get("world", {})
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
        "layers": _add_layers(columns, names, tables, _add_tiles(columns, names, tables, places)),
    }  # fmt: skip


def _add_tiles(columns: Columns, names: Names, tables: Tables, places: Sequence[Place]) -> set[str]:
    """Squares of all places one after the other, and when each was done in truth; returns the tables of that."""
    parts = [place.tiles for place in places if place.tiles is not None]
    columns.add("tiles.column", [column for tiles in parts for column, _ in tiles.squares], 1)
    columns.add("tiles.row", [row for tiles in parts for _, row in tiles.squares], 1)
    found: list[tuple[float, int, int]] = []
    first = 0
    for tiles in parts:
        numbers = {square: first + number for number, square in enumerate(tiles.squares)}
        first += len(tiles.squares)
        table = tables.find(tiles.table, ("time_s", "vehicle", *tiles.columns))
        if table is None:
            continue
        squares = zip(*(table[column].to_pylist() for column in tiles.columns), strict=True)
        rows = zip(table["time_s"].to_pylist(), table["vehicle"].to_pylist(), squares, strict=True)
        found += [
            (time_s, numbers[square], names.vehicle(vehicle)) for time_s, vehicle, square in rows if square in numbers
        ]
    found.sort()
    columns.add("done.time", [time_s for time_s, _, _ in found], 1, TIME_STEP_S)
    columns.add("done.tile", [tile for _, tile, _ in found], 1)
    columns.add("done.vehicle", [vehicle for _, _, vehicle in found])
    return {tiles.table for tiles in parts}


def _add_layers(columns: Columns, names: Names, tables: Tables, known: set[str]) -> list[dict[str, Any]]:
    """Tables of the mission's own, but those of which the squares of its places are made."""
    own = [name for name in tables.names if name not in OWN and name not in known]
    found = [(name, table) for name in own if (table := tables.find(name, ("time_s",))) is not None]
    return [add_own(columns, names, table, name, MOST_ROWS) for name, table in found]
