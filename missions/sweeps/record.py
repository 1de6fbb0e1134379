"""Record of a sweep's study in ``study.json``.

It has version, study, scenarios, configuration digests and code fingerprint. A sweep resumes in a folder only if it
still has every configuration, with the same content and code; then all existing runs belong to the new study, which may
have more. Declared metrics and labels, which are not compared, allow analysis without importing the mission.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from missions.files import shown
from missions.metric import MetricRecord
from missions.sweeps.code import fingerprint, short
from missions.sweeps.plan import ConfigurationLabel

if TYPE_CHECKING:
    from missions.sweeps.plan import SweepPlan

DECLARATIONS, LABELS, IDENTITY, OWN, ASSUMED = "metrics", "labels", "id", "own_metrics", "assumed"
"""Keys of the record that may differ when a sweep resumes."""
UNCOMPARED = (DECLARATIONS, LABELS, IDENTITY, OWN, ASSUMED, "digests")
FIXED = ("version", "study.study.name", "study.study.seed", "study.study.keep_tables")
"""Keys that must not differ when a sweep resumes."""
REPEATS = "study.study.repeats"
OWN_METRICS = ".scenario.metrics"
"""Suffix of the key of metrics named by a scenario."""
LACK_IT = "; runs that were made lack it: `remoras compare DIR --metric FILE.py:METRIC` reads the tables that were kept"
REPORTED = ("study.study.metrics", "study.study.baseline", "study.stopping")
"""Keys that change metrics or number of runs, but no run."""


def record_of(plan: SweepPlan) -> dict[str, Any]:
    """Return the record of a study as JSON values."""
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
    """Return a configuration label from JSON; raise TypeError or ValueError if malformed."""
    label = ConfigurationLabel(**entry)
    return replace(label, settings=tuple((str(key), value) for key, value in label.settings))


def differences(path: Path, record: Mapping[str, Any], accept_code: bool = False) -> Iterator[str]:
    """Yield a line per key that makes the runs of a stored record incompatible with another.

    Runs are compatible if the other record has every configuration with the same content, seed and version, and asks
    for no fewer repeats. ``accept_code`` ignores changed code.
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
    """Return the compared part of a record."""
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


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and values of nested tables; lists of tables use entry names.

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
