"""Plug-ins that a user names: ``package.module:object``, or ``file.py:object`` wherever the file is.

A file is imported as a module of its name, from a folder of plug-ins (``remoras/plugins.py``); worker
processes know it, too. So results call ``mine.py:Mine`` what scenarios call it, ``mine:Mine``, wherever the file is.
"""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from missions.errors import ConfigurationFault
from missions.figure import Declared, Figure, faults_of_figure
from missions.files import is_file, is_named, shown
from missions.metric import Metric, faults_of_metric
from remoras.errors import PluginError
from remoras.plugins import asked_for, look_in, named_object, refuse_unshipped

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario

METRICS = "scenario.metrics"
"""Key of a scenario that names metrics of one's own."""
OBJECT_OF_FILE = re.compile(r"\S.*\.py:\w+")
TRACKS = "trajectories"
"""Kind of figure into which layers and marks are drawn."""


def importable(given: str, folder: Path | None = None) -> str:
    """A plug-in as scenarios name it; the folder of a file is one of plug-ins then.

    Args:
        given: ``package.module:object`` or ``file.py:object``.
        folder: in which a file is looked for first; then in the current one.

    Raises:
        PluginError: there is no such file, or it cannot be imported by its name.
    """
    file, colon, name = given.rpartition(":")
    if not colon and given.endswith(".py"):
        raise PluginError(f"names a file and no object in it; allowed: {given}:OBJECT")
    if not file.endswith(".py"):
        return given
    refuse_unshipped("", given)
    path = Path(file).expanduser()
    if folder is not None and is_file(folder / path):
        path = folder / path
    path = path.resolve()
    if not is_file(path):
        raise PluginError(f"no such file: {path}")
    if not path.stem.isidentifier():
        raise PluginError(f"{path.name} cannot be imported, its name is none of a module; rename it, as my_strategy.py")
    look_in([str(path.parent)])
    try:
        with asked_for(path.stem):
            spec = importlib.util.find_spec(path.stem)
    except (ImportError, ValueError):
        spec = None
    if spec is None or spec.origin is None or Path(spec.origin).resolve() != path:
        other = "a module" if spec is None or spec.origin is None else spec.origin
        raise PluginError(f"{path.name} has the name of {other}, which Python finds first; rename the file")
    return f"{path.stem}:{name}"


def metric_named(reference: str) -> Metric:
    """The metric that a user names, as ``importable`` has it.

    Raises:
        PluginError: it cannot be loaded, is no ``remoras.Metric``, or a part of it is none.
    """
    found: Any = named_object(importable(reference))
    if faults := list(faults_of_metric(found)):
        raise PluginError(f"a metric: {'; '.join(fault.text for fault in faults)}")
    metric: Metric = found
    return metric


def metric_given(given: str | Metric, where: str) -> Metric:
    """The metric that a user names, or passes as an object.

    Args:
        given: ``package.module:object``, ``file.py:object``, or the metric.
        where: how it was given, for messages.

    Raises:
        PluginError: see ``metric_named``.
    """
    try:
        if isinstance(given, str):
            return metric_named(given)
        if faults := list(faults_of_metric(given)):
            raise PluginError(f"a metric: {'; '.join(fault.text for fault in faults)}")
    except PluginError as error:
        raise PluginError(f"{where} {given!r}: {error}") from None
    return given


def with_figures(
    kinds: Sequence[str | Declared], declared: Sequence[Declared], taken: Collection[str]
) -> tuple[list[str], list[Declared]]:
    """Kinds of figures by their names, and what is declared, each with figures of a user's own.

    Args:
        kinds: names of figures, ``package.module:object``, ``file.py:object``, or figures themselves.
        declared: what the mission declares.
        taken: names of figures that every run has.

    Raises:
        PluginError: one cannot be had, is no figure, or has the name of another one.
    """
    names: list[str] = []
    figures = list(declared)
    for kind in kinds:
        if isinstance(kind, str) and not is_named(kind):
            names.append(kind)
            continue
        where = f"figure {kind!r}" if isinstance(kind, str) else "figure"
        try:
            found = named_object(importable(kind)) if isinstance(kind, str) else kind
            if faults := list(faults_of_figure(found)):
                raise PluginError(f"a figure: {'; '.join(faults)}")
        except PluginError as error:
            raise PluginError(f"{where}: {error}") from None
        own: Declared = found
        if isinstance(own, Figure) and own not in figures:
            known = [*taken, *(figure.name for figure in figures if isinstance(figure, Figure))]
            if own.name in known:
                raise PluginError(
                    f"{where}: its name {own.name!r} is that of another; rename it, none of {', '.join(known)}"
                )
        figures += [] if own in figures else [own]
        names.append(own.name if isinstance(own, Figure) else TRACKS)
    return names, figures


def with_files_found(raw: Mapping[str, Any], folder: Path, overridden: Collection[str] = ()) -> dict[str, Any]:
    """Tables in which every object of a file is named by its module, as worker processes and results name it.

    What cannot be had stays, and is reported where it is looked for.

    Args:
        raw: tables of a scenario or a study.
        folder: that the paths of files start from.
        overridden: dotted keys of the overrides; a path in one starts from the current folder.
    """

    def found(value: Any, key: str) -> Any:
        if isinstance(value, dict):
            return {name: found(part, f"{key}.{name}".lstrip(".")) for name, part in value.items()}
        if isinstance(value, list):
            return [found(part, key) for part in value]
        if not (isinstance(value, str) and OBJECT_OF_FILE.fullmatch(value)):
            return value
        is_set = any(f"{key}.".startswith(f"{option}.") for option in overridden)
        try:
            return importable(value, None if is_set else folder)
        except PluginError:
            return value

    tables: dict[str, Any] = found(raw, "")
    return tables


def metric_faults(scenario: Scenario) -> Iterator[ConfigurationFault]:
    """Metrics of a scenario that cannot be had."""
    for reference in scenario.scenario.metrics:
        try:
            metric_named(reference)
        except PluginError as error:
            yield ConfigurationFault(METRICS, shown(reference), str(error))
