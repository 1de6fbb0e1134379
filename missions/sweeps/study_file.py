"""A study as its file has it: the tables, and all that can be wrong with them before a scenario is looked at."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import Any, Literal

from pydantic import Field, field_validator

from missions.errors import ConfigurationFault
from missions.scenarios.tables import Name, Table

METRICS = (
    "mission_time_s", "completed", "coverage_fraction", "mapping_time_s", "duplicate_fraction",
    "least_mapped_fraction", "distance_m",
    "energy_j", "modem_energy_j", "n_packets", "n_bytes", "delivery_ratio", "mean_latency_s", "p95_latency_s",
    "consistency_time_s", "consistent_fraction", "false_beliefs",
)  # fmt: skip
"""Fields of a summary that can be compared."""


class Design(Table):
    """The table ``[study]``."""

    name: Name = Field(description="name of the study; used in progress and reports")
    scenario: tuple[str, ...] = Field(min_length=1, description="scenario, or list of scenarios: names or files")
    strategies: tuple[str, ...] | None = Field(None, min_length=1, description="strategies; the scenario's if absent")
    policies: tuple[str, ...] | None = Field(None, min_length=1, description="policies; the scenario's if absent")
    vehicles: tuple[int, ...] | None = Field(
        None, min_length=1, description="sizes of the fleet (fleet.size); the scenario's if absent"
    )
    repeats: int = Field(ge=1, le=1_000_000, strict=True, description="runs of each configuration")
    seed: int = Field(1, ge=0, le=2**53, strict=True, description="master seed")
    metrics: tuple[str, ...] = Field(
        ("mission_time_s", "completed", "coverage_fraction", "duplicate_fraction", "energy_j", "n_bytes"),
        min_length=1,
        description="fields of the summary that are compared",
    )
    baseline: str | None = Field(None, description="strategy or policy the others are compared with; else the first")
    sampling: Literal["grid", "list", "latin"] = Field("grid", description="where the points come from")
    samples: int = Field(10, ge=2, le=100_000, strict=True, description="points of a Latin hypercube")
    keep_tables: int = Field(1, ge=0, description="repeats of each configuration whose tables are kept")

    @field_validator("scenario", mode="before")
    @classmethod
    def _one_or_more(cls, given: Any) -> Any:
        return (given,) if isinstance(given, str) else given


class StoppingRule(Table):
    """The table ``[stopping]``: repeat a configuration until its mean is known well enough."""

    metric: str = Field(description="metric whose mean has to be known")
    half_width: float = Field(gt=0.0, description="half-width of its 95 % interval at which a configuration is done")
    minimum: int = Field(10, ge=2, strict=True, description="fewest repeats")
    maximum: int = Field(ge=2, le=1_000_000, strict=True, description="most repeats; replaces study.repeats")


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

    @property
    def sampled_keys(self) -> tuple[str, ...]:
        """Keys of the scenario that a Latin hypercube varies; empty for other designs."""
        return tuple(key for key, _ in flattened(self.latin))


# Values ------------------------------------------------------------------------------------------


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


def is_axis(values: Any) -> bool:
    """Whether a grid runs over the values: a list of tables, such as ``[[channel.link]]``, is one value."""
    return isinstance(values, list) and not any(isinstance(value, Mapping) for value in values)


# Faults -------------------------------------------------------------------------------------------


def or_one_of(given: str, known: Sequence[str]) -> str:
    nearest = get_close_matches(given, known, n=1)
    return (f" or one of {', '.join(known)}" if known else "") + (f"; did you mean {nearest[0]!r}?" if nearest else "")


def fault_of(detail: Any) -> ConfigurationFault:
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
    message = str(detail["msg"]).replace("tuple", "list")
    return ConfigurationFault(key, toml_value(detail["input"])[:60], message[0].lower() + message[1:])


def own_faults(file: StudyFile) -> Iterator[ConfigurationFault]:
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
             "vehicles": design.vehicles, "metrics": design.metrics}  # fmt: skip
    for name, values in lists.items():
        if values and len(set(values)) < len(values):
            yield ConfigurationFault(f"study:{name}", toml_value(values), "a value is listed twice")
    if "samples" in design.model_fields_set and design.sampling != "latin":
        yield ConfigurationFault("study:samples", str(design.samples), 'not used: study.sampling is not "latin"')
    if stopping and stopping.minimum > stopping.maximum:
        yield ConfigurationFault("stopping:minimum", str(stopping.minimum), f"allowed: 2 to {stopping.maximum}")
    yield from _point_faults(file)
    yield from _conflicts(file)


def _conflicts(file: StudyFile) -> Iterator[ConfigurationFault]:
    """Keys of the scenario that two tables of the study set."""
    design = file.study
    places: dict[str, str] = {}
    lists = {"strategies": "strategy.name", "policies": "communication.policy", "vehicles": "fleet.size"}
    own = [(f"study:{name}", key) for name, key in lists.items() if getattr(design, name) is not None]
    own += [(f"channel:{key}", f"channel.{key}") for table in file.channel for key in table]
    for table, given in (("set", [file.set]), ("grid", [file.grid]), ("point", file.point), ("latin", [file.latin])):
        own += dict.fromkeys((f"{table}:{key}", key) for one in given for key, _ in flattened(one))
    for place, key in dict.fromkeys(own):
        if key in places:
            yield ConfigurationFault(place, "", f"is set by {places[key].replace(':', '.')} too; set it in one place")
        places[key] = place


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
        numbers = isinstance(bounds, list) and [type(b) in (int, float) for b in bounds] == [True, True]
        if not numbers or not bounds[0] < bounds[1] or not math.isfinite(bounds[1] - bounds[0]):
            yield ConfigurationFault(f"latin:{key}", toml_value(bounds), "allowed: [lowest, highest], two numbers")


def located(text: str, faults: Iterable[ConfigurationFault]) -> list[ConfigurationFault]:
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
