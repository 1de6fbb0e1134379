"""A study as its file has it: its tables, and how their keys and values are read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal, NamedTuple

from pydantic import Field, field_validator

from missions.scenarios.tables import Name, Section, one_or_more


class Design(Section):
    """The table ``[study]``."""

    name: Name = Field(description="name of the study; used in progress and reports")
    scenario: tuple[str, ...] = Field(
        min_length=1, description="scenario, or list of scenarios: names or files", json_schema_extra=one_or_more
    )
    strategies: tuple[str, ...] | None = Field(None, min_length=1, description="strategies; the scenario's if absent")
    policies: tuple[str, ...] | None = Field(None, min_length=1, description="policies; the scenario's if absent")
    vehicles: tuple[int, ...] | None = Field(
        None, min_length=1, description="sizes of the fleet (fleet.size); the scenario's if absent"
    )
    repeats: int = Field(ge=1, le=1_000_000, strict=True, description="runs of each configuration")
    seed: int = Field(1, ge=0, le=2**53, strict=True, description="master seed")
    metrics: tuple[str, ...] | None = Field(
        None,
        min_length=1,
        description="metrics that are compared, by their fields or as package.module:object or file.py:object; "
        "the headline metrics of the mission if absent",
    )
    baseline: str | None = Field(None, description="strategy or policy the others are compared with; else the first")
    sampling: Literal["grid", "list", "latin", "factorial"] = Field("grid", description="where the points come from")
    samples: int = Field(10, ge=2, le=100_000, strict=True, description="points of a Latin hypercube")
    halvings: int = Field(
        0, ge=0, le=5, strict=True, description="how many times a factorial design is halved; 0 for all combinations"
    )
    keep_tables: int = Field(1, ge=0, description="repeats of each configuration whose tables are kept")

    @field_validator("scenario", mode="before")
    @classmethod
    def _one_or_more(cls, value: Any) -> Any:
        return (value,) if isinstance(value, str) else value


class StoppingRule(Section):
    """The table ``[stopping]``: repeat a configuration until its mean is known well enough."""

    metric: str = Field(description="metric whose mean has to be known")
    half_width: float | None = Field(
        None, gt=0.0, description="half-width of its 95 % interval at which a configuration is done"
    )
    half_width_share: float | None = Field(
        None, gt=0.0, lt=1.0, description="the same as a share of the mean; of both limits the first that is met counts"
    )
    minimum: int = Field(10, ge=2, strict=True, description="fewest repeats")
    maximum: int = Field(ge=2, le=1_000_000, strict=True, description="most repeats; replaces study.repeats")


class Unforeseen(Section):
    """One ``[[unforeseen]]``: what a mission meets that its plan did not count with."""

    name: Name = Field(description="what figures and tables call it")
    set: dict[str, Any] = Field({}, description="keys of the scenario that it sets")
    fault: tuple[dict[str, Any], ...] = Field(
        (), description="faults, as the tables [[fault]] of the scenario have them"
    )


class StudyFile(Section):
    """A study as its file has it."""

    study: Design
    channel: tuple[dict[str, Any], ...] = Field(
        (),
        description="in a study: a table for each channel, in which a list of values is a grid",
        json_schema_extra=one_or_more,
    )
    set: dict[str, Any] = Field({}, description="keys of the scenario that are the same in all runs")
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
        (), description="an axis of its own: the runs of every entry are made with what it sets"
    )
    stopping: StoppingRule | None = None

    @property
    def factors(self) -> dict[str, Any]:
        """Keys of the scenario that a factorial design crosses, with their two levels; empty for other designs."""
        return dict(flattened(self.factorial))

    @property
    def sampled_keys(self) -> tuple[str, ...]:
        """Keys of the scenario that a Latin hypercube varies; empty for other designs."""
        return tuple(key for key, _ in flattened(self.latin))


class StudySetting(NamedTuple):
    """A key of the scenario with its value.

    Args:
        place: key of the study file that sets it.
    """

    key: str
    value: Any
    place: str


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
    """True if a grid runs over the values; a list of tables, such as ``[[channel.link]]``, is one value."""
    return isinstance(values, list) and not any(isinstance(value, Mapping) for value in values)
