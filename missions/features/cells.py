"""Cells: ``[[cell]]``, ``[[gateway]]`` and ``[cells]``, by which a large fleet shares the slots of one sea.

As in a cellular network, a fleet falls into cells. Each cell is a fleet of at most 10 vehicles with a schedule, a
channel, a codec and node numbers of its own; what it costs does not depend on how many others there are. A slot of a
cell is open for all colours in turn, and the cell sends in the turn of its colour. Cells within interference range have
different colours; those of one colour speak at once, and a packet of one is noise to vehicles of another whom it still
reaches.

A gateway is one vehicle with an address, a name and a node of its own, in each of two cells. Its first address acts;
the second is where the first is, speaks and hears. What it knows in one cell of the jobs of the mission it passes on in
the other, as a block of the vehicle that observed it: same origin, epoch, sequence and time. In a cell the numbers of
such origins follow those of the nodes, and for each of them one node speaks: the gateway through which it is heard.

No fact goes round in circles, and none is told twice as news: cells and gateways form a tree, so there is one way from
a cell to another; a block has the same name everywhere, so nobody takes it in twice; and it passes at most ``hops``
gateways, counted from the cell of its origin, which all know beforehand. Acknowledgements concern the cell in which
they are given: nobody believes anything of what vehicles of other cells hold.

A cell is led from within: a group, its roles and its jobs belong to one cell. What belongs to whom follows from names:
of a list of tables a cell has those that name its own vehicles and groups alone, the jobs of its roles, and the rally
points of its groups.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, Field

from exchange.acoustics import loss
from missions.errors import ConfigurationFault
from missions.feature import ALONE, Common, Feature, Neighbourhood, Yard
from missions.files import shown
from missions.scenarios.deployment import deployment_of, scenario_sound_speed_mps
from missions.scenarios.extending import place_error_m, used_in
from missions.scenarios.guard import guard_s
from missions.scenarios.tables import (
    Name,
    PointM,
    Raw,
    Section,
    Sparse,
    entries,
    list_of,
    names_of,
    one_of,
    table_of,
)
from remoras.events import Part
from remoras.faults import SOUND
from remoras.separation import Box, boxes_apart_m
from worldmodel import Instance, PropertyValue, ValueKind

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario, VehicleTable
    from remoras.database import VehicleData
    from remoras.faults import Fault
    from remoras.fleet import Fleet
    from remoras.flotilla import Flotilla
    from remoras.mission import Mission
    from remoras.recorder import Recorder
    from remoras.social.agreement import Agreement
    from remoras.strategy import Strategy
    from remoras.vehicle import Vehicle
    from worldmodel import TBox

KEY, CELL, GATEWAY = "cells", "cell", "gateway"
MOST = 10
"""Vehicles of a cell, gateways among them: one for each slot."""
LARGEST = 1200
"""Vehicles of all cells together, second addresses among them."""
TIMES_RANGE = 2.0
"""A packet is noise up to so many times the range in which it can be read, if a scenario does not say how far."""
JOB = "Job"
"""Class of the core ontology; gateways pass on what is known of jobs."""


class CellTable(Sparse):
    """One ``[[cell]]``."""

    UNSAID = frozenset({"x_m", "y_m", "colour"})

    name: Name = Field(description="name of the cell")
    vehicles: tuple[str, ...] = Field(min_length=2, description="its vehicles, each in one cell")
    groups: tuple[str, ...] = Field((), description="its groups, each in one cell; their jobs are done here")
    x_m: PointM | None = Field(None, description="west and east border of its waters; those of the world if absent")
    y_m: PointM | None = Field(None, description="south and north border of its waters; those of the world if absent")
    colour: int | None = Field(
        None, ge=0, lt=LARGEST, description="turn in which it sends in every slot; the first that is free if absent"
    )


class GatewayTable(Section):
    """One ``[[gateway]]``."""

    vehicles: tuple[str, str] = Field(
        description="the two addresses of one vehicle, of two cells; the second plays no role and has no sensor"
    )


class CellsTable(Section):
    """The table ``[cells]``."""

    relays: tuple[str, ...] = Field((), description="attributes of jobs that gateways pass on")
    hops: int = Field(2, ge=1, le=LARGEST, description="gateways that a fact passes at most")
    interference_m: float | None = Field(
        None,
        gt=0.0,
        le=1e6,
        description="how far a packet is noise: nearer cells have different colours; twice the range if absent",
    )


# What a scenario says of cells ---------------------------------------------------------------------


def cell_faults(raw: Raw, mission: type[Mission] | None) -> Iterator[ConfigurationFault]:
    """Vehicles and groups that are in no cell or several, too many in one, and gateways that join nothing."""
    tables, vehicles = entries(raw, CELL), names_of(raw, "vehicle")
    if not tables:
        key = KEY if table_of(raw, KEY) else GATEWAY
        yield ConfigurationFault(key, "", "there are no cells: list them as [[cell]], or leave this out")
        return
    for name, count in Counter(names_of(raw, CELL)).items():
        if count > 1:
            yield ConfigurationFault(f"cell.{name}.name", shown(name), f"used {count} times; give each its own")
    cells_of = _owners(tables, "vehicles")
    for table in tables:
        key, listed = f"cell.{table.get('name')}", list_of(table, "vehicles")
        for name in listed:
            yield from one_of(f"{key}.vehicles", name, vehicles)
        for name in list_of(table, "groups"):
            yield from one_of(f"{key}.groups", name, names_of(raw, "group"))
        if len(listed) > MOST:
            allowed = f"{len(listed)} vehicles for {MOST} slots; make two cells of it, with a gateway between them"
            yield ConfigurationFault(f"{key}.vehicles", "", allowed)
    for name in vehicles:
        of = cells_of.get(name, [])
        if not of:
            allowed = "is in no cell: list it in vehicles of one"
            yield ConfigurationFault(f"vehicle.{name}", "", allowed)
        elif len(of) > 1:
            allowed = (
                f"is in {' and '.join(of)}: a vehicle has one cell; let a gateway have a second address, another "
                f"[[vehicle]] without roles and sensors: [[gateway]] vehicles = [{shown(name)}, that one]"
            )
            yield ConfigurationFault(f"cell.{of[1]}.vehicles", shown(name), allowed)
    for name in names_of(raw, "group"):
        of = _owners(tables, "groups").get(name, [])
        if len(of) != 1:
            where = f"is in {' and '.join(of)}" if of else "is in no cell"
            yield ConfigurationFault(f"group.{name}", "", f"{where}: list it in groups of the one that it works in")
    yield from _setting_faults(raw)
    yield from _gateway_faults(raw, {name: of[0] for name, of in cells_of.items()}, vehicles)


def _setting_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """What cells do not go with."""
    if table_of(raw, "communication").get("mac") == "aloha":
        yield ConfigurationFault("communication.mac", '"aloha"', 'cells send in turns: allowed: "tdma"')
    if table_of(raw, "communication").get("key_file"):
        yield ConfigurationFault("communication.key_file", "", "cells send in clear: leave it out")
    if table_of(raw, "scenario").get("settle_s"):
        allowed = "the exchange of cells ends with the mission: allowed: 0, or leave it out"
        yield ConfigurationFault("scenario.settle_s", shown(table_of(raw, "scenario")["settle_s"]), allowed)


def _owners(tables: Iterable[Raw], key: str) -> dict[str, list[str]]:
    """Names of the cells that list each name below a key."""
    found: dict[str, list[str]] = {}
    for table in tables:
        for name in list_of(table, key):
            if isinstance(name, str):
                found.setdefault(name, []).append(str(table.get("name")))
    return found


def _gateway_faults(raw: Raw, cell_of: Mapping[str, str], vehicles: Sequence[str]) -> Iterator[ConfigurationFault]:
    """Gateways within one cell, between cells that are joined already, and addresses that do what they cannot do."""
    joined = {name: name for name in names_of(raw, CELL)}  # by cell, one that it is joined with
    tables = {str(vehicle.get("name")): vehicle for vehicle in entries(raw, "vehicle")}
    said: set[str] = set()

    def root(cell: str) -> str:
        while joined[cell] != cell:
            cell = joined[cell]
        return cell

    for number, table in enumerate(entries(raw, GATEWAY), 1):
        key, pair = f"gateway.{number}.vehicles", list_of(table, "vehicles")
        if len(pair) != 2 or not all(isinstance(name, str) for name in pair):
            continue  # reported as what it is
        unknown = [fault for name in pair for fault in one_of(key, name, vehicles)]
        yield from unknown
        if unknown or not all(name in cell_of for name in pair):
            continue
        if again := said & set(pair):
            yield ConfigurationFault(key, shown(pair), f"{min(again)} is a gateway already: it joins two cells alone")
        said |= set(pair)
        one, other = (cell_of[name] for name in pair)
        if one == other:
            allowed = f"is in one cell only, {one}: its second address has to be in another, which it joins with this"
            yield ConfigurationFault(key, shown(pair), allowed)
        elif root(one) == root(other):
            allowed = f"{one} and {other} are joined already, and facts would go round: take a gateway away"
            yield ConfigurationFault(key, shown(pair), allowed)
        else:
            joined[root(one)] = root(other)
        second = tables[pair[1]]
        for idle in ("playable_roles", "sensor"):
            if second.get(idle, [] if idle == "sensor" else None) not in ([], ()):
                allowed = f"is the second address of {pair[0]}, which acts: allowed: {idle} = []"
                yield ConfigurationFault(f"vehicle.{pair[1]}.{idle}", "", allowed)
        for at, fault in enumerate(entries(raw, "fault"), 1):
            if fault.get("vehicle") == pair[1]:
                allowed = f'is the second address of a gateway: allowed: "{pair[0]}", whatever befalls it befalls both'
                yield ConfigurationFault(f"fault.{at}.vehicle", shown(pair[1]), allowed)


def coloured(near: Sequence[Iterable[int]], given: Sequence[int | None]) -> list[int]:
    """Colours such that none has that of one near it: the first that is free, for each in turn (greedy colouring).

    >>> coloured([[1], [0, 2], [1]], [None, None, None])
    [0, 1, 0]

    Args:
        near: those near each; given: colours that are fixed.
    """
    colours = list(given)
    for number, colour in enumerate(colours):
        if colour is None:
            taken = {colours[other] for other in near[number]}
            colours[number] = next(free for free in range(len(colours) + 1) if free not in taken)
    return [colour for colour in colours if colour is not None]


@dataclass(frozen=True)
class Plan:
    """How a scenario falls into cells.

    Attributes:
        scenario: the whole input.
    """

    scenario: Scenario

    @cached_property
    def cells(self) -> tuple[CellTable, ...]:
        """The cells, by number."""
        found: tuple[CellTable, ...] = self.scenario.of_feature(CELL)
        return found

    @cached_property
    def table(self) -> CellsTable:
        """What holds for all of them."""
        return self.scenario.of_feature(KEY) or CellsTable()

    @cached_property
    def cell_of(self) -> dict[str, int]:
        """Number of the cell of each vehicle."""
        return {name: number for number, cell in enumerate(self.cells) for name in cell.vehicles}

    @cached_property
    def members(self) -> tuple[tuple[VehicleTable, ...], ...]:
        """Vehicles of each cell; their place in it is their slot, and their node."""
        by_slot = sorted(self.scenario.vehicle, key=lambda vehicle: vehicle.slot)
        return tuple(
            tuple(vehicle for vehicle in by_slot if self.cell_of[vehicle.name] == number)
            for number in range(len(self.cells))
        )

    @cached_property
    def places(self) -> dict[str, tuple[int, int]]:
        """Cell and node of each vehicle."""
        of_all = enumerate(self.members)
        return {vehicle.name: (number, node) for number, of in of_all for node, vehicle in enumerate(of)}

    @cached_property
    def gateways(self) -> tuple[tuple[str, str], ...]:
        """First and second address of each gateway."""
        tables: tuple[GatewayTable, ...] = self.scenario.of_feature(GATEWAY)
        return tuple(table.vehicles for table in tables)

    @cached_property
    def first_of(self) -> dict[str, str]:
        """First address of each second one."""
        return {second: first for first, second in self.gateways}

    @cached_property
    def ways(self) -> tuple[tuple[dict[int, str], ...], tuple[dict[int, int], ...]]:
        """For each cell, by the number of each that it is joined with: the address here by which it is heard, and the
        gateways on the way."""
        beside: list[dict[int, str]] = [{} for _ in self.cells]
        for pair in self.gateways:
            one, other = (self.cell_of[name] for name in pair)
            beside[one][other], beside[other][one] = pair
        through: list[dict[int, str]] = []
        far: list[dict[int, int]] = []
        for start in range(len(self.cells)):
            found, hops = dict(beside[start]), dict.fromkeys(beside[start], 1)
            due = deque(found)
            while due:
                cell = due.popleft()
                for beyond in beside[cell] if hops[cell] < self.table.hops else ():
                    if beyond != start and beyond not in found:
                        found[beyond], hops[beyond] = found[cell], hops[cell] + 1
                        due.append(beyond)
            through.append(found)
            far.append(hops)
        return tuple(through), tuple(far)

    # Who disturbs whom ---------------------------------------------------------------------------

    @cached_property
    def interference_m(self) -> float:
        """How far a packet is noise."""
        return self.table.interference_m or TIMES_RANGE * self.scenario.communication.range_m

    def waters(self, number: int) -> Box:
        """Waters of a cell."""
        world, cell = self.scenario.world, self.cells[number]
        (west, east), (south, north) = cell.x_m or world.x_m, cell.y_m or world.y_m
        return west, south, east, north

    @cached_property
    def boxes(self) -> tuple[tuple[Box, ...], ...]:
        """Where vehicles of each cell may send from: its waters, and where the first address of a gateway may be."""
        found: list[list[Box]] = [[self.waters(number)] for number in range(len(self.cells))]
        tables = {vehicle.name: vehicle for vehicle in self.scenario.vehicle}
        for first, second in self.gateways:
            table = tables[first]
            at_m = (*table.start_m, *table.start_m) if not table.playable_roles else self.waters(self.cell_of[first])
            found[self.cell_of[second]].append(at_m)
        return tuple(map(tuple, found))

    def cells_apart_m(self, one: int, other: int) -> float:
        """How near vehicles of two cells may come to each other."""
        return min(boxes_apart_m(a, b) for a in self.boxes[one] for b in self.boxes[other])

    @cached_property
    def near(self) -> tuple[frozenset[int], ...]:
        """For each cell those that must not send while it does: within interference range, or joined by a gateway."""
        found: list[set[int]] = [set() for _ in self.cells]
        for one in range(len(self.cells)):
            for other in range(one):
                if self.cells_apart_m(one, other) <= self.interference_m or self.ways[1][one].get(other) == 1:
                    found[one].add(other)
                    found[other].add(one)
        return tuple(map(frozenset, found))

    @cached_property
    def colours(self) -> list[int]:
        """Colour of each cell."""
        return coloured(self.near, [cell.colour for cell in self.cells])

    # What belongs to whom ------------------------------------------------------------------------

    @cached_property
    def _claimed(self) -> dict[str, set[int]]:
        """Numbers of the cells whose groups name a job or a rally point."""
        number_of = {name: number for number, cell in enumerate(self.cells) for name in cell.groups}
        found: dict[str, set[int]] = {}
        for group in self.scenario.group:
            for name in (group.rally_point, *(role.job for role in group.role)):
                if name is not None:
                    found.setdefault(name, set()).add(number_of[group.name])
        return found

    @cached_property
    def _named(self) -> frozenset[str]:
        """Names by which tables name vehicles and groups."""
        groups = self.scenario.group
        paths = [f"{group.name}.{role.name}" for group in groups for role in group.role]
        heads = [f"head of {group.name}" for group in groups]
        return frozenset([*(v.name for v in self.scenario.vehicle), *(g.name for g in groups), *paths, *heads])

    def _is_of(self, entry: BaseModel, number: int) -> bool:
        """True if a cell has an entry of a list of tables."""
        if (cells := self._claimed.get(getattr(entry, "name", ""))) is not None:
            return number in cells
        cell = self.cells[number]
        own = (*cell.vehicles, *cell.groups)
        named = self._named.intersection(_texts_in(entry.model_dump(mode="json")))
        return all(name.removeprefix("head of ").partition(".")[0] in own for name in named)

    def scenario_of(self, number: int) -> Scenario:
        """The scenario of a cell by itself."""
        whole, cell = self.scenario, self.cells[number]
        groups = tuple(group for group in whole.group if group.name in cell.groups)
        roles = {role.name for group in groups for role in group.role}
        paths = roles | {f"{group.name}.{role.name}" for group in groups for role in group.role}
        of_cell: dict[str, Any] = {CELL: (), GATEWAY: (), KEY: None, "fault": (), "group": groups}
        west, south, east, north = self.waters(number)
        of_cell["vehicle"] = tuple(
            vehicle.model_copy(
                update={
                    "slot": node,
                    "playable_roles": tuple(role for role in vehicle.playable_roles or () if role in paths),
                    "start_m": vehicle.start_m
                    if vehicle.name not in self.first_of  # who is there speaks into the cell from elsewhere
                    else (min(max(vehicle.start_m[0], west), east), min(max(vehicle.start_m[1], south), north)),
                }
            )
            for node, vehicle in enumerate(self.members[number])
        )
        for name in type(whole).model_fields:
            listed = getattr(whole, name)
            if name in of_cell or not isinstance(listed, tuple) or not all(isinstance(e, BaseModel) for e in listed):
                continue
            of_cell[name] = tuple(entry for entry in listed if self._is_of(entry, number))
        of_cell["world"] = whole.world.model_copy(update={"x_m": (west, east), "y_m": (south, north)})
        channel = {
            name: tuple(entry for entry in listed if self._is_of(entry, number))
            for name in ("link", "blackout")
            if (listed := getattr(whole.channel, name, ()))
        }
        own = {vehicle.name for vehicle in self.members[number]}
        cuts = tuple(cut for entry in whole.channel.blackout for cut in entry.among(own))
        if cuts:
            channel["blackout"] = (*(entry for entry in channel["blackout"] if not entry.between), *cuts)
        of_cell["channel"] = whole.channel.model_copy(update=channel)
        if self._turns_s:
            guard = {"guard_s": self._turns_s - self._packet_s}
            of_cell["communication"] = whole.communication.model_copy(update=guard)
        return whole.model_copy(update=of_cell)

    @cached_property
    def _packet_s(self) -> float:
        modem = deployment_of(self.scenario).modem
        return modem.packet_s(modem.payload_bits)

    @cached_property
    def _turn_s(self) -> float:
        """How long a turn takes: the longest packet, and the guard in which it travels (s)."""
        return self._packet_s + guard_s(self.scenario)

    @cached_property
    def _turns_s(self) -> float:
        """How long the turns of all colours take, where there are several (s); else 0."""
        return (1 + max(self.colours)) * self._turn_s if max(self.colours) else 0.0

    def neighbourhood(self, number: int, jobs: Iterable[tuple[str, str]]) -> Neighbourhood:
        """What a cell has to do with the others.

        Args:
            number: of the cell.
            jobs: class and name of what the whole mission has names for.
        """
        if len(self.cells) == 1:
            return ALONE
        through = self.ways[0][number]
        vehicles = [(vehicle, through[cell]) for cell in sorted(through) for vehicle in self.members[cell]]
        beyond, own = self._claimed, {number}
        told_of = tuple(
            (of, name) for of, name in jobs if beyond.get(name, own) != own and beyond[name] & through.keys()
        )
        return Neighbourhood(
            tuple((vehicle.vehicle_type, vehicle.name) for vehicle, _ in vehicles),
            tuple(self.places[speaker][1] for _, speaker in vehicles),
            tuple(one for one in told_of if number not in beyond[one[1]]),
            self.colours[number] * self._turn_s,
        )


def _texts_in(value: Any) -> Iterator[str]:
    """Every text in nested tables and lists."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for entry in value.values() if isinstance(value, dict) else value:
            yield from _texts_in(entry)


