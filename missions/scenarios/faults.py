"""Tables ``[[fault]]``: faults of vehicles, and their checks against the fleet.

The schedule is a pure function of (faults, seed, agreement): loss rate, strategy and other faults shift no draw.
"""

from __future__ import annotations

import json
import math
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    model_validator,
)
from pydantic_core import PydanticCustomError

from exchange.arithmetic import log1p
from exchange.channel import loss
from missions.errors import ConfigurationFault, one_of
from missions.fault import Absence, kinds
from missions.files import is_number, shown
from remoras.condition import SOUND, Condition
from remoras.database import AUVDatabase, VehicleData
from remoras.errors import PluginError
from remoras.faults import ANY, HEAD_OF, Fault
from remoras.mission import Mission
from remoras.organisation import Group, Organisation
from remoras.plugins import RAISED, answer, faults_of, known_or_named, named_error, refuse, refuse_other
from remoras.table import PointM, Positive, Section
from worldmodel import suggestion

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario

KEY = "fault"
A_TIME = "a number of seconds, 0 or more, or [earliest, latest]"
MOST_SHIPPED = 1 << 8  # shipped kinds have lower numbers; plug-in numbers derive from names, below 2^25
COMPULSORY = ("leaves", "detail", "able", "checks", "began_anew")  # hooks of a kind; all have a default


def one_or_two(allowed: str, fit: Callable[[Sequence[float]], bool] = lambda numbers: True) -> BeforeValidator:
    """Return the validator of a number or a pair of them, for which pydantic would report each type of the union."""

    def checked(value: Any) -> Any:
        numbers = value if isinstance(value, list | tuple) and len(value) == 2 else [value]
        if value is not None and not (all(map(is_number, numbers)) and fit(numbers)):
            raise PydanticCustomError("one_or_two", "allowed: {allowed}", {"allowed": allowed})
        return tuple(value) if isinstance(value, list) else value

    return BeforeValidator(checked)


def _kind(name: str) -> str:
    try:
        kind_named(name)
    except PluginError as error:
        raise PydanticCustomError("fault_kind", "{why}", {"why": str(error)}) from None
    return name


def _with_kinds(schema: dict[str, Any], table: type) -> None:
    """Extend a JSON Schema by the keys of all kinds; plug-in kinds accept any key."""
    if table is not DeclaredFault:
        return
    own = {key: value for kind in kinds().values() for key, value in kind.model_json_schema()["properties"].items()}
    schema["properties"] = {**own, **schema["properties"]}
    del schema["additionalProperties"]
    # A kind with a colon is a plug-in, whose keys are unknown here.
    schema["if"] = {"properties": {"kind": {"pattern": ":"}}}
    schema["else"] = {"properties": dict.fromkeys(schema["properties"], True), "additionalProperties": False}


