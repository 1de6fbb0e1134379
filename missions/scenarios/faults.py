"""The tables ``[[fault]]``: what befalls which vehicle, and when; what has to hold between them and the fleet."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from missions.errors import ConfigurationFault
from missions.files import shown
from missions.scenarios.abilities import can_play
from missions.scenarios.ontologies import words_of
from missions.scenarios.tables import PointM, Positive, Raw, Sparse, entries, names_of, one_of, table_of
from remoras.database import AUVDatabase
from remoras.faults import ANY, HEAD_OF, OF_SENSORS, SLOW_FACTOR, Bias, DeclaredFault, FaultKind, able_to_work
from remoras.mission import Mission
from remoras.organisation import Group
from worldmodel import OntologyError, suggestion

A_TIME = "a number of seconds, 0 or more, or [earliest, latest]"
AN_OFFSET = "a number, or [east, north] for a point"
OF_KIND = {
    "factor": (FaultKind.SLOW,),
    "sensor": OF_SENSORS,
    "attribute": (FaultKind.BIASED,),
    "offset": (FaultKind.BIASED,),
    "memory": (FaultKind.RESTARTS,),
    "drain_w": (FaultKind.DRAINS,),
}
"""Keys that have an effect for some kinds only."""
NOT_OF_JOINS = {
    "rate_per_h": "a vehicle joins at a time: give at_s",
    "until_s": "a vehicle that has joined stays; leave until_s out, or add a fault of kind lost",
}
"""Keys that a vehicle which joins late cannot have, and what to do instead."""
MOST_RESTARTS = 3
"""A vehicle may begin anew so often in a run: packets have names for four of its lives."""


def _is_finite(value: Any) -> bool:
    """True for a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _number(value: Any) -> float | None:
    """A time as a number; None if it is none."""
    return float(value) if _is_finite(value) and value >= 0 else None


def _span_s(value: Any) -> tuple[float, float] | None:
    """Earliest and latest time of ``at_s``; None if it is malformed."""
    if (one := _number(value)) is not None:
        return one, one
    if not isinstance(value, list | tuple) or len(value) != 2:
        return None
    earliest_s, latest_s = map(_number, value)
    return None if earliest_s is None or latest_s is None or earliest_s > latest_s else (earliest_s, latest_s)


def _time(value: Any) -> Any:
    """Refuse what is no time, in one message whatever is wrong with it."""
    if value is not None and _span_s(value) is None:
        raise PydanticCustomError("time", "allowed: " + A_TIME)
    return tuple(value) if isinstance(value, list) else value


def _off(value: Any) -> Any:
    """Refuse what is no offset, in one message whatever is wrong with it."""
    numbers = value if isinstance(value, list | tuple) and len(value) == 2 else [value]
    if value is not None and not all(map(_is_finite, numbers)):
        raise PydanticCustomError("offset", "allowed: " + AN_OFFSET)
    return tuple(value) if isinstance(value, list) else value


