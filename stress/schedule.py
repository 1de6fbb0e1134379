"""Schedules: what befalls a fleet in one run, as a frozen value that is written as TOML and read again."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import Annotated, Any

import tomli_w
from pydantic import ConfigDict, Field, ValidationError

from missions.document import Document, fault_of
from missions.errors import ConfigurationError, ConfigurationFault
from missions.files import shown, text_of, toml_value
from missions.scenarios import load
from missions.scenarios.deployment import deployment_of
from missions.scenarios.faults import DeclaredFault, users_of_keys
from missions.scenarios.loading import scenario_from
from missions.scenarios.scenario import Scenario
from missions.scenarios.tables import Section, one_of
from remoras.errors import PluginError
from stress.draws import stream_of
from stress.kinds import KINDS, Family, kind_of
from stress.ways import losses_of, packets_each, passes_on
from worldmodel import suggestion

VERSION = 1
"""Of the form of schedules, and of what their kinds mean."""
SETTLE_FRAMES = 240
"""Longest quiet time after the mission, in TDMA frames, or longer by ``ROUNDS``."""
ROUNDS = 24
"""Packets and their answers that come through in the longest quiet time, in the mean, on the worst way."""
MOST_PACKETS = 100.0
"""Packets that are reckoned with for one to come through, at most."""
READY_S = 1e-6
"""What a clock that jumps during the run is ahead at its start: so little that it never shows."""
FLEET_SIZE = "fleet.size"
NOT_OF_SCENARIO = ("peer", "share", "slots", "bits", "one_way", "by_s", "by_m", "term")


class StressFault(Section):
    """One ``[[fault]]`` of a schedule; what a scenario may declare is the same there, with keys of its kind."""

    model_config = ConfigDict(extra="allow")

    kind: str = Field(description="what befalls the vehicle or the link")
    vehicle: str = Field("", description="name of the vehicle; of a link the sender; any if absent")
    peer: str = Field("", description="of a link: name of the receiver; any if absent")
    at_s: float = Field(ge=0.0, description="when it begins")
    until_s: float | None = Field(None, gt=0.0, description="when it is over; for good if absent")
    share: float = Field(1.0, gt=0.0, le=1.0, description="share of packets or readings that it befalls")
    slots: float = Field(1.0, gt=0.0, description="by how many slots packets come later, or how long bursts are")
    bits: int = Field(1, ge=1, description="bits that are flipped in a packet")
    one_way: bool = Field(False, description="of kind partition: only what the vehicle sends is cut off")
    by_s: float = Field(0.0, description="of kind clock: by how much it jumps forward")
    by_m: float = Field(5000.0, description="of kind misplaced: how far reports are off, to the east")
    term: int = Field(1, ge=0, le=255, description="of kind forged-lead: under which it claims the group")

    @property
    def ends_s(self) -> float:
        """When it is over (s); infinite for good."""
        return float("inf") if self.until_s is None else self.until_s

    def holds(self, now_s: float) -> bool:
        """True while it holds."""
        return self.at_s <= now_s < self.ends_s

    @property
    def is_permanent(self) -> bool:
        """True if it lasts for good."""
        kind = kind_of(self.kind)
        return self.until_s is None and kind.may_stay

    @property
    def speed_left(self) -> float:
        """Share of the speeds of the vehicle that it leaves."""
        kind = kind_of(self.kind).declared
        return 1.0 if kind is None else self.declared(kind).speed_left

    def declared(self, kind: type[DeclaredFault]) -> DeclaredFault:
        """What it is in a scenario; raises ValidationError if a value is none that its kind takes."""
        known = {name: value for name, value in self.said().items() if name in kind.model_fields}
        return kind.model_validate_json(json.dumps(known), strict=True)

    def said(self) -> dict[str, Any]:
        """The keys that say something, as TOML has them."""
        return self.model_dump(mode="json", exclude_defaults=True)


class StressTable(Section):
    """The table ``[stress]``."""

    version: int = Field(description="of the form of schedules")
    scenario: str = Field(description="shipped scenario or TOML file")
    strategy: str = Field(description="organisational strategy")
    settings: tuple[str, ...] = Field((), description="KEY=VALUE of the scenario")
    vehicles: tuple[str, ...] = Field(description="names of the fleet, in the order of their nodes")
    seed: Annotated[int, Field(ge=0, le=2**53)] = Field(description="root of all draws of the run")
    heal_s: float = Field(gt=0.0, description="when what is transient is over, and the survivors have to go on")
    bound_s: float = Field(gt=0.0, description="by when the mission has to be complete")
    must_finish: bool = Field(True, description="the mission completes without faults, so survivors must complete it")
    must_end: bool = Field(False, description="the run has to be over before the bound, complete or not")


class Schedule(Section):
    """What befalls a fleet in one run.

    Two schedules that are equal give runs that are equal, byte for byte.
    """

    stress: StressTable
    settings: dict[str, tuple[str, ...]] = Field({}, description="KEY=VALUE of each setting that the seed has drawn")
    fault: tuple[StressFault, ...] = ()

    @property
    def kinds(self) -> frozenset[str]:
        """Kinds of its faults."""
        return frozenset(fault.kind for fault in self.fault)

    @property
    def permanent(self) -> tuple[StressFault, ...]:
        """Faults that last for good."""
        return tuple(fault for fault in self.fault if fault.is_permanent)

    def with_faults(self, faults: Sequence[StressFault]) -> Schedule:
        """The same with other faults."""
        return self.model_copy(update={"fault": tuple(faults)})

    def numbered(self) -> Iterator[tuple[int, StressFault]]:
        """Faults with numbers by which their draws are keyed: those of a fault do not depend on the others."""
        for fault in self.fault:
            name = f"{fault.kind} {fault.vehicle} {fault.peer} {fault.at_s}"
            yield stream_of(name), fault

    def as_toml(self) -> str:
        """The schedule as a file; reading it gives an equal one."""
        about = self.stress.model_dump(mode="json", exclude_defaults=True)
        tables = [("[stress]", about), *([("\n[settings]", self.settings)] if self.settings else [])]
        tables += [("\n[[fault]]", fault.said()) for fault in self.fault]
        lines = [[head, *(f"{key} = {toml_value(value)}" for key, value in table.items())] for head, table in tables]
        return "".join(f"{line}\n" for line in chain.from_iterable(lines))

    @property
    def overrides(self) -> list[tuple[str, str]]:
        """What changes the scenario, with the option that each comes from: what was drawn goes over what was given."""
        return overrides(self.stress.strategy, self.stress.settings, self.settings)

    def with_settings(self, settings: Mapping[str, tuple[str, ...]]) -> Schedule:
        """The same with other settings, without the faults of vehicles that are not there then.

        Raises:
            ConfigurationError: the scenario does not allow it.
        """
        about = self.stress
        fleet = fleet_of(load(about.scenario, overrides(about.strategy, about.settings, settings)))
        faults = tuple(fault for fault in self.fault if {fault.vehicle, fault.peer} <= {*fleet, ""})
        about = about.model_copy(update={"vehicles": fleet})
        return self.model_copy(update={"stress": about, "settings": dict(settings), "fault": faults})

    def scenario(self) -> Scenario:
        """The scenario of the run, with the faults that it can declare itself.

        Raises:
            ConfigurationError: the faults contradict those of the scenario, or each other.
        """
        about = self.stress
        own, quiet_s = _known(about.scenario, tuple(self.overrides))
        told = [*own, *(fault.said() for fault in self.fault if kind_of(fault.kind).is_of_scenario)]
        given: dict[str, Any] = {"scenario.duration_s": about.bound_s}
        if quiet_s:
            given["scenario.settle_s"] = quiet_s
        given |= {f"vehicle.{name}.clock": {"offset_s": off_s} for name, off_s in self._clocks().items()}
        mine = [("schedule", f"{key}={toml_value(value)}") for key, value in given.items()]
        if told:
            mine.append(("schedule", f"fault={toml_value(told)}"))
        others = [override for override in self.overrides if _key(override[1]) not in given]
        if not any(key.startswith("vehicle.") for key in given) or FLEET_SIZE not in map(_key_of, others):
            return load(about.scenario, [*others, *mine])
        whole = load(about.scenario, others).model_dump(mode="json", exclude_none=True)  # copies have tables here
        return scenario_from(Document.of_text(tomli_w.dumps(whole), about.scenario), mine)

    def as_scenario(self) -> str:
        """The run as a scenario file: with its settings, and those of its faults that a scenario may declare."""
        about = self.stress
        others = [fault for fault in self.fault if not kind_of(fault.kind).is_of_scenario and fault.kind != "clock"]
        head = [
            f"A run of {about.scenario} under stress, alone: remoras run FILE --seed {about.seed}",
            *(f"not in it: {toml_value(fault.said())}" for fault in others),
            *(
                f"not in it: a jump of the clock, {toml_value(fault.said())}"
                for fault in self.fault
                if fault.kind == "clock"
            ),
        ]
        tables = self.scenario().model_dump(mode="json", exclude_none=True)
        return "".join(f"# {line}\n" for line in head) + tomli_w.dumps(tables)

    def _clocks(self) -> dict[str, float]:
        """By how much clocks are ahead at the start, of those that are ever off."""
        found: dict[str, float] = {}
        for fault in self.fault:
            if fault.kind == "clock":
                found[fault.vehicle] = found.get(fault.vehicle, 0.0) + (fault.by_s if fault.at_s == 0.0 else 0.0)
        return {name: off_s or READY_S for name, off_s in found.items()}


def overrides(
    strategy: str, settings: Sequence[str], drawn: Mapping[str, Sequence[str]] | None = None
) -> list[tuple[str, str]]:
    """What changes a scenario, with the option that each comes from; what was drawn goes over what was given."""
    named = [("--strategy", f"strategy.name={strategy}")] if strategy else []
    given = named + [("--set", setting) for setting in settings]
    over = {_key(line): ("--settings", line) for lines in (drawn or {}).values() for line in lines}
    return [*(setting for setting in given if _key(setting[1]) not in over), *over.values()]


def _key(override: str) -> str:
    return override.partition("=")[0].strip()


def _key_of(change: tuple[str, str]) -> str:
    return _key(change[1])


def frame_s(scenario: Scenario) -> float:
    """Length of a TDMA frame of a scenario (s)."""
    from missions.runs.setup import resolved

    return resolved(scenario).schedule.frame_s


@lru_cache(maxsize=64)
def _known(scenario: str, changes: tuple[tuple[str, str], ...]) -> tuple[tuple[dict[str, Any], ...], float]:
    """The faults that a scenario has itself, and its longest quiet time (s): many schedules have one."""
    own = load(scenario, changes)
    n_frames = max(SETTLE_FRAMES, math.ceil(ROUNDS * _packets_each(own)))
    return tuple(table.model_dump(mode="json", exclude_none=True) for table in own.fault), n_frames * frame_s(own)


def _packets_each(scenario: Scenario) -> float:
    """Packets that it takes for one to be heard and answered, on the worst way of a fleet; 100 at most.

    Where links have no lasting rates of their own the mean of all is taken.
    """
    if losses := losses_of(scenario):
        return min(MOST_PACKETS, packets_each(losses, passes_on(scenario), scenario.names_by_slot))
    mean_per = scenario.channel.settings().mean_per(deployment_of(scenario))
    return MOST_PACKETS if mean_per >= 1.0 else min(MOST_PACKETS, 1.0 / (1.0 - mean_per) ** 2)


def excludes(fault: StressFault, other: StressFault) -> bool:
    """True if two faults cannot be in one schedule: the same of one vehicle, or one that is away twice."""
    if fault.vehicle != other.vehicle or not fault.vehicle:
        return False
    return fault.kind == other.kind or (kind_of(fault.kind).takes_away and kind_of(other.kind).takes_away)


def read_schedule(path: Path) -> Schedule:
    """The schedule that a file has.

    Raises:
        ConfigurationError: with all that is wrong with it: of another version or fleet, a fault of an unknown kind or
            vehicle or after the end.
    """
    document = Document.of_text(text_of(path), str(path))
    try:
        schedule = Schedule.model_validate(document.raw)
    except ValidationError as error:
        raise document.error(document.faults_of(error, Schedule)) from None
    faults = [*_faults_of_about(schedule)]
    if not faults:
        for number, fault in enumerate(schedule.fault, 1):
            faults += _faults_of(f"fault.{number}", fault, schedule.stress)
    if faults:
        raise document.error(faults)
    return schedule


def _faults_of_about(schedule: Schedule) -> Iterator[ConfigurationFault]:
    about = schedule.stress
    if about.version != VERSION:
        yield ConfigurationFault("stress.version", str(about.version), f"this is version {VERSION}: draw it anew")
        return
    try:
        scenario = load(about.scenario, schedule.overrides)
    except ConfigurationError as error:
        yield ConfigurationFault("stress.scenario", f'"{about.scenario}"', "; ".join(str(error).splitlines()))
        return
    fleet = fleet_of(scenario)
    if about.vehicles != fleet:
        allowed = f"the fleet of {about.scenario} is {toml_value(fleet)}"
        yield ConfigurationFault("stress.vehicles", toml_value(about.vehicles), allowed)


def _faults_of(key: str, fault: StressFault, about: StressTable) -> Iterator[ConfigurationFault]:
    """What is wrong with one fault."""
    try:
        kind = kind_of(fault.kind)
    except PluginError as error:
        named = f"allowed: {', '.join(KINDS)}{suggestion(fault.kind, list(KINDS))}"
        yield ConfigurationFault(f"{key}.kind", f'"{fault.kind}"', str(error) if ":" in fault.kind else named)
        return
    for name in ("vehicle", "peer"):
        if getattr(fault, name) or (name == "vehicle" and kind.family is not Family.LINK):
            yield from one_of(f"{key}.{name}", getattr(fault, name), about.vehicles)
    if fault.at_s >= about.bound_s:
        allowed = f"must be below stress.bound_s = {about.bound_s:g}, when the run is over"
        yield ConfigurationFault(f"{key}.at_s", shown(fault.at_s), allowed)
    if fault.until_s is not None and fault.until_s <= fault.at_s:
        yield ConfigurationFault(f"{key}.until_s", shown(fault.until_s), f"must be above at_s = {fault.at_s:g}")
    for name in fault.said():
        if name not in ("kind", "vehicle", "at_s", "until_s", *kind.keys):
            allowed = f"not used by kind {kind.name}: leave it out"
            if name not in StressFault.model_fields and name not in users_of_keys():
                known = ["kind", "vehicle", "at_s", "until_s", *kind.keys]
                allowed = f"unknown key, allowed here: {', '.join(known)}{suggestion(name, known)}"
            yield ConfigurationFault(f"{key}.{name}", shown(getattr(fault, name)), allowed)
    if kind.declared is not None:
        said = {name: value for name, value in fault.said().items() if name in kind.keys}
        try:
            fault.declared(kind.declared)
        except ValidationError as error:
            for one in (fault_of(detail, kind.declared, said) for detail in error.errors()):
                if one.key in kind.keys:
                    yield ConfigurationFault(f"{key}.{one.key}", one.given, one.allowed)


def fleet_of(scenario: Scenario) -> tuple[str, ...]:
    """Names of the vehicles of a scenario in the order of their nodes."""
    return tuple(scenario.names_by_slot)
