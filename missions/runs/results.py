"""Results of a run: summary, manifest and tables, written once and read back.

A folder holds ``summary.json``, ``manifest.json`` and one Parquet file per table. Units are in the metadata of every
column. A folder appears, and is replaced, whole or not at all, see ``folder``. Its files carry the id of their run, and
a reader refuses a mixture of two.
"""

from __future__ import annotations

import hashlib
import io
import json
import platform
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w

from missions.document import Document
from missions.errors import OutputError
from missions.runs.folder import MANIFEST, SUMMARY, check_output, new_content
from missions.runs.reader import RunReader
from missions.runs.summary import summary
from missions.runs.tables import recorded_table, write_table
from missions.scenarios.loading import scenario_from
from missions.scenarios.scenario import Scenario
from remoras.recorder import TABLES
from remoras.version import __version__

if TYPE_CHECKING:
    from missions.runs.run import Run
    from missions.runs.setup import Setup

LIBRARIES = ("mesa", "rdflib", "numpy", "matplotlib", "pyarrow", "pydantic")
MODEM_KEYS = ("name", "payload_bytes", "rate_bps", "head_s", "receive_w")
"""What slots, packets and energy follow from, of the modem that the scenario only names."""
NEEDED_KEY = {SUMMARY: "milestones", MANIFEST: "scenario"}
LONGEST_S = 1e12
"""No mission takes longer (s)."""
MILESTONE_KEYS = ("name", "vehicle", "group", "time_s")
ASSUMED = "assumed"
"""Key of the manifest by which captions know what the channel assumes."""
RUN_ID = "run_id"
"""Key of the id of a run in summary, manifest and the metadata of every table."""


def manifest(run: Run) -> dict[str, Any]:
    """What is needed to repeat the run: version, resolved scenario as TOML and seed.

    What depends on the machine stands here, too: libraries, platform, and the time that the run took. What the channel
    assumes is there if it assumes something.
    """
    assumed = run.scenario.channel.assumed(run.scenario.deployment, run.seed)
    return {
        "version": __version__,
        "seed": run.seed,
        "scenario": tomli_w.dumps(run.scenario.model_dump(mode="json", exclude_none=True)),
        "modem": {key: getattr(run.setup.modem, key) for key in MODEM_KEYS},
        **({ASSUMED: assumed} if assumed else {}),
        "libraries": {name: metadata.version(name) for name in LIBRARIES},
        "python": platform.python_version(),
        "platform": platform.platform(),
        "wall_s": round(run.wall_s, 3),
    }


def write_results(run: Run | MemoryResults, folder: Path, force: bool = False) -> None:
    """Write summary, manifest and tables; ``force`` replaces results that are already there.

    Raises OutputError if the folder holds something or cannot be written.
    """
    check_output(folder, force)
    results = run if isinstance(run, MemoryResults) else MemoryResults(run)
    try:
        with new_content(folder) as draft:
            (draft / SUMMARY).write_text(_json(results.summary), encoding="utf-8")
            (draft / MANIFEST).write_text(_json(results.manifest), encoding="utf-8")
            for name in results.tables:
                write_table(draft / f"{name}.parquet", results.table(name))
    except OSError as error:
        raise OutputError(f"--out {folder}: cannot be written: {error.strerror}") from None


class _Digest(io.RawIOBase):
    """A file of which nothing is kept but a digest of what is written to it."""

    def __init__(self, begin: str) -> None:
        self.of = hashlib.sha256(begin.encode())

    def writable(self) -> bool:
        """It is."""
        return True

    def write(self, content: Any) -> int:
        """Take the next bytes."""
        self.of.update(content)
        return len(content)


def run_id(run: Run, tables: Iterable[tuple[str, pa.Table]]) -> str:
    """Name of what a run is and gave: a hash of version, scenario, seed and tables, which all of its files carry.

    Args:
        run: that has ended.
        tables: with their names, in the order of these; each is let go of before the next is taken.
    """
    digest = _Digest(f"{__version__} {run.scenario.model_dump_json()} {run.seed}")
    for name, table in tables:
        digest.write(name.encode())
        with pa.ipc.new_stream(pa.PythonFile(digest, "w"), table.schema) as out:
            out.write_table(table)
    return digest.of.hexdigest()[:20]


def _json(value: Any) -> str:
    return json.dumps(value, indent=2, allow_nan=False) + "\n"


