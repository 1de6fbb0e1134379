"""Tables ``[communication]`` and ``[modem.NAME]``; a modem file's table becomes part of the scenario."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from exchange.channel.modems import LEAST_BYTES, MEASURED, Modem, Profile, modems
from exchange.errors import ExchangeError
from exchange.policy.candidates import ADDITIVE, Age, Deadline, Goby, ValueRule
from exchange.policy.policies import POLICIES, AckPolicy, checked_policy, header_bits
from exchange.wire.sealing import Seal, key_in
from missions.document import Document
from missions.errors import ConfigurationFault, one_of
from missions.files import is_file, shown
from missions.scenarios.features import with_features
from remoras.errors import PluginError
from remoras.plugins import RAISED, faults_of, instance_of, known_or_named, named_error, refuse
from remoras.table import NotNegative, Section, Sparse

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario

MODEMS, MODEM = "modem", "communication.modem"  # table with a user's modems by name, and the key of the modem in use
CURVE = "per_at_snr"


class ModemTable(Section, Profile):
    """Table ``[modem.NAME]``."""

    def contradictions(self) -> Iterator[tuple[str, str]]:
        if self.frame_bytes is not None and self.frame_bytes > self.payload_bytes:
            yield "frame_bytes", f"allowed: up to payload_bytes = {self.payload_bytes}"
        if self.band_khz is not None and self.band_khz[0] >= self.band_khz[1]:
            yield "band_khz", "the lower end must come first"
        curve, is_measured = self.per_at_snr, self.modulation == MEASURED
        if is_measured and len(curve) < 2:
            yield CURVE, f'{len(curve)} points; modulation = "{MEASURED}" needs 2 or more, [[snr_db, per], ...]'
        if curve and not is_measured:
            yield CURVE, f'has an effect with modulation = "{MEASURED}" alone'
        for (before_db, _), (snr_db, _) in pairwise(curve):
            if snr_db <= before_db:
                yield CURVE, f"{snr_db:g} dB comes behind {before_db:g} dB; sort its points by rising SNR, each once"
                break


def modem_named(name: str, own: Mapping[str, ModemTable]) -> Modem:
    """Return the profile of a modem, one of a validated scenario or a shipped one."""
    return Modem(name=name, **dict(own[name])) if name in own else modems()[name]


def modem_in(scenario: Scenario) -> Modem | None:
    """Return the modem of a scenario under validation; None if unknown."""
    name, own = scenario.communication.modem, scenario.modem
    return modem_named(name, own) if name in {**own, **modems()} else None


def with_modem_read(document: Document, folder: Path) -> tuple[Document, list[ConfigurationFault]]:
    """Merge the modem file that ``communication.modem`` names; return faults, ConfigurationError if unreadable."""
    communication, own = document.raw.get("communication"), document.raw.get(MODEMS, {})
    modem = communication.get("modem") if isinstance(communication, dict) else None
    if not isinstance(communication, dict) or not isinstance(modem, str) or not modem.endswith(".toml"):
        return document, []
    path = folder / modem
    if not is_file(path):
        allowed = f"there is no file {path}; allowed: a TOML file with one [modem.NAME], or {', '.join(modems())}"
        return document, [ConfigurationFault(MODEM, shown(modem), allowed)]
    part = Document.at(path)
    tables: Any = part.raw.get(MODEMS)
    if set(part.raw) != {MODEMS} or not isinstance(tables, dict) or len(tables) != 1 or not isinstance(own, dict):
        allowed = f"{path} must hold one table [modem.NAME] and nothing else"
        return document, [ConfigurationFault(MODEM, shown(modem), allowed)]
    (name,) = tables
    faults = []
    if name in own:
        key, allowed = f"{MODEMS}.{name}", f"{path} has one of this name, too; rename one of them"
        faults.append(ConfigurationFault(key, "", allowed, document.line_of(key), document.path))
    raw = {**document.raw, MODEMS: {**own, **tables}, "communication": {**communication, "modem": name}}
    return replace(document, raw=raw, parts=(*document.parts, part)), faults


def modem_faults(scenario: Scenario) -> Iterator[ConfigurationFault]:
    """Yield faults: unknown or duplicate modems, and a missing receive power."""
    communication, own = scenario.communication, scenario.modem
    yield from one_of(MODEM, communication.modem, list({**own, **modems()}))
    for name in own.keys() & modems():
        yield ConfigurationFault(f"{MODEMS}.{name}", "", "is the name of a shipped profile; give it another")
    modem = modem_in(scenario)
    if communication.count_listening and modem is not None and modem.receive_w is None:
        allowed = f"the profile {modem.name} has no receive_w (W); name a modem that has one, or [modem.NAME]"
        yield ConfigurationFault("communication.count_listening", "", allowed)


@with_features("communication")
class Communication(Sparse):
    """The table ``[communication]``."""

    UNSAID = frozenset({"count_listening", "crc_bits", "key_file", "needs_follow", "queue_limit", "value"})

    modem: str = Field(
        description="modem profile: see `remoras list modems`, a table [modem.NAME], or a TOML file with one such table"
    )
    range_m: float = Field(
        gt=0.0,
        le=100_000.0,
        description="operating range: sets the guard of a slot; no reception beyond, except on the channel acoustic",
    )
    transmit_power_w: NotNegative = Field(10.0, description="power of the modem while sending")
    count_listening: bool = Field(
        False,
        description="the modem draws the receive power of its profile at all times, in addition to hotel_w; false: "
        "hotel_w has it",
    )
    policy: str = Field(description="exchange policy, see `remoras list policies`")
    lease_frames: int = Field(
        40, ge=1, le=100_000, description="TDMA frames without reception after which a vehicle is declared absent"
    )
    false_absence: float = Field(
        1e-6,
        ge=0.0,
        le=0.01,
        description="probability that losses alone cause a silence that declares a vehicle absent: shortens "
        "leases where others receive it, down to 10 frames and 200 s; 0: lease_frames for all",
    )
    carrier_evidence: bool = Field(True, description="implicit acknowledgement by a peer that sends an item")
    time_resolution_s: float = Field(
        0.1, ge=0.001, le=10.0, multiple_of=0.001, description="resolution of observation times on the wire"
    )
    clock_tolerance_s: float = Field(
        1.0,
        ge=0.0,
        le=604_800.0,
        description="largest lead of an observation time over its arrival; a packet beyond it is refused",
    )
    crc_bits: Literal[0, 8, 16, 32] = Field(
        0, description="checksum of each packet; 0 where the modem discards damaged packets, as modems do"
    )
    key_file: str = Field(
        "",
        description="file of 32, 48 or 64 hexadecimal digits, the key that encrypts packets after their header; "
        "readable by its owner only (chmod 600); extra `crypto`",
    )
    needs_follow: Literal["all", "groups"] = Field(
        "all",
        description="need for the listed attributes: of all vehicles, or of those in the groups that a fact concerns",
    )
    value: str = Field(
        "additive",
        description="rule for the value of queued items: additive, goby, age, deadline, or package.module:object",
    )
    queue_limit: int = Field(
        10_000,
        ge=1,
        le=1_000_000,
        description="maximum number of items in the queue of a vehicle; others wait outside",
    )
    needs: dict[str, Annotated[int, Field(ge=1, le=1000)]] = Field(
        description="priority of each attribute needed by peers"
    )


VALUE_RULES: dict[str, ValueRule] = {rule.name: rule for rule in (ADDITIVE, Goby(), Age(), Deadline())}


def value_rule_of(name: str) -> ValueRule:
    """Return a value rule by name, or an instance of package.module:object; raise PluginError if invalid."""
    rule: ValueRule = instance_of(known_or_named("", name, VALUE_RULES), name)
    refuse("a value rule", faults_of(rule, ValueRule, ("name", "place", "value")))
    return rule


def policy_of(name: str) -> AckPolicy:
    """Return a shipped or plug-in (``package.module:object``) policy, or raise PluginError."""
    policy: AckPolicy = known_or_named("policy", name, POLICIES)
    if name in POLICIES:
        return policy
    try:
        return checked_policy(policy, name)
    except ExchangeError as error:
        raise PluginError(str(error)) from None


def key_of(file: str) -> bytes | None:
    """Return the encryption key in a file, None for no file name; raise ConfigurationError if unusable."""
    if not file:
        return None
    key = key_in(Path(file))
    Seal(key)
    return key


def communication_faults(scenario: Scenario) -> Iterator[ConfigurationFault]:
    """Yield faults: an unusable value rule, key or policy, and a header that fills the packet."""
    communication = scenario.communication
    try:
        value_rule_of(communication.value)
    except PluginError as error:
        yield ConfigurationFault("communication.value", "", str(error))
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
    except RAISED as error:
        allowed = f"its carries must answer for every bit of a header, but raised {named_error(error)}"
        yield ConfigurationFault("communication.policy", "", allowed)
        return
    if modem is not None and n_vehicles >= 2 and header + 8 * LEAST_BYTES > modem.payload_bits:
        allowed = (
            f"its acknowledgements take {header} bits for {n_vehicles} vehicles, a packet of modem {modem.name} "
            f"has {modem.payload_bits} and needs {8 * LEAST_BYTES} for the rest: take ack or another modem"
        )
        yield ConfigurationFault("communication.policy", "", allowed)
