"""Study: what a sweep varies, frozen, read from a TOML file and checked whole.

The design is scenarios x vehicles x strategies x policies x channels x points. A point sets keys of the scenario,
named as ``--set`` names them; points come from a full grid, a list or a Latin hypercube. Every configuration of the
design is resolved when the study is loaded, so that a study that starts can also finish: all faults are reported at
once.
"""

from __future__ import annotations

import itertools
import json
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from importlib import resources
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError, field_validator

from missions.errors import ConfigurationError, ConfigurationFault
from missions.scenario import Scenario, explanations_of, load, shipped
from missions.tables import Name, Table

METRICS = (
    "mission_time_s", "completed", "coverage_fraction", "mapping_time_s", "duplicate_fraction",
    "least_mapped_fraction", "distance_m",
    "energy_j", "modem_energy_j", "n_packets", "n_bytes", "delivery_ratio", "mean_latency_s", "p95_latency_s",
    "consistency_time_s", "consistent_fraction", "false_beliefs",
)  # fmt: skip
"""Fields of a summary that can be compared."""

Settings = tuple[tuple[str, Any], ...]
"""Keys of a scenario and their values."""


class Design(Table):
    """The table ``[study]``."""

    name: Name = Field(description="name of the study; used in progress and reports")
    scenario: tuple[str, ...] = Field(min_length=1, description="scenario, or list of scenarios: names or files")
    strategies: tuple[str, ...] | None = Field(None, min_length=1, description="strategies; the scenario's if absent")
    policies: tuple[str, ...] | None = Field(None, min_length=1, description="policies; the scenario's if absent")
    vehicles: tuple[int, ...] | None = Field(
        None, min_length=1, description="sizes of the fleet (fleet.size); the scenario's if absent"
    )
    repeats: int = Field(ge=1, le=1_000_000, description="runs of each configuration")
    seed: int = Field(1, ge=0, le=2**53, description="master seed")
    metrics: tuple[str, ...] = Field(
        ("mission_time_s", "completed", "coverage_fraction", "duplicate_fraction", "energy_j", "n_bytes"),
        min_length=1,
        description="fields of the summary that are compared",
    )
    baseline: str | None = Field(None, description="strategy or policy the others are compared with; else the first")
    sampling: Literal["grid", "list", "latin"] = Field("grid", description="where the points come from")
    samples: int = Field(10, ge=2, le=100_000, description="points of a Latin hypercube")
    keep_tables: int = Field(1, ge=0, description="repeats of each configuration whose tables are kept")

    @field_validator("scenario", mode="before")
    @classmethod
    def _one_or_more(cls, given: Any) -> Any:
        return (given,) if isinstance(given, str) else given


class StoppingRule(Table):
    """The table ``[stopping]``: repeat a configuration until its mean is known well enough."""

    metric: str = Field(description="metric whose mean has to be known")
    half_width: float = Field(gt=0.0, description="half-width of its 95 % interval at which a configuration is done")
    minimum: int = Field(10, ge=2, description="fewest repeats")
    maximum: int = Field(ge=2, description="most repeats; replaces study.repeats")


class StudyFile(Table):
    """A study as its file has it."""

    study: Design
    channel: tuple[dict[str, Any], ...] = Field(
        (), description="in a study: a table for each channel, in which a list of values is a grid"
    )
    set: dict[str, Any] = Field({}, description="keys of the scenario that are the same in all runs")
    grid: dict[str, Any] = Field({}, description="keys of the scenario with lists of values; all combinations are run")
    point: tuple[dict[str, Any], ...] = Field(
        (), description='keys of the scenario, a table for each point; for sampling = "list"'
    )
    latin: dict[str, Any] = Field(
        {}, description='keys of the scenario with their [lowest, highest]; for sampling = "latin"'
    )
    stopping: StoppingRule | None = None


@dataclass(frozen=True)
class Configuration:
    """One cell of the design: the scenario resolved, and how to get it.

    Args:
        source: scenario as `remoras run` takes it.
        settings: every key that the study sets.
    """

    source: str
    settings: Settings
    scenario: Scenario


