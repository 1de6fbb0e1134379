"""The tables ``[[fault]]``: what befalls which vehicle, and when; what has to hold between them and the fleet.

What befalls is said by the kind that a table names: a class in ``missions.faults``, or one of somebody else's.
"""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import Annotated, Any, ClassVar

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    SerializationInfo,
    model_serializer,
    model_validator,
)
from pydantic_core import PydanticCustomError

from missions.errors import ConfigurationFault
from missions.fault import Absence, kinds
from missions.files import shown
from missions.scenarios.copies import can_play, sensor_tables
from missions.scenarios.tables import PointM, Positive, Raw, Section, entries, is_number, names_of, one_of, table_of
from remoras.condition import SOUND, Condition
from remoras.database import AUVDatabase, VehicleData
from remoras.errors import PluginError
from remoras.faults import ANY, HEAD_OF, Fault
from remoras.mission import Mission
from remoras.organisation import Group
from remoras.plugins import answer, faults_of, named_object
from worldmodel import suggestion

KEY = "fault"
A_TIME = "a number of seconds, 0 or more, or [earliest, latest]"
MOST_SHIPPED = 1 << 8
"""Numbers of kinds that are shipped are below; those of others follow from their names, and are below 2^25."""
COMPULSORY = ("leaves", "detail", "able", "checks", "began_anew")
"""Hooks of a kind; all have a default."""


def number(value: Any) -> float | None:
    """A time as a number; None if it is none."""
    return float(value) if is_number(value) and value >= 0 else None


def span_of(value: Any) -> tuple[float, float] | None:
    """Earliest and latest time of ``at_s``; None if it is malformed."""
    if (one := number(value)) is not None:
        return one, one
    if not isinstance(value, list | tuple) or len(value) != 2:
        return None
    earliest_s, latest_s = map(number, value)
    return None if earliest_s is None or latest_s is None or earliest_s > latest_s else (earliest_s, latest_s)


def _time(value: Any) -> Any:
    """Refuse what is no time, in one message whatever is wrong with it."""
    if value is not None and span_of(value) is None:
        raise PydanticCustomError("time", "allowed: " + A_TIME)
    return tuple(value) if isinstance(value, list) else value


def _kind(name: str) -> str:
    """Refuse a kind that there is not."""
    try:
        kind_named(name)
    except PluginError as error:
        raise PydanticCustomError("fault_kind", "{why}", {"why": str(error)}) from None
    return name


def _with_kinds(schema: dict[str, Any], table: type) -> None:
    """Let a JSON Schema of the table have the keys of all kinds, and any in one whose kind is from outside."""
    if table is not DeclaredFault:
        return  # a kind, of which this asks for its own keys
    own = {key: value for kind in kinds().values() for key, value in kind.model_json_schema()["properties"].items()}
    schema["properties"] = {**own, **schema["properties"]}
    del schema["additionalProperties"]
    schema["if"] = {"properties": {"kind": {"pattern": ":"}}}
    schema["else"] = {"properties": dict.fromkeys(schema["properties"], True), "additionalProperties": False}


