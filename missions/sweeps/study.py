"""Studies: the product of scenarios, fleet sizes, strategies, policies, channels, unforeseen cases and points.

A point sets keys of the scenario, named as for ``--set``; points come from a full grid, a list, a Latin hypercube or a
two-level factorial design. Loading resolves every configuration, so that a study that starts can finish.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

from missions.document import Document
from missions.errors import ConfigurationError, ConfigurationFault
from missions.files import (
    SCENARIO,
    STUDY,
    dotted,
    file_or_name,
    is_file,
    is_named,
    shipped,
    shipped_studies,
    shown,
    toml_value,
)
from missions.metric import Metric
from missions.runs.metrics import metrics_of, own_metrics
from missions.scenarios import Scenario, load
from missions.scenarios.channel import is_left_aside
from missions.scenarios.explanations import explanations_of
from missions.scenarios.loading import scenario_from
from missions.scenarios.parts import METRICS, entrants, importable, metric_named, with_files_found
from missions.sweeps.factorial import HIGH
from missions.sweeps.study_file import (
    FAULT,
    LISTS,
    TABLE_OF,
    Design,
    StudyFile,
    StudySetting,
    Unforeseen,
    channel_place,
    faults_between,
    faults_of_no_fault,
    is_axis,
)
from remoras.errors import PluginError
from remoras.plugins import installed
from worldmodel import suggestion

Settings = tuple[StudySetting, ...]


def combinations(file: StudyFile) -> Iterator[tuple[Settings, str]]:
    """Yield every combination of settings with the name of its unforeseen case, if any; scenarios run with all."""
    axes: list[list[Settings]] = [[tuple(StudySetting(key, value, f"set.{key}") for key, value in dotted(file.set))]]
    for name, key in LISTS.items():
        values: Sequence[Any] = getattr(file.study, name) or ()
        axes.append([(StudySetting(key, value, f"study.{name}"),) for value in values] or [()])
    axes += [_channels(file), points(file)]
    cases = [(_unforeseen(case), case.name) for case in file.unforeseen] or [((), "")]
    for chosen in itertools.product(*axes):
        for settings, name in cases:
            yield (*itertools.chain(*chosen), *settings), name


def _unforeseen(case: Unforeseen) -> Settings:
    place = f"unforeseen.{case.name}"
    settings = [StudySetting(key, value, f"{place}.set.{key}") for key, value in dotted(case.set)]
    return (*settings, *([StudySetting(FAULT, list(case.fault), f"{place}.fault")] if case.fault else []))


def _channels(file: StudyFile) -> list[Settings]:
    channels = []
    for number, table in enumerate(file.channel):
        place = channel_place(file, number)
        channels += _product([StudySetting(f"channel.{key}", value, f"{place}.{key}") for key, value in table.items()])
    return channels or [()]


def points(file: StudyFile) -> list[Settings]:
    """Return the settings of every point, in file order; the last key of a grid varies fastest."""
    table = TABLE_OF[file.study.sampling]
    if table == "point":
        return [
            tuple(StudySetting(key, value, f"point.{number}.{key}") for key, value in dotted(point))
            for number, point in enumerate(file.point, 1)
        ]
    if table == "latin":
        return _latin_hypercube(dict(dotted(file.latin)), file.study.samples, file.study.seed)
    if table == "factorial":
        return _factorial(file)
    return _product([StudySetting(key, value, f"grid.{key}") for key, value in dotted(file.grid)])


def _factorial(file: StudyFile) -> list[Settings]:
    levels = file.factors
    return [
        tuple(StudySetting(key, levels[key][level == HIGH], f"factorial.{key}") for key, level in run.items())
        for run in file.two_level_design.runs
    ]


def _latin_hypercube(bounds: Mapping[str, tuple[float, float]], samples: int, seed: int) -> list[Settings]:
    from scipy.stats import qmc  # slow to load

    unit = qmc.LatinHypercube(len(bounds), seed=seed).random(samples)
    return [
        tuple(
            StudySetting(key, _between(*bounds[key], share), f"latin.{key}")
            for key, share in zip(bounds, row, strict=True)
        )
        for row in unit.tolist()
    ]


def _between(low: float, high: float, share: float) -> float:
    if isinstance(low, int) and isinstance(high, int):
        return low + min(int(share * (high - low + 1)), high - low)
    return float(f"{low + share * (high - low):.6g}")


def _product(grid: Sequence[StudySetting]) -> list[Settings]:
    choices = [
        [setting._replace(value=value) for value in (setting.value if is_axis(setting.value) else [setting.value])]
        for setting in grid
    ]
    return list(itertools.product(*choices))


KEY_OF_METRICS = "study.metrics"


@dataclass(frozen=True)
class Configuration:
    """One combination of settings, with its resolved scenario; ``source`` is as for `remoras run`."""

    source: str
    settings: tuple[tuple[str, Any], ...]
    scenario: Scenario
    unforeseen: str = ""


@dataclass(frozen=True)
class Study:
    """Study with every configuration resolved; ``metrics`` can be compared, ``own_metrics`` are the users' ones."""

    text: str
    file: StudyFile
    configurations: tuple[Configuration, ...]
    metrics: Mapping[str, Metric]
    own_metrics: tuple[str, ...] = ()

    @property
    def design(self) -> Design:
        """Table ``[study]``."""
        return self.file.study

    @property
    def maximum(self) -> int:
        """Most repeats of a configuration."""
        return self.file.stopping.maximum if self.file.stopping else self.design.repeats

    @property
    def n_runs(self) -> int:
        """Number of runs; with a stopping rule the maximum."""
        return len(self.configurations) * self.maximum


