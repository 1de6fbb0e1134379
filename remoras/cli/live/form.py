"""What a page may ask of a live run, as values that are checked before anything changes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from exchange.policies import POLICIES
from missions.fault import kinds
from missions.files import parsed, shown, toml_value
from missions.scenarios import load
from missions.scenarios.scenario import Scenario
from missions.scenarios.tables import is_number
from remoras.strategies import strategies

LEAST_SPEED, GREATEST_SPEED = 0.1, 10_000.0
MOST_STEPS = 10_000
KEYS = {
    "strategy": "strategy.name", "policy": "communication.policy", "per": "channel.per", "faults": "fault"
}  # fmt: skip
"""Keys of a scenario that the fields of the form set."""
EXAMPLE = 'kind = "lost", vehicle = "AUV01", at_s = 300'


class AskedWrongly(Exception):
    """The page asked for what cannot be; the message says why."""


class RunForm:
    """The settings of a run that a page may change, beside those of the command line.

    Args:
        scenario: name or file.
        overrides: (option, KEY=VALUE) of the command line.
        first: the scenario that they give.
    """

    def __init__(self, scenario: str, overrides: list[tuple[str, str]], first: Scenario) -> None:
        self._scenario = scenario
        self._overrides = overrides
        self._given: dict[str, Any] = {}
        self.allowed = {
            "strategy": sorted({*strategies(), first.strategy.name}),
            "policy": sorted({*POLICIES, first.communication.policy}),
            "kind": list(kinds()),
        }

    def changed(self, fields: Any) -> tuple[Scenario, dict[str, Any]]:
        """The scenario under some fields, and all fields that were ever given; ``keep`` makes them count.

        Args:
            fields: values by the names of ``KEYS``; one of None is again as the command line has it.

        Raises:
            AskedWrongly: a field that the form does not have, or a value that it cannot give.
            ConfigurationError: a value out of its range.
        """
        if not isinstance(fields, dict):
            raise AskedWrongly("form: allowed is an object of its fields")
        if strange := sorted(set(fields) - set(KEYS)):
            raise AskedWrongly(f"{', '.join(map(shown, strange))}: no field of the form; allowed: {', '.join(KEYS)}")
        given = {name: value for name, value in {**self._given, **fields}.items() if value is not None}
        own = [(name, f"{KEYS[name]}={self._value(name, value)}") for name, value in given.items()]
        kept = [override for override in self._overrides if not any(_sets(override[1], KEYS[name]) for name in given)]
        return load(self._scenario, [*kept, *own]), given

    def keep(self, given: dict[str, Any]) -> None:
        """Take fields that ``changed`` has returned as those of the run."""
        self._given = given

    def _value(self, field: str, given: Any) -> str:
        """A field as the value of an option."""
        if field == "per":
            if isinstance(given, bool) or not isinstance(given, int | float) or not 0 <= given < 1:
                raise AskedWrongly(f"loss {shown(given)}: allowed is a number, 0 to below 1")
            return toml_value(given)
        if not isinstance(given, str):
            raise AskedWrongly(f"{field} {shown(given)}: allowed is a text")
        if field == "faults":
            return toml_value([_fault(line) for line in given.splitlines() if line.strip()])
        if given not in self.allowed[field]:
            raise AskedWrongly(f"{field} {shown(given)}: allowed are {', '.join(self.allowed[field])}")
        return given


def fields_of(scenario: Scenario) -> dict[str, Any]:
    """The fields of the form as a scenario has them; None where it has no loss rate of its own."""
    per = scenario.channel.model_dump(mode="json").get("per")
    faults = [fault.model_dump(mode="json", exclude_none=True) for fault in scenario.fault]
    return {
        "strategy": scenario.strategy.name,
        "policy": scenario.communication.policy,
        "per": per if isinstance(per, int | float) else None,
        "faults": "\n".join(_line(fault) for fault in faults),
    }


def whole_number(name: str, given: Any) -> int:
    """A number of steps.

    Raises:
        AskedWrongly: it is none, or out of range.
    """
    if isinstance(given, bool) or not isinstance(given, int) or not 1 <= given <= MOST_STEPS:
        raise AskedWrongly(f"{name} {shown(given)}: allowed is a whole number, 1 to {MOST_STEPS}")
    return given


def speed_of(given: Any) -> float | None:
    """A multiple of real time; None is as fast as the machine can.

    Raises:
        AskedWrongly: it is none, or out of range.
    """
    if given == "full":
        return None
    if not is_number(given) or not LEAST_SPEED <= given <= GREATEST_SPEED:
        text = f"{LEAST_SPEED:g} to {GREATEST_SPEED:g} times real time, or full"
        raise AskedWrongly(f"speed {shown(given)}: allowed is {text}")
    return float(given)


def time_within(given: Any, until_s: float) -> float:
    """A time of the mission (s), at most ``until_s``.

    Raises:
        AskedWrongly: it is none, or out of range.
    """
    if not is_number(given) or not 0.0 <= given <= until_s:
        raise AskedWrongly(f"skip_to_s {shown(given)}: allowed is a time of the mission, 0 to {until_s:g} s")
    return float(given)


def _sets(override: str, key: str) -> bool:
    name = override.partition("=")[0].strip()
    return name == key or name.startswith(f"{key}.")


def _fault(line: str) -> dict[str, Any]:
    try:
        found: dict[str, Any] = parsed(f"fault = {{ {line} }}")["fault"]
    except ValueError as error:
        raise AskedWrongly(f"faults: {shown(line)} cannot be read ({error}); write one a line, as: {EXAMPLE}") from None
    return found


def _line(fault: Mapping[str, Any]) -> str:
    return ", ".join(f"{key} = {toml_value(value)}" for key, value in fault.items())