class DeclaredFault(Section):
    """One ``[[fault]]``; a kind is a subclass of it, with keys of its own.

    A table is read as the kind that it names. What a kind does not say stays as it is here: nothing befalls.

    Attributes:
        TEXT: what befalls the vehicle, in a line of ``remoras explain``.
        NUMBER: by which draws are keyed, so that no other kind shifts them; of one from outside it follows from the
            name.
        NOT_USED: keys of every fault that it does not take, with what to do instead.
        REQUIRED: keys that have to be given, with what they say.
        BEFALLS: what vehicles have among which ``any`` is drawn.
        ABSENCE: how a vehicle is away while it holds, if at all.
        DISABLES: True if others have to take over what the vehicle did.
    """

    model_config = ConfigDict(json_schema_extra=_with_kinds)

    TEXT: ClassVar[str] = ""
    NUMBER: ClassVar[int | None] = None
    NOT_USED: ClassVar[Mapping[str, str]] = {}
    REQUIRED: ClassVar[Mapping[str, str]] = {}
    BEFALLS: ClassVar[str] = "a sensor or a role with a job"
    ABSENCE: ClassVar[Absence | None] = None
    DISABLES: ClassVar[bool] = False

    kind: Annotated[str, AfterValidator(_kind)] = Field(description="what befalls the vehicle")
    vehicle: str = Field(
        description="name of the vehicle; any: drawn among those that have a sensor or are able to play a role with a "
        "job; head of GROUP: who was agreed to lead the group before the mission"
    )
    at_s: Annotated[float | PointM | None, BeforeValidator(_time)] = Field(
        None, description="when it begins; [earliest, latest] is drawn evenly, once per run"
    )
    rate_per_h: Positive | None = Field(
        None,
        description="instead of at_s: faults per hour, so that the time of the first is drawn exponentially, once per "
        "run; later than the end of the mission, or than until_s, it does not happen",
    )
    until_s: Positive | None = Field(None, description="when it is over; for good if absent")

    # What a kind says ----------------------------------------------------------------------------

    def leaves(self, data: VehicleData) -> Condition:
        """What it leaves of a vehicle while it holds; ``Condition()`` is a sound one."""
        return SOUND

    def detail(self, data: VehicleData, how_long: str) -> str:
        """What the table of faults says when it begins.

        Args:
            data: of the vehicle.
            how_long: "for good", or until when; the text has to have it.
        """
        return how_long

    @property
    def remembers(self) -> bool | None:
        """Whether the vehicle begins anew when it is over, and then still knows what it knew; None if it goes on."""
        return None

    def holds_s(self, at_s: float) -> tuple[float, float]:
        """From when on, and until before when, it holds that was to happen at a time (s)."""
        return at_s, math.inf if self.until_s is None else self.until_s

    def able(self, database: AUVDatabase, groups: Mapping[str, Group]) -> list[VehicleData]:
        """Vehicles among which ``any`` is drawn, in the order of the nodes: those with a sensor, or able to work."""
        working = [(group.name, role.name) for group in groups.values() for role in group.roles if role.job is not None]
        return [data for data in database.values() if data.sensors or any(data.can_play(*role) for role in working)]

    @property
    def sensor_meant(self) -> str | None:
        """Name of the sensor that it is about; None if it is about none, or all."""
        return None

    @property
    def speed_left(self) -> float:
        """Share of the speeds of the vehicle that it leaves."""
        return 1.0

    @classmethod
    def checks(
        cls, key: str, table: Raw, raw: Raw, mission: type[Mission] | None, before: Sequence[tuple[str, Raw]]
    ) -> Iterator[ConfigurationFault]:
        """What else is wrong with a table; malformed values are passed over.

        Args:
            key: of the table, dotted.
            table: as TOML has it; raw: the whole scenario.
            mission: its class, None if that is not to be had.
            before: key and table of each fault of the same kind and ``vehicle`` that stands before it.
        """
        yield from ()

    @classmethod
    def began_anew(cls, detail: str) -> bool | None:
        """Whether a vehicle that begins anew, when it is over, still knows what it knew; None if it does not.

        Args:
            detail: of the row in the table of faults when it began.
        """
        return None

    # What follows --------------------------------------------------------------------------------

    @classmethod
    def own_keys(cls) -> list[str]:
        """Keys that the kind has beside those of every fault."""
        return [key for key in cls.model_fields if key not in DeclaredFault.model_fields]

    @classmethod
    def number_of(cls, name: str) -> int:
        """Number of the kind, by which draws are keyed."""
        return cls.NUMBER if cls.NUMBER is not None else MOST_SHIPPED + (zlib.crc32(name.encode()) & 0xFF_FFFF)

    @classmethod
    def faults_of_kind(cls) -> Iterator[str]:
        """What a kind from outside lacks of the seam, in words."""
        if not isinstance(cls.TEXT, str) or not cls.TEXT:
            yield "lacks TEXT, a line that says what befalls"
        if cls.leaves is DeclaredFault.leaves and cls.remembers is DeclaredFault.remembers:
            yield "does nothing; define leaves(data)"
        yield from faults_of(cls, DeclaredFault, COMPULSORY)
        if cls.NUMBER is not None:
            yield "has a NUMBER, which is for kinds that are shipped: leave it out"
        for key in DeclaredFault.model_fields:
            if cls.model_fields[key] is not DeclaredFault.model_fields[key] and key in cls.__annotations__:
                yield f"has its own {key}, a key of every fault: rename it"

    @property
    def number(self) -> int:
        """Number of its kind."""
        return self.number_of(self.kind)

    @property
    def span_s(self) -> tuple[float, float] | None:
        """Earliest and latest time at which it begins (s); None if a rate says when."""
        return span_of(self.at_s)

    def befalling(self, data: VehicleData, at_s: float) -> Fault:
        """The fault as it befalls a vehicle at a time (s)."""
        from_s, until_s = self.holds_s(at_s)
        how_long = "for good" if math.isinf(until_s) else f"until {until_s:g} s"
        who = f"fault kind {self.kind}"
        leaves = answer(
            who, "leaves", "a Condition", lambda found: isinstance(found, Condition), lambda: self.leaves(data)
        )
        detail = answer(
            who,
            "detail",
            "a text that has how_long",
            lambda found: how_long in found,
            lambda: self.detail(data, how_long),
        )
        return Fault(self.kind, data.name, from_s, until_s, leaves, detail, self.remembers)

    @model_validator(mode="wrap")
    @classmethod
    def _as_its_kind(cls, table: Any, handler: ModelWrapValidatorHandler[DeclaredFault]) -> DeclaredFault:
        """Read a table as the kind that it names; keys of other kinds are left to ``fault_table_faults``."""
        if cls is not DeclaredFault or not isinstance(table, Mapping):
            return handler(table)
        kind = fitting(table)
        left_out = set(users_of_keys()) - set(kind.model_fields)
        if kind is DeclaredFault and ":" in str(table.get("kind")):  # nobody knows what else it has
            left_out = set(table) - set(kind.model_fields)
        own = json.dumps({key: value for key, value in table.items() if key not in left_out}, default=str)
        found: DeclaredFault = (_AnyKind if kind is DeclaredFault else kind).model_validate_json(own, strict=True)
        return found

    @model_serializer(mode="plain")
    def _said(self, info: SerializationInfo) -> dict[str, Any]:
        """All keys of its kind: what is written can be read again."""
        found = {key: getattr(self, key) for key in type(self).model_fields}
        return {key: value for key, value in found.items() if value is not None or not info.exclude_none}

    @classmethod
    def fitting(cls, table: Raw) -> type[DeclaredFault]:
        """The class that a table is read as."""
        return fitting(table) if cls is DeclaredFault else cls