@dataclass(frozen=True, repr=False)
class MemoryResults(RunReader):
    """Results of one run that has not been written."""

    run: Run

    def __repr__(self) -> str:
        return f"<Results of {self.run!r}>"

    @cached_property  # digest of all tables
    def _run_id(self) -> str:
        return run_id(self.run, ((name, recorded_table(self.run.recorder, name)) for name in self.tables))

    @cached_property  # all metrics
    def figures(self) -> dict[str, Any]:
        """The figures of the run."""
        return summary(self.run)

    @cached_property  # asked for each figure
    def summary(self) -> dict[str, Any]:
        """The same with the name of the run."""
        return {**self.figures, RUN_ID: self._run_id}

    @cached_property  # asked for each figure
    def manifest(self) -> dict[str, Any]:
        """What is needed to repeat the run."""
        return {**manifest(self.run), RUN_ID: self._run_id}

    @property
    def scenario(self) -> Scenario:
        """The whole input of the run."""
        return self.run.scenario

    @property
    def setup(self) -> Setup:
        """What was settled before the mission began."""
        return self.run.setup

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables."""
        return tuple(sorted(self.run.recorder.tables))

    def _read(self, name: str) -> pa.Table:
        return recorded_table(self.run.recorder, name).replace_schema_metadata({RUN_ID: self._run_id})


def _is_milestone(value: Any) -> bool:
    return isinstance(value, dict) and set(MILESTONE_KEYS) <= set(value) and isinstance(value["time_s"], int | float)


def _run_id_of(table: pa.Table) -> str | None:
    run_id: bytes | None = (table.schema.metadata or {}).get(RUN_ID.encode())
    return None if run_id is None else run_id.decode()


@dataclass(frozen=True, repr=False)
class Results(RunReader):
    """Results of one run, read from their folder."""

    folder: Path

    def __repr__(self) -> str:
        return f"<Results of a run in {self.folder}>"

    @classmethod
    def read(cls, folder: Path) -> Results:
        """Raises OutputError if the folder holds no results."""
        missing = [name for name in NEEDED_KEY if not (folder / name).is_file()]
        if not missing and not any(folder.glob("*.parquet")):
            missing = [f"{table.name}.parquet" for table in TABLES]
        if missing:
            raise OutputError(f"{folder}: no results of a run, missing: {', '.join(missing)}")
        return cls(folder)

    @cached_property  # asked for each figure
    def summary(self) -> dict[str, Any]:
        """The figures of the run.

        Raises:
            OutputError: it is damaged.
        """
        summary = self._json(SUMMARY)
        time_s, milestones = summary.get("mission_time_s"), summary["milestones"]
        if isinstance(time_s, bool) or not isinstance(time_s, int | float) or not 0.0 <= time_s <= LONGEST_S:
            raise OutputError(f"{self.folder / SUMMARY}: damaged: mission_time_s is no number of seconds")
        if not isinstance(milestones, list) or not all(map(_is_milestone, milestones)):
            raise OutputError(f"{self.folder / SUMMARY}: damaged: milestones need {', '.join(MILESTONE_KEYS)} each")
        return summary

    @cached_property  # asked for each figure
    def manifest(self) -> dict[str, Any]:
        """What is needed to repeat the run.

        Raises:
            OutputError: it is damaged, or of another run than the summary.
        """
        manifest = self._json(MANIFEST)
        self._check_run(MANIFEST, manifest.get(RUN_ID))
        return manifest

    def _check_run(self, name: str, run_id: str | None) -> None:
        """Refuse a file of another run than the summary."""
        own = self.summary.get(RUN_ID)
        if run_id != own:
            raise OutputError(
                f"{self.folder}: holds files of two runs: {SUMMARY} is of run {own}, {name} of run {run_id}; "
                "run the scenario again, or restore the folder whole"
            )

    def _json(self, name: str) -> dict[str, Any]:
        try:
            loaded: dict[str, Any] = json.loads((self.folder / name).read_text(encoding="utf-8"))
            if NEEDED_KEY[name] not in loaded:
                raise ValueError(f"{NEEDED_KEY[name]!r} is missing")
            return loaded
        except (OSError, ValueError, TypeError, RecursionError) as error:
            raise OutputError(f"{self.folder / name}: damaged: {error}") from None

    @cached_property  # loads a scenario
    def scenario(self) -> Scenario:
        """The whole input of the run.

        Raises:
            ConfigurationError: this version cannot read the scenario in the manifest.
        """
        document = Document.of_text(self.manifest["scenario"], str(self.folder / MANIFEST))
        table = document.raw.get("scenario")
        if isinstance(table, dict):
            table.pop("metrics", None)  # their values are there, and their files need not be
        return scenario_from(document)

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables that are there."""
        return tuple(sorted(path.stem for path in self.folder.glob("*.parquet")))

    def has(self, name: str) -> bool:
        """True if there is a table of that name: its mission or a feature may not have it."""
        return (self.folder / f"{name}.parquet").is_file()

    def _read(self, name: str) -> pa.Table:
        """A table; refuse one that is damaged, of another run than the summary, or lacks a column."""
        path = self.folder / f"{name}.parquet"
        try:
            with pq.ParquetFile(path) as file:  # pq.read_table loads pandas
                stored = file.read()
            written_by = _run_id_of(stored)
        except (OSError, ValueError, pa.ArrowException) as error:  # of names that are no text Python says ValueError
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
