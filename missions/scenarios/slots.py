"""Who sends when: ``communication.mac`` and ``slots``, and ``[[slots]]``, by which a person orders another list."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

from pydantic import Field

from exchange.turns import MAX_SLOTS, masks_of
from missions.errors import ConfigurationFault
from missions.files import shown
from missions.scenarios.tables import NotNegative, Raw, Section, entries, list_of, names_of, one_of, table_of
from remoras.slots import NewSlots
from worldmodel import slot_ontology_path

SlotList = tuple[str | tuple[str, ...], ...]
"""Who sends in each slot of a frame: a vehicle, several that share the slot, or "" for a free one."""
KEY = "communication.slots"


class SlotsTable(Section):
    """One ``[[slots]]``."""

    by: str = Field(description="vehicle that says so, told by a person at its console")
    at_s: NotNegative = Field(description="when it says so; whoever hears of it keeps to it from its next frame on")
    order: SlotList = Field(description="slot list, as communication.slots, of as many slots as that")


class _Sending(Protocol):
    """A vehicle."""

    @property
    def name(self) -> str: ...

    @property
    def slot(self) -> int: ...


class _Agreed(Protocol):
    """What the table of the exchange has of slots."""

    @property
    def slots(self) -> SlotList: ...


class _WithSlots(Protocol):
    @property
    def communication(self) -> _Agreed: ...

    @property
    def vehicle(self) -> Sequence[_Sending]: ...

    @property
    def slots(self) -> Sequence[SlotsTable]: ...


def agreed_slots(scenario: _WithSlots) -> tuple[tuple[int, ...], ...]:
    """Nodes of each slot by the list that is agreed before the mission; empty if no list is in use."""
    listed = scenario.communication.slots
    if listed:
        return _nodes(listed, scenario)
    return tuple((node,) for node in range(len(scenario.vehicle))) if scenario.slots else ()


def new_slots(scenario: _WithSlots) -> tuple[NewSlots, ...]:
    """The lists that persons order during the mission."""
    names = _by_node(scenario)
    return tuple(
        NewSlots(
            table.by, table.at_s, tuple(zip(names, masks_of(_nodes(table.order, scenario), len(names)), strict=True))
        )
        for table in scenario.slots
    )


def slot_words(scenario: _WithSlots) -> tuple[Path, ...]:
    """The Turtle file with the word for slot lists, where a scenario orders any during the mission."""
    return (slot_ontology_path(),) if scenario.slots else ()


def _by_node(scenario: _WithSlots) -> list[str]:
    return [vehicle.name for vehicle in sorted(scenario.vehicle, key=lambda one: one.slot)]


def _nodes(listed: SlotList, scenario: _WithSlots) -> tuple[tuple[int, ...], ...]:
    names = _by_node(scenario)
    return tuple(tuple(names.index(name) for name in _shared(entry)) for entry in listed)


def _shared(entry: Any) -> list[Any]:
    """The vehicles of one entry of a list."""
    return [name for name in (list(entry) if isinstance(entry, list | tuple) else [entry]) if name != ""]


def slot_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """Slot lists that leave a vehicle out or name none, and lists where nobody heeds them.

    Args:
        raw: the tables as TOML has them.
    """
    communication, vehicles, given = table_of(raw, "communication"), names_of(raw, "vehicle"), entries(raw, "slots")
    listed, end_s = communication.get("slots"), table_of(raw, "scenario").get("duration_s")
    if communication.get("mac") == "aloha":
        for key in [KEY] if listed is not None else ["slots.1"] if given else []:
            allowed = 'nobody has a slot by communication.mac = "aloha": leave the list out, or mac'
            yield ConfigurationFault(key, shown(listed if listed is not None else given[0].get("order")), allowed)
        if table_of(communication, "clocks").get("discipline") is True:
            allowed = 'must be false by communication.mac = "aloha": arrivals tell nothing where no packet has a slot'
            yield ConfigurationFault("communication.clocks.discipline", "true", allowed)
        return
    if listed is not None:
        yield from _list_faults(KEY, listed, vehicles)
    elif given and len(vehicles) > MAX_SLOTS:
        allowed = f"missing: a list of up to {MAX_SLOTS} slots, which [[slots]] changes; let vehicles far apart share"
        yield ConfigurationFault(KEY, "", allowed)
    n_slots = len(listed) if isinstance(listed, list) else len(vehicles)
    for number, table in enumerate(given, 1):
        key, order, at_s = f"slots.{number}", list_of(table, "order"), table.get("at_s")
        yield from one_of(f"{key}.by", table.get("by"), vehicles)
        if isinstance(at_s, int | float) and isinstance(end_s, int | float) and at_s >= end_s:
            allowed = f"must be below scenario.duration_s = {end_s:g}, when the mission is over"
            yield ConfigurationFault(f"{key}.at_s", shown(at_s), allowed)
        if len(order) != n_slots:
            allowed = (
                f'must have {n_slots} slots, as the list before the mission, so that frames stay alike: "" is free'
            )
            yield ConfigurationFault(f"{key}.order", shown(table.get("order")), allowed)
        else:
            yield from _list_faults(f"{key}.order", order, vehicles)


def _list_faults(key: str, listed: Any, vehicles: list[str]) -> Iterator[ConfigurationFault]:
    """What is wrong with one list."""
    if not isinstance(listed, list):
        return
    if not 2 <= len(listed) <= MAX_SLOTS:
        allowed = f"must have 2 to {MAX_SLOTS} slots; leave it out for one slot each, in the order of the fleet"
        yield ConfigurationFault(key, shown(listed), allowed)
        return
    named = [name for entry in listed for name in _shared(entry)]
    unknown = [name for name in named if isinstance(name, str) and name not in vehicles]
    for name in unknown[:1]:
        yield from one_of(key, name, vehicles)
    missing = [name for name in vehicles if name not in named]
    n_free = sum(not _shared(entry) for entry in listed)
    if len(missing) > n_free and not unknown:
        allowed = (
            f'leaves out {", ".join(missing)} with {n_free} free slots: list them, or add a free slot "" for each, '
            "which they find by listening"
        )
        yield ConfigurationFault(key, shown(listed), allowed)
