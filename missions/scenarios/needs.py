"""Needs and silence: ``[[need]]``, by which vehicles need an attribute on terms of their own, and ``[[covert]]``."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

from pydantic import Field

from missions.errors import ConfigurationFault
from missions.files import shown
from missions.scenarios.communication import QUEUE_LIMIT, Communication
from missions.scenarios.ontologies import TABLE, TEXTS, words_of
from missions.scenarios.tables import NotNegative, Positive, Raw, Section, entries, names_of, one_of, table_of
from remoras.covert import Covert
from remoras.mission import Mission
from remoras.needs import need_name
from worldmodel import OntologyError, Terms, need_ontology_path

ALL = "all"
"""Every vehicle has the need."""


class NeedTable(Section):
    """One ``[[need]]``."""

    attribute: str = Field(description="attribute of which values are needed")
    of: str = Field("", description="class or instance of which they are needed; all that have the attribute if absent")
    vehicle: str = Field(ALL, description='vehicle that needs them, or "all"')
    priority: int = Field(1, ge=1, le=1000, description="how urgent it is")
    ttl_s: float | None = Field(None, description="age beyond which a value is of no use; none if absent")
    blackout_s: float = Field(0.0, description="least time between two packets of one vehicle with such values")
    queue_limit: int | None = Field(None, description="most such values that wait at a vehicle; no limit if absent")
    newest_first: bool = Field(False, description="the newest value goes first, else the one that has waited longest")
    acknowledged: bool = Field(True, description="told until all who need it are known to hold it, else once")
    from_s: NotNegative = Field(0.0, description="when the vehicle says so; agreed before the mission if 0 or absent")
    until_s: Positive | None = Field(None, description="when the vehicle takes the need back; never if absent")

    def terms(self) -> Terms:
        """The terms of the need."""
        return Terms(
            math.inf if self.ttl_s is None else self.ttl_s,
            self.blackout_s,
            self.queue_limit,
            self.newest_first,
            self.acknowledged,
        )


class CovertTable(Section):
    """One ``[[covert]]``."""

    vehicle: str = Field(description="vehicle that hears but does not send")
    above: int | None = Field(None, ge=0, le=1000, description="it sends what has a higher priority; nothing if absent")
    from_s: NotNegative = Field(0.0, description="when that begins")
    until_s: Positive | None = Field(None, description="when that is over; never if absent")

    def declared(self) -> Covert:
        """The time as a value."""
        return Covert(self.vehicle, self.above, self.from_s, math.inf if self.until_s is None else self.until_s)


class _Named(Protocol):
    @property
    def name(self) -> str: ...


class _Vehicle(_Named, Protocol):
    @property
    def slot(self) -> int: ...


class _Group(_Named, Protocol):
    @property
    def role(self) -> Sequence[_Named]: ...


class _Words(Protocol):
    @property
    def ontology_text(self) -> Any: ...


class _WithNeeds(Protocol):
    @property
    def need(self) -> Sequence[NeedTable]: ...

    @property
    def communication(self) -> Communication: ...

    @property
    def vehicle(self) -> Sequence[_Vehicle]: ...

    @property
    def group(self) -> Sequence[_Group]: ...

    @property
    def rally_point(self) -> Sequence[_Named]: ...

    @property
    def worldmodel(self) -> _Words: ...


def states_needs(scenario: _WithNeeds) -> bool:
    """True if vehicles of a scenario may state needs."""
    return bool(scenario.need) or scenario.communication.needs_per_vehicle > 0


def need_words(scenario: _WithNeeds) -> tuple[Path, ...]:
    """The Turtle file with the words for needs, where vehicles of a scenario may state any."""
    return (need_ontology_path(),) if states_needs(scenario) else ()


def need_names(scenario: _WithNeeds) -> tuple[str, ...]:
    """Names of the needs that the vehicles of a scenario may state: as many for each."""
    if not states_needs(scenario):
        return ()
    most = scenario.communication.needs_per_vehicle + len(scenario.need)
    vehicles = sorted(scenario.vehicle, key=lambda vehicle: vehicle.slot)
    return tuple(need_name(vehicle.name, number + 1) for vehicle in vehicles for number in range(most))


def need_faults(raw: Raw, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Needs of what there is not, or on terms that cannot be served.

    Args:
        raw: the tables as TOML has them.
        mission: whose ontology says what can be needed.
    """
    try:
        tbox = words_of(raw, mission)
    except (OntologyError, OSError):
        return  # reported where the ontology is checked
    attributes = [one.name for one in tbox.attributes]
    for number, table in enumerate(entries(raw, "need"), 1):
        key = f"need.{number}"
        yield from one_of(f"{key}.attribute", table.get("attribute"), attributes)
        yield from one_of(f"{key}.vehicle", table.get("vehicle", ALL), [ALL, *names_of(raw, "vehicle")])
        yield from list(_term_faults(key, table)) or _idle_term_faults(raw, key, table)
        yield from _span_faults(raw, key, table)
    for number, table in enumerate(entries(raw, "covert"), 1):
        yield from one_of(f"covert.{number}.vehicle", table.get("vehicle"), names_of(raw, "vehicle"))
        yield from _span_faults(raw, f"covert.{number}", table)
    on_demand = table_of(raw, "communication").get("on_demand")
    for name in on_demand if isinstance(on_demand, list | tuple) else ():
        yield from one_of("communication.on_demand", name, attributes)