def made_faults(scenario: Scenario, made: Mission) -> Iterator[ConfigurationFault]:
    """Cells that would disturb each other, that cannot do their work by themselves, and what cells do not go with."""
    plan = Plan(scenario)
    if len(plan.cells) > 1:
        yield from _water_faults(plan)
        yield from _colour_faults(plan)
    yield from _relay_faults(plan, made)
    used = used_in(scenario)
    unlike = [
        ("several vehicles", "a slot list", any(len(feature.turns(scenario)) for feature in used)),
        ("clocks that differ", "clocks", any(f.apart_s(scenario) or f.ahead_s(scenario) for f in used)),
        ("errors of place", "navigation", place_error_m(scenario, ()) is not None),
        ("finds", "objects", made.instances_found_per_vehicle > 0),
    ]
    for _, what, is_there in unlike:
        if is_there:
            allowed = f"cells do not go with {what} that the scenario has: leave one of them out"
            yield ConfigurationFault(CELL, "", allowed)
            return
    yield from _faults_within(plan, made)


def _water_faults(plan: Plan) -> Iterator[ConfigurationFault]:
    """Waters that are none, or not of this world, and what does not lie in them."""
    world, tables = plan.scenario.world, plan.scenario.rally_point
    rallies = {rally.name: rally.position_m for rally in tables}
    for number, cell in enumerate(plan.cells):
        west, south, east, north = plan.waters(number)
        for key, (low, high), (least, most) in (
            ("x_m", (west, east), world.x_m), ("y_m", (south, north), world.y_m),
        ):  # fmt: skip
            if not least <= low < high <= most:
                allowed = f"allowed: rising, within world.{key} = [{least:g}, {most:g}]"
                yield ConfigurationFault(f"cell.{cell.name}.{key}", shown([low, high]), allowed)
        places = [
            (f"vehicle.{vehicle.name}.start_m", vehicle.start_m)
            for vehicle in plan.members[number]
            if vehicle.name not in plan.first_of
        ]
        places += [
            (f"group.{group.name}.rally_point", rallies[group.rally_point])
            for group in plan.scenario.group
            if group.name in cell.groups and group.rally_point in rallies
        ]
        for key, (x_m, y_m) in places:
            if not (west <= x_m <= east and south <= y_m <= north):
                allowed = (
                    f"outside the waters of cell {cell.name}, x {west:g} to {east:g}, y {south:g} to {north:g}: "
                    "widen cell.x_m and y_m, or list it in another cell"
                )
                yield ConfigurationFault(key, shown([x_m, y_m]), allowed)


