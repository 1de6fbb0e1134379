"""Slot lists: ``communication.slots``, who sends when, and ``[[slots]]``, by which a person orders another list.

The vehicle that a person tells states a list as facts, one for each vehicle. What comes of it is decided by every
vehicle for itself, from what it has heard; see ``exchange.peering.turns``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pydantic import Field

from exchange.peering.turns import MAX_SLOTS, SENDS_IN, masks_of
from missions.errors import ConfigurationFault
from missions.feature import Draws, Feature, Joining, Trial
from missions.files import shown
from missions.scenarios.tables import NotNegative, Raw, Section, entries, list_of, names_of, one_of, table_of
from remoras.events import Host, Part, Says, say_at
from worldmodel import ontology_path

if TYPE_CHECKING:
    from pathlib import Path

    from missions.scenarios.scenario import Scenario
    from remoras.beliefs import Beliefs, Fact
    from remoras.mission import Mission

SlotList = tuple[str | tuple[str, ...], ...]
"""Who sends in each slot of a frame: a vehicle, several that share the slot, or "" for a free one."""
ORDERED = "slots"
KEY = "communication.slots"
UNSAID = ("slots not said", "their speaker is away")


class SlotsTable(Section):
    """One ``[[slots]]``."""

    by: str = Field(description="vehicle that says so, told by a person at its console")
    at_s: NotNegative = Field(description="when it says so; whoever hears of it keeps to it from its next frame on")
    order: SlotList = Field(description="slot list, as communication.slots, of as many slots as that")


def turns_of(scenario: Scenario) -> tuple[tuple[int, ...], ...]:
    """Nodes of each slot by the list that is agreed before the mission; empty if no list is in use."""
    listed: SlotList = scenario.communication.of_feature("slots")
    if listed:
        return _nodes(listed, scenario)
    return tuple((node,) for node in range(len(scenario.vehicle))) if scenario.of_feature(ORDERED) else ()


def part_of(joining: Joining) -> Part | None:
    """Let vehicles say the lists that persons order, at their times."""
    scenario = joining.scenario
    tables: tuple[SlotsTable, ...] = scenario.of_feature(ORDERED)
    names = scenario.names_by_slot

    def begin(host: Host) -> None:
        for table in tables:
            masks = tuple(zip(names, masks_of(_nodes(table.order, scenario), len(names)), strict=True))

            def facts(beliefs: Beliefs, masks: tuple[tuple[str, int], ...] = masks) -> list[Fact]:
                return [beliefs.fact(vehicle, SENDS_IN, mask) for vehicle, mask in masks]

            say_at(host, table.at_s, Says(table.by, facts, UNSAID))

    return Part(begin) if tables else None


def words(scenario: Scenario) -> Sequence[Path]:
    """The Turtle file with the word for slot lists, where a scenario orders any during the mission."""
    return (ontology_path("slots"),) if scenario.of_feature(ORDERED) else ()


def _nodes(listed: SlotList, scenario: Scenario) -> tuple[tuple[int, ...], ...]:
    names = scenario.names_by_slot
    return tuple(tuple(names.index(name) for name in _shared(entry)) for entry in listed)


def _shared(entry: Any) -> list[Any]:
    """The vehicles of one entry of a list."""
    return [name for name in (list(entry) if isinstance(entry, list | tuple) else [entry]) if name != ""]


def slot_faults(raw: Raw, mission: type[Mission] | None) -> Iterator[ConfigurationFault]:
    """Slot lists that leave a vehicle out or name none, and lists where nobody heeds them."""
    communication, vehicles, given = table_of(raw, "communication"), names_of(raw, "vehicle"), entries(raw, "slots")
    listed, end_s = communication.get("slots"), table_of(raw, "scenario").get("duration_s")
    if communication.get("mac") == "aloha":
        for key in [KEY] if listed is not None else ["slots.1"] if given else []:
            allowed = 'nobody has a slot by communication.mac = "aloha": leave the list out, or mac'
            yield ConfigurationFault(key, shown(listed if listed is not None else given[0].get("order")), allowed)
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


def drawn(draws: Draws, scenario: Scenario) -> Mapping[str, Any]:
    """Another order of the slots, with free ones and double ones."""
    names = scenario.names_by_slot
    listed = draws.some_of(names, len(names))
    for _ in range(int(draws.uniform() * 3)):
        listed.insert(int(draws.uniform() * len(listed)), draws.one_of(("", draws.one_of(names))))
    return {KEY: listed}


FEATURE = Feature(
    {
        "": {ORDERED: (tuple[SlotsTable, ...], ())},
        "communication": {
            "slots": (
                SlotList,
                Field(
                    (),
                    description='who sends in each slot of a frame: a vehicle, a list of those that share it, or "" '
                    "for free; one slot each, in the order of the fleet, if absent",
                ),
            )
        },
    },
    part_of,
    slot_faults,
    words,
    (SENDS_IN,),
    turns_of,
    trials=(Trial("slots", "another order, free slots, slots twice", (KEY,), drawn),),
)