class DeclaredFault(Section):
    """One ``[[fault]]``, parsed as the kind that it names; kinds are subclasses with further keys.

    Attributes:
        TEXT: effect on the vehicle, a line of ``remoras explain``.
        NUMBER: key of draws; derived from the name for plug-ins.
        CONDITION: condition of the vehicle during the fault, unless ``leaves`` gives another.
        NOT_USED, REQUIRED: keys that it rejects or requires, with a message.
        BEFALLS: property of the vehicles from which ``any`` is drawn.
        ABSENCE: kind of absence during the fault; None if present.
        DISABLES: True if others must take over the vehicle's work.

    >>> from missions.scenarios import load
    >>> fault = 'fault=[{kind="mute", vehicle="AUV01", at_s=10.0}]'
    >>> mute: DeclaredFault = load("mapping-rendezvous", [("--set", fault)]).fault[0]
    >>> mute.CONDITION.is_mute, mute.holds_s(10.0)
    (True, (10.0, inf))
    """

    model_config = ConfigDict(json_schema_extra=_with_kinds)

    TEXT: ClassVar[str] = ""
    CONDITION: ClassVar[Condition] = SOUND
    NUMBER: ClassVar[int | None] = None
    NOT_USED: ClassVar[Mapping[str, str]] = {}
    REQUIRED: ClassVar[Mapping[str, str]] = {}
    BEFALLS: ClassVar[str] = "a sensor or a role with a job"
    ABSENCE: ClassVar[Absence | None] = None
    DISABLES: ClassVar[bool] = False

    kind: Annotated[str, AfterValidator(_kind)] = Field(description="kind of fault of the vehicle")
    vehicle: str = Field(
        description="name of the vehicle; any: drawn among those with a sensor or a role with a job; head of "
        "GROUP: leader of the group as agreed before the mission"
    )
    at_s: Annotated[float | PointM | None, one_or_two(A_TIME, lambda s: 0 <= s[0] <= s[-1])] = Field(
        None, description="start; [earliest, latest] is drawn uniformly, once per run"
    )
    rate_per_h: Positive | None = Field(
        None,
        description="instead of at_s: faults per hour; the first time is drawn exponentially, once per run; none "
        "occurs after the end of the mission or until_s",
    )
    until_s: Positive | None = Field(None, description="end; permanent if absent")

    # Hooks of a kind -----------------------------------------------------------------------------

    def leaves(self, data: VehicleData) -> Condition:
        """Return the condition of the vehicle during the fault; ``Condition()`` is sound."""
        return self.CONDITION

    def detail(self, data: VehicleData, how_long: str) -> str:
        """Return the start text in the table of faults, which must contain ``how_long``."""
        return how_long

    @property
    def remembers(self) -> bool | None:
        """True or False if the vehicle restarts with or without memory; None if it continues."""
        return None

    def holds_s(self, at_s: float) -> tuple[float, float]:
        """Return start and end (s) of a fault scheduled for ``at_s``."""
        return at_s, math.inf if self.until_s is None else self.until_s

    def able(self, database: AUVDatabase, groups: Mapping[str, Group]) -> list[VehicleData]:
        """Return the vehicles from which ``any`` is drawn, in node order: with sensor or job."""
        working = [(group.name, role.name) for group in groups.values() for role in group.roles if role.job is not None]
        return [data for data in database.values() if data.sensors or any(data.can_play(*role) for role in working)]

    @property
    def sensor_meant(self) -> str | None:
        """Name of the affected sensor; None for none or all."""
        return None

    def checks(
        self, key: str, scenario: Scenario, mission: type[Mission], before: Sequence[tuple[str, DeclaredFault]]
    ) -> Iterator[ConfigurationFault]:
        """Yield faults between this one and other tables; ``before`` are earlier ones of its kind and ``vehicle``."""
        yield from ()

    def contradictions(self) -> Iterator[tuple[str, str]]:
        used = {key for key in self.model_fields_set if getattr(self, key) is not None}
        timed, rated = "at_s" in used, "rate_per_h" in used
        for key, allowed in self.NOT_USED.items():
            if key in used and not (key == "rate_per_h" and timed):
                yield key, allowed
        yield from ((key, text) for key, text in self.REQUIRED.items() if key not in used)
        if timed and rated:
            yield "rate_per_h", "given beside at_s: leave one out"
        elif not (timed or rated):
            yield "at_s", f"missing: {A_TIME}" + ("" if "rate_per_h" in self.NOT_USED else "; or give rate_per_h")
        elif (span_s := self.span_s) and "until_s" not in self.NOT_USED and (self.until_s or math.inf) <= span_s[1]:
            latest = "the latest " if isinstance(self.at_s, tuple) else ""
            yield "until_s", f"must be above {latest}at_s = {span_s[1]:g}"

    def overlaps(self, other: DeclaredFault) -> bool:
        """True if both may be active at one time."""
        begin, other_begin = ((fault.span_s or (0.0,))[0] for fault in (self, other))
        end, other_end = (math.inf if fault.until_s is None else fault.until_s for fault in (self, other))
        return begin < other_end and other_begin < end

    @classmethod
    def unknown(cls, key: str) -> str:
        """Explain why a key of other kinds is not allowed; empty for an unknown key."""
        users = users_of_keys().get(key, ())
        name = next((name for name, kind in kinds().items() if kind is cls), cls.__name__)
        return f"not used by kind {name}, only by {' and '.join(users)}: leave it out" if users else ""

    @classmethod
    def began_anew(cls, detail: str) -> bool | None:
        """Return True if a restart keeps memory, judged by ``detail``; None without a restart."""
        return None

    # Derived data --------------------------------------------------------------------------------

    @classmethod
    def own_keys(cls) -> list[str]:
        """Return the keys of this kind alone."""
        return [key for key in cls.model_fields if key not in DeclaredFault.model_fields]

    @classmethod
    def number_of(cls, name: str) -> int:
        """Return the number of the kind, which keys its draws."""
        # The checksum of the name is equal in all processes, unlike ``hash``.
        return cls.NUMBER if cls.NUMBER is not None else MOST_SHIPPED + (zlib.crc32(name.encode()) & 0xFF_FFFF)

    @classmethod
    def faults_of_kind(cls) -> Iterator[str]:
        """Yield the parts of the interface that a plug-in kind lacks."""
        if not isinstance(cls.TEXT, str) or not cls.TEXT:
            yield "lacks TEXT, a line that describes the fault"
        if cls.leaves is DeclaredFault.leaves and cls.remembers is DeclaredFault.remembers:
            yield "does nothing; define leaves(data)"
        yield from faults_of(cls, DeclaredFault, COMPULSORY)
        if cls.NUMBER is not None:
            yield "has a NUMBER, which is reserved for shipped kinds: leave it out"
        for key in DeclaredFault.model_fields:
            if cls.model_fields[key] is not DeclaredFault.model_fields[key] and key in cls.__annotations__:
                yield f"has its own {key}, a key of every fault: rename it"

    @property
    def span_s(self) -> tuple[float, float] | None:
        """Earliest and latest start (s); None if a rate determines it."""
        return (self.at_s, self.at_s) if isinstance(self.at_s, float) else self.at_s

    def befalling(self, data: VehicleData, at_s: float) -> Fault:
        """Return the fault as it occurs to a vehicle at a time (s)."""
        from_s, until_s = self.holds_s(at_s)
        how_long = "for good" if math.isinf(until_s) else f"until {until_s:g} s"
        subject, told = f"fault kind {self.kind}", "a text that has how_long"
        leaves = answer(subject, "leaves", "a Condition", Condition, partial(self.leaves, data))
        detail = answer(subject, "detail", told, lambda text: how_long in text, partial(self.detail, data, how_long))
        return Fault(self.kind, data.name, from_s, until_s, leaves, detail, self.remembers)

    @model_validator(mode="wrap")
    @classmethod
    def _as_its_kind(cls, table: Any, handler: ModelWrapValidatorHandler[DeclaredFault]) -> DeclaredFault:
        if cls is not DeclaredFault or not isinstance(table, Mapping):
            return handler(table)
        own = json.dumps(dict(table), default=str)
        return fitting(table, _AnyKind).model_validate_json(own, strict=True)

    @classmethod
    def fitting(cls, table: Mapping[str, Any]) -> type[DeclaredFault]:
        """Return the class that parses a table."""
        return fitting(table, cls) if cls is DeclaredFault else cls