def _colour_faults(plan: Plan) -> Iterator[ConfigurationFault]:
    """Cells of one colour that are too near each other, and an interference that ends where packets can be read."""
    range_m = plan.scenario.communication.range_m
    if plan.interference_m < range_m:
        allowed = f"allowed: communication.range_m = {range_m:g} or more: what can be read there is noise as well"
        yield ConfigurationFault("cells.interference_m", f"{plan.interference_m:g}", allowed)
    for one, near in enumerate(plan.near):
        for other in sorted(near):
            cell, before = plan.cells[one], plan.cells[other]
            if other > one or cell.colour is None or plan.colours[one] != plan.colours[other]:
                continue
            joined = ", and a gateway would have to speak in both at once" if plan.ways[1][one].get(other) == 1 else ""
            allowed = (
                f"{before.name} sends at the same time, {plan.cells_apart_m(one, other):.0f} m away with an "
                f"interference of {plan.interference_m:g} m{joined}: give it another colour, or leave it out"
            )
            yield ConfigurationFault(f"cell.{cell.name}.colour", str(cell.colour), allowed)


def _relay_faults(plan: Plan, made: Mission) -> Iterator[ConfigurationFault]:
    """Attributes that are no facts about jobs, or that nobody exchanges."""
    from missions.scenarios.ontologies import words_of

    tbox = words_of(plan.scenario.model_dump(mode="json"), type(made))
    able = [name for name in plan.scenario.communication.needs if _is_of_job(tbox, name)]
    for name in plan.table.relays:
        for fault in one_of("cells.relays", name, able):
            yield replace(fault, allowed=f"gateways pass on what is exchanged of jobs; {fault.allowed}")
    if plan.gateways and not plan.table.relays:
        allowed = f"missing: what gateways pass on; allowed: {', '.join(able)}"
        yield ConfigurationFault("cells.relays", "", allowed)


