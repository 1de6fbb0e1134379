"""Results of a run: summary, manifest and tables.

A folder holds ``summary.json``, ``manifest.json`` and one Parquet file per table, with units in the column metadata.
Each file has the run's id; a reader rejects a mixture of two runs.
"""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq

from missions.disk import MANIFEST, STUDY, SUMMARY, check_output, new_content
from missions.document import Document
from missions.errors import OutputError, writing
from missions.metric import NOT_APPLICABLE
from missions.runs.reader import RunReader, value_of
from missions.runs.tables import arrow_table, parquet
from missions.scenarios.loading import scenario_from
from missions.scenarios.scenario import Scenario
from remoras.recorder import TABLES
from remoras.version import __version__

if TYPE_CHECKING:
    from missions.runs.run import Run
    from missions.runs.setup import Setup
    from remoras.truth import Milestone

LIBRARIES = ("mesa", "rdflib", "numpy", "matplotlib", "pyarrow", "pydantic")
MODEM_KEYS = ("name", "payload_bytes", "rate_bps", "head_s", "receive_w")
"""Modem data that determine slots, packets and energy; the scenario names only the modem."""
NEEDED: dict[str, dict[str, Any]] = {
    SUMMARY: {"milestones": list, "mission_time_s": int | float}, MANIFEST: {"scenario": str},
}  # fmt: skip
"""Keys that a file needs, with the types of their values."""
ASSUMED = "assumed"  # manifest key of the channel assumptions, for captions
RUN_ID = "run_id"  # key of the run id in summary, manifest and table metadata


def identity(scenario: Scenario, seed: int) -> dict[str, Any]:
    """Return the fields known before the run."""
    return {
        "scenario": scenario.scenario.name,
        "strategy": scenario.strategy.name,
        "policy": scenario.communication.policy,
        "channel": scenario.channel.name,
        "per": scenario.channel.mean_per(scenario.deployment),
        "seed": seed,
        "n_vehicles": len(scenario.vehicle),
    }


def summary(run: Run) -> dict[str, Any]:
    """Return the summary of a run, or raise PluginError for a metric that fails.

    ``per`` is the mean packet error rate of the loss model, without blackouts and range. An undefined value, such as a
    latency without packets, is None; a metric that does not apply is absent.
    """
    mission, own = run.scenario.scenario.mission, run.setup.own_metrics
    names = {metric.name for metric in own.values()}
    shipped = [metric for metric in run.setup.metrics.values() if metric.name not in names]
    values = {metric.name: value_of(metric, run, mission) for metric in shipped}
    fields = {
        **identity(run.scenario, run.seed),
        "completed": values.pop("completed"),
        "reason": run.reason,
        **_applicable(values),
    }
    milestones = milestone_rows(run.milestones)
    # Own metrics read the quantised tables, so that a sweep's folder gives the same values later.
    stored = MemoryResults(run, {**fields, "milestones": milestones})
    measured = {metric.name: value_of(metric, stored, reference) for reference, metric in own.items()}
    return {**fields, **_applicable(measured), "drawn": run.drawn, "milestones": milestones}


def milestone_rows(milestones: Iterable[Milestone]) -> list[dict[str, Any]]:
    """Return milestones as they are written."""
    return [{"name": m.name, "vehicle": m.vehicle, "group": m.group, "time_s": round(m.time_s, 4)} for m in milestones]


def _applicable(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in values.items() if value is not NOT_APPLICABLE}


def manifest(run: Run) -> dict[str, Any]:
    """Return the data needed to repeat the run: version, resolved scenario (TOML), seed, libraries and platform."""
    assumed = run.scenario.channel.assumed(run.scenario.deployment, run.seed)
    return {
        "version": __version__,
        "seed": run.seed,
        "scenario": run.scenario.text,
        "modem": {key: getattr(run.setup.modem, key) for key in MODEM_KEYS},
        **({ASSUMED: assumed} if assumed else {}),
        "libraries": library_versions(),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "wall_s": round(run.wall_s, 3),
    }


@cache  # 5 ms of a run's 40 for results: metadata of packages are parsed
def library_versions() -> dict[str, str]:
    """Return the versions of the libraries that determine results and their files."""
    return {name: metadata.version(name) for name in LIBRARIES}


def write_results(run: Run | MemoryResults, folder: Path, force: bool = False) -> None:
    """Write results; raise OutputError for a non-empty folder unless ``force``."""
    check_output(folder, force)
    results = run if isinstance(run, MemoryResults) else MemoryResults(run)
    with writing(f"--out {folder}"), new_content(folder) as draft:
        for name, content in results.files.items():
            (draft / name).write_bytes(content)


def _json(value: Any) -> bytes:
    return (json.dumps(value, indent=2, allow_nan=False) + "\n").encode()