class FaultTable(Sparse):
    """One ``[[fault]]``."""

    UNSAID = frozenset({"attribute", "offset", "memory", "drain_w"})

    kind: Literal["lost", "mute", "deaf", "slow", "sensor", "joins", "biased", "restarts", "drains"] = Field(
        description="what befalls the vehicle. lost: it does nothing any more; mute: nobody hears it; deaf: it hears "
        "nobody; slow: its speeds are multiplied by factor; sensor: its sensor yields nothing; joins: it is not there "
        "before at_s; biased: what its sensor reads of attribute is off by offset; restarts: it is off from at_s "
        "on and begins anew at until_s; drains: it loses drain_w beside what it uses"
    )
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
    factor: float | None = Field(
        None, gt=0.0, lt=1.0, description=f"of kind slow: share of its speeds that is left, {SLOW_FACTOR} if absent"
    )
    sensor: str | None = Field(
        None, description="of kinds sensor and biased: name of the sensor; all of the vehicle if absent"
    )
    attribute: str | None = Field(None, description="of kind biased: attribute of the facts that are off")
    offset: Annotated[float | PointM | None, BeforeValidator(_off)] = Field(
        None, description="of kind biased: what is added to a number, or [east, north] to a point"
    )
    memory: Literal["kept", "lost"] | None = Field(
        None,
        description="of kind restarts: whether the vehicle still knows what it knew; lost if absent. It has its roles "
        "and work back from the others",
    )

    drain_w: Positive | None = Field(None, description="of kind drains: power that is lost, W")

    def declared(self) -> DeclaredFault:
        """The fault as a value."""
        return DeclaredFault(
            FaultKind(self.kind),
            self.vehicle,
            _span_s(self.at_s),
            self.rate_per_h,
            math.inf if self.until_s is None else self.until_s,
            SLOW_FACTOR if self.factor is None else self.factor,
            self.sensor,
            self._bias,
            self.memory == "kept",
            self.drain_w or 0.0,
        )

    @property
    def _bias(self) -> Bias | None:
        if FaultKind(self.kind) is not FaultKind.BIASED or self.attribute is None or self.offset is None:
            return None
        return Bias(self.attribute, self.offset if isinstance(self.offset, tuple) else (self.offset,))


def fault_table_faults(raw: Raw, default_sensor: str = "") -> Iterator[ConfigurationFault]:
    """What has to hold within faults, and between them, the vehicles and the groups.

    Args:
        raw: the tables as TOML has them.
        default_sensor: kind of a sensor that names none, by which it is called.
    """
    tables = raw.get("fault")
    numbered = [(f"fault.{n}", one) for n, one in enumerate(tables if isinstance(tables, list) else [], 1)]
    told = [(key, one) for key, one in numbered if isinstance(one, dict)]
    for key, table in told:
        yield from _whose(key, table, raw)
        yield from _when(key, table)
        yield from _too_late(key, table, raw)
        yield from _useless(key, table)
        yield from _sensor(key, table, raw, default_sensor)
    yield from _twice(told)


def draw_faults(
    faults: Sequence[DeclaredFault], database: AUVDatabase, groups: Mapping[str, Group]
) -> Iterator[ConfigurationFault]:
    """More faults of one kind for ``any`` than there are vehicles to draw; called where nothing else is wrong.

    Args:
        faults: of the scenario, in its order.
        database: of all vehicles.
        groups: by name.
    """
    for number, fault in enumerate(faults, 1):
        if fault.vehicle == ANY and ANY not in database:
            alike = [o for o in faults[:number] if (o.vehicle, o.kind, o.sensor) == (ANY, fault.kind, fault.sensor)]
            able = [data.name for data in able_to_work(database, groups, fault)]
            if len(alike) > len(able):
                with_what = "the sensor" if fault.kind in OF_SENSORS else "a sensor or a role with a job"
                allowed = f"the {len(alike)} of kind {fault.kind} befall different vehicles, but those with {with_what}"
                yield ConfigurationFault(
                    f"fault.{number}.vehicle", f'"{ANY}"', f"{allowed} are {', '.join(able) or 'none'}"
                )


def _whose(key: str, table: Raw, raw: Raw) -> Iterator[ConfigurationFault]:
    """A vehicle or a group that there is not."""
    vehicle, vehicles = table.get("vehicle"), names_of(raw, "vehicle")
    if not isinstance(vehicle, str) or vehicle in vehicles:
        return
    if table.get("kind") == FaultKind.JOINS and (vehicle == ANY or vehicle.startswith(HEAD_OF)):
        allowed = f"the vehicle that joins has to be named: {', '.join(vehicles)}"
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