def _is_of_job(tbox: TBox, name: str) -> bool:
    """True for an attribute of jobs."""
    job = next((of.uid for of in tbox.classes if of.name == JOB), None)
    found = next((attribute for attribute in tbox.attributes if attribute.name == name), None)
    return job is not None and found is not None and tbox.is_a(found.domain, job)


def _faults_within(plan: Plan, made: Mission) -> Iterator[ConfigurationFault]:
    """What is wrong with a cell by itself: roles that nobody in it plays, jobs that others have."""
    from missions.scenarios.checks import cross_faults

    jobs: Counter[str] = Counter()
    for number, cell in enumerate(plan.cells):
        scenario = plan.scenario_of(number)
        raw = scenario.model_dump(mode="json", exclude_none=True)
        found = cross_faults(raw, type(made))
        for fault in found:
            yield replace(fault, allowed=f"{fault.allowed} (within cell {cell.name}, which has to do without others)")
        if found:
            return
        jobs.update(type(made).from_scenario(scenario).jobs.keys())
    for name in made.jobs:
        if jobs[name] != 1:
            allowed = f"{jobs[name]} cells have the job {name}; one has to: that of the group with a role for it"
            yield ConfigurationFault(CELL, "", allowed)
            return


# The setup of all ----------------------------------------------------------------------------------