class _AnyKind(DeclaredFault):
    """A table whose kind cannot be had."""


class FaultOfSensors(DeclaredFault):
    """A kind that befalls sensors: one that is named, or all of a vehicle."""

    BEFALLS = "the sensor"

    sensor: str | None = Field(None, description="name of the sensor; all of the vehicle if absent")

    @property
    def sensor_meant(self) -> str | None:
        """Name of the sensor that it is about; None if it is about all."""
        return self.sensor

    def of(self, data: VehicleData) -> tuple[str, ...]:
        """Names of the sensors of a vehicle that it is about."""
        return tuple(settings.name for settings in data.sensors if self.sensor in (None, settings.name))

    def able(self, database: AUVDatabase, groups: Mapping[str, Group]) -> list[VehicleData]:
        """Vehicles that have the sensor."""
        return [data for data in database.values() if self.of(data)]

    @classmethod
    def checks(
        cls, key: str, table: Raw, raw: Raw, mission: type[Mission] | None, before: Sequence[tuple[str, Raw]]
    ) -> Iterator[ConfigurationFault]:
        """A sensor that no vehicle which is meant has."""
        vehicle = table.get("vehicle")
        named = [entry for entry in entries(raw, "vehicle") if entry.get("name") == vehicle]
        meant = named or entries(raw, "vehicle")
        if not named and isinstance(vehicle, str) and vehicle.startswith(HEAD_OF):
            group = vehicle.removeprefix(HEAD_OF)
            roles = [
                role for entry in entries(raw, "group") if entry.get("name") == group for role in entries(entry, "role")
            ]
            heads = [role.get("name") for role in roles if role.get("head") is True]
            meant = [one for one in meant if any(can_play(one, group, head) for head in heads)]
            if not heads:
                return  # reported as what it is
        elif not named and vehicle != ANY:
            return
        default = "" if mission is None else next(iter(mission.sensors), "")
        has = list(dict.fromkeys(name for one in meant for name in _sensor_names(one, default)))
        if not has:
            allowed = "has no sensor that could fail" if named or vehicle != ANY else "no vehicle has a sensor"
            yield ConfigurationFault(f"{key}.vehicle", shown(vehicle), allowed)
        else:
            yield from one_of(f"{key}.sensor", table.get("sensor"), has)


def _sensor_names(vehicle: Raw, default: str) -> list[str]:
    return [str(table.get("name") or table.get("type") or default) for table in sensor_tables(vehicle)]


# Kinds ---------------------------------------------------------------------------------------------


