"""Communication of a scenario: acknowledgement policy and value rule."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from exchange.errors import ExchangeError
from exchange.policies import POLICIES, AckPolicy, checked_policy, header_bits
from exchange.queueing.limits import Deadline, Goby
from exchange.values import ADDITIVE, Age, ValueRule
from exchange.wire.sealing import Seal, key_in
from missions.errors import ConfigurationFault
from missions.scenarios.modem import LEAST_BYTES, modem_in
from missions.scenarios.tables import Raw, entries, table_of
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


def policy_of(name: str) -> AckPolicy:
    """A shipped policy by name, or one from outside by ``package.module:object``.

    Raises:
        PluginError: there is none of that name, it cannot be loaded, or it lacks a part.
    """
    if ":" not in name:
        if name not in POLICIES:
            raise PluginError(f"allowed: {', '.join(POLICIES)}{suggestion(name, POLICIES)}")
        return POLICIES[name]
    found = named_object(name)
    try:
        return checked_policy(found, name)
    except ExchangeError as error:
        raise PluginError(str(error)) from None


def with_key_found(raw: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Tables in which the file of the key has its whole path.

    Args:
        raw: tables of a scenario.
        folder: that the path of the file starts from.
    """
    communication: Mapping[str, Any] = table_of(raw, "communication")
    file = communication.get("key_file")
    if not isinstance(file, str) or not file:
        return raw
    return {**raw, "communication": {**communication, "key_file": str((folder / file).resolve())}}


def key_of(file: str) -> bytes | None:
    """The key in a file; None where no file is named.

    Raises:
        ConfigurationError: it holds no key, or there is no library to encrypt.
    """
    if not file:
        return None
    key = key_in(Path(file))
    Seal(key)
    return key


def key_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """The file of the key must hold one, and the library that encrypts must be there."""
    file = table_of(raw, "communication").get("key_file")
    if not isinstance(file, str):
        return
    try:
        key_of(file)
    except ExchangeError as error:
        yield ConfigurationFault("communication.key_file", f'"{file}"', str(error))


def policy_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """The policy must be there, and the acknowledgements of all nodes must leave room in a packet."""
    communication = table_of(raw, "communication")
    modem, name = modem_in(raw), communication.get("policy")
    if not isinstance(name, str):
        return
    n_vehicles = len(entries(raw, "vehicle"))
    try:
        policy = policy_of(name)
        header = header_bits(policy, n_vehicles)
    except PluginError as error:
        yield ConfigurationFault("communication.policy", f'"{name}"', str(error))
        return
    except Exception as error:  # it is somebody else's function: anything may be wrong with it
        allowed = f"its carries must answer for every bit of a header, but raised {type(error).__name__}: {error}"
        yield ConfigurationFault("communication.policy", f'"{name}"', allowed)
        return
    if modem is not None and n_vehicles >= 2 and header + 8 * LEAST_BYTES > modem.payload_bits:
        allowed = (
            f"its acknowledgements take {header} bits for {n_vehicles} vehicles, a packet of modem {modem.name} "
            f"has {modem.payload_bits} and needs {8 * LEAST_BYTES} for the rest: take ack or another modem"
        )
        yield ConfigurationFault("communication.policy", f'"{name}"', allowed)