@dataclass(frozen=True)
class Study:
    """A study whose every configuration has been resolved."""

    text: str
    file: StudyFile
    configurations: tuple[Configuration, ...]

    @property
    def design(self) -> Design:
        return self.file.study

    @property
    def maximum(self) -> int:
        """Most repeats of a configuration."""
        return self.file.stopping.maximum if self.file.stopping else self.design.repeats

    @property
    def n_runs(self) -> int:
        """Runs of the whole study; with a stopping rule the most that there can be."""
        return len(self.configurations) * self.maximum


def shipped_studies() -> dict[str, Path]:
    """Study files that come with the package, by name."""
    folder = Path(str(resources.files("missions"))) / "studies"
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def is_study(name_or_path: str) -> bool:
    """Is this the name of a shipped study, or a TOML file with a table ``[study]``?"""
    if name_or_path in shipped_studies():
        return True
    try:
        return "study" in tomllib.loads(Path(name_or_path).read_text(encoding="utf-8"))
    except (OSError, ValueError):  # no such file, not text, not TOML
        return False


def example_study() -> str:
    """A commented study file to start from."""
    return (resources.files("missions") / "examples" / "study.toml").read_text(encoding="utf-8")


def study_explanations() -> dict[str, tuple[str, str]]:
    """(type and range, meaning) of every key of a study."""
    return explanations_of(StudyFile)


def load_study(name_or_path: str) -> Study:
    """The study of a shipped name or a TOML file.

    Raises:
        ConfigurationError: with every fault of the file, or of the scenario that it names.
    """
    known = shipped_studies()
    path = known.get(name_or_path, Path(name_or_path))
    if not path.is_file():
        hint = f"a TOML file{_or_one_of(name_or_path, list(known))}"
        raise ConfigurationError(name_or_path, [ConfigurationFault("study", name_or_path, hint)])
    try:
        text = path.read_text(encoding="utf-8")
        raw = tomllib.loads(text)
        if isinstance(raw.get("channel"), dict):
            raw["channel"] = [raw["channel"]]
        file = StudyFile.model_validate(raw)
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ConfigurationError(str(path), [ConfigurationFault("TOML", "", str(error))]) from None
    except ValidationError as error:
        raise ConfigurationError(str(path), _located(text, map(_fault_of, error.errors()))) from None
    if faults := [*_own_faults(file)]:
        raise ConfigurationError(str(path), _located(text, faults))
    configurations, found = _resolved(file, path.parent)
    if found:
        raise ConfigurationError(str(path), _located(text, found))
    return Study(text, file, configurations)


