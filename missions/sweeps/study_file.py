"""Study files: keys and checks."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple

from pydantic import Field

from missions.errors import ConfigurationFault
from missions.files import dotted, shown, toml_value
from missions.sweeps.factorial import MOST_FACTORS, FactorialDesign, designed, most_halvings
from remoras.table import Name, OneOrMore, Section

TABLE_OF = {"grid": "grid", "list": "point", "latin": "latin", "factorial": "factorial"}
"""Table read by each kind of sampling."""
LISTS = {"strategies": "strategy.name", "policies": "communication.policy", "vehicles": "fleet.size"}
"""Lists of ``[study]`` and the scenario key that each sets."""

KEY_OF_PER = "channel.per"
CONDITIONS = ("channel.name", KEY_OF_PER)  # keys that name the conditions of a comparison
OWN_COLUMNS = ("strategy.name", "communication.policy", *CONDITIONS)  # keys with a column of their own in comparisons
PER = "per"
FAULT = "fault"  # scenario key of the faults of a run


def level_name(text: str) -> str:
    """Return a level ``KEY=VALUE`` as comparisons name it: each loss rate in one form.

    >>> level_name("channel.per=0.0"), level_name("per=.50"), level_name("fleet.size=3")
    ('per=0', 'per=0.5', 'fleet.size=3')
    """
    key, _, value = text.partition("=")
    if key not in (PER, KEY_OF_PER):
        return text
    try:
        return f"{PER}={float(value)!r}".removesuffix(".0")
    except ValueError:
        return text


def _levels(file: StudyFile) -> Iterator[str]:
    """Yield the levels ``KEY=VALUE`` of the keys that vary."""
    settings = [*dotted(file.grid), *dotted(file.factorial), *(pair for point in file.point for pair in dotted(point))]
    settings += [(f"channel.{key}", value) for channel in file.channel for key, value in dotted(channel)]
    settings += [(LISTS["vehicles"], file.study.vehicles or [])]
    levels: dict[str, dict[str, None]] = {}
    for key, value in settings:
        named = (level_name(f"{key}={level}") for level in (value if isinstance(value, list) else [value]))
        if key not in OWN_COLUMNS or key in CONDITIONS[1:]:
            levels.setdefault(key, {}).update(dict.fromkeys(named))
    return itertools.chain(*(own for key, own in levels.items() if len(own) > 1))


def faults_between(file: StudyFile) -> Iterator[ConfigurationFault]:
    """Yield every fault between the tables of a study."""
    design, stopping = file.study, file.stopping
    compared = (*(design.strategies or ()), *(design.policies or ()), *_levels(file))
    if design.baseline is not None and level_name(design.baseline) not in compared:
        yield ConfigurationFault("study.baseline", f'"{design.baseline}"', f"allowed: {', '.join(compared) or 'none'}")
    for name in (*LISTS, "scenario", "metrics"):
        values = getattr(design, name)
        if values and len(set(values)) < len(values):
            yield ConfigurationFault(f"study.{name}", toml_value(values), "a value is listed twice")
    if "samples" in design.model_fields_set and design.sampling != "latin":
        yield ConfigurationFault("study.samples", str(design.samples), 'not used: study.sampling is not "latin"')
    if "halvings" in design.model_fields_set and design.sampling != "factorial":
        yield ConfigurationFault("study.halvings", str(design.halvings), 'not used: study.sampling is not "factorial"')
    if stopping and stopping.minimum > stopping.maximum:
        yield ConfigurationFault("stopping.minimum", str(stopping.minimum), f"allowed: 2 to {stopping.maximum}")
    if stopping and stopping.half_width is None and stopping.half_width_share is None:
        yield ConfigurationFault("stopping.half_width", "", "missing; give it, or half_width_share, or both")
    yield from _unforeseen_faults(file)
    yield from _sampling_faults(file)
    yield from _axis_faults(file)
    yield from _bounds_faults(file)
    yield from _factorial_faults(file)
    yield from _conflicts(file)


def _sampling_faults(file: StudyFile) -> Iterator[ConfigurationFault]:
    sampling = file.study.sampling
    used = TABLE_OF[sampling]
    for table in TABLE_OF.values():
        values = getattr(file, table)
        if values and table != used:
            yield ConfigurationFault(table, "", f'not used: study.sampling is "{sampling}", which reads [{used}]')
        elif not values and table == used and used != "grid":
            yield ConfigurationFault("study.sampling", f'"{sampling}"', f"needs [{used}], which is missing")


def _unforeseen_faults(file: StudyFile) -> Iterator[ConfigurationFault]:
    yield from repeated_names("unforeseen", file.unforeseen)
    empty = [(number, case.name) for number, case in enumerate(file.unforeseen, 1) if not case.set and not case.fault]
    for number, name in empty[1:]:
        allowed = f'sets nothing, and neither does "{empty[0][1]}"; give it [unforeseen.set] or a fault'
        yield ConfigurationFault(f"unforeseen.{number}.name", f'"{name}"', allowed)


def repeated_names(table: str, cases: Sequence[Any]) -> Iterator[ConfigurationFault]:
    """Yield faults: entries of a list of tables with the name of an earlier one."""
    names = [case.name for case in cases]
    for number, name in enumerate(names, 1):
        if name in names[: number - 1]:
            allowed = "a second entry of this name; give each its own"
            yield ConfigurationFault(f"{table}.{number}.name", shown(name), allowed)


def _axis_faults(file: StudyFile) -> Iterator[ConfigurationFault]:
    tables = [("grid", dict(dotted(file.grid)))]
    tables += [(channel_place(file, number), channel) for number, channel in enumerate(file.channel)]
    for table, values in tables:
        for key, value in values.items():
            if value == []:
                yield ConfigurationFault(f"{table}.{key}", "[]", "no values: list at least one")
            elif isinstance(value, list) and len({toml_value(level) for level in value}) < len(value):
                yield ConfigurationFault(f"{table}.{key}", toml_value(value), "a value is listed twice")
    for number, channel in enumerate(file.channel):
        if "name" not in channel:
            place = f"{channel_place(file, number)}.name"
            yield ConfigurationFault(place, "", "missing; see `remoras list channels`")


def _bounds_faults(file: StudyFile) -> Iterator[ConfigurationFault]:
    for key, bounds in dotted(file.latin):
        numbers = isinstance(bounds, list) and [type(bound) in (int, float) for bound in bounds] == [True, True]
        if not numbers or not bounds[0] < bounds[1] or not math.isfinite(bounds[1] - bounds[0]):
            yield ConfigurationFault(f"latin.{key}", toml_value(bounds), "allowed: [lowest, highest], two numbers")


def _factorial_faults(file: StudyFile) -> Iterator[ConfigurationFault]:
    factors, halvings = file.factors, file.study.halvings
    for key, levels in factors.items():
        if not isinstance(levels, list) or len(levels) != 2 or levels[0] == levels[1]:
            yield ConfigurationFault(f"factorial.{key}", shown(levels), "allowed: [low, high], two levels that differ")
        if key in CONDITIONS:
            allowed = "a condition, not a factor of this design; give it as [[channel]]"
            yield ConfigurationFault(f"factorial.{key}", "", allowed)
    if not factors:
        return
    if not 2 <= len(factors) <= MOST_FACTORS:
        yield ConfigurationFault("factorial", f"{len(factors)} factors", f"allowed: 2 to {MOST_FACTORS}")
    elif halvings > (most := most_halvings(len(factors))):
        allowed = f"allowed for {len(factors)} factors: 0 to {most}; with more, main effects are mixed with each other"
        yield ConfigurationFault("study.halvings", str(halvings), allowed)


def _conflicts(file: StudyFile) -> Iterator[ConfigurationFault]:
    """Yield faults: scenario keys set by two tables of the study."""
    places: dict[str, str] = {}
    own_faults = any(unforeseen.fault for unforeseen in file.unforeseen)
    set_by = [(f"study.{name}", key) for name, key in LISTS.items() if getattr(file.study, name) is not None]
    set_by += [(f"channel.{key}", f"channel.{key}") for table in file.channel for key in table]
    for table, settings in (
        ("set", [file.set]),
        ("grid", [file.grid]),
        ("point", file.point),
        ("latin", [file.latin]),
        ("factorial", [file.factorial]),
    ):
        set_by += [(f"{table}.{key}", key) for setting in settings for key, _ in dotted(setting)]
    for place, key in set_by:
        if own_faults and key.partition(".")[0] == FAULT:
            yield ConfigurationFault(place, "", "[[unforeseen.fault]] sets all faults of its runs; set them there")
    set_by += [
        ("unforeseen.set", key) for key in {key for unforeseen in file.unforeseen for key, _ in dotted(unforeseen.set)}
    ]
    for place, key in dict.fromkeys(set_by):
        if key in places:
            yield ConfigurationFault(place, "", f"is set by {places[key]} too; set it in one place")
        places[key] = place


def faults_of_no_fault(settings: Iterable[StudySetting], source: str) -> Iterator[ConfigurationFault]:
    """Yield faults: keys below ``fault`` set for a scenario (``source``) that has no fault."""
    for key, value, place in settings:
        if key.startswith("fault."):
            allowed = f"{source} has no [[fault]]; allowed: one in the scenario, or [[unforeseen.fault]] in the study"
            yield ConfigurationFault(place, shown(value), allowed)


def channel_place(file: StudyFile, number: int) -> str:
    """Return the name of a channel in messages; ``number`` counts from 0."""
    return f"channel.{number + 1}" if len(file.channel) > 1 else "channel"


class Design(Section):
    """The table ``[study]``."""

    name: Name = Field(description="name of the study; used in progress and reports")
    scenario: OneOrMore[str] = Field(min_length=1, description="scenario, or list of scenarios: names or files")
    strategies: tuple[str, ...] | None = Field(None, min_length=1, description="strategies; the scenario's if absent")
    policies: tuple[str, ...] | None = Field(None, min_length=1, description="policies; the scenario's if absent")
    vehicles: tuple[int, ...] | None = Field(
        None, min_length=1, description="sizes of the fleet (fleet.size); the scenario's if absent"
    )
    repeats: int = Field(ge=1, le=1_000_000, strict=True, description="runs per configuration")
    seed: int = Field(1, ge=0, le=2**53, strict=True, description="master seed")
    metrics: tuple[str, ...] | None = Field(
        None,
        min_length=1,
        description="compared metrics, by field or as package.module:object or file.py:object; the headline "
        "metrics of the mission if absent",
    )
    baseline: str | None = Field(None, description="baseline strategy, policy or KEY=VALUE; else the first")
    sampling: Literal["grid", "list", "latin", "factorial"] = Field("grid", description="source of the points")
    samples: int = Field(10, ge=2, le=100_000, strict=True, description="points of a Latin hypercube")
    halvings: int = Field(
        0, ge=0, le=5, strict=True, description="number of halvings of a factorial design; 0 for all combinations"
    )
    keep_tables: int | None = Field(
        None, ge=0, description="number of repeats per configuration with stored tables; if absent all, up to 500 MB"
    )


class StoppingRule(Section):
    """The table ``[stopping]``: repeat a configuration until its mean is known well enough."""

    metric: str = Field(description="metric that determines the repeats")
    half_width: float | None = Field(
        None, gt=0.0, description="half-width of its 95 % interval at which a configuration is complete"
    )
    half_width_share: float | None = Field(
        None, gt=0.0, lt=1.0, description="the same as a share of the mean; the first limit that is met counts"
    )
    minimum: int = Field(10, ge=2, strict=True, description="minimum repeats")
    maximum: int = Field(ge=2, le=1_000_000, strict=True, description="maximum repeats; replaces study.repeats")

    def is_met(self, half_width: float, mean: float) -> bool:
        """True if the half-width of the mean's interval is within a limit."""
        of_mean = None if self.half_width_share is None else self.half_width_share * abs(mean)
        return any(half_width <= limit for limit in (self.half_width, of_mean) if limit is not None)