class _AnyKind(DeclaredFault):
    model_config = ConfigDict(extra="ignore")

    def contradictions(self) -> Iterator[tuple[str, str]]:
        yield from ()


class FaultOfSensors(DeclaredFault):
    """Kind that affects one named sensor or all of a vehicle."""

    BEFALLS = "the sensor"

    sensor: str | None = Field(None, description="name of the sensor; all of the vehicle if absent")

    @property
    def sensor_meant(self) -> str | None:
        return self.sensor

    def of(self, data: VehicleData) -> tuple[str, ...]:
        """Return the names of a vehicle's affected sensors."""
        return tuple(settings.name for settings in data.sensors if self.sensor in (None, settings.name))

    def able(self, database: AUVDatabase, groups: Mapping[str, Group]) -> list[VehicleData]:
        return [data for data in database.values() if self.of(data)]

    def checks(
        self, key: str, scenario: Scenario, mission: type[Mission], before: Sequence[tuple[str, DeclaredFault]]
    ) -> Iterator[ConfigurationFault]:
        is_any, group = self.vehicle == ANY, self.vehicle.removeprefix(HEAD_OF)
        heads = [(t.name, t.head.name) for t in scenario.group if t.name == group and t.head is not None]
        meant = [
            t for t in scenario.vehicle if is_any or t.name == self.vehicle or any(t.can_play(*head) for head in heads)
        ]
        default = next(iter(mission.sensors), "")
        has = list(dict.fromkeys(name for t in meant for name in t.sensor_names(default)))
        if not has and (meant or is_any):
            allowed = "no vehicle has a sensor" if is_any else "has no sensor that could fail"
            yield ConfigurationFault(f"{key}.vehicle", "", allowed)
        elif has:
            yield from one_of(f"{key}.sensor", self.sensor, has)


# Kinds ------------------------------------------------------------------------------------------


def kind_named(name: str) -> type[DeclaredFault]:
    """Return a shipped or plug-in (``package.module:Class``) kind, or raise PluginError."""
    kind: type[DeclaredFault] = known_or_named("fault", name, kinds(), "package.module:Class")
    if name not in kinds():
        refuse_other(kind, DeclaredFault, "remoras.DeclaredFault")
        refuse("a fault kind", kind.faults_of_kind())
    return kind


