"""Results of a run: summary, manifest and tables, written once and read back.

A folder holds ``summary.json``, ``manifest.json`` and one Parquet file per table of ``remoras.recorder``. Units are
in the metadata of every column. A new folder appears whole or not at all; in one that is there, files are replaced one
by one.
"""

from __future__ import annotations

import itertools
import json
import math
import platform
import statistics
import tempfile
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w

from missions.errors import OutputError
from missions.runs.run import Run, seabed_of, transmit_j_per_bit
from missions.scenarios.scenario import Scenario
from remoras.recorder import TABLES, Recorder

LIBRARIES = ("mesa", "rdflib", "networkx", "numpy", "matplotlib", "pyarrow", "pydantic")
NEEDED_KEY = {"summary.json": "milestones", "manifest.json": "scenario"}
DECIMALS = {"m": 3, "rad": 6, "m/s": 4, "J": 2, "s": 4, "1": 6}
"""Digits kept by unit: far below anything that means something, far above rounding in the arithmetic."""


def summary(run: Run) -> dict[str, Any]:
    """The figures of a run, with the names of the contract.

    ``per``: mean packet error rate of the loss model as it is set: 0 for perfect, ``per`` for bernoulli, the mean over
    all directed pairs of vehicles for matrix, the stationary mean for gilbert-elliott; without blackouts and range.
    ``coverage_fraction``: cells of the areas that somebody mapped; ``mapping_time_s``: see there.
    ``duplicate_fraction``: share of the mapping that was done again by another vehicle. ``delivery_ratio``: packets
    received among all (packet, receiver) pairs. Latencies: from an item's observation to its reception, over all
    (item, receiver) pairs; NaN becomes null.
    ``consistency_time_s`` and ``consistent_fraction``: see ``consistency``. ``least_mapped_fraction``: see there.
    ``modem_energy_j``: of ``energy_j`` what the modems sent with.
    """
    scenario, recorder = run.scenario, run.recorder
    received = sum(len(row[6]) for row in recorder.packets)
    lost = sum(len(row[7]) for row in recorder.packets)
    mapped = {(row[2], row[3]) for row in recorder.coverage}
    n_cells = len(seabed_of(scenario).cells)
    latencies = sorted(_latencies_s(recorder))
    n_bits = sum(row[3] for row in recorder.packets)
    consistency_time_s, consistent_fraction = consistency(recorder, len(scenario.vehicle))
    return {
        **identity(scenario, run.seed),
        "completed": run.completed,
        "reason": run.reason,
        "mission_time_s": round(run.end_s, 4),
        "coverage_fraction": len(mapped) / n_cells if n_cells else 0.0,
        "mapping_time_s": mapping_time_s(recorder, n_cells),
        "duplicate_fraction": 1.0 - len(mapped) / len(recorder.coverage) if recorder.coverage else 0.0,
        "least_mapped_fraction": least_mapped_fraction(recorder, area_roles(scenario)),
        "distance_m": round(run.distance_m, 3),
        "energy_j": round(_energy_j(recorder), 2),
        "modem_energy_j": round(n_bits * transmit_j_per_bit(scenario), 2),
        "n_packets": len(recorder.packets),
        "n_bytes": n_bits // 8,
        "delivery_ratio": received / (received + lost) if received + lost else None,
        "mean_latency_s": round(statistics.fmean(latencies), 4) if latencies else None,
        "p95_latency_s": round(quantile(latencies, 0.95), 4) if latencies else None,
        "consistency_time_s": None if consistency_time_s is None else round(consistency_time_s, 4),
        "consistent_fraction": consistent_fraction,
        "false_beliefs": run.n_false_beliefs,
        "wall_s": round(run.wall_s, 3),
        "milestones": [
            {"name": m.name, "vehicle": m.vehicle, "group": m.group, "time_s": round(m.time_s, 4)}
            for m in run.milestones
        ],
    }


MAPPED_SHARE = 0.95
"""Share of the cells at which the areas count as mapped."""


def mapping_time_s(recorder: Recorder, n_cells: int) -> float | None:
    """When 95 % of all cells had been mapped by anybody; None if they never were, or if there are none."""
    first_s: dict[tuple[int, int], float] = {}
    for time_s, _, x, y in recorder.coverage:
        first_s.setdefault((x, y), time_s)
    needed = math.ceil(MAPPED_SHARE * n_cells)
    return round(sorted(first_s.values())[needed - 1], 4) if 0 < needed <= len(first_s) else None