def setup_of(scenario: Scenario, strategy: Strategy | None, resolve: Callable[..., Any]) -> Any:
    """The setup of a scenario with cells: that of the first, with what all are instead of what it is.

    Args:
        scenario: the whole input.
        strategy: takes the place of the one that it names.
        resolve: gives the setup of a cell, of its scenario, the strategy and its neighbourhood.
    """
    from missions.scenarios.parts import database_of, mission_of

    plan, mission = Plan(scenario), mission_of(scenario)
    named = mission.instances
    parts = tuple(
        resolve(plan.scenario_of(number), strategy, plan.neighbourhood(number, named))
        for number in range(len(plan.cells))
    )
    first, database = parts[0], database_of(scenario, type(mission))
    instances = _instances_of(database.names, parts)
    uids = {instance.name: instance.uid for instance in instances}
    common = dict.fromkeys(
        known for part in parts for fact in part.common_facts if (known := _renumbered(fact, part, uids)) is not None
    )
    west, east = scenario.world.x_m
    south, north = scenario.world.y_m
    return replace(
        first,
        scenario=scenario if strategy is None else replace_strategy(scenario, first.scenario),
        mission=mission,
        instances=instances,
        common_facts=tuple(common),
        database=database,
        agreement=_agreement_of([part.agreement for part in parts]),
        rally_points_m={rally.name: rally.position_m for rally in scenario.rally_point},
        bounds_m=(west, south, east, north),
        deployment=deployment_of(scenario),
        sound_speed_mps=scenario_sound_speed_mps(scenario),
        subjects=None,
        features=used_in(scenario),
        neighbourhood=ALONE,
        parts=parts,
    )


