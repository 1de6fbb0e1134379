"""Objects named in a scenario: mission, strategy, vehicle data, groups, metrics, figures.

A plug-in is named ``package.module:object`` or ``file.py:object``. A file is imported as a module of its name:
scenarios and results name ``mine.py:Mine`` as ``mine:Mine``, independent of the folder.
"""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from exchange.channel.shipped import CHANNELS
from exchange.policy.policies import POLICIES
from missions.errors import ConfigurationFault
from missions.fault import kinds
from missions.figure import Declared, Figure, faults_of_figure
from missions.files import is_file, is_named, shown
from missions.metric import Metric, faults_of_metric
from missions.scenarios.fleet import makes_sensors
from missions.scenarios.scenario import Scenario
from remoras.errors import PluginError
from remoras.mission import Mission
from remoras.plugins import (
    allowed_names,
    asked_for,
    faults_of,
    installed,
    instance_of,
    look_in,
    named_object,
    refuse,
    refuse_unshipped,
)
from remoras.recorder import Table
from remoras.strategies import configured, names_of_strategies, shipped, strategies
from remoras.strategy import Strategy, faults_of_strategy

METRICS = "scenario.metrics"
OBJECT_OF_FILE = re.compile(r"\S.*\.py:\w+")
TRACKS = "trajectories"
KIND_OF_KEY = {
    "scenario.mission": "mission", "scenario.metrics": "metric", "strategy.name": "strategy",
    "study.strategies": "strategy", "communication.policy": "policy", "study.policies": "policy",
    "channel.name": "channel", "sensor.type": "sensor", "fault.kind": "fault",
}  # fmt: skip
"""Kind of the plug-in that a key names, by the last two parts of the key."""


NAMES: dict[str, Callable[[], Collection[str]]] = {
    "strategy": names_of_strategies, "policy": lambda: POLICIES, "channel": lambda: CHANNELS, "fault": kinds,
}  # fmt: skip
"""Shipped plug-ins by kind."""


def shipped_names(kind: str, tables: Mapping[str, Any]) -> Collection[str]:
    """Return the shipped names of a kind of plug-in; those of sensors depend on the mission in ``tables``."""
    if kind == "sensor" and tables:
        return mission_class(installed("mission", str(tables["scenario"].get("mission")))).sensors
    return NAMES[kind]() if kind in NAMES else ()


def stored(kind: str, name: str) -> str:
    """Return a plug-in that a user names as scenarios store it: a shipped name, or as ``importable``."""
    return name if name in shipped_names(kind, {}) else importable(installed(kind, name))


def importable(reference: str, folder: Path | None = None) -> str:
    """Return a plug-in reference as scenarios store it, and register a file's folder; PluginError if not importable.

    ``folder`` is searched for a file before the current one.
    """
    file, colon, name = reference.rpartition(":")
    if not colon and reference.endswith(".py"):
        raise PluginError(f"names a file without an object; allowed: {reference}:OBJECT")
    if not file.endswith(".py"):
        return reference
    refuse_unshipped("", reference)
    path = Path(file).expanduser()
    if folder is not None and is_file(folder / path):
        path = folder / path
    path = path.resolve()
    if not is_file(path):
        raise PluginError(f"no such file: {path}")
    if not path.stem.isidentifier():
        raise PluginError(f"{path.name} cannot be imported, its name is no module name; rename it, as my_strategy.py")
    # Before the search: worker processes find the module in this folder, too.
    look_in([str(path.parent)])
    try:
        with asked_for(path.stem):
            spec = importlib.util.find_spec(path.stem)
    except (ImportError, ValueError):
        spec = None
    # A module of that name elsewhere on the path would be imported instead.
    if spec is None or spec.origin is None or Path(spec.origin).resolve() != path:
        other = "a module" if spec is None or spec.origin is None else spec.origin
        raise PluginError(f"{path.name} has the name of {other}, which Python finds first; rename the file")
    return f"{path.stem}:{name}"


def metric_named(reference: str) -> Metric:
    """Return the metric that a user names, as for ``importable``, or raise PluginError."""
    metric: Metric = named_object(importable(reference))
    refuse("a metric", faults_of_metric(metric))
    return metric


def metric_given(metric: str | Metric, fields: Collection[str], where: str) -> tuple[str, Metric] | None:
    """Return a user's metric with its reference, empty for an object; None for the name of a field.

    ``fields`` are known names, ``where`` is the origin of the metric, for messages.
    """
    if isinstance(metric, str):
        metric = metric if metric in fields else installed("metric", metric)
        if not is_named(metric):
            return None
    try:
        if isinstance(metric, str):
            return metric, metric_named(metric)
        refuse("a metric", faults_of_metric(metric))
    except PluginError as error:
        raise PluginError(f"{where} {metric!r}: {error}") from None
    return "", metric


def with_figures(
    kinds: Sequence[str | Declared], declared: Sequence[Declared], taken: Collection[str]
) -> tuple[list[str], list[Declared]]:
    """Return names of figures, and the declared ones with a user's; PluginError for a faulty one or a taken name."""
    names: list[str] = []
    figures = list(declared)
    for kind in kinds:
        if isinstance(kind, str) and kind not in {*taken, *(f.name for f in figures if isinstance(f, Figure))}:
            kind = installed("figure", kind)  # noqa: PLW2901
        if isinstance(kind, str) and not is_named(kind):
            names.append(kind)
            continue
        where = f"figure {kind!r}" if isinstance(kind, str) else "figure"
        try:
            own: Declared = named_object(importable(kind)) if isinstance(kind, str) else kind
            refuse("a figure", faults_of_figure(own))
        except PluginError as error:
            raise PluginError(f"{where}: {error}") from None
        if isinstance(own, Figure) and own not in figures:
            known = [*taken, *(figure.name for figure in figures if isinstance(figure, Figure))]
            if own.name in known:
                raise PluginError(f"{where}: its name {own.name!r} is taken; rename it, not as {', '.join(known)}")
        figures += [] if own in figures else [own]
        names.append(own.name if isinstance(own, Figure) else TRACKS)
    return names, figures