def toml_value(value: Any) -> str:
    """A value on one line of TOML.

    >>> toml_value([0.5, True, {"name": "a b"}])
    '[0.5, true, {"name" = "a b"}]'
    """
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(key)} = {toml_value(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


# The design ---------------------------------------------------------------------------------------


def flattened(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys of nested tables; a key that is written with dots in quotes is taken as it is.

    >>> dict(flattened({"channel": {"per": [0.1]}, "mission.patience_s": [5]}))
    {'channel.per': [0.1], 'mission.patience_s': [5]}
    """
    for key, value in table.items():
        path = key if not above else f'{above}."{key}"' if "." in key else f"{above}.{key}"
        if isinstance(value, Mapping):
            yield from flattened(value, path)
        else:
            yield path, value


def points(file: StudyFile) -> list[Settings]:
    """Settings of every point, in the order of the file; the last key of a grid varies fastest.

    A Latin hypercube (McKay, Beckman, Conover 1979) is scaled to the bounds; its values have six digits.
    """
    if file.study.sampling == "list":
        return [tuple(flattened(point)) for point in file.point]
    if file.study.sampling == "latin":
        from scipy.stats import qmc

        keys, bounds = zip(*flattened(file.latin), strict=True)
        unit = qmc.LatinHypercube(len(keys), seed=file.study.seed).random(file.study.samples)
        scaled = qmc.scale(unit, [low for low, _ in bounds], [high for _, high in bounds])
        return [tuple(zip(keys, (float(f"{value:.6g}") for value in row), strict=True)) for row in scaled.tolist()]
    return _product(dict(flattened(file.grid)))


def _product(grid: Mapping[str, Any]) -> list[Settings]:
    """Settings of a full grid; a value that is no list, or a list of tables, stays the same everywhere."""
    choices = [[(key, value) for value in (values if _is_axis(values) else [values])] for key, values in grid.items()]
    return [tuple(chosen) for chosen in itertools.product(*choices)]


def _is_axis(values: Any) -> bool:
    """Whether a grid runs over the values: a list of tables, such as ``[[channel.link]]``, is one value."""
    return isinstance(values, list) and not any(isinstance(value, Mapping) for value in values)


def _channels(file: StudyFile) -> list[Settings]:
    channels = [{f"channel.{key}": value for key, value in table.items()} for table in file.channel]
    return [settings for channel in channels for settings in _product(channel)] or [()]


def _resolved(file: StudyFile, folder: Path) -> tuple[tuple[Configuration, ...], list[ConfigurationFault]]:
    """Every configuration once, and the faults of those that the scenario does not allow."""
    design = file.study
    found: dict[str, Configuration] = {}
    faults: dict[tuple[str, str], ConfigurationFault] = {}
    table = {"grid": "grid", "list": "point", "latin": "latin"}[design.sampling]
    choices: list[list[tuple[str, Settings]]] = [
        [("set", tuple(flattened(file.set)))],
        [("study:strategies", (("strategy.name", name),)) for name in design.strategies or ()] or [("", ())],
        [("study:policies", (("communication.policy", name),)) for name in design.policies or ()] or [("", ())],
        [("study:vehicles", (("fleet.size", size),)) for size in design.vehicles or ()] or [("", ())],
        [("channel", settings) for settings in _channels(file)],
        [(table, point) for point in points(file)],
    ]
    for name in design.scenario:
        nearby = folder / name
        source = name if name in shipped() or not nearby.is_file() else str(nearby.resolve())
        load(source)
        for chosen in itertools.product(*choices):
            settings = {key: value for _, pairs in chosen for key, value in pairs}
            written = {key: _written(where, key) for where, pairs in chosen for key, _ in pairs}
            overrides = [(written[key], f"{key}={toml_value(value)}") for key, value in settings.items()]
            try:
                scenario = load(source, overrides)
            except ConfigurationError as error:
                for fault in error.faults:
                    own = [place for key, place in written.items() if key.startswith(f"{fault.key}.")]
                    place = own[0] if own else fault.key
                    given = "" if own else fault.given
                    faults.setdefault((place, fault.allowed), replace(fault, key=place, given=given))
                continue
            found.setdefault(scenario.model_dump_json(), Configuration(source, tuple(settings.items()), scenario))
    return tuple(found.values()), list(faults.values())


def _written(where: str, key: str) -> str:
    """Table and key of the study file that set a key of the scenario, as ``table:key``."""
    return where if ":" in where else f"{where}:{key.removeprefix('channel.') if where == 'channel' else key}"


# Faults -------------------------------------------------------------------------------------------


def _or_one_of(given: str, known: Sequence[str]) -> str:
    nearest = get_close_matches(given, known, n=1)
    return (f" or one of {', '.join(known)}" if known else "") + (f"; did you mean {nearest[0]!r}?" if nearest else "")


def _fault_of(detail: Any) -> ConfigurationFault:
    """A fault of pydantic, with the keys that are allowed where the key is unknown."""
    parts = [str(part) for part in detail["loc"] if not isinstance(part, int)]
    key = f"{parts[0]}:{parts[-1]}" if len(parts) > 1 else parts[0]
    if detail["type"] == "missing":
        return ConfigurationFault(key, "", "missing")
    if detail["type"] == "extra_forbidden":
        table: Any = StudyFile if len(parts) == 1 else {"study": Design, "stopping": StoppingRule}[parts[0]]
        nearest = get_close_matches(parts[-1], table.model_fields, n=1)
        hint = f"; did you mean {nearest[0]!r}?" if nearest else ""
        return ConfigurationFault(key, "", f"unknown key, allowed here: {', '.join(table.model_fields)}{hint}")
    message = str(detail["msg"])
    return ConfigurationFault(key, toml_value(detail["input"])[:60], message[0].lower() + message[1:])


def _own_faults(file: StudyFile) -> Iterator[ConfigurationFault]:
    """What has to be true between the tables of a study."""
    design, stopping = file.study, file.stopping
    named = [("study:metrics", metric) for metric in design.metrics]
    named += [("stopping:metric", stopping.metric)] if stopping else []
    for key, metric in named:
        if metric not in METRICS:
            nearest = get_close_matches(metric, METRICS, n=1)
            hint = f"; did you mean {nearest[0]!r}?" if nearest else ""
            yield ConfigurationFault(key, f'"{metric}"', f"allowed: {', '.join(METRICS)}{hint}")
    compared = (*(design.strategies or ()), *(design.policies or ()))
    if design.baseline is not None and design.baseline not in compared:
        yield ConfigurationFault("study:baseline", f'"{design.baseline}"', f"allowed: {', '.join(compared) or 'none'}")
    lists = {"strategies": design.strategies, "policies": design.policies, "scenario": design.scenario,
             "vehicles": design.vehicles}  # fmt: skip
    for name, values in lists.items():
        if values and len(set(values)) < len(values):
            yield ConfigurationFault(f"study:{name}", toml_value(values), "a value is listed twice")
    if stopping and stopping.minimum > stopping.maximum:
        yield ConfigurationFault("stopping:minimum", str(stopping.minimum), f"allowed: 2 to {stopping.maximum}")
    yield from _point_faults(file)


def _point_faults(file: StudyFile) -> Iterator[ConfigurationFault]:
    used = {"grid": "grid", "list": "point", "latin": "latin"}[file.study.sampling]
    for table in ("grid", "point", "latin"):
        given = getattr(file, table)
        if given and table != used:
            allowed = f'not used: study.sampling is "{file.study.sampling}", which reads [{used}]'
            yield ConfigurationFault(table, "", allowed)
        elif not given and table == used and used != "grid":
            yield ConfigurationFault("study:sampling", f'"{file.study.sampling}"', f"needs [{used}], which is missing")
    tables = [("grid", dict(flattened(file.grid)))] + [("channel", channel) for channel in file.channel]
    for table, values in tables:
        for key, value in values.items():
            if value == []:
                yield ConfigurationFault(f"{table}:{key}", "[]", "no values: list at least one")
    for channel in file.channel:
        if "name" not in channel:
            yield ConfigurationFault("channel:name", "", "missing; see `remoras list channels`")
    for key, bounds in flattened(file.latin):
        numbers = isinstance(bounds, list) and len(bounds) == 2 and all(isinstance(b, int | float) for b in bounds)
        if not numbers or not bounds[0] < bounds[1]:
            yield ConfigurationFault(f"latin:{key}", toml_value(bounds), "allowed: [lowest, highest]")


def _located(text: str, faults: Iterable[ConfigurationFault]) -> list[ConfigurationFault]:
    """Faults with their line; a key ``table:key`` is looked for below the header of its table."""
    lines = [line.strip() for line in text.splitlines()]
    found = []
    for fault in faults:
        place = fault.key.partition(" ")[0]
        table, _, key = place.partition(":")
        headers = [number for number, line in enumerate(lines, 1) if line[:1] == "[" and line.strip("[] ") == table]
        written = [
            number
            for number, line in enumerate(lines, 1)
            if headers and number > headers[0] and line.partition("=")[0].strip().strip('"') == key
        ]
        line = next(iter([*written, *headers]), None)
        found.append(ConfigurationFault(place.replace(":", "."), fault.given, fault.allowed, line))
    return sorted(found, key=lambda fault: (fault.line or 0, fault.key))