def replace_strategy(scenario: Scenario, of: Scenario) -> Scenario:
    """The scenario with the strategy of another one."""
    return scenario.model_copy(update={"strategy": of.strategy})


def _instances_of(names: Sequence[str], parts: Sequence[Any]) -> tuple[Instance, ...]:
    """What all cells have names for, each once: the vehicles first, by their nodes."""
    classes = {instance.name: instance.class_uid for part in parts for instance in part.instances}
    listed = dict.fromkeys((*names, *(instance.name for part in parts for instance in part.instances)))
    return tuple(Instance(uid, classes[name], name) for uid, name in enumerate(listed))


def _renumbered(fact: PropertyValue, of: Any, uids: Mapping[str, int]) -> PropertyValue | None:
    """A fact by other numbers of the same names; None if one has none.

    Args:
        fact: by the numbers of a setup; of: that setup.
        uids: numbers by name.
    """
    subject = uids.get(of.instances[fact.subject].name)
    value: Any = fact.value
    if of.tbox.attributes[fact.attribute].kind is ValueKind.LINK:
        value = uids.get(of.instances[fact.target].name)
    return None if subject is None or value is None else fact._replace(subject=subject, value=value)


def _agreement_of(parts: Sequence[Agreement]) -> Agreement:
    """What all cells agree on before the mission."""
    first = parts[0]
    organisation = replace(
        first.organisation,
        groups={name: group for part in parts for name, group in part.organisation.groups.items()},
        assignments=frozenset(one for part in parts for one in part.organisation.assignments),
    )
    return replace(
        first,
        organisation=organisation,
        objectives=tuple(objective for part in parts for objective in part.objectives),
        plans={name: plan for part in parts for name, plan in part.plans.items()},
        meets_after={name: after for part in parts for name, after in part.meets_after.items()},
        supervisors={name: above for part in parts for name, above in part.supervisors.items()},
        at_sea={name: group for part in parts for name, group in part.at_sea.items()},
    )


