"""Folder of a sweep: reading, and writing while it runs.

``study.json`` records the study: version, tables, scenarios, digests of configurations and code. A sweep resumes only
if every configuration is still there, with the same content and code; the study may have more. ``ledger.jsonl`` has a
line per finished run, ``runs`` the results folder of every sampled run (``key=KEY``, the name by which tools for
Parquet add the column). ``runs.parquet`` is derived: a row per run, by key.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from missions.disk import STUDY, SUMMARY, check_folder, drafted, lock, synced, write_synced
from missions.errors import OutputError, StudyChangedError, writing
from missions.files import leaves, shown, toml_value
from missions.metric import NOT_APPLICABLE, TAKEN, Metric
from missions.scenarios.faults import fault_text
from missions.scenarios.parts import metric_given
from missions.sweeps.code import fingerprint, references, short
from missions.sweeps.ledger import (
    DONE,
    FAILED,
    LEDGER,
    MACHINE_COLUMNS,
    FinishedRun,
    Line,
    RunLedger,
    read_ledger,
)
from missions.sweeps.plan import ConfigurationLabel, RunSchedule, SweepPlan
from missions.sweeps.study_file import FAULT, StudyFile
from remoras.strategies import bounds

if TYPE_CHECKING:
    from missions.runs.results import Results
    from missions.sweeps.study import Study

MOST_TABLE_BYTES = 500_000_000  # limit (bytes) on a study's tables, unless it sets the repeats to keep
STUDY_TEXT, RUNS, KEPT, LOCK = "study.toml", "runs.parquet", "runs", "lock"
DAMAGED = "lost or changed since it was written; repeat the sweep with the same --out to restore it"
MOST_DIFFERENCES = 20
CODE_CHANGED = "the code that makes the runs has changed: continue with --accept-code, which marks its runs; or "
UNCOMPARED = ("id", "metrics", "own_metrics", "configurations", "repeats_of")
"""Keys of the record that may differ when a sweep resumes."""
FIXED = ("version", "study.study.name", "study.study.seed", "study.study.keep_tables")
"""Keys that must not differ when a sweep resumes."""
REPEATS = "study.study.repeats"
OWN_METRICS = ".scenario.metrics"
LACK_IT = "; runs that were made lack it: `remoras compare DIR --metric FILE.py:METRIC` reads the tables that were kept"
REPORTED = ("study.study.metrics", "study.study.baseline", "study.stopping")
"""Keys that change metrics or number of runs, but no run."""


class StudyRecord(BaseModel):
    """Content of ``study.json``; ``repeats_of`` has the repeats of each configuration, if not those of the study."""

    id: str = ""
    version: str
    study: StudyFile
    scenario: dict[str, dict[str, Any]] = {}
    code: dict[str, str] = {}
    metrics: tuple[dict[str, Any], ...]
    own_metrics: tuple[str, ...] = ()
    configurations: tuple[ConfigurationLabel, ...]
    repeats_of: tuple[int, ...] | None = None


@dataclass(frozen=True)
class SweepStatus:
    """Progress of a sweep; ``done`` runs are completed or censored, ``planned`` is the total."""

    planned: int
    done: int
    failed: int
    censored: int
    remaining: int
    with_tables: int

    @property
    def progress(self) -> str:
        """Progress in words, as of a dry run."""
        return progress_text(self.done + self.failed, self.remaining)


def progress_text(done: int, to_do: int) -> str:
    """Return the number of runs made and the greatest number still to make.

    >>> progress_text(32, 18), progress_text(50, 0)
    ('done 32, at most 18 to do; equal runs are made once', 'done 50, none to do')
    """
    return f"done {done}, " + (f"at most {to_do} to do; equal runs are made once" if to_do else "none to do")


@dataclass(frozen=True)
class SweepResults:
    """Results in the folder of a sweep, finished or not; ``measured`` are user metrics, computed from kept tables."""

    folder: Path
    measured: Mapping[str, Metric] = field(default_factory=dict, hash=False)

    @classmethod
    def read(cls, folder: Path) -> SweepResults:
        """Open a folder; raise OutputError if it holds no sweep."""
        if not (folder / STUDY).is_file():
            raise OutputError(f"{folder}: no results of a sweep, missing: {STUDY}")
        return cls(folder)

    def naming(self, named: Sequence[str | Metric], option: str = "--metric") -> tuple[SweepResults, tuple[str, ...]]:
        """Return results with all metrics that a user names, and their field names.

        Names are fields, ``package.module:object``, ``file.py:object``, or metrics; the latter are computed for runs
        with kept tables, unless the study has measured them. Raises OutputError if a name is taken or no run has kept
        its tables, PluginError if a metric cannot be loaded.
        """
        known = {name: self.metrics[name].written() for name in self._record.own_metrics if name in self.metrics}
        names: list[str] = []
        new: dict[str, Metric] = {}
        for given in named:
            if (own := metric_given(given, self.metrics, option)) is None:
                names.append(str(given))
                continue
            reference, metric = own
            names.append(metric.name)
            if metric.written() == known.get(metric.name) or metric in (*self.measured.values(), *new.values()):
                continue
            if metric.name in (*self.metrics, *TAKEN, *(own.name for own in new.values())):
                allowed = "there is another field of that name; give the metric another one"
                raise OutputError(f"{reference or metric.name}: metric {metric.name}: {allowed}")
            new[reference or metric.name] = metric
        if new and not any(line["tables"] for line in self.lines.values()):
            raise OutputError(
                f"{self.folder}: kept no tables, of which {', '.join(metric.name for metric in new.values())} could be "
                "read; name it in study.metrics, or set study.keep_tables to the repeats whose tables are to be kept, "
                "and make the runs in another folder"
            )
        return replace(self, measured={**self.measured, **new}) if new else self, tuple(names)

    @cached_property  # a file of megabytes
    def _record(self) -> StudyRecord:
        try:
            return StudyRecord.model_validate_json((self.folder / STUDY).read_bytes())
        except ValueError:  # as pydantic's errors are
            raise OutputError(
                f"{self.folder / STUDY}: does not describe a study of this version; {LEDGER} beside it still has the "
                "runs"
            ) from None

    @cached_property  # it keeps the keys of the runs
    def schedule(self) -> RunSchedule:
        """Study with the keys of its runs; raises OutputError if ``study.json`` is damaged or of another version."""
        record = self._record
        return RunSchedule(record.version, record.study, record.configurations, self.metrics, record.repeats_of)

    @property
    def file(self) -> StudyFile:
        """Study file; raises OutputError as ``schedule``."""
        return self._record.study

    @property
    def code(self) -> Mapping[str, str]:
        """Digests and versions of the code that made the runs."""
        return self._record.code

    @cached_property  # asked for each name
    def metrics(self) -> dict[str, Metric]:
        """Metrics that can be compared, by field; raises OutputError for damaged declarations."""
        record = self._record
        try:
            declared = [Metric.read(entry) for entry in record.metrics]
        except OutputError as error:
            raise OutputError(f"{self.folder / STUDY}: {error}") from None
        return {metric.name: metric for metric in (*declared, *self.measured.values())}

    @property
    def compared(self) -> tuple[str, ...]:
        """Metrics that the study names, else the headline metrics."""
        headline = tuple(name for name, metric in self.metrics.items() if metric.headline)
        return self.file.study.metrics or headline

    def assumed(self, settings: Mapping[str, str]) -> list[str]:
        """Return the assumptions of channels with these settings (by key), for captions; often none."""
        texts = [
            label.assumed
            for label in self._record.configurations
            if label.assumed
            and all(settings.get(key, value) == value for key, value in label.settings if isinstance(value, str))
        ]
        return list(dict.fromkeys(texts))

    @cached_property  # the whole ledger
    def lines(self) -> dict[str, Line]:
        """Lines of the ledger in key order, with current settings; raises OutputError."""
        lines = self.schedule.labelled(read_ledger(self.folder / LEDGER, self._record.id))
        return self._with_measured(lines) if self.measured else lines

    def _with_measured(self, lines: Mapping[str, Line]) -> dict[str, Line]:
        from missions.runs.reader import value_of

        changed = dict(lines)
        for key, line in lines.items():
            if line["status"] == DONE and line["tables"]:
                run = self.kept(line)
                values = {m.name: value_of(m, run, f"{name}, run {key}") for name, m in self.measured.items()}
                known = {name: value for name, value in values.items() if value is not NOT_APPLICABLE}
                changed[key] = {**line, "summary": {**line["summary"], **known}}
        return changed

    def kept(self, line: Line) -> Results:
        """Return the results of a sampled run by its ledger line; raise OutputError if damaged."""
        from missions.runs.results import Results

        folder = run_folder(self.folder, line["key"])
        if is_damaged(self.folder, line):
            raise OutputError(f"{folder}: {DAMAGED}")
        return Results.read(folder)

    @cached_property  # it reads all tables, to leave out damaged ones
    def examples(self) -> list[Line]:
        """Run with tables of each scenario: of the baseline if possible, first repeat, least loss."""
        baseline = self.file.study.baseline or next(iter(self.file.study.strategies or ()), "")
        lines = sorted(
            (line for line in self.lines.values() if line["tables"] and not is_damaged(self.folder, line)),
            key=lambda line: (
                line["summary"]["strategy"] != baseline, line["repeat"], line["summary"]["per"], line["key"],
            ),
        )  # fmt: skip
        return list({line["summary"]["scenario"]: line for line in reversed(lines)}.values())[::-1]

    @property
    def shared_faults(self) -> list[str]:
        """Faults of the scenario as texts, if all runs share them."""
        labels = self.schedule.labels
        varies = len({(label.source, label.unforeseen) for label in labels}) > 1
        varies |= any(key.partition(".")[0] == FAULT for label in labels for key, _ in label.settings)
        tables = [] if varies else self.scenarios.values()
        return [fault_text(fault) for own in tables for fault in own.get(FAULT, ())]

    @property
    def scenarios(self) -> Mapping[str, Mapping[str, Any]]:
        """Tables of the first configuration of each scenario, by its source; none of an older version."""
        return self._record.scenario

    def runs(self) -> Any:
        """Return a pandas data frame with one row per finished run."""
        return run_table(self.lines).to_pandas()

    @property
    def damaged(self) -> list[Path]:
        """Folders of sampled runs whose tables were lost or changed since they were written."""
        return [run_folder(self.folder, key) for key, line in self.lines.items() if is_damaged(self.folder, line)]

    def status(self) -> SweepStatus:
        """Return the progress of the sweep."""
        lines = self.lines.values()
        summaries = {key: line["summary"] for key, line in self.lines.items()}
        remaining = sum(1 for _ in self.schedule.missing(summaries))
        failed = sum(line["status"] == FAILED for line in lines)
        censored = sum(line["status"] == DONE and not line["summary"]["completed"] for line in lines)
        with_tables = sum(bool(line["tables"]) for line in lines)
        return SweepStatus(len(lines) + remaining, len(lines) - failed, failed, censored, remaining, with_tables)


@cache  # lists all shipped strategies, asked for each row
def is_bound(strategy: str) -> bool:
    """True for an upper bound: shown beside the other strategies, never ranked."""
    return strategy in bounds()


def run_folder(folder: Path, key: str) -> Path:
    """Return the results folder of a sampled run in the folder of a sweep."""
    return folder / KEPT / f"key={key}"


def tables_digest(files: Mapping[str, bytes]) -> str:
    """Return the digest of the tables among files by name; empty without tables."""
    tables = sorted(name for name in files if name.endswith(".parquet"))
    content = b"".join(name.encode() + hashlib.sha256(files[name]).digest() for name in tables)
    return hashlib.sha256(content).hexdigest()[:20] if tables else ""


def is_damaged(folder: Path, line: Line) -> bool:
    """True if the tables of a run in a sweep were lost or changed since they were written."""
    if not line["tables"]:
        return False
    paths = run_folder(folder, line["key"]).glob("*.parquet")
    try:
        return tables_digest({path.name: path.read_bytes() for path in paths}) != str(line["tables"])
    except OSError:
        return True


class SweepFolder:
    """Folder of a running sweep, created if missing, locked by one process; OutputError if another one has it.

    ``accept_code`` resumes runs of other code (column ``code``); ``retry_failed`` repeats failed runs. Raises
    StudyChangedError for another study or an incompatible version of this one.
    """

    def __init__(self, folder: Path, plan: SweepPlan, accept_code: bool = False, retry_failed: bool = False) -> None:
        self.folder = folder
        self._plan = plan
        record = record_of(plan)
        check_folder(folder)
        if (folder / SUMMARY).exists():
            raise OutputError(f"--out {folder}: holds the results of a single run; name another folder")
        with writing(f"--out {folder}"):
            folder.mkdir(parents=True, exist_ok=True)
            # Before anything is read, since another sweep may be writing it.
            held = lock(folder / LOCK, os.O_RDWR | os.O_CREAT, is_required=True)
            if held is None:
                raise OutputError(f"--out {folder}: another sweep is writing this folder")
            self._lock = held
            try:
                record["id"] = self._make_sure_of_study(record, accept_code)
                write_synced(folder / STUDY_TEXT, plan.study.text)
                write_synced(folder / STUDY, json.dumps(record, indent=1))
                self._ledger = RunLedger(folder / LEDGER, record["id"])
                lines = self._ledger.lines.items()
                self._again = {
                    key
                    for key, line in lines
                    if (retry_failed and line["status"] == FAILED) or is_damaged(folder, line)
                }
                self.summaries = {key: line["summary"] for key, line in lines if key not in self._again}
                self._table_bytes = sum(path.stat().st_size for path in (folder / KEPT).glob("[!.]*/*"))
            # An interruption releases the lock too.
            except BaseException:
                os.close(held)
                raise

    def _make_sure_of_study(self, record: Mapping[str, Any], accept_code: bool) -> str:
        path = self.folder / STUDY
        if path.is_file():
            differing = list(differences(path, record, accept_code))
        else:
            differing = [f"{STUDY} is missing"] if (self.folder / LEDGER).is_file() else []
        if differing:
            of_code = "" if any(not line.startswith("code.") for line in differing) else CODE_CHANGED
            shown = "\n".join(f"  {line}" for line in differing[:MOST_DIFFERENCES])
            raise StudyChangedError(
                f"{self.folder} holds runs of a study that this one does not continue:\n{shown}\n"
                "a study may grow (repeats, strategies, policies, channels, vehicles, scenarios, points, unforeseen); "
                f"{of_code}name another folder for --out"
            )
        kept = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else record
        identity: str = kept["id"]
        return identity

    def append(self, finished: Sequence[FinishedRun]) -> None:
        """Record finished runs on disk, known ones skipped; OutputError if the disk or a changed repeat forbids it."""
        known, runs = self._ledger.lines, self.folder / KEPT
        new = {run.key: run for run in finished if run.key in self._again or run.key not in known}
        for key, run in new.items():
            if key in self._again and known[key]["status"] != FAILED and run.line["summary"] != known[key]["summary"]:
                raise OutputError(
                    f"{self.folder / LEDGER}: the run {key} was repeated, since its tables are lost, and differs "
                    "now; name another folder for --out"
                )
        with writing(runs):
            for key, run in new.items():
                n_bytes = sum(map(len, run.files.values()))
                if self._plan.study.design.keep_tables is None and self._table_bytes + n_bytes > MOST_TABLE_BYTES:
                    # Above the limit the run keeps its summary, without tables.
                    new[key] = FinishedRun({**run.line, "tables": ""})
                elif run.files:
                    runs.mkdir(exist_ok=True)
                    with drafted(run_folder(self.folder, key), lasts=True) as draft:
                        draft.mkdir()
                        for name, content in run.files.items():
                            (draft / name).write_bytes(content)
                        synced(*draft.iterdir())
                    self._table_bytes += n_bytes
        # After the tables: a line in the ledger promises that they are on disk.
        self._ledger.append(
            run.line
            for key, run in new.items()
            if key not in known or known[key]["status"] == FAILED or known[key]["tables"] != run.line["tables"]
        )
        self._again -= new.keys()
        self.summaries |= {key: run.line["summary"] for key, run in new.items()}

    def compact(self) -> None:
        """Write ``runs.parquet``; raise OutputError if the disk rejects it."""
        import pyarrow.parquet as pq

        with writing(f"--out {self.folder}"), drafted(self.folder / RUNS, lasts=True) as draft:
            pq.write_table(run_table(self._plan.schedule.labelled(self._ledger.lines)), draft, compression="zstd")

    def close(self) -> None:
        """Close the ledger and release the lock."""
        self._ledger.close()
        os.close(self._lock)


def run_table(lines: Mapping[str, Line]) -> Any:
    """Return one row per run, sorted by key: settings, summary, errors, code, machine."""
    import pyarrow as pa

    rows = [lines[key] for key in sorted(lines)]
    columns: dict[str, list[Any]] = {"key": [row["key"] for row in rows], "repeat": [row["repeat"] for row in rows]}
    for name in sorted({name for row in rows for name in row["settings"]}):
        columns[name] = [row["settings"].get(name) for row in rows]
    # Columns have the order of the longest summary, since failed runs have few fields.
    longest_first = sorted(rows, key=lambda row: -len(row["summary"]))
    for name in dict.fromkeys(name for row in longest_first for name in row["summary"]):
        columns[name] = [row["summary"].get(name) for row in rows]
    for name in ("status", "error", "replay"):
        columns[name] = [row[name] for row in rows]
    columns["code"] = [row.get("code", "") for row in rows]
    for name in MACHINE_COLUMNS:
        columns[name] = [row["machine"][name] for row in rows]
    return pa.table({name: _array(values) for name, values in columns.items()})


def _array(values: list[Any]) -> Any:
    import pyarrow as pa

    try:
        array = pa.array(values)
    except (pa.ArrowInvalid, pa.ArrowTypeError):
        return pa.array([None if value is None else toml_value(value) for value in values])
    return array.cast(pa.float64()) if pa.types.is_null(array.type) else array


def record_of(plan: SweepPlan) -> dict[str, Any]:
    """Return the record of a study as JSON values."""
    study = plan.study
    scenarios = {
        configuration.source: configuration.scenario.model_dump(mode="json")
        for configuration in reversed(study.configurations)
    }
    record = StudyRecord(
        version=plan.schedule.version,
        study=study.file,
        scenario=scenarios,
        code=code_of(study),
        metrics=tuple(metric.written() for metric in study.metrics.values()),
        own_metrics=study.own_metrics,
        configurations=plan.schedule.labels,
    ).model_dump(mode="json", exclude={"id", "repeats_of"})
    asked = {} if plan.repeats_of is None else {"repeats_of": list(plan.repeats_of)}
    return {"id": short({name: json.dumps(value) for name, value in record.items()}), **record, **asked}


def code_of(study: Study) -> dict[str, str]:
    """Return digests and versions of the code that makes the runs of a study."""
    return dict(fingerprint(references(part.scenario for part in study.configurations)))


def differences(path: Path, record: Mapping[str, Any], accept_code: bool = False) -> Iterator[str]:
    """Yield a line per key that makes the runs of a stored record incompatible with another.

    Runs are compatible if the other record has every configuration with the same content, seed and version, and asks
    for no fewer repeats. ``accept_code`` ignores changed code.
    """
    try:
        before = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(before, dict):
            raise TypeError("no table")
        old, new = dict(leaves(_compared(before))), dict(leaves(_compared(record)))
        lost = _digests(before) - _digests(record)
    except (ValueError, TypeError, KeyError):
        yield f"{path.name} cannot be read"
        return
    changed = [key for key in [*old, *(key for key in new if key not in old)] if old.get(key) != new.get(key)]
    changed = [key for key in changed if not (accept_code and key.startswith("code."))]
    breaking = [key for key in changed if not _is_growth(key, old.get(key), new.get(key), bool(lost))]
    for key in breaking:
        was, now = (shown(side[key]) if key in side else "absent" for side in (old, new))
        remedy = LACK_IT if key.endswith(OWN_METRICS) else ""
        yield f"{key.removeprefix('study.')}: was {was}, now {now}{remedy}"
    if lost and not breaking:
        yield f"{len(lost)} of {len(before['configurations'])} configurations are gone"


def _digests(record: Mapping[str, Any]) -> set[str]:
    return {entry["digest"] for entry in record["configurations"]}


def _compared(record: Mapping[str, Any]) -> dict[str, Any]:
    compared = {key: value for key, value in record.items() if key not in UNCOMPARED}
    if record["study"].get("stopping"):  # the rule sets the number of repeats
        design = {key: value for key, value in record["study"]["study"].items() if key != "repeats"}
        compared["study"] = {**record["study"], "study": design}
    return compared


def _is_growth(key: str, old: Any, new: Any, lost: bool) -> bool:
    """True if a difference cannot invalidate runs; ``lost``: configurations are missing."""
    if key in FIXED or (key.startswith("code.") and old is not None):
        return False
    if key.endswith(OWN_METRICS):
        return set(new or ()) <= set(old or ())
    if key == REPEATS:
        return old is None or new is None or new >= old
    if key.startswith(REPORTED) or not lost:
        return True
    return isinstance(old, list) and isinstance(new, list) and all(value in new for value in old)
