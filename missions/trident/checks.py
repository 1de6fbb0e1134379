"""What has to hold between the tables of this mission; malformed tables are passed over, as everywhere."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from typing import Any

from missions.errors import ConfigurationFault
from missions.scenarios.abilities import sensor_tables
from missions.scenarios.ontologies import words_of
from missions.scenarios.tables import (
    Raw,
    entries,
    list_of,
    names_of,
    one_of,
    outside_faults,
    point_of,
    table_of,
)
from missions.trident.choreography import unsound
from missions.trident.services import CHOOSE, SURVEY
from remoras.mission import Mission
from worldmodel import Instance, Keeping, OntologyError, PropertyValue, TBox, WorldModel

SERVICE = "Service"
MOST_TILES = 1024
"""Tiles of one block that ``chartedTile`` can name."""


def trident_faults(raw: Raw, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """All faults of blocks, of the target, of services and of the choreography."""
    yield from _blocks(raw)
    target_m = [("recovery.target_m", at_m) for at_m in point_of(table_of(raw, "recovery"), "target_m")]
    stands_m = [("transponder.position_m", at_m) for at_m in point_of(table_of(raw, "transponder"), "position_m")]
    yield from outside_faults(raw, target_m + stands_m)
    try:
        tbox = words_of(raw, mission)
    except (OntologyError, OSError):
        return  # reported elsewhere
    yield from _services(raw, tbox)
    yield from _choreography(raw, tbox)


def _blocks(raw: Raw) -> Iterator[ConfigurationFault]:
    """Blocks without width, outside the world, of too many tiles, upon each other, or with names used elsewhere."""
    boxes: list[tuple[str, tuple[float, float, float, float]]] = []
    taken = Counter(name for kind in ("vehicle", "group", "rally_point", "block") for name in names_of(raw, kind))
    taken.update([table_of(raw, "recovery").get("name", "recovery")])
    tile_m = table_of(raw, "mission").get("tile_m", 20.0)
    for block in entries(raw, "block"):
        key, name = f"block.{block.get('name')}", str(block.get("name"))
        if taken[name] > 1:
            yield ConfigurationFault(f"{key}.name", f'"{name}"', "used twice; blocks need names of their own")
        spans = [point_of(block, side) for side in ("x_m", "y_m")]
        if not all(spans):
            continue
        (west, east), (south, north) = spans[0][0], spans[1][0]
        for side, low, high in (("x_m", west, east), ("y_m", south, north)):
            if low >= high:
                yield ConfigurationFault(f"{key}.{side}", f"[{low}, {high}]", "allowed: the smaller border first")
        corners = [(f"{key}.x_m, y_m", corner) for corner in ((west, south), (east, north))]
        yield from outside_faults(raw, corners)
        if (
            isinstance(tile_m, int | float)
            and tile_m > 0.0
            and (east - west) * (north - south) / (tile_m * tile_m) > MOST_TILES
        ):
            yield ConfigurationFault(key, "", f"more than {MOST_TILES} tiles; allowed: a greater mission.tile_m")
        for other, (w, s, e, n) in boxes:
            if west < e and w < east and south < n and s < north:
                yield ConfigurationFault(key, "", f"overlaps block {other}; allowed: blocks side by side")
        boxes.append((name, (west, south, east, north)))


# Services


def _modules(raw: Raw) -> dict[str, tuple[Raw, Raw]]:
    """Vehicle and module of every service that is offered, by its name."""
    return {
        f"{vehicle.get('name')} {table.get('name') or table.get('type')}": (vehicle, table)
        for vehicle in entries(raw, "vehicle")
        for table in sensor_tables(vehicle)
        if "capability" in table
    }


def _services(raw: Raw, tbox: TBox) -> Iterator[ConfigurationFault]:
    """Capabilities that are none, activities for which nobody offers a service, and services that nobody has."""
    modules, named = _modules(raw), {ontology_class.name: ontology_class.uid for ontology_class in tbox.classes}
    kinds = sorted(tbox.classes[uid].name for uid in tbox.subclasses(named[SERVICE]))
    for name, (vehicle, table) in modules.items():
        module = name.removeprefix(f"{vehicle.get('name')} ")
        yield from one_of(f"vehicle.{vehicle.get('name')}.sensor.{module}.capability", table.get("capability"), kinds)
    offered = {name: _concluded(tbox, vehicle, table) for name, (vehicle, table) in modules.items()}
    for activity, table in table_of(raw, "activity").items():
        if not isinstance(table, dict):
            continue
        key, requires = f"activity.{activity}", table.get("requires")
        yield from one_of(f"{key}.requires", requires, kinds)
        able = [name for name, classes in offered.items() if requires in classes]
        if requires in kinds and not able:
            allowed = "a service that nobody offers; allowed: " + ", ".join(sorted(set().union(*offered.values())))
            yield ConfigurationFault(f"{key}.requires", f'"{requires}"', allowed)
        if activity != SURVEY:
            yield from _named(key, table, able)
        if activity == CHOOSE:
            for name in able:
                if modules[name][1].get("self_test") is False:
                    carrier = modules[name][0].get("name")
                    key = f"vehicle.{carrier}.sensor.{name.removeprefix(f'{carrier} ')}"
                    allowed = f"{name} makes choices, so it has to tell whether it works; allowed: self_test = true"
                    yield ConfigurationFault(f"{key}.self_test", "false", allowed)
    requires = table_of(table_of(raw, "activity"), SURVEY).get("requires")
    for block in entries(raw, "block"):
        able = [name for name, classes in offered.items() if requires in classes]
        yield from _named(f"block.{block.get('name')}", block, able)


def _named(key: str, table: Raw, able: Collection[str]) -> Iterator[ConfigurationFault]:
    """Services that the plan has for an activity, and that are not able to do it; that none is, is told elsewhere."""
    if not able:
        return
    if "service" not in table:
        yield ConfigurationFault(f"{key}.service", "", f"is missing; allowed: {', '.join(able)}")
    for where, given in [("service", table.get("service")), *(("spare", spare) for spare in list_of(table, "spare"))]:
        yield from one_of(f"{key}.{where}", given, sorted(able))


def _concluded(tbox: TBox, vehicle: Raw, table: Raw) -> frozenset[str]:
    """Classes that a service is of: as it is advertised, and as follows from who provides it and that it works."""
    named = {ontology_class.name: ontology_class.uid for ontology_class in tbox.classes}
    of_class, kind = named.get(str(table.get("capability"))), named.get(str(vehicle.get("vehicle_type")))
    if of_class is None or kind is None:
        return frozenset()
    instances = [Instance(0, kind, "vehicle"), Instance(1, of_class, "service")]
    provided = PropertyValue(1, tbox.attribute_named("providedBy").uid, 0)
    model = WorldModel(
        tbox, 0, instances, n_origins=1, run_time_instances_per_origin=0, keeping=Keeping(common_facts=[provided])
    )
    seen, above = model.inference.classes(1), named[SERVICE]
    return frozenset(
        ontology_class.name
        for ontology_class in tbox.classes
        if seen >> ontology_class.uid & 1 and ontology_class.uid != above
    )


# The choreography


def _choreography(raw: Raw, tbox: TBox) -> Iterator[ConfigurationFault]:
    """States that cannot be reached or left, and messages between states, of facts or vehicles that there are not."""
    table = table_of(raw, "choreography")
    states, messages = names_of(table, "state"), entries(table, "message")
    for name, count in Counter(states).items():
        if count > 1:
            yield ConfigurationFault(f"choreography.state.{name}", "", f"listed {count} times; allowed: once")
    attributes = {attribute.name: attribute for attribute in tbox.attributes}
    needs = list(table_of(table_of(raw, "communication"), "needs"))
    roles = [role for group in entries(raw, "group") for role in names_of(group, "role")]
    speakers = list(dict.fromkeys([*names_of(raw, "vehicle"), *roles]))
    is_whole = True
    for number, one in enumerate(messages, 1):
        key = f"choreography.message.{number}"
        found: list[ConfigurationFault] = [
            *one_of(f"{key}.state", one.get("state"), states),
            *one_of(f"{key}.to", one.get("to"), states),
            *one_of(f"{key}.says", one.get("says"), [name for name in needs if name in attributes]),
            *(one_of(f"{key}.by", one["by"], speakers) if one.get("by") else ()),
            *_value(key, one, attributes.get(str(one.get("says")))),
        ]
        is_whole = is_whole and not found
        yield from found
    if states and is_whole:
        final = [str(entry.get("name")) for entry in entries(table, "state") if entry.get("final") is True]
        arrows = [(str(message.get("state")), str(message.get("to"))) for message in messages]
        for state, wrong in unsound(states, final, arrows):
            yield ConfigurationFault(f"choreography.state.{state}", "", wrong)


def _value(key: str, message: Raw, attribute: Any) -> Iterator[ConfigurationFault]:
    """A symbol that the attribute has not."""
    if attribute is not None and attribute.symbols and message.get("value"):
        yield from one_of(f"{key}.value", message["value"], attribute.symbols)