# The fleets of all ---------------------------------------------------------------------------------


def fleets_of(setup: Any, seed: int, yard: Yard) -> Fleet:
    """The fleets of all cells as one.

    Args:
        setup: of all cells.
        seed: root of the draws; the first cell has those of its fleet by itself.
        yard: by which the fleets are made.
    """
    from remoras.flotilla import Address, Carrier, Crew, Flotilla, Passage, Times, Water
    from remoras.vehicle import Vehicle

    plan, parts, recorders = Plan(setup.scenario), setup.parts, _recorders_of(setup, yard.recorder)
    befalling = [fault for one in yard.faults(setup, seed) for fault in _at_all_addresses(one, plan)]
    seconds = {plan.places[first]: plan.places[second] for first, second in plan.gateways}
    firsts = {second: first for first, second in seconds.items()}
    joined = [
        (*pair, tells_own) for first in seconds.items() for pair, tells_own in ((first, True), (first[::-1], False))
    ]
    numbers = {here: _numbers_of(plan, setup, here, there) for here, there, _ in joined}

    def part_of(of_all: Flotilla, number: int) -> Part:
        passages = {
            here: Passage(of_all.fleets, here, there, *numbers[here], tells_own)
            for here, there, tells_own in joined
            if here[0] == number
        }

        def made(host: Any, data: VehicleData, *others: Any) -> Vehicle:
            first = firsts.get((number, data.node))
            if first is None:
                return Vehicle(host, data, *others)
            return Address(lambda: of_all.fleets[first[0]].vehicles[first[1]], host, data, *others)

        def equip(vehicle: Vehicle) -> None:
            passage = passages.get((number, vehicle.data.node))
            if passage is not None:
                vehicle.radio.noted.append(passage.note)

        return Part(vehicle=made, equip=equip)

    def make(of_all: Flotilla, number: int) -> Fleet:
        own_seed = seed if number == 0 else _seed_of(seed, number)
        own = [fault for fault in befalling if plan.cell_of[fault.vehicle] == number]
        carrier = Carrier(yard.channel(parts[number], own_seed), number, of_all.disturb)
        return yard.assemble(parts[number], own_seed, carrier, Common(recorders[number], own, part_of(of_all, number)))

    about, colours = setup.scenario.scenario, plan.colours
    return Flotilla(
        make,
        _first_addresses_first(plan),
        seconds,
        [Crew(cell.name, of.mission.jobs, of.agreement.groups) for cell, of in zip(plan.cells, parts, strict=True)],
        [name for name in setup.database.names if name not in plan.first_of],
        Water(
            [
                [other for other, colour in enumerate(colours) if colour == own and other != number]
                for number, own in enumerate(colours)
            ],
            plan.interference_m,
            setup.sound_speed_mps,
            setup.modem.packet_s,
        ),
        yard.recorder,
        Times(about.tick_s, about.duration_s),
        setup.scenario.guidance.separation_m,
    )