def _when(key: str, table: Raw) -> Iterator[ConfigurationFault]:
    """Times that contradict each other."""
    timed, rated = "at_s" in table, "rate_per_h" in table
    joins = table.get("kind") == FaultKind.JOINS
    if timed and rated:
        yield ConfigurationFault(f"{key}.rate_per_h", shown(table["rate_per_h"]), "given beside at_s: leave one out")
    elif not (timed or rated):
        allowed = f"missing: {A_TIME}" + ("" if joins else "; or give rate_per_h")
        yield ConfigurationFault(f"{key}.at_s", "", allowed)
    span_s, until_s = _span_s(table.get("at_s")), _number(table.get("until_s"))
    if table.get("kind") == FaultKind.RESTARTS:
        if "until_s" not in table:
            yield ConfigurationFault(f"{key}.until_s", "", "missing: when the vehicle begins anew")
        if rated and not timed:
            yield ConfigurationFault(
                f"{key}.rate_per_h", shown(table["rate_per_h"]), "a vehicle restarts at a time: give at_s"
            )
    if table.get("kind") == FaultKind.DRAINS and "drain_w" not in table:
        yield ConfigurationFault(f"{key}.drain_w", "", "missing: the power that the vehicle loses, above 0 W")
    if joins and span_s is not None and span_s[0] <= 0.0:
        allowed = "must be above 0: a vehicle that is there from the start does not join"
        yield ConfigurationFault(f"{key}.at_s", shown(table["at_s"]), allowed)
    if not joins and span_s is not None and until_s is not None and until_s <= span_s[1]:
        allowed = f"must be above at_s = {shown(table['at_s'])}"
        yield ConfigurationFault(f"{key}.until_s", shown(table["until_s"]), allowed)


def _too_late(key: str, table: Raw, raw: Raw) -> Iterator[ConfigurationFault]:
    """A fault that can never happen, because the mission is over before."""
    end_s, span_s = _number(table_of(raw, "scenario").get("duration_s")), _span_s(table.get("at_s"))
    if end_s is not None and span_s is not None and span_s[1] >= end_s:
        allowed = f"must be below scenario.duration_s = {end_s:g}, when the mission is over"
        yield ConfigurationFault(f"{key}.at_s", shown(table["at_s"]), allowed)


def _useless(key: str, table: Raw) -> Iterator[ConfigurationFault]:
    """Keys that have no effect for the kind."""
    kind = table.get("kind")
    for name, of_kind in OF_KIND.items():
        if name in table and kind in list(FaultKind) and kind not in of_kind:
            allowed = f"not used by kind {kind}, only by {' and '.join(of_kind)}: leave it out"
            yield ConfigurationFault(f"{key}.{name}", shown(table[name]), allowed)
    if kind == FaultKind.JOINS:
        for name, allowed in NOT_OF_JOINS.items():
            if name in table and not (name == "rate_per_h" and "at_s" in table):
                yield ConfigurationFault(f"{key}.{name}", shown(table[name]), allowed)


def _sensor(key: str, table: Raw, raw: Raw, default: str) -> Iterator[ConfigurationFault]:
    """A sensor that no vehicle which is meant has."""
    if table.get("kind") not in OF_SENSORS:
        return
    vehicle, sensor = table.get("vehicle"), table.get("sensor")
    named = [one for one in entries(raw, "vehicle") if one.get("name") == vehicle]
    meant = named or entries(raw, "vehicle")
    if not named and isinstance(vehicle, str) and vehicle.startswith(HEAD_OF):
        group = vehicle.removeprefix(HEAD_OF)
        roles = [role for one in entries(raw, "group") if one.get("name") == group for role in entries(one, "role")]
        heads = [role.get("name") for role in roles if role.get("head") is True]
        meant = [one for one in meant if any(can_play(one, group, head) for head in heads)]
        if not heads:
            return  # reported as what it is
    elif not named and vehicle != ANY:
        return
    has = list(dict.fromkeys(name for one in meant for name in _sensor_names(one, default)))
    if not has:
        allowed = "has no sensor that could fail" if named or vehicle != ANY else "no vehicle has a sensor"
        yield ConfigurationFault(f"{key}.vehicle", shown(vehicle), allowed)
    else:
        yield from one_of(f"{key}.sensor", sensor, has)


def _sensor_names(vehicle: Raw, default: str) -> list[str]:
    given = vehicle.get("sensor")
    tables = [given] if isinstance(given, dict) else entries(vehicle, "sensor")
    return [str(table.get("name") or table.get("type") or default) for table in tables]