def identity(scenario: Scenario, seed: int) -> dict[str, Any]:
    """The fields of a summary that are known before the run."""
    return {
        "scenario": scenario.scenario.name,
        "strategy": scenario.strategy.name,
        "policy": scenario.communication.policy,
        "channel": scenario.channel.name,
        "per": scenario.channel.mean_per(len(scenario.vehicle)),
        "seed": seed,
        "n_vehicles": len(scenario.vehicle),
    }


def quantile(ordered: Sequence[float], share: float) -> float:
    """Quantile of ascending values, linear between them.

    >>> quantile([0.0, 1.0, 2.0, 3.0], 0.5)
    1.5
    """
    position = share * (len(ordered) - 1)
    low = math.floor(position)
    high = min(low + 1, len(ordered) - 1)
    return ordered[low] + (position - low) * (ordered[high] - ordered[low])


def _latencies_s(recorder: Recorder) -> list[float]:
    observed = {item: time_s for time_s, _, item, _, event in recorder.knowledge if event == "observed"}
    return [time_s - observed[item] for time_s, _, item, _, event in recorder.knowledge if event == "received"]


def consistency(recorder: Recorder, n_vehicles: int) -> tuple[float | None, float | None]:
    """(consistency_time_s, consistent_fraction): how soon the fleet has one picture, and of how much of it.

    An item is consistent once every vehicle of the fleet holds it, one that has fallen silent too. The time is the mean
    over such items, from the observation of each until its last vehicle held it; None if there is no such item. The
    fraction is their share of all items observed by the end of the run; None if there were none.
    """
    observed_s: dict[str, float] = {}
    lacking: dict[str, int] = {}
    waits_s: list[float] = []
    for time_s, _, item, _, event in recorder.knowledge:  # in time order; a vehicle receives an item once
        if event == "observed":
            observed_s[item], lacking[item] = time_s, n_vehicles - 1
        elif event == "received":
            lacking[item] -= 1
            if not lacking[item]:
                waits_s.append(time_s - observed_s[item])
    if not observed_s:
        return None, None
    return (math.fsum(waits_s) / len(waits_s) if waits_s else None), len(waits_s) / len(observed_s)


def area_roles(scenario: Scenario) -> set[tuple[str, str]]:
    """(group, role) of the roles whose holder explores an area."""
    return {(group.name, role.name) for group in scenario.group for role in group.role if role.area is not None}


def least_mapped_fraction(recorder: Recorder, roles: Collection[tuple[str, str]]) -> float | None:
    """Utility of the worst vehicle: the smallest share of the mapped cells that was first mapped by one vehicle.

    Over the vehicles that held one of ``roles`` at any time. With n of them it is 1/n if they shared the work equally
    and 0 if one did nothing; None if nobody held such a role or nothing was mapped. (Egalitarian welfare: Brandt
    et al., Handbook of Computational Social Choice, 2016, chapter 12.)
    """
    first: dict[tuple[int, int], str] = {}
    for _, vehicle, x, y in recorder.coverage:
        first.setdefault((x, y), vehicle)
    holders = {vehicle for _, vehicle, group, role, event in recorder.roles if (group, role) in roles}
    counts = Counter(first.values())
    return min(counts[vehicle] for vehicle in holders) / len(first) if holders and first else None


def _energy_j(recorder: Recorder) -> float:
    end_s = recorder.trajectories[-1][0]
    last = itertools.takewhile(lambda row: row[0] == end_s, reversed(recorder.trajectories))
    return math.fsum(energy_j for *_, energy_j in last)


def table(name: str, rows: Sequence[tuple[Any, ...]]) -> pa.Table:
    """Rows of a recorder table as an Arrow table with units."""
    kinds = {"float": pa.float64(), "int": pa.int64(), "str": pa.string(), "list": pa.list_(pa.string())}
    columns = TABLES[name]
    fields = [
        pa.field(column.name, kinds[column.kind], metadata={"unit": column.unit} if column.unit else None)
        for column in columns
    ]
    arrays = []
    for number, (column, field) in enumerate(zip(columns, fields, strict=True)):
        values: list[Any] = [row[number] for row in rows]
        if column.kind == "float":
            digits = DECIMALS[column.unit]
            values = [round(value, digits) for value in values]
        arrays.append(pa.array(values, type=field.type))
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def manifest(run: Run) -> dict[str, Any]:
    """What is needed to repeat the run: version, resolved scenario as TOML, seed, libraries, platform."""
    return {
        "version": metadata.version("remoras"),
        "seed": run.seed,
        "scenario": tomli_w.dumps(run.scenario.model_dump(mode="json", exclude_none=True)),
        "libraries": {name: metadata.version(name) for name in LIBRARIES},
        "python": platform.python_version(),
        "platform": platform.platform(),
    }