def _numbers_of(
    plan: Plan, setup: Any, here: tuple[int, int], there: tuple[int, int]
) -> tuple[dict[int, int], frozenset[int], frozenset[int], frozenset[int]]:
    """Numbers by which a gateway passes facts on: of instances there by those here, of origins whose facts go on, of
    attributes that do, and of those of them whose values are instances.

    Args:
        plan: of the cells.
        setup: of all.
        here, there: cell and node of the address where facts come from, and of that where they go.
    """
    tbox, (uid_of, uid_there) = (
        setup.tbox,
        ({instance.name: instance.uid for instance in setup.parts[number].instances} for number in (here[0], there[0])),
    )
    relayed = frozenset(tbox.attribute_named(name).uid for name in plan.table.relays)
    links = frozenset(uid for uid in relayed if tbox.attributes[uid].kind is ValueKind.LINK)
    hops_here, hops_there = plan.ways[1][here[0]], plan.ways[1][there[0]]
    origins = frozenset(
        uid_of[vehicle.name]
        for cell in (here[0], *hops_here)
        for vehicle in plan.members[cell]
        if hops_there.get(cell, 0) > hops_here.get(cell, 0)
    )
    return {uid: uid_there[name] for name, uid in uid_of.items() if name in uid_there}, origins, relayed, links


def _recorders_of(setup: Any, recorder: Recorder) -> list[Recorder]:
    """What takes the rows of each cell: the recorder itself where it is all of them."""
    from remoras.flotilla import Numbers, RecorderOfFleet

    uids = {instance.name: instance.uid for instance in setup.instances}
    seconds = Plan(setup.scenario).first_of.keys()
    found: list[Recorder] = []
    for part in setup.parts:
        numbers = Numbers(tuple(uids[instance.name] for instance in part.instances))
        is_same = len(setup.parts) == 1 and numbers.uids == tuple(range(len(numbers.uids)))
        elsewhere = seconds & set(part.database)
        found.append(recorder if is_same else RecorderOfFleet(recorder, numbers, elsewhere))
    return found


def _first_addresses_first(plan: Plan) -> list[int]:
    """The cells such that the first address of a gateway is made before the second; gateways form no circle."""
    order: list[int] = []

    def take(number: int) -> None:
        if number not in order:
            for first, second in plan.gateways:
                if plan.cell_of[second] == number:
                    take(plan.cell_of[first])
            order.append(number)

    for number in range(len(plan.cells)):
        take(number)
    return order


def _at_all_addresses(fault: Fault, plan: Plan) -> Iterator[Fault]:
    """A fault as it befalls a vehicle at all its addresses; what it does to the body it does once."""
    vehicle = plan.first_of.get(fault.vehicle, fault.vehicle)
    yield replace(fault, vehicle=vehicle)
    for first, second in plan.gateways:
        if first == vehicle:
            yield replace(fault, vehicle=second, acts=fault.acts if fault.leaves != SOUND else None)


def _seed_of(seed: int, number: int) -> int:
    """Seed of a cell behind the first."""
    return loss.slot_key(loss.trial_key(seed, loss.FLEETS), number) >> 2


FEATURE = Feature(
    {
        "": {
            CELL: (tuple[CellTable, ...], ()),
            GATEWAY: (tuple[GatewayTable, ...], ()),
            KEY: (CellsTable | None, Field(None, description="what holds for all cells, and between them")),
        }
    },
    checks=cell_faults,
    made_checks=made_faults,
    most_vehicles=LARGEST,
    fleet_size=lambda raw: max([len(list_of(table, "vehicles")) for table in entries(raw, CELL)], default=0),
    n_fleets=lambda scenario: len(scenario.of_feature(CELL)),
    other_addresses=lambda scenario: Plan(scenario).first_of,
    setup=setup_of,
    fleet=fleets_of,
)
