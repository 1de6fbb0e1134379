"""Recording of packets of other programs as the results of a run, for ``plot``, ``replay`` and ``verify``.

A station is a vehicle without tasks that moves as its program says. Its scenario has the sea of another scenario, or of
a measured network.
"""

from __future__ import annotations

import csv
import json
import math
import tomllib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field

from exchange.channel.models import number_in
from exchange.channel.modems import modems
from exchange.channel.network import network_of
from missions.document import Document
from missions.errors import ConfigurationError, OutputError, writing
from missions.files import LARGEST_BYTES, text_of
from missions.runs.results import MemoryResults, Results, write_results
from missions.runs.run import Run, is_drawn
from missions.runs.setup import Setup, recorder_of_mission, resolved
from missions.scenarios.loading import load, scenario_from
from missions.scenarios.scenario import Scenario, World
from remoras.errors import PluginError
from remoras.htn import Domain, Method
from remoras.mission import FleetView, Mission, Truth
from remoras.recorder import PACKETS, TRAJECTORIES, Content, Recorder, Row
from remoras.table import PointM, Section

MODEM = "nanomodem-v3"
"""Modem in a measured network, unless set."""
MARGIN_M = 2000.0
"""Distance from the nodes of a network to the borders of its world."""
APART_M = 50.0
"""Distance between stations of a network that states no positions."""
ENDED = "recording of other programs, without a goal"
NONE = "none"  # strategy and policy of other programs
Access = Literal["slots", "free"]
Trace = Sequence[tuple[float, PointM]]
"""Positions of a station by time (s), linear between them."""
COLUMNS = ("time_s", "vehicle", "x_m", "y_m")
ROWS = "rows.jsonl"
"""File of the rows of a service under way."""
SIZE_BITS, END_S, ARRIVALS_S = map(PACKETS.column_names.index, ("size_bits", "end_s", "arrivals_s"))
SPEED_MPS = TRAJECTORIES.column_names.index("speed_mps")


class StationsTable(Section):
    """Table ``[mission]`` of a recording."""

    access: Access = Field("free", description="slots: a station sends in its TDMA slots; free: at any time")


class StationsScenario(Scenario):
    """Scenario of a recording."""

    mission: StationsTable = StationsTable.usual()


class Unjudged(Truth):
    """Truth of a recording: nothing is achieved."""

    milestones = ()
    goal_fraction = 0.0
    is_over = True

    def observe(self, fleet: FleetView, now_s: float) -> bool:
        return False

    def close(self, fleet: FleetView, now_s: float) -> str:
        return ENDED


class Stations(Mission):
    """Mission of a recording: none."""

    Scenario = StationsScenario
    group_missions = ("None",)

    @classmethod
    def from_scenario(cls, scenario: Any) -> Self:
        return cls()

    @property
    def jobs(self) -> dict[str, Any]:
        return {}

    @property
    def social_domain(self) -> Domain:
        return Domain.of((), {"None": [Method("nothing", lambda *asked: [], uses=())]})

    def activity_sets(self, *asked: Any) -> Any:
        return (), frozenset()

    def behaviour_for(self, *asked: Any) -> Any:
        raise PluginError("a recording has no activities")

    def truth(self, *asked: Any) -> Unjudged:
        return Unjudged()


Overrides = Sequence[tuple[str, str]]


def of_scenario(name: str, access: Access, overrides: Overrides) -> Scenario:
    """Return the stations of a scenario: its vehicles, with its sea, modem and channel."""
    sea = load(name, overrides)
    given = sea.model_dump(mode="json", exclude_none=True)
    vehicles = [{key: table[key] for key in ("name", "start_m", "depth_m", "slot")} for table in given["vehicle"]]
    tables = {
        "world": {key: value for key, value in given["world"].items() if key in World.model_fields},
        "communication": {key: given["communication"][key] for key in ("modem", "range_m", "transmit_power_w")},
        "channel": given["channel"],
        "modem": given.get("modem", {}),
    }
    return _stations(sea.scenario.name, access, vehicles, tables)


def of_network(name: str, access: Access, stations: Sequence[str], overrides: Overrides) -> Scenario:
    """Return the stations of a measured network, all nodes by default; ConfigurationError for an unknown one."""
    network, vehicles = network_of(name), []
    nodes = {node.name: node for node in network.node}
    for slot, station in enumerate(stations or network.nodes):
        if nodes and station not in nodes:
            raise ConfigurationError.of(name, "--stations", station, f"allowed: {', '.join(nodes)}")
        node = nodes.get(station)
        start_m = (node and node.position_m) or (slot * APART_M, 0.0)
        vehicles.append({"name": station, "start_m": start_m, "depth_m": (node and node.depth_m) or 0.0, "slot": slot})
    if len(vehicles) < 2:
        raise ConfigurationError.of(name, "--stations", ",".join(stations), "allowed: two stations or more, as A,B")
    borders = zip(*(vehicle["start_m"] for vehicle in vehicles), strict=True)
    (west_m, east_m), (south_m, north_m) = ((min(at_m) - MARGIN_M, max(at_m) + MARGIN_M) for at_m in borders)
    tables = {
        "world": {"x_m": [west_m, east_m], "y_m": [south_m, north_m]},
        "communication": {"modem": MODEM, "range_m": modems()[MODEM].range_m},
        "channel": {"name": "network", "network": name, "nodes": {v["name"]: v["name"] for v in vehicles if nodes}},
    }
    return _stations(network.name, access, vehicles, tables, overrides)