class Unforeseen(Section):
    """One ``[[unforeseen]]``: an event that the mission plan does not consider."""

    name: Name = Field(description="name in figures and tables")
    set: dict[str, Any] = Field({}, description="keys of the scenario that it sets")
    fault: tuple[dict[str, Any], ...] = Field(
        (), description="faults, as the tables [[fault]] of the scenario have them"
    )


class StudyFile(Section):
    """Content of a study file."""

    study: Design
    channel: OneOrMore[dict[str, Any]] = Field(
        (), description="in a study: a table for each channel, in which a list of values is a grid"
    )
    set: dict[str, Any] = Field({}, description="keys of the scenario common to all runs")
    grid: dict[str, Any] = Field({}, description="keys of the scenario with lists of values; all combinations are run")
    point: tuple[dict[str, Any], ...] = Field(
        (), description='keys of the scenario, a table for each point; for sampling = "list"'
    )
    latin: dict[str, Any] = Field(
        {}, description='keys of the scenario with their [lowest, highest]; for sampling = "latin"'
    )
    factorial: dict[str, Any] = Field(
        {}, description='keys of the scenario with their [low, high] levels; for sampling = "factorial"'
    )
    unforeseen: tuple[Unforeseen, ...] = Field(
        (), description="separate axis: runs are made with the settings of each entry"
    )
    stopping: StoppingRule | None = None

    @property
    def factors(self) -> dict[str, Any]:
        """Scenario keys crossed by a factorial design, with two levels; empty for other designs."""
        return dict(dotted(self.factorial))

    @property
    def two_level_design(self) -> FactorialDesign:
        """Runs over the factors of a factorial design."""
        return designed(tuple(self.factors), self.study.halvings)


class StudySetting(NamedTuple):
    """Key of the scenario with its value; ``place`` is the key of the study that sets it."""

    key: str
    value: Any
    place: str


def is_axis(values: Any) -> bool:
    """True if a grid iterates over the values; a list of tables is one value."""
    return isinstance(values, list) and not any(isinstance(value, Mapping) for value in values)
