"""User metrics computed afterwards from the kept tables of a sweep.

Values equal those measured by the run. A run without tables has no value and does not count in comparisons.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection, Mapping
from functools import cache, partial

import pyarrow as pa
import pyarrow.compute as pc

from missions.errors import MissionsError, OutputError
from missions.files import toml_value
from missions.metric import NOT_APPLICABLE, Metric
from missions.runs.reader import KeptRun, value_of
from missions.scenarios import Scenario, load
from missions.sweeps.ledger import DONE, Line
from missions.sweeps.plan import ConfigurationLabel, RunSchedule, run_content
from remoras.recorder import KEY


def with_values(
    lines: Mapping[str, Line],
    metrics: Mapping[str, Metric],
    schedule: RunSchedule,
    tables: Collection[str],
    whole: Callable[[str], pa.Table],
) -> dict[str, Line]:
    """Return ledger lines with values of further metrics in the summaries, where tables exist.

    ``schedule`` maps runs to configurations; ``whole`` returns a kept table of all runs. Raises PluginError if a metric
    fails.
    """
    label_of = _labels(schedule, lines)
    read = cache(whole)  # one table for all runs
    changed = dict(lines)
    for key, line in lines.items():
        if line["status"] == DONE and line["tables"]:
            run = KeptRun(line["summary"], tables, partial(_own_rows, read, key), _scenario(key, label_of))
            values = {metric.name: value_of(metric, run, f"{of}, run {key}") for of, metric in metrics.items()}
            kept = {name: value for name, value in values.items() if value is not NOT_APPLICABLE}
            changed[key] = {**line, "summary": {**line["summary"], **kept}}
    return changed


def _own_rows(whole: Callable[[str], pa.Table], key: str, name: str) -> pa.Table:
    table = whole(name)
    return table.filter(pc.equal(table[KEY], key))


def _labels(schedule: RunSchedule, lines: Mapping[str, Line]) -> dict[str, tuple[ConfigurationLabel, str]]:
    """Return label and digest of each run's configuration, where the folder has them."""
    repeats = {line["repeat"] for line in lines.values()}
    return {
        schedule.key(number, repeat): (label, schedule.digests[number])
        for number, label in enumerate(schedule.labels)
        for repeat in repeats
    }


def _scenario(key: str, label_of: Mapping[str, tuple[ConfigurationLabel, str]]) -> Callable[[], Scenario]:
    """Return a loader of a run's scenario, called only if a metric needs it."""

    def scenario_of() -> Scenario:
        if key not in label_of:
            raise OutputError(f"run {key}: the folder does not record its scenario")
        label, digest = label_of[key]
        settings = [("study", f"{name}={toml_value(value)}") for name, value in label.settings]
        try:
            scenario = load(label.source, settings)
        except MissionsError as error:
            raise OutputError(f"run {key}: its scenario {label.source} cannot be loaded: {error}") from None
        if hashlib.sha256(run_content(scenario).encode()).hexdigest() != digest:
            raise OutputError(f"run {key}: its scenario {label.source} is another one now; rows of tables can be read")
        return scenario

    return scenario_of