def fitting(table: Mapping[str, Any], otherwise: type[DeclaredFault]) -> type[DeclaredFault]:
    """Return the kind that a table names; ``otherwise`` if unknown, which is reported elsewhere."""
    try:
        return kind_named(table["kind"])
    except (KeyError, TypeError, PluginError):
        return otherwise


@cache  # imports all kinds, asked for each unknown key
def users_of_keys() -> dict[str, list[str]]:
    """Return the kinds that use each key not common to all."""
    users: dict[str, list[str]] = {}
    for name, kind in kinds().items():
        for key in kind.own_keys():
            users.setdefault(key, []).append(name)
    return users


# Checks -----------------------------------------------------------------------------------------


def fault_table_faults(scenario: Scenario, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Yield faults of ``[[fault]]`` tables against vehicles and groups."""
    before = dict[tuple[str, str], list[tuple[str, DeclaredFault]]]()
    for number, fault in enumerate(scenario.fault, 1):
        key = f"{KEY}.{number}"
        yield from _whose(key, fault, scenario)
        if fault.span_s is not None:
            yield from scenario.after_end(f"{key}.at_s", fault.span_s[1])
        alike = before.setdefault((fault.kind, fault.vehicle), [])
        asked = partial(fault.checks, key, scenario, mission, tuple(alike))
        yield from own_faults(f"{key}.kind", "checks", asked)
        alike.append((key, fault))


def own_faults(key: str, hook: str, asked: Callable[[], Iterable[ConfigurationFault]]) -> list[ConfigurationFault]:
    """Return the faults reported by a plug-in's hook, or a fault if the hook raises."""
    try:
        faults = list(asked())
    except RAISED as error:
        reason = f"its {hook} must take every scenario whose tables are well-formed, but raised"
        return [ConfigurationFault(key, "", f"{reason} {named_error(error)}")]
    if all(isinstance(fault, ConfigurationFault) for fault in faults):
        return faults
    allowed = f"its {hook} must give missions.errors.ConfigurationFault values, but gave {faults!r}"
    return [ConfigurationFault(key, "", allowed)]


def draw_faults(
    faults: Sequence[DeclaredFault], database: AUVDatabase, groups: Mapping[str, Group]
) -> Iterator[ConfigurationFault]:
    """Yield faults of ``[[fault]]`` tables: kinds that raise, or more draws than able vehicles."""
    for number, fault in enumerate(faults, 1):
        try:
            for data in database.values():
                # A trial with every vehicle finds a failing hook before the run.
                fault.befalling(data, 0.0)
            able = [data.name for data in fault.able(database, groups)]
        except RAISED as error:
            text = str(error) if isinstance(error, PluginError) else f"raised {named_error(error)}"
            yield ConfigurationFault(f"{KEY}.{number}.kind", shown(fault.kind), text)
            continue
        if fault.vehicle == ANY and ANY not in database:
            whom = (ANY, fault.kind, fault.sensor_meant)
            alike = [fault for fault in faults[:number] if (fault.vehicle, fault.kind, fault.sensor_meant) == whom]
            if len(alike) > len(able):
                allowed = f"the {len(alike)} of kind {fault.kind} befall different vehicles, but those with"
                allowed = f"{allowed} {fault.BEFALLS} are {', '.join(able) or 'none'}"
                yield ConfigurationFault(f"{KEY}.{number}.vehicle", f'"{ANY}"', allowed)


def _whose(key: str, fault: DeclaredFault, scenario: Scenario) -> Iterator[ConfigurationFault]:
    vehicle, vehicles = fault.vehicle, scenario.vehicle_names
    if vehicle in vehicles:
        return
    if fault.ABSENCE is Absence.BEFORE and (vehicle == ANY or vehicle.startswith(HEAD_OF)):
        allowed = f"the vehicle that {fault.kind} has to be named: {', '.join(vehicles)}"
        yield ConfigurationFault(f"{key}.vehicle", "", allowed)
    elif vehicle.startswith(HEAD_OF):
        groups, name = {group.name: group for group in scenario.group}, vehicle.removeprefix(HEAD_OF)
        yield from one_of(f"{key}.vehicle", vehicle, [HEAD_OF + group for group in groups])
        if name in groups and groups[name].head is None:
            allowed = f"the group {name} has no role with head = true, so no vehicle leads it"
            yield ConfigurationFault(f"{key}.vehicle", "", allowed)
    elif vehicle != ANY:
        allowed = f"allowed: {', '.join(vehicles)}, {ANY}, {HEAD_OF}GROUP{suggestion(vehicle, vehicles)}"
        yield ConfigurationFault(f"{key}.vehicle", "", allowed)


# Draws --------------------------------------------------------------------------------------------

_SELECTORS = 1 << 16


def drawn(
    faults: Sequence[DeclaredFault], seed: int, database: AUVDatabase, organisation: Organisation, duration_s: float
) -> tuple[Fault, ...]:
    """Return the faults of one run by start; omit those after the mission or their own end."""
    sensors = dict.fromkeys(settings.name for data in database.values() for settings in data.sensors)
    known = {name: number for number, name in enumerate(sensors, 1)}
    counts: Counter[int] = Counter()
    by_start: list[tuple[tuple[float, int, int, float], Fault]] = []
    for declared in faults:
        of_kind = declared.number_of(declared.kind)
        # Keyed by kind, selector and sensor, so that no other fault shifts a draw.
        number = of_kind * _SELECTORS + _selector(declared.vehicle, database, organisation)
        stream = number * _SELECTORS + known.get(declared.sensor_meant or "", 0)
        nth = counts[stream]
        counts[stream] += 1
        at_s = _time_s(declared, seed, stream, nth)
        data = database[_name(declared, seed, stream, nth, database, organisation)]
        fault = declared.befalling(data, at_s)
        if fault.from_s < min(duration_s, fault.until_s):
            by_start.append(((fault.from_s, data.node, of_kind, at_s), fault))
    return tuple(fault for _, fault in sorted(by_start, key=lambda dated: dated[0]))


def _selector(vehicle: str, database: AUVDatabase, organisation: Organisation) -> int:
    if vehicle in database:
        return database[vehicle].node + 1
    return 0 if vehicle == ANY else _SELECTORS // 2 + list(organisation.groups).index(vehicle.removeprefix(HEAD_OF))


def _time_s(fault: DeclaredFault, seed: int, stream: int, nth: int) -> float:
    earliest_s, latest_s = fault.span_s or (0.0, 0.0)
    if fault.rate_per_h is None and earliest_s == latest_s:
        return earliest_s
    share = loss.uniform(seed, loss.FAULTS, stream, nth, 0)
    if fault.rate_per_h is not None:
        # Inverse of the exponential distribution: with one share, a higher rate gives an earlier time.
        return -3600.0 * log1p(-share) / fault.rate_per_h
    return earliest_s + share * (latest_s - earliest_s)


def _name(
    fault: DeclaredFault, seed: int, stream: int, nth: int, database: AUVDatabase, organisation: Organisation
) -> str:
    if fault.vehicle in database:
        return fault.vehicle
    if fault.vehicle != ANY:
        heads = organisation.heads(fault.vehicle.removeprefix(HEAD_OF))
        return min(heads, key=lambda name: database[name].node)
    able = fault.able(database, organisation.groups)
    # One order for all equal faults (draw 0), so that they befall different vehicles.
    order = sorted(able, key=lambda data: loss.uniform(seed, loss.FAULTS, stream, 0, data.node + 1))
    return order[nth].name


def fault_text(fault: Mapping[str, Any]) -> str:
    """Return vehicle, kind and time of a ``[[fault]]`` table.

    >>> fault_text({"kind": "lost", "vehicle": "any", "at_s": [61.0, 303.0]})
    'any vehicle lost between 61 s and 303 s'
    >>> fault_text({"kind": "mute", "vehicle": "AUV01", "at_s": 600.0, "until_s": 900.0})
    'AUV01 mute at 600 s, until 900 s'
    """
    at_s, rate_per_h, until_s = (fault.get(key) for key in ("at_s", "rate_per_h", "until_s"))
    earliest, *latest = at_s if isinstance(at_s, list) else [at_s]
    start = f"at {earliest:g} s" if at_s is not None and not latest else ""
    start += f"between {earliest:g} s and {latest[0]:g} s" if latest else ""
    start += f"{rate_per_h:g} times per hour" if rate_per_h is not None else ""
    end = f", until {until_s:g} s" if until_s is not None else ""
    return f"{fault['vehicle']}{' vehicle' * (fault['vehicle'] == ANY)} {fault['kind']} {start}{end}".rstrip()