@cache
def kind_named(name: str) -> type[DeclaredFault]:
    """A kind by its name, or one from outside by ``package.module:Class``.

    Raises:
        PluginError: there is none of that name, it cannot be loaded, or it lacks a part of the seam.
    """
    known: dict[str, type[DeclaredFault]] = kinds()
    if ":" not in name:
        if name not in known:
            raise PluginError(f"allowed: {', '.join(known)}, package.module:Class{suggestion(name, known)}")
        return known[name]
    found = named_object(name)
    if not (isinstance(found, type) and issubclass(found, DeclaredFault)):
        what = f"class {found.__name__}" if isinstance(found, type) else f"object of {type(found).__name__}"
        raise PluginError(f"a subclass of remoras.DeclaredFault is needed, not the {what}")
    if faults := list(found.faults_of_kind()):
        raise PluginError(f"a fault kind: {'; '.join(faults)}")
    return found


def fitting(table: Raw) -> type[DeclaredFault]:
    """The kind that a table names; that of none in particular if it cannot be had, which is reported."""
    try:
        return kind_named(table["kind"])
    except (KeyError, TypeError, PluginError):
        return DeclaredFault


@cache
def users_of_keys() -> dict[str, list[str]]:
    """The kinds that use a key, for each key that not all have."""
    found: dict[str, list[str]] = {}
    for name, kind in kinds().items():
        for key in kind.own_keys():
            found.setdefault(key, []).append(name)
    return found


# What has to hold ----------------------------------------------------------------------------------


def fault_table_faults(raw: Raw, mission: type[Mission] | None) -> Iterator[ConfigurationFault]:
    """What has to hold within faults, and between them, the vehicles and the groups.

    Args:
        raw: the tables as TOML has them.
        mission: class of the mission; None if it cannot be had.
    """
    tables = raw.get(KEY)
    numbered = [(f"{KEY}.{n}", table) for n, table in enumerate(tables if isinstance(tables, list) else [], 1)]
    told = [(key, one) for key, one in numbered if isinstance(one, dict)]
    for position, (key, table) in enumerate(told):
        kind = fitting(table)
        yield from _whose(key, table, raw, kind)
        yield from _when(key, table, kind)
        yield from _too_late(key, table, raw)
        yield from _useless(key, table, kind)
        yield from _lacking(key, table, kind)
        whom = table.get("kind"), table.get("vehicle")
        before = [earlier for earlier in told[:position] if (earlier[1].get("kind"), earlier[1].get("vehicle")) == whom]
        yield from _own_faults(kind, key, table, raw, mission, before)


def _own_faults(
    kind: type[DeclaredFault],
    key: str,
    table: Raw,
    raw: Raw,
    mission: type[Mission] | None,
    before: Sequence[tuple[str, Raw]],
) -> list[ConfigurationFault]:
    """What the kind itself finds wrong."""
    try:
        found = list(kind.checks(key, table, raw, mission, before))
    except Exception as error:  # it may be somebody else's class
        allowed = f"its checks must pass malformed values over, but raised {type(error).__name__}: {error}"
        return [ConfigurationFault(f"{key}.kind", shown(table.get("kind")), allowed)]
    if all(isinstance(fault, ConfigurationFault) for fault in found):
        return found
    allowed = f"its checks must give missions.errors.ConfigurationFault values, but gave {found!r}"
    return [ConfigurationFault(f"{key}.kind", shown(table.get("kind")), allowed)]


def draw_faults(
    faults: Sequence[DeclaredFault], database: AUVDatabase, groups: Mapping[str, Group]
) -> Iterator[ConfigurationFault]:
    """What cannot be drawn, and kinds that answer with something else than the seam says; where nothing else is wrong.

    Args:
        faults: of the scenario, in its order.
        database: of all vehicles.
        groups: by name.
    """
    for number, fault in enumerate(faults, 1):
        try:
            for data in database.values():
                fault.befalling(data, 0.0)
            able = [data.name for data in fault.able(database, groups)]
        except Exception as error:  # it may be somebody else's class
            text = str(error) if isinstance(error, PluginError) else f"raised {type(error).__name__}: {error}"
            yield ConfigurationFault(f"{KEY}.{number}.kind", shown(fault.kind), text)
            continue
        if fault.vehicle == ANY and ANY not in database:
            whom = (ANY, fault.kind, fault.sensor_meant)
            alike = [fault for fault in faults[:number] if (fault.vehicle, fault.kind, fault.sensor_meant) == whom]
            if len(alike) > len(able):
                allowed = f"the {len(alike)} of kind {fault.kind} befall different vehicles, but those with"
                allowed = f"{allowed} {fault.BEFALLS} are {', '.join(able) or 'none'}"
                yield ConfigurationFault(f"{KEY}.{number}.vehicle", f'"{ANY}"', allowed)