def _stations(
    name: str, access: Access, vehicles: list[dict[str, Any]], tables: dict[str, Any], overrides: Overrides = ()
) -> Scenario:
    raw = tomllib.loads(Path(__file__).with_name("stations.toml.txt").read_text(encoding="utf-8"))
    raw["scenario"]["name"], raw["mission"] = name, {"access": access}
    raw["rally_point"][0]["position_m"] = vehicles[0]["start_m"]
    raw["vehicle"] = [raw["vehicle"][0] | vehicle for vehicle in vehicles]
    raw |= tables | {"communication": raw["communication"] | tables["communication"]}
    return scenario_from(Document.of_tables(raw, name), overrides)


def traces_in(path: Path, scenario: Scenario) -> dict[str, Trace]:
    """Return the positions in a run's results, or in a CSV file with ``COLUMNS``; ConfigurationError if invalid."""
    names, (x_min, y_min, x_max, y_max) = scenario.names_by_slot, scenario.world.box_m
    if path.is_dir():
        rows: Sequence[Mapping[str, Any]] = Results.read(path).rows("trajectories")
    else:
        rows = list(csv.DictReader(text_of(path, LARGEST_BYTES).splitlines(), skipinitialspace=True))
    traces: dict[str, list[tuple[float, PointM]]] = {name: [] for name in names}
    for number, row in enumerate(rows, 1):
        name, *values = (row.get(column) for column in ("vehicle", "time_s", "x_m", "y_m"))
        time_s, x_m, y_m = (number_in(str(value)) for value in values)
        is_later = name in traces and time_s > (traces[name][-1][0] if traces[name] else -math.inf)
        if not (is_later and x_min <= x_m <= x_max and y_min <= y_m <= y_max):
            allowed = (
                f"time_s,vehicle,x_m,y_m with vehicles {', '.join(names)}, rising times, "
                f"x {x_min:g} to {x_max:g}, y {y_min:g} to {y_max:g}"
            )
            given = ",".join(str(row.get(column, "")) for column in COLUMNS)
            raise ConfigurationError.of(str(path), f"row {number}", given, f"allowed: {allowed}")
        traces[str(name)].append((time_s, (x_m, y_m)))
    return dict(traces)


class RowLog:
    """Rows of a service, appended once they are final, so that a kill loses none; ``restored`` reads them.

    A packet is final after its last reception; the positions behind it are written after it, so their energy is that of
    the written packets.
    """

    def __init__(self, folder: Path, setup: Setup, seed: int, recorder: Recorder) -> None:
        self._recorder, self._n = recorder, Counter[str]()
        with writing(f"--out {folder}"):
            folder.mkdir(parents=True, exist_ok=True)
            self._file = (folder / ROWS).open("w", encoding="utf-8")
        self._file.write(json.dumps([setup.scenario.text, int(seed)]) + "\n")

    def keep(self, now_s: float) -> None:
        """Append the rows that are final by now (s)."""
        packets = self._recorder.packets
        self._append("packets", lambda row: max([row[END_S], *row[ARRIVALS_S]]) <= now_s)
        until_s = packets[self._n["packets"]][1] if self._n["packets"] < len(packets) else now_s
        self._append("trajectories", lambda row: row[0] <= until_s)
        self._file.flush()

    def _append(self, table: str, is_final: Callable[[Row], bool]) -> None:
        rows = self._recorder.rows(table)
        while self._n[table] < len(rows) and is_final(rows[self._n[table]]):
            self._file.write(json.dumps([table, rows[self._n[table]]]) + "\n")
            self._n[table] += 1


def restored(folder: Path) -> None:
    """Write the recording of a killed service from its rows; OutputError if damaged or less than a second."""
    file = folder / ROWS
    try:
        lines = file.read_bytes().splitlines(keepends=True)
        (text, seed), *rows = [json.loads(line) for line in lines if line.endswith(b"\n")]
    except ValueError as error:
        raise OutputError(f"{file}: damaged: {error}") from None
    setup = resolved(scenario_from(Document.of_text(text, str(file))))
    recorder, n = recorder_of_mission(setup.mission, []), len(setup.database)
    for table, row in rows:
        recorder.rows(table).append(tuple(row))
    del recorder.trajectories[len(recorder.trajectories) // n * n :]  # of a tick that was cut short
    if len(recorder.trajectories) < 2 * n:
        raise OutputError(f"{file}: holds no second of a service; nothing is written")
    recorder.packets[:] = [row for row in recorder.packets if row[1] <= recorder.trajectories[-1][0]]
    written(setup, seed, recorder, folder)


def written(setup: Setup, seed: int, recorder: Recorder, folder: Path) -> None:
    """Write the rows of stations as the results of a run that ends at their last tick."""
    about, end_s = setup.scenario.scenario, recorder.trajectories[-1][0]
    distance_m = about.tick_s * math.fsum(row[SPEED_MPS] for row in recorder.trajectories)
    recorder.bits[Content.OBSERVATIONS] = sum(row[SIZE_BITS] for row in recorder.packets)
    about = about.model_copy(update={"duration_s": end_s})
    setup = resolved(setup.scenario.model_copy(update={"scenario": about}))
    drawn = is_drawn(seed, setup.scenario, setup.strategy)
    run = Run(setup, seed, recorder, (), 0.0, 0.0, False, ENDED, end_s, 0, distance_m, end_s, drawn=drawn)
    results = MemoryResults(run)
    results.summary.update(strategy=NONE, policy=NONE)
    write_results(results, folder, force=True)
    (folder / ROWS).unlink(missing_ok=True)