def of_faults(scenario: _WithNeeds, made: Mission) -> Iterator[ConfigurationFault]:
    """Needs of classes and instances that there are not.

    Args:
        scenario: whose tables are whole.
        made: the mission, which has instances of its own.
    """
    if not any(table.of for table in scenario.need):
        return
    texts = {TABLE: {TEXTS: scenario.worldmodel.ontology_text}}
    classes = [one.name for one in words_of(texts, type(made)).classes]
    named = [group.name for group in scenario.group]
    named += [f"{group.name}.{role.name}" for group in scenario.group for role in group.role]
    named += [vehicle.name for vehicle in scenario.vehicle] + [rally.name for rally in scenario.rally_point]
    named += [name for _, name in made.instances]
    for number, table in enumerate(scenario.need, 1):
        if table.of:
            for fault in one_of(f"need.{number}.of", table.of, [*classes, *named]):
                yield ConfigurationFault(fault.key, shown(table.of), f"no class or instance; {fault.allowed}")


def _term_faults(key: str, table: Raw) -> Iterator[ConfigurationFault]:
    """Terms that cannot be served."""
    ttl_s, blackout_s, limit = table.get("ttl_s"), table.get("blackout_s", 0.0), table.get("queue_limit")
    if isinstance(ttl_s, int | float) and not ttl_s > 0.0:
        yield ConfigurationFault(f"{key}.ttl_s", shown(ttl_s), "must be above 0: leave it out for no limit")
    elif isinstance(blackout_s, int | float) and blackout_s < 0.0:
        yield ConfigurationFault(f"{key}.blackout_s", shown(blackout_s), "must be 0 or more")
    elif isinstance(ttl_s, int | float) and isinstance(blackout_s, int | float) and blackout_s >= ttl_s:
        allowed = f"must be below ttl_s = {ttl_s:g}, else values expire before they may be said: shorten the blackout"
        yield ConfigurationFault(f"{key}.blackout_s", shown(blackout_s), allowed)
    if isinstance(limit, int) and limit < 1:
        yield ConfigurationFault(f"{key}.queue_limit", shown(limit), "must be 1 or more: leave it out for no limit")


def _idle_term_faults(raw: Raw, key: str, table: Raw) -> Iterator[ConfigurationFault]:
    """Limits on an attribute that all need without any: what serves all needs is what goes out."""
    attribute = table.get("attribute")
    if attribute not in table_of(table_of(raw, "communication"), "needs"):
        return
    limits = [name for name in ("ttl_s", "blackout_s", "queue_limit") if table.get(name)]
    limits += ["acknowledged"] if table.get("acknowledged") is False else []
    allowed = f"limits nothing, for communication.needs lists {attribute}, without limits, for all: take it out there"
    yield from (ConfigurationFault(f"{key}.{name}", shown(table[name]), allowed) for name in limits)


def detail_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """A queue that is never as long as coarse values ask for."""
    communication = table_of(raw, "communication")
    above, limit = communication.get("coarse_above"), communication.get("queue_limit", QUEUE_LIMIT)
    if isinstance(above, int) and isinstance(limit, int) and above >= limit > 0:
        allowed = f"must be below queue_limit = {limit}, or the queue never gets that long"
        yield ConfigurationFault("communication.coarse_above", shown(above), allowed)


def _span_faults(raw: Raw, key: str, table: Raw) -> Iterator[ConfigurationFault]:
    """Times that cannot be."""
    from_s, until_s, end_s = table.get("from_s", 0.0), table.get("until_s"), table_of(raw, "scenario").get("duration_s")
    if isinstance(from_s, int | float) and isinstance(end_s, int | float) and from_s >= end_s:
        allowed = f"must be below scenario.duration_s = {end_s:g}, when the mission is over"
        yield ConfigurationFault(f"{key}.from_s", shown(from_s), allowed)
    if isinstance(from_s, int | float) and isinstance(until_s, int | float) and until_s <= from_s:
        yield ConfigurationFault(f"{key}.until_s", shown(until_s), f"must be above from_s = {from_s:g}")
