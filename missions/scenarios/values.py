"""Value rules by name: ``communication.value``, a shipped rule or one of a user's own."""

from __future__ import annotations

from collections.abc import Iterator

from exchange.queueing.limits import Deadline, Goby
from exchange.values import ADDITIVE, Age, ValueRule
from missions.errors import ConfigurationFault
from missions.scenarios.tables import Raw, table_of
from remoras.errors import PluginError
from remoras.plugins import faults_of, named_object
from worldmodel import suggestion

VALUE_RULES: dict[str, ValueRule] = {rule.name: rule for rule in (ADDITIVE, Goby(), Age(), Deadline())}
"""The rules that are shipped, by name."""


def value_rule_of(name: str) -> ValueRule:
    """The value rule of that name.

    Args:
        name: of a shipped rule, or package.module:object; a class is called without arguments.

    Raises:
        PluginError: there is none, or it lacks a part of the seam.

    >>> value_rule_of("goby").name
    'goby'
    """
    if ":" not in name:
        if name not in VALUE_RULES:
            raise PluginError(f"allowed: {', '.join(VALUE_RULES)}{suggestion(name, VALUE_RULES)}")
        return VALUE_RULES[name]
    found = named_object(name)
    rule = found() if isinstance(found, type) else found
    faults = list(faults_of(rule, ValueRule, ("name", "place", "value")))
    if faults:
        raise PluginError("; ".join(faults))
    made: ValueRule = rule
    return made


def value_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """The value rule must be there.

    Args:
        raw: the tables as TOML has them.
    """
    name = table_of(raw, "communication").get("value")
    if isinstance(name, str):
        try:
            value_rule_of(name)
        except PluginError as error:
            yield ConfigurationFault("communication.value", f'"{name}"', str(error))
        except Exception as error:  # it is somebody else's class: anything may be wrong with it
            allowed = f"it cannot be made without arguments: {type(error).__name__}: {error}"
            yield ConfigurationFault("communication.value", f'"{name}"', allowed)