def with_files_found(raw: Mapping[str, Any], folder: Path, overridden: Collection[str] = ()) -> dict[str, Any]:
    """Replace files and names of installed plug-ins in tables by module references, as workers and results use."""

    def resolved(value: Any, key: str) -> Any:
        if isinstance(value, dict):
            return {name: resolved(part, f"{key}.{name}".lstrip(".")) for name, part in value.items()}
        if isinstance(value, list):
            return [resolved(part, key) for part in value]
        if not isinstance(value, str):
            return value
        if not OBJECT_OF_FILE.fullmatch(value):
            kind = KIND_OF_KEY.get(".".join(key.split(".")[-2:]), "")
            # Sensors of a study are resolved with its scenario, whose mission names others.
            is_open = kind and not (kind == "sensor" and not isinstance(raw.get("scenario"), dict))
            try:
                return installed(kind, value) if is_open and value not in shipped_names(kind, raw) else value
            except PluginError:
                if kind != "sensor":
                    raise
                return value  # the mission is at fault, as the check of its key tells
        # Paths in a file are relative to it, those of an option to the current folder.
        is_set = any(f"{key}.".startswith(f"{option}.") for option in overridden)
        # An unresolved reference stays, since the check of its key names the reason.
        try:
            return importable(value, None if is_set else folder)
        except PluginError:
            return value

    tables: dict[str, Any] = resolved(raw, "")
    return tables


def metric_faults(scenario: Scenario) -> Iterator[ConfigurationFault]:
    """Yield faults: metrics of a scenario that cannot be loaded."""
    for reference in scenario.scenario.metrics:
        try:
            metric_named(reference)
        except PluginError as error:
            yield ConfigurationFault(METRICS, shown(reference), str(error))


COMPULSORY_OF_MISSION = (
    "Scenario", "group_missions", "social_domain", "from_scenario", "jobs", "activity_sets", "behaviour_for", "truth",
    "founding_objectives", "is_individual", "completion", "findings", "world", "check", "completed",
    "delegating_mission", "groups_of", "needs", "vocabulary", "sensors", "tables", "metrics", "figures",
)  # fmt: skip
"""Required members of a mission class; subclasses of ``Mission`` inherit defaults."""
HELD = {
    "group_missions": (str,), "needs": (str,), "vocabulary": (Path, str), "tables": (Table,), "metrics": (Metric,),
}  # fmt: skip


def mission_class(reference: str) -> type[Mission]:
    """Load the class of a mission, ``package.module:Class``, or raise PluginError."""
    loaded = named_object(reference)
    if not isinstance(loaded, type):
        raise PluginError(f"a class, a subclass of remoras.Mission; {reference} is {type(loaded).__name__}")
    tables = getattr(loaded, "Scenario", Scenario)
    if not (isinstance(tables, type) and issubclass(tables, Scenario)):
        raise PluginError("its Scenario must be missions.scenarios.Scenario or a subclass of it")
    refuse("a mission", faults_of(loaded, Mission, COMPULSORY_OF_MISSION))
    mission: type[Mission] = loaded
    refuse("a mission", [*_wrongly_held(mission), *_wrong_sensors(mission.sensors)])
    return mission


def _wrongly_held(mission: type[Mission]) -> Iterator[str]:
    for name, types in HELD.items():
        held, wanted = getattr(mission, name), f"expected a tuple of {types[0].__name__}"
        if isinstance(held, str) or not isinstance(held, Sequence):
            yield f"{name} is {type(held).__name__}; {wanted}"
        else:
            yield from (f"{name} holds {part!r}; {wanted}" for part in held if not isinstance(part, types))


def _wrong_sensors(sensors: Any) -> Iterator[str]:
    wanted = "expected a mapping of names to subclasses of remoras.SensorSettings that define make(data)"
    if not isinstance(sensors, Mapping):
        yield f"sensors is {type(sensors).__name__}; {wanted}"
        return
    for name, kind in sensors.items():
        if not makes_sensors(kind):
            yield f"sensors has {kind!r} as {name}; {wanted}"


def mission_of(scenario: Scenario) -> Mission:
    """Create the mission of a scenario."""
    return mission_class(scenario.scenario.mission).from_scenario(scenario)


def strategy_of(scenario: Scenario) -> Strategy:
    """Create the strategy of a scenario, with its parameters."""
    return configured(strategy_named(scenario.strategy.name), scenario.strategy.parameters)


def strategy_named(name: str) -> Strategy:
    """Return a shipped or plug-in strategy, a class instantiated, or raise PluginError."""
    if not is_named(name):
        if (of_name := shipped(name)) is None:
            raise PluginError(allowed_names("strategy", name, strategies()))
        return of_name
    strategy: Strategy = instance_of(named_object(importable(name)), name)
    refuse("a strategy", faults_of_strategy(strategy))
    return strategy


def entrants(references: Iterable[str]) -> tuple[str, ...]:
    """Return strategies named by ``--strategy`` as scenarios store them, each once; PluginError if unavailable."""
    named = []
    for reference in references:
        try:
            named.append(stored("strategy", reference))
            strategy_named(named[-1])
        except PluginError as error:
            raise PluginError(f'--strategy "{reference}": {error}') from error
    return tuple(dict.fromkeys(named))