def bias_faults(raw: Raw, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """A bias of no attribute, or of one that has no such offset.

    Args:
        raw: the tables as TOML has them.
        mission: class of the mission, whose words there are.
    """
    told = [(n, one) for n, one in enumerate(entries(raw, "fault"), 1) if one.get("kind") == FaultKind.BIASED]
    axes = _axes(raw, mission) if told else {}
    for number, table in told:
        key, attribute, offset = f"fault.{number}", table.get("attribute"), table.get("offset")
        for name, what in (("attribute", "of which attribute readings are off"), ("offset", "by how much")):
            if name not in table:
                yield ConfigurationFault(f"{key}.{name}", "", f"required by kind biased: {what}")
        if attribute is None or not axes:
            continue
        yield from one_of(f"{key}.attribute", attribute, sorted(axes))
        n_given = len(offset) if isinstance(offset, list | tuple) else 1
        if offset is not None and attribute in axes and n_given != axes[attribute]:
            allowed = f"{attribute} is a {'point: [east, north]' if axes[attribute] == 2 else 'number: one number'}"
            yield ConfigurationFault(f"{key}.offset", shown(offset), allowed)


def _axes(raw: Raw, mission: type[Mission]) -> dict[str, int]:
    """Of attributes that are numbers and points, by name: how many numbers each has."""
    try:
        tbox = words_of(raw, mission)
    except (OntologyError, OSError):
        return {}  # reported elsewhere
    return {attribute.name: len(attribute.fields) for attribute in tbox.attributes if attribute.fields}


def _twice(told: Sequence[tuple[str, Raw]]) -> Iterator[ConfigurationFault]:
    """A vehicle that joins twice, or may be lost again before it has come back."""
    for number, (key, table) in enumerate(told):
        kind, vehicle = table.get("kind"), table.get("vehicle")
        if kind == FaultKind.RESTARTS and isinstance(vehicle, str):
            yield from _restarts(key, table, [one for _, one in told[:number]])
        if kind not in (FaultKind.LOST, FaultKind.JOINS) or not isinstance(vehicle, str) or vehicle == ANY:
            continue
        for other_key, other in told[:number]:
            if (other.get("kind"), other.get("vehicle")) != (kind, vehicle):
                continue
            if kind == FaultKind.JOINS:
                allowed = f"joins twice, here and by {other_key}: leave one out"
            elif _overlap(table, other):
                allowed = f"lost twice, here and by {other_key}; the first has to end by its until_s before the other"
            else:
                continue
            yield ConfigurationFault(f"{key}.vehicle", f'"{vehicle}"', allowed)
            break


def _restarts(key: str, table: Raw, before: Sequence[Raw]) -> Iterator[ConfigurationFault]:
    """A vehicle that restarts too often, or while it is off."""
    vehicle = table.get("vehicle")
    others = [one for one in before if (one.get("kind"), one.get("vehicle")) == (FaultKind.RESTARTS, vehicle)]
    if len(others) >= MOST_RESTARTS:
        allowed = f"restarts for the {len(others) + 1}th time: {MOST_RESTARTS} times are allowed in a run"
        yield ConfigurationFault(f"{key}.vehicle", f'"{vehicle}"', allowed)
    elif any(_overlap(table, one) for one in others):
        allowed = "restarts while it is off already; one has to be over by its until_s before the other"
        yield ConfigurationFault(f"{key}.vehicle", f'"{vehicle}"', allowed)


def _overlap(one: Raw, other: Raw) -> bool:
    """True if both faults may hold at one time."""
    (from_s, until_s), (other_from_s, other_until_s) = _longest_s(one), _longest_s(other)
    return from_s < other_until_s and other_from_s < until_s


def _longest_s(table: Raw) -> tuple[float, float]:
    """From when to when the fault holds at most."""
    span_s, until_s = _span_s(table.get("at_s")), _number(table.get("until_s"))
    return (0.0 if span_s is None else span_s[0]), (math.inf if until_s is None else until_s)
