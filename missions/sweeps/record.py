"""Records of runs, as rows of a table and as values of JSON.

A run without its tables has no value; how many have is the n of a comparison.

It names the version, the study, the scenarios, the digests of configurations, and the code that makes the runs. A
sweep goes on in a folder whose every configuration it still has, with the same content and the same code: then all runs
that were made are runs of the new study, too, and it may only have more of them. The record also declares the metrics
and labels the configurations, so that the folder can be compared, ranked and drawn where the mission cannot be
imported; that is no part of the study.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from missions.errors import MissionsError, OutputError
from missions.files import shown, toml_value
from missions.metric import NOT_APPLICABLE, Metric, MetricRecord
from missions.runs.measured import KeptRun, value_of
from missions.scenarios import Scenario, load
from missions.sweeps.code import fingerprint, short
from missions.sweeps.ledger import DONE, Line
from missions.sweeps.plan import ConfigurationLabel, RunSchedule, run_content
from remoras.recorder import KEY

if TYPE_CHECKING:
    import pyarrow as pa

    from missions.sweeps.plan import SweepPlan


def with_values(
    lines: Mapping[str, Line],
    metrics: Mapping[str, Metric],
    schedule: RunSchedule,
    whole: Callable[[str], pa.Table | None],
) -> dict[str, Line]:
    """Lines of the ledger whose summaries have the values of further metrics, where tables were kept.

    Args:
        lines: of the ledger, by key.
        metrics: by what the user calls them.
        schedule: says of which configuration each run is.
        whole: gives a table of all kept runs; None if there is none of that name.

    Raises:
        PluginError: a metric fails.
    """
    label_of = _labels(schedule, lines)
    read = cache(whole)
    changed = dict(lines)
    for key, line in lines.items():
        if line["status"] == DONE and line["tables"]:
            run = KeptRun(line["summary"], partial(_own_rows, read, key), _scenario(key, label_of))
            values = {metric.name: value_of(metric, run, f"{of}, run {key}") for of, metric in metrics.items()}
            kept = {name: value for name, value in values.items() if value is not NOT_APPLICABLE}
            changed[key] = {**line, "summary": {**line["summary"], **kept}}
    return changed


def _own_rows(whole: Callable[[str], pa.Table | None], key: str, name: str) -> pa.Table | None:
    """A table of one run."""
    import pyarrow.compute as pc  # here: `compare` alone does not need it

    table = whole(name)
    return None if table is None else table.filter(pc.equal(table[KEY], key))


def _labels(schedule: RunSchedule, lines: Mapping[str, Line]) -> dict[str, tuple[ConfigurationLabel, str]]:
    """Label and digest of the configuration of every run, by key; none where the folder does not say."""
    repeats = {line["repeat"] for line in lines.values()}
    return {
        schedule.key(number, repeat): (label, schedule.digests[number])
        for number, label in enumerate(schedule.labels)
        for repeat in repeats
    }


def _scenario(key: str, label_of: Mapping[str, tuple[ConfigurationLabel, str]]) -> Callable[[], Scenario]:
    """Gives the scenario of a run, made as ``remoras run`` makes it, and only if a metric asks for it."""

    def scenario_of() -> Scenario:
        if key not in label_of:
            raise OutputError(f"run {key}: the folder does not say of which scenario it is")
        label, digest = label_of[key]
        settings = [("study", f"{name}={toml_value(value)}") for name, value in label.settings]
        try:
            scenario = load(label.source, settings)
        except MissionsError as error:
            raise OutputError(f"run {key}: its scenario {label.source} cannot be had: {error}") from None
        if hashlib.sha256(run_content(scenario).encode()).hexdigest() != digest:
            raise OutputError(f"run {key}: its scenario {label.source} is another one now; rows of tables can be read")
        return scenario

    return scenario_of


DECLARATIONS, LABELS, IDENTITY, OWN, ASSUMED = "metrics", "labels", "id", "own_metrics", "assumed"
"""Keys of the record that may differ when a sweep goes on."""
UNCOMPARED = (DECLARATIONS, LABELS, IDENTITY, OWN, ASSUMED, "digests")
FIXED = ("version", "study.study.name", "study.study.seed", "study.study.keep_tables")
"""Keys that never differ when a sweep goes on."""
REPEATS = "study.study.repeats"
OWN_METRICS = ".scenario.metrics"
"""End of the key of the metrics that a scenario names itself."""
LACK_IT = "; runs that were made lack it: `remoras compare DIR --metric FILE.py:METRIC` reads the tables that were kept"
REPORTED = ("study.study.metrics", "study.study.baseline", "study.stopping")
"""Keys that change what is asked of the runs, or how many are needed, but no run."""


def record_of(plan: SweepPlan) -> dict[str, Any]:
    """The record of a study, as JSON has it."""
    study = plan.study
    scenarios = {
        configuration.source: configuration.scenario.model_dump(mode="json")
        for configuration in reversed(study.configurations)
    }
    assumed = [configuration.scenario.channel.assumed() for configuration in study.configurations]
    record = {
        "version": plan.schedule.version,
        "study": study.file.model_dump(mode="json"),
        "scenario": scenarios,
        "code": fingerprint(configuration.scenario.model_dump(mode="json") for configuration in study.configurations),
        DECLARATIONS: [MetricRecord.of(metric).written() for metric in study.metrics.values()],
        OWN: list(study.own_metrics),
        "digests": plan.schedule.digests,
        LABELS: [vars(label) for label in plan.schedule.labels],
        **({ASSUMED: assumed} if any(assumed) else {}),
    }
    loaded: dict[str, Any] = json.loads(json.dumps(record))
    return {IDENTITY: short({name: json.dumps(value) for name, value in loaded.items()}), **loaded}


def read_label(entry: Mapping[str, Any]) -> ConfigurationLabel:
    """The label of a configuration that JSON has.

    Raises:
        TypeError, ValueError: it is none.
    """
    label = ConfigurationLabel(**entry)
    return replace(label, settings=tuple((str(key), value) for key, value in label.settings))


def differences(path: Path, record: Mapping[str, Any], accept_code: bool = False) -> Iterator[str]:
    """Why the runs of the record in a file are not all runs of another record, one line per key; nothing if they are.

    Runs are kept if the other record has every configuration with the same content, seed and version, and asks for no
    fewer repeats.

    Args:
        path: of the file.
        record: of the study that is to go on.
        accept_code: pass over code that has changed.
    """
    try:
        before = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(before, dict):
            raise TypeError("no table")
        old, new = dict(_leaves(_compared(before))), dict(_leaves(_compared(record)))
        lost = set(before["digests"]) - set(record["digests"])
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
        yield f"{len(lost)} of {len(before['digests'])} configurations are gone"


def _compared(record: Mapping[str, Any]) -> dict[str, Any]:
    """What the record says of the study."""
    compared = {key: value for key, value in record.items() if key not in UNCOMPARED}
    if record["study"].get("stopping"):  # the rule says how many repeats there are
        design = {key: value for key, value in record["study"]["study"].items() if key != "repeats"}
        compared["study"] = {**record["study"], "study": design}
    return compared


def _is_growth(key: str, old: Any, new: Any, lost: bool) -> bool:
    """True if a difference cannot be why runs are lost.

    Args:
        key: of the record, dotted.
        old: the value of the folder; None if it has none.
        new: the value of the study; None if it has none.
        lost: whether the study lacks configurations that the folder has.
    """
    if key in FIXED or (key.startswith("code.") and old is not None):
        return False
    if key.endswith(OWN_METRICS):
        return set(new or ()) <= set(old or ())
    if key == REPEATS:
        return old is None or new is None or new >= old
    if key.startswith(REPORTED) or not lost:
        return True
    return isinstance(old, list) and isinstance(new, list) and all(value in new for value in old)


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys and values of nested tables; a list of values is one, entries of a list of tables go by name.

    >>> list(_leaves({"a": [{"name": "x", "b": [1, 2]}]}))
    [('a.x.name', 'x'), ('a.x.b', [1, 2])]
    """
    if isinstance(value, dict):
        for key, entry in value.items():
            yield from _leaves(entry, f"{path}.{key}".removeprefix("."))
    elif isinstance(value, list) and any(isinstance(entry, dict) for entry in value):
        for number, entry in enumerate(value, 1):
            name = entry.get("name", number) if isinstance(entry, dict) else number
            yield from _leaves(entry, f"{path}.{name}")
    else:
        yield path, value