def example_study() -> str:
    """Return a commented study file to start from."""
    return (resources.files("missions") / "mapping" / "example-study.toml.txt").read_text(encoding="utf-8")


def study_explanations() -> dict[str, tuple[str, str]]:
    """Return (type and range, meaning) of every key of a study."""
    return explanations_of(StudyFile)


def load_study(name_or_path: str, strategies: Sequence[str] = ()) -> Study:
    """Read a study and resolve all of its configurations.

    ``name_or_path`` is a shipped study, see ``shipped_studies``, or a TOML file. ``strategies`` are added: shipped
    names, ``package.module:object`` or ``file.py:object``. Raises ConfigurationError with all malformed values; else
    all faults between tables; else all faults of configurations. Raises PluginError for an unavailable strategy.
    """
    return study_of(Document.read(name_or_path, shipped_studies(), STUDY), strategies)


def study_of(document: Document, strategies: Sequence[str] = ()) -> Study:
    """Resolve the study of a document; see ``load_study``."""
    folder = Path(document.path).parent
    file = document.values(StudyFile, with_files_found(document.raw, folder))
    file = _with_strategies(file, strategies, folder)
    between = list(faults_between(file))
    file, own, no_metrics = _with_own_metrics(file, folder)
    if faults := [*between, *no_metrics]:
        raise document.error(faults)
    configurations, bases, faults = _resolved(file, folder, own)
    metrics, of_metrics = _metrics(bases)
    if metrics:
        unknown = (name for name in file.study.metrics or () if name not in metrics)
        if found := {name: reference for name in unknown if (reference := installed("metric", name)) != name}:
            design = {**document.raw[STUDY], "metrics": [found.get(n, n) for n in document.raw[STUDY]["metrics"]]}
            return study_of(replace(document, raw={**document.raw, STUDY: design}), strategies)
        of_metrics += _metric_faults(file, metrics)
    if faults or of_metrics:
        raise document.error([*faults, *of_metrics])
    text = "".join(f"# --strategy {name}\n" for name in strategies) + document.text
    named = {metric.name: None for part in configurations for metric in own_metrics(part.scenario).values()}
    return Study(text, file, tuple(configurations), metrics, tuple(named))


def _with_strategies(file: StudyFile, added: Sequence[str], folder: Path) -> StudyFile:
    if not added:
        return file
    listed: Iterable[str] = file.study.strategies or ()
    if file.study.strategies is None:
        sources = (_source(name, folder, shipped()) for name in file.study.scenario)
        listed = dict.fromkeys(load(source).strategy.name for source in sources if source is not None)
    return _designed(file, strategies=(*listed, *(name for name in entrants(added) if name not in listed)))


def _designed(file: StudyFile, **changes: Any) -> StudyFile:
    return file.model_copy(update={"study": file.study.model_copy(update=changes)})


def _with_own_metrics(file: StudyFile, folder: Path) -> tuple[StudyFile, tuple[str, ...], list[ConfigurationFault]]:
    names: list[str] = []
    own: dict[str, None] = {}
    faults: list[ConfigurationFault] = []
    for metric in file.study.metrics or ():
        if not is_named(metric):
            names.append(metric)
            continue
        try:
            reference = importable(metric, folder)
            names.append(metric_named(reference).name)
        except PluginError as error:
            faults.append(ConfigurationFault(KEY_OF_METRICS, shown(metric), str(error)))
        else:
            own[reference] = None
    if not own:
        return file, (), faults
    return _designed(file, metrics=tuple(names)), tuple(own), faults


