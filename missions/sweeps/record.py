"""Record: what a folder of a sweep is for, in ``study.json``.

It names the version, the study, the scenarios, the digests of configurations, and the code that makes the runs. A
sweep goes on in a folder whose every configuration it still has, with the same content and the same code: then all runs
that were made are runs of the new study, too, and it may only have more of them. The record also declares the metrics
and labels the configurations, so that the folder can be compared, ranked and drawn where the mission cannot be
imported; that is no part of the study.
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
