"""The table ``[communication]``: modem, exchange policy, needs, and what packets carry.

Communication of a scenario: acknowledgement policy and value rule.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from exchange.errors import ExchangeError
from exchange.policies import POLICIES, AckPolicy, checked_policy, header_bits
from exchange.queueing.limits import Deadline, Goby
from exchange.values import ADDITIVE, Age, ValueRule
from exchange.wire.sealing import Seal, key_in
from missions.errors import ConfigurationFault
from missions.files import shown
from missions.scenarios.modem import LEAST_BYTES, modem_in
from missions.scenarios.tables import QUEUE_LIMIT, with_features
from remoras.errors import PluginError
from remoras.plugins import faults_of, named_object
from remoras.table import NotNegative, Sparse
from worldmodel import suggestion

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario


@with_features("communication")
class Communication(Sparse):
    """The table ``[communication]``."""

    UNSAID = frozenset(
        {
            "count_listening",
            "crc_bits",
            "guard_s",
            "key_file",
            "needs_follow",
            "queue_limit",
            "receive_power_w",
            "value",
        }
    )

    modem: str = Field(
        description="modem profile: see `remoras list modems`, a table [modem.NAME], or a TOML file with one such table"
    )
    range_m: float = Field(
        gt=0.0,
        le=100_000.0,
        description="operating range: sets the guard of a slot; nothing is heard beyond, save on the channel acoustic",
    )
    transmit_power_w: NotNegative = Field(10.0, description="power of the modem while it sends")
    receive_power_w: float | None = Field(
        None,
        gt=0.0,
        le=1000.0,
        description="power of the modem while it listens, which is all the time: counts on top of hotel_w",
    )
    count_listening: bool = Field(
        False,
        description="the modem listens with the receive power of its profile, if receive_power_w does not say more; "
        "false: hotel_w has it",
    )
    policy: str = Field(description="exchange policy, see `remoras list policies`")
    lease_frames: int = Field(
        40, ge=1, le=100_000, description="TDMA frames without word of a vehicle after which it is taken to have left"
    )
    false_absence: float = Field(
        1e-6,
        ge=0.0,
        le=0.01,
        description="probability that losses alone make a silence for which a vehicle is taken to have left: by it "
        "leases are shorter where others hear it, too, down to 10 frames and 200 s; 0: lease_frames for all",
    )
    carrier_evidence: bool = Field(True, description="take a peer that sends an item as holding it")
    time_resolution_s: float = Field(
        0.1, ge=0.001, le=10.0, multiple_of=0.001, description="resolution of observation times on the wire"
    )
    guard_s: float | None = Field(
        None,
        ge=0.0,
        le=86_400.0,
        description="silence behind the longest packet of a slot; as long as needed if absent",
    )
    clock_tolerance_s: float = Field(
        1.0,
        ge=0.0,
        le=604_800.0,
        description="how much later than its arrival a fact may be observed; with a later one a packet is refused",
    )
    crc_bits: Literal[0, 8, 16, 32] = Field(
        0, description="checksum of each packet; 0 where the modem refuses what was damaged, as modems do"
    )
    key_file: str = Field(
        "",
        description="file of 32, 48 or 64 hexadecimal digits, by whose key packets are encrypted behind their head; "
        "open to its owner alone (chmod 600); extra `crypto`",
    )
    needs_follow: Literal["all", "groups"] = Field(
        "all", description="who needs the listed attributes: all vehicles, or those whose groups what is told concerns"
    )
    value: str = Field(
        "additive",
        description="rule by which vehicles compare what waits to be said: additive, goby, age, deadline, or "
        "package.module:object",
    )
    queue_limit: int = Field(
        QUEUE_LIMIT,
        ge=1,
        le=1_000_000,
        description="most items in the queue of a vehicle; others wait outside of it until there is room",
    )
    needs: dict[str, Annotated[int, Field(ge=1, le=1000)]] = Field(
        description="priority of each attribute that vehicles need of each other"
    )


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


def communication_faults(scenario: Scenario) -> Iterator[ConfigurationFault]:
    """A value rule, a key or a policy that cannot be had, and acknowledgements that leave no room in a packet."""
    communication = scenario.communication
    try:
        value_rule_of(communication.value)
    except PluginError as error:
        yield ConfigurationFault("communication.value", "", str(error))
    except Exception as error:  # it is somebody else's class: anything may be wrong with it
        allowed = f"it cannot be made without arguments: {type(error).__name__}: {error}"
        yield ConfigurationFault("communication.value", "", allowed)
    try:
        key_of(communication.key_file)
    except ExchangeError as error:
        yield ConfigurationFault("communication.key_file", shown(communication.key_file), str(error))
    modem, n_vehicles = modem_in(scenario), len(scenario.vehicle)
    try:
        header = header_bits(policy_of(communication.policy), n_vehicles)
    except PluginError as error:
        yield ConfigurationFault("communication.policy", "", str(error))
        return
    except Exception as error:  # it is somebody else's function: anything may be wrong with it
        allowed = f"its carries must answer for every bit of a header, but raised {type(error).__name__}: {error}"
        yield ConfigurationFault("communication.policy", "", allowed)
        return
    if modem is not None and n_vehicles >= 2 and header + 8 * LEAST_BYTES > modem.payload_bits:
        allowed = (
            f"its acknowledgements take {header} bits for {n_vehicles} vehicles, a packet of modem {modem.name} "
            f"has {modem.payload_bits} and needs {8 * LEAST_BYTES} for the rest: take ack or another modem"
        )
        yield ConfigurationFault("communication.policy", "", allowed)