def check_output(folder: Path, force: bool) -> None:
    """Raise OutputError unless results can be written to ``folder`` without losing anything."""
    try:
        if folder.exists() and not folder.is_dir():
            raise OutputError(f"--out {folder}: is a file; name a folder")
        if (folder / "ledger.jsonl").exists():
            raise OutputError(f"--out {folder}: holds a sweep; name another folder")
        if folder.is_dir() and any(folder.iterdir()) and not force:
            raise OutputError(f"--out {folder}: exists and is not empty; name another folder or add --force")
        parent = folder if folder.is_dir() else folder.parent
        while not parent.exists():
            parent = parent.parent
        with tempfile.TemporaryFile(dir=parent):
            pass
    except OSError as error:
        raise OutputError(f"--out {folder}: cannot be written: {error.strerror}") from None


def write(run: Run, folder: Path, force: bool = False) -> None:
    """Write summary, manifest and tables; ``force`` replaces results that are already there.

    Raises OutputError if the folder holds something or cannot be written.
    """
    check_output(folder, force)
    folder.parent.mkdir(parents=True, exist_ok=True)
    try:
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}-") as made:
            draft = Path(made) / "results"
            draft.mkdir()
            (draft / "summary.json").write_text(_json(summary(run)), encoding="utf-8")
            (draft / "manifest.json").write_text(_json(manifest(run)), encoding="utf-8")
            for name in TABLES:
                pq.write_table(table(name, run.recorder.rows(name)), draft / f"{name}.parquet", compression="zstd")
            if folder.exists():
                for path in draft.iterdir():
                    path.replace(folder / path.name)
            else:
                draft.rename(folder)
    except OSError as error:
        raise OutputError(f"--out {folder}: cannot be written: {error.strerror}") from None


def _json(value: Any) -> str:
    return json.dumps(value, indent=2, allow_nan=False) + "\n"


@dataclass(frozen=True)
class Results:
    """Results of one run, read from their folder."""

    folder: Path

    @classmethod
    def read(cls, folder: Path) -> Results:
        """Raises OutputError if the folder holds no complete results."""
        needed = ["summary.json", "manifest.json", *(f"{name}.parquet" for name in TABLES)]
        missing = [name for name in needed if not (folder / name).is_file()]
        if missing:
            raise OutputError(f"{folder}: no results of a run, missing: {', '.join(missing)}")
        return cls(folder)

    @cached_property
    def summary(self) -> dict[str, Any]:
        return self._json("summary.json")

    @cached_property
    def manifest(self) -> dict[str, Any]:
        return self._json("manifest.json")

    def _json(self, name: str) -> dict[str, Any]:
        try:
            loaded: dict[str, Any] = json.loads((self.folder / name).read_text(encoding="utf-8"))
            if NEEDED_KEY[name] not in loaded:
                raise ValueError(f"{NEEDED_KEY[name]!r} is missing")
            return loaded
        except (OSError, ValueError, TypeError) as error:
            raise OutputError(f"{self.folder / name}: damaged: {error}") from None

    def has(self, name: str) -> bool:
        """True if there is a table of that name: older results, or those of another mission, may lack one."""
        return (self.folder / f"{name}.parquet").is_file()

    def table(self, name: str) -> pa.Table:
        """An Arrow table; ``.to_pandas()`` makes a data frame of it."""
        try:
            return pq.read_table(self.folder / f"{name}.parquet")
        except (OSError, pa.ArrowException) as error:
            raise OutputError(f"{self.folder / name}.parquet: damaged: {error}") from None

    def units(self, name: str) -> dict[str, str]:
        """Units of a table's columns."""
        schema = pq.read_schema(self.folder / f"{name}.parquet")
        return {field.name: field.metadata[b"unit"].decode() for field in schema if field.metadata}
