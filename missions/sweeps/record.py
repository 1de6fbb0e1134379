"""Record: what a folder of a sweep is for, in ``study.json``.

It names the version, the study, the scenarios, the digests of configurations and of plug-ins. A sweep goes on only in a
folder with the same record. The record also declares the metrics, so that the folder can be compared, ranked and drawn
where the mission cannot be imported; another declaration of a metric is no other study.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from missions.document import shown
from missions.metric import MetricRecord

if TYPE_CHECKING:
    from missions.sweeps.plan import SweepPlan

DECLARATIONS = "metrics"
"""Key of the record that may differ when a sweep goes on."""
OURS = ("worldmodel", "exchange", "remoras", "missions", "visualisation")
"""Packages of this program; their version stands for their code."""
REFERENCE = re.compile(r"([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*):[A-Za-z_][\w.]*")
"""``package.module:object``."""


def record_of(plan: SweepPlan) -> dict[str, Any]:
    """The record of a study, as JSON has it."""
    study = plan.study
    scenarios = {one.source: one.scenario.model_dump(mode="json") for one in reversed(study.configurations)}
    record = {
        "version": plan.schedule.version,
        "study": study.file.model_dump(mode="json"),
        "scenario": scenarios,
        "code": code_digests(one.scenario.model_dump(mode="json") for one in study.configurations),
        DECLARATIONS: [MetricRecord.of(metric).written() for metric in study.metrics.values()],
        "digests": plan.schedule.digests,
    }
    loaded: dict[str, Any] = json.loads(json.dumps(record))
    return loaded


def code_digests(scenarios: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Digests of the files of all plug-ins that scenarios name as ``package.module:object``, by reference."""
    references = {text for scenario in scenarios for text in _texts(scenario) if _is_reference(text)}
    files = {reference: _file_of(reference.partition(":")[0]) for reference in sorted(references)}
    return {
        reference: hashlib.sha256(file.read_bytes()).hexdigest()[:12]
        for reference, file in files.items()
        if file is not None
    }


def _texts(value: Any) -> Iterator[str]:
    """Every text in nested tables and lists."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for entry in value.values() if isinstance(value, dict) else value:
            yield from _texts(entry)


def _is_reference(text: str) -> bool:
    """True for a text that may name an object of a module that is not this program's own."""
    found = REFERENCE.fullmatch(text)
    return found is not None and found[1].partition(".")[0] not in OURS


def _file_of(module: str) -> Path | None:
    """Source of a module; None if there is no such module, for a text with a colon may mean something else."""
    try:
        spec = importlib.util.find_spec(module)
    except Exception:  # finding it loads the packages around it, which may be anything
        return None
    return Path(spec.origin) if spec is not None and spec.origin is not None and spec.has_location else None


def differences(path: Path, record: Mapping[str, Any]) -> Iterator[str]:
    """What differs between a record and the one that is in the file, one line per key."""
    try:
        old = dict(_leaves(_comparable(json.loads(path.read_text(encoding="utf-8")))))
    except ValueError:
        yield f"{path.name} cannot be read"
        return
    new = dict(_leaves(_comparable(record)))
    changed = [key for key in [*old, *(key for key in new if key not in old)] if old.get(key) != new.get(key)]
    for key in changed:
        before, now = (shown(side[key]) if key in side else "absent" for side in (old, new))
        if key != "digests" or len(changed) == 1:  # they differ with whatever else does
            yield f"{key.removeprefix('study.')}: was {before}, now {now}"


def _comparable(record: Any) -> Any:
    """The record without what may differ."""
    return {key: value for key, value in record.items() if key != DECLARATIONS} if isinstance(record, dict) else record


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