def _whose(key: str, table: Raw, raw: Raw, kind: type[DeclaredFault]) -> Iterator[ConfigurationFault]:
    """A vehicle or a group that there is not."""
    vehicle, vehicles = table.get("vehicle"), names_of(raw, "vehicle")
    if not isinstance(vehicle, str) or vehicle in vehicles:
        return
    if kind.ABSENCE is Absence.BEFORE and (vehicle == ANY or vehicle.startswith(HEAD_OF)):
        allowed = f"the vehicle that {table.get('kind')} has to be named: {', '.join(vehicles)}"
        yield ConfigurationFault(f"{key}.vehicle", f'"{vehicle}"', allowed)
    elif vehicle.startswith(HEAD_OF):
        groups = {str(group["name"]): group for group in entries(raw, "group") if isinstance(group.get("name"), str)}
        name = vehicle.removeprefix(HEAD_OF)
        if name not in groups:
            known = [HEAD_OF + group for group in groups]
            yield from one_of(f"{key}.vehicle", vehicle, known)
        elif not any(role.get("head") is True for role in entries(groups[name], "role")):
            allowed = f"the group {name} has no role with head = true, so nobody leads it"
            yield ConfigurationFault(f"{key}.vehicle", f'"{vehicle}"', allowed)
    elif vehicle != ANY:
        allowed = f"allowed: {', '.join(vehicles)}, {ANY}, {HEAD_OF}GROUP{suggestion(vehicle, vehicles)}"
        yield ConfigurationFault(f"{key}.vehicle", f'"{vehicle}"', allowed)


def _when(key: str, table: Raw, kind: type[DeclaredFault]) -> Iterator[ConfigurationFault]:
    """Times that contradict each other."""
    timed, rated = "at_s" in table, "rate_per_h" in table
    if timed and rated:
        yield ConfigurationFault(f"{key}.rate_per_h", shown(table["rate_per_h"]), "given beside at_s: leave one out")
    elif not (timed or rated):
        allowed = f"missing: {A_TIME}" + ("" if "rate_per_h" in kind.NOT_USED else "; or give rate_per_h")
        yield ConfigurationFault(f"{key}.at_s", "", allowed)
    span_s, until_s = span_of(table.get("at_s")), number(table.get("until_s"))
    if "until_s" not in kind.NOT_USED and span_s is not None and until_s is not None and until_s <= span_s[1]:
        allowed = f"must be above at_s = {shown(table['at_s'])}"
        yield ConfigurationFault(f"{key}.until_s", shown(table["until_s"]), allowed)


def _too_late(key: str, table: Raw, raw: Raw) -> Iterator[ConfigurationFault]:
    """A fault that can never happen, because the mission is over before."""
    end_s, span_s = number(table_of(raw, "scenario").get("duration_s")), span_of(table.get("at_s"))
    if end_s is not None and span_s is not None and span_s[1] >= end_s:
        allowed = f"must be below scenario.duration_s = {end_s:g}, when the mission is over"
        yield ConfigurationFault(f"{key}.at_s", shown(table["at_s"]), allowed)


def _useless(key: str, table: Raw, kind: type[DeclaredFault]) -> Iterator[ConfigurationFault]:
    """Keys that have no effect for the kind."""
    for name, users in users_of_keys().items():
        if name in table and kind is not DeclaredFault and name not in kind.model_fields:
            allowed = f"not used by kind {table.get('kind')}, only by {' and '.join(users)}: leave it out"
            yield ConfigurationFault(f"{key}.{name}", shown(table[name]), allowed)
    for name, allowed in kind.NOT_USED.items():
        if name in table and not (name == "rate_per_h" and "at_s" in table):
            yield ConfigurationFault(f"{key}.{name}", shown(table[name]), allowed)


def _lacking(key: str, table: Raw, kind: type[DeclaredFault]) -> Iterator[ConfigurationFault]:
    """Keys that the kind cannot do without."""
    for name, what in kind.REQUIRED.items():
        if name not in table:
            yield ConfigurationFault(f"{key}.{name}", "", what)


def overlap(one: Raw, other: Raw) -> bool:
    """True if two faults may hold at one time."""
    (from_s, until_s), (other_from_s, other_until_s) = _longest_s(one), _longest_s(other)
    return from_s < other_until_s and other_from_s < until_s


def _longest_s(table: Raw) -> tuple[float, float]:
    """From when to when the fault holds at most."""
    span_s, until_s = span_of(table.get("at_s")), number(table.get("until_s"))
    return (0.0 if span_s is None else span_s[0]), (math.inf if until_s is None else until_s)