def _resolved(
    file: StudyFile, folder: Path, own: Sequence[str]
) -> tuple[list[Configuration], dict[str, Scenario], list[ConfigurationFault]]:
    bases: dict[str, Scenario] = {}
    resolved_by_text: dict[str, Configuration] = {}
    faults: dict[tuple[str, str], ConfigurationFault] = {}
    known = shipped()
    for name in file.study.scenario:
        source = _source(name, folder, known)
        if source is None:
            fault = ConfigurationFault("study.scenario", f'"{name}"', file_or_name(name, known))
            faults.setdefault((fault.key, fault.allowed), fault)
            continue
        document = Document.read(source, known, SCENARIO)
        base = scenario_from(document)  # raises its faults
        bases.setdefault(source, _naming(base, own))
        has_faults = bool(getattr(base, FAULT, ()))
        for settings, case in combinations(file):
            lacking = [] if has_faults else list(faults_of_no_fault(settings, source))
            for fault in lacking:
                faults.setdefault((fault.key, fault.allowed), fault)
            if lacking:
                continue
            try:
                configuration = _configuration(source, document, settings, case, own)
            except ConfigurationError as error:
                for fault in _in_study(error.faults, settings):
                    faults.setdefault((fault.key, fault.allowed), fault)
            else:
                # Combinations that resolve to one scenario, such as a setting equal to the default, run once.
                first = resolved_by_text.setdefault(configuration.scenario.model_dump_json(), configuration)
                if case != first.unforeseen:
                    allowed = f'{source} runs alike with it and with "{first.unforeseen}"; leave one of the two out'
                    faults.setdefault((case, ""), ConfigurationFault(f"unforeseen.{case}.name", f'"{case}"', allowed))
    resolved = list(resolved_by_text.values())
    # Reversed, so that the first configuration of a source remains.
    bases |= {configured.source: configured.scenario for configured in reversed(resolved)}
    return resolved, bases, list(faults.values())


def _source(name: str, folder: Path, known: Mapping[str, Path]) -> str | None:
    nearby = folder / name
    if name in known:
        return name
    if is_file(nearby):
        return str(nearby.resolve())
    return name if is_file(Path(name)) else None


def _configuration(source: str, document: Document, settings: Settings, case: str, own: Sequence[str]) -> Configuration:
    last = {setting.key: setting for setting in settings}
    if (channel := last.get("channel.name")) is not None:
        last = {key: setting for key, setting in last.items() if not is_left_aside(key, channel.value)}
    overrides = [(setting.place, f"{setting.key}={toml_value(setting.value)}") for setting in last.values()]
    pairs = tuple((setting.key, setting.value) for setting in last.values())
    return Configuration(source, pairs, _naming(scenario_from(document, overrides), own), case)


def _naming(scenario: Scenario, own: Sequence[str]) -> Scenario:
    if not own:
        return scenario
    metrics = tuple(dict.fromkeys((*scenario.scenario.metrics, *own)))
    return scenario.model_copy(update={"scenario": scenario.scenario.model_copy(update={"metrics": metrics})})


def _in_study(faults: Iterable[ConfigurationFault], settings: Settings) -> Iterator[ConfigurationFault]:
    # Longest first, since one place may be the beginning of another.
    places = sorted({setting.place for setting in settings}, key=len, reverse=True)
    for fault in faults:
        place = next((place for place in places if f"{fault.key} ".startswith(f"{place} ")), None)
        inside = fault.key.partition(f" ({FAULT}.")[2].removesuffix(")")  # an entry of the list and its key
        key = f"{place}.{inside}" if place and inside and place.endswith(f".{FAULT}") else place
        yield replace(fault, key=key or fault.key, line=None)


def _metrics(scenarios: Mapping[str, Scenario]) -> tuple[dict[str, Metric], list[ConfigurationFault]]:
    metrics: dict[str, Metric] = {}
    faults = []
    for scenario in scenarios.values():
        try:
            known = metrics_of(scenario)
        except ConfigurationError as error:
            if any(fault.key != METRICS for fault in error.faults):
                raise  # of the mission itself
            faults += [replace(fault, key=KEY_OF_METRICS) for fault in error.faults]
            continue
        for name, metric in known.items():
            other = metrics.setdefault(name, metric)
            if (other.unit, other.better) != (metric.unit, metric.better):
                allowed = f"the missions of these scenarios differ in what {name} means; study them apart"
                faults.append(ConfigurationFault("study.scenario", "", allowed))
    return metrics, faults


def _metric_faults(file: StudyFile, metrics: Mapping[str, Metric]) -> list[ConfigurationFault]:
    named = [(KEY_OF_METRICS, name) for name in file.study.metrics or ()]
    named += [("stopping.metric", file.stopping.metric)] if file.stopping else []
    return [
        ConfigurationFault(key, f'"{name}"', f"allowed: {', '.join(metrics)}{suggestion(name, metrics)}")
        for key, name in named
        if name not in metrics
    ]