@dataclass(frozen=True, repr=False)
class MemoryResults(RunReader):
    """Results of a run that have not been written; ``measured`` is its summary while own metrics are computed."""

    run: Run
    measured: Mapping[str, Any] | None = None

    def __repr__(self) -> str:
        return f"<Results of {self.run!r}>"

    @cached_property  # for the run id and for each reader
    def _arrow(self) -> dict[str, pa.Table]:
        recorder = self.run.recorder
        return {name: arrow_table(recorder.tables[name], recorder.rows(name)) for name in self.tables}

    @cached_property  # digest of all tables
    def _run_id(self) -> str:
        digest = hashlib.sha256(f"{__version__} {self.run.scenario.model_dump_json()} {self.run.seed}".encode())
        for name, table in self._arrow.items():
            content = pa.BufferOutputStream()
            # IPC bytes, since those of Parquet depend on its version.
            with pa.ipc.new_stream(content, table.schema) as out:
                out.write_table(table)
            digest.update(name.encode())
            digest.update(content.getvalue())
        return digest.hexdigest()[:20]

    @cached_property  # all metrics
    def figures(self) -> dict[str, Any]:
        """Summary without the run id."""
        return summary(self.run)

    @cached_property  # asked for each figure
    def summary(self) -> dict[str, Any]:
        return dict(self.measured) if self.measured else {**self.figures, RUN_ID: self._run_id}

    @cached_property  # asked for each figure
    def manifest(self) -> dict[str, Any]:
        return {**manifest(self.run), RUN_ID: self._run_id}

    @property
    def files(self) -> dict[str, bytes]:
        """Content of the files of the results, by name."""
        tables = {f"{name}.parquet": parquet(self.table(name)) for name in self.tables}
        return {SUMMARY: _json(self.summary), MANIFEST: _json(self.manifest), **tables}

    @property
    def scenario(self) -> Scenario:
        return self.run.scenario

    @property
    def setup(self) -> Setup:
        return self.run.setup

    @property
    def tables(self) -> tuple[str, ...]:
        return tuple(sorted(self.run.recorder.tables))

    def _read(self, name: str) -> pa.Table:
        return self._arrow[name].replace_schema_metadata({RUN_ID: self._run_id})


@dataclass(frozen=True, repr=False)
class Results(RunReader):
    """Results of a run, read from a folder."""

    folder: Path

    def __repr__(self) -> str:
        return f"<Results of a run in {self.folder}>"

    def __str__(self) -> str:
        return str(self.folder)

    @classmethod
    def read(cls, folder: Path) -> Results:
        """Open a folder; raise OutputError if it holds no results."""
        missing = [name for name in NEEDED if not (folder / name).is_file()]
        if missing and (folder / STUDY).is_file():
            raise OutputError(
                f"{folder}: holds a sweep; allowed: the results of one run, made with: remoras run --out DIR"
            )
        if not missing and not any(folder.glob("*.parquet")):
            missing = [f"{table.name}.parquet" for table in TABLES]
        if missing:
            raise OutputError(f"{folder}: no results of a run, missing: {', '.join(missing)}")
        return cls(folder)

    @cached_property  # asked for each figure
    def summary(self) -> dict[str, Any]:
        """Metrics and outcome of the run; raises OutputError if the file is damaged."""
        return self._json(SUMMARY)

    @cached_property  # asked for each figure
    def manifest(self) -> dict[str, Any]:
        """Data needed to repeat the run; raises OutputError if damaged or of another run."""
        manifest = self._json(MANIFEST)
        self._check_run(MANIFEST, manifest.get(RUN_ID))
        return manifest

    def _check_run(self, name: str, run_id: str | None) -> None:
        own = self.summary.get(RUN_ID)
        if run_id != own:
            raise OutputError(
                f"{self.folder}: holds files of two runs: {SUMMARY} is of run {own}, {name} of run {run_id}; "
                "run the scenario again, or restore the folder whole"
            )

    def _json(self, name: str) -> dict[str, Any]:
        try:
            loaded: dict[str, Any] = json.loads((self.folder / name).read_text(encoding="utf-8"))
            if not isinstance(loaded, dict):
                raise ValueError("no JSON object")
            for key, kind in NEEDED[name].items():
                if not isinstance(loaded.get(key), kind):
                    raise ValueError(f"{key!r} is missing or of a wrong type")
            return loaded
        except (OSError, ValueError, RecursionError) as error:
            raise OutputError(f"{self.folder / name}: damaged: {error}") from None

    @cached_property  # loads a scenario
    def scenario(self) -> Scenario:
        """Resolved scenario; raises ConfigurationError if this version cannot read it."""
        document = Document.of_text(self.manifest["scenario"], str(self.folder / MANIFEST))
        table = document.raw.get("scenario")
        if isinstance(table, dict):
            table.pop("metrics", None)  # the values are stored, their code may be missing
        return scenario_from(document)

    @property
    def tables(self) -> tuple[str, ...]:
        return tuple(sorted(path.stem for path in self.folder.glob("*.parquet")))

    def _read(self, name: str) -> pa.Table:
        path = self.folder / f"{name}.parquet"
        try:
            with pq.ParquetFile(path) as file:  # pq.read_table loads pandas
                stored = file.read()
            run_id = (stored.schema.metadata or {}).get(RUN_ID.encode())
            written_by = None if run_id is None else run_id.decode()
        except (OSError, ValueError, pa.ArrowException) as error:  # ValueError: a name that is not text
            raise OutputError(f"{path}: damaged: {error}") from None
        declared = next((table.column_names for table in TABLES if table.name == name), None)
        if written_by is not None or declared is not None:
            self._check_run(path.name, written_by)
        if missing := [column for column in declared or () if column not in stored.column_names]:
            raise OutputError(
                f"{path}: a table of an unknown schema: it lacks {', '.join(missing)}, and has "
                f"{', '.join(stored.column_names)}; run the scenario again to have it as this version writes it"
            )
        return stored
