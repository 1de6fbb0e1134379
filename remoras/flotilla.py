"""Several fleets in one sea, stepped as one: in one time, event by event, and within sight of each other.

Each is a whole fleet that knows nothing of the others. What they have in common is here: the order of their events, the
obstacle sonars, packets that are noise to others, tables with the numbers of all, and gateways. A gateway is one
vehicle with an address in each of two fleets, and passes on facts of the one in the other as what they are.

It is made where a scenario asks for it, and loaded then.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

from exchange.acoustics.channel import Arrival, Channel
from exchange.arithmetic import length
from remoras.clock import Clock
from remoras.fleet import Fleet
from remoras.holders import HolderCount
from remoras.radio import SUSPECTED
from remoras.recorder import FAULTS, TRAJECTORIES, Recorder, Row, Rows, Table
from remoras.separation import Box, Separation, boxes_apart_m
from remoras.truth import COMPLETE, reachable_fraction
from remoras.vehicle import Vehicle
from remoras.view import ReadOnlyFleet
from worldmodel import Block, PropertyValue, merge

if TYPE_CHECKING:
    from remoras.avoidance import Neighbour
    from remoras.database import VehicleData
    from remoras.functional.layer import FunctionalLayer
    from remoras.organisation import Group
    from remoras.truth import FleetView, Milestone, Truth
    from remoras.work import Job
    from worldmodel import Change

MOST_REASONS = 3
"""Of so many fleets it is told why they are not done; the others are counted."""
Place = tuple[int, int]
"""Number of a fleet, and node in it."""


class Crew(NamedTuple):
    """A fleet as its truth is weighed by: its name, the jobs of its mission, and its groups."""

    name: str
    jobs: Mapping[str, Job]
    groups: Sequence[Group]


class Water(NamedTuple):
    """How fleets disturb each other.

    Attributes:
        sharing: by fleet, the others that send at once with it.
        interference_m: how far a packet is noise.
        sound_speed_mps: in the sea.
        packet_s: time that the modem takes to send so many bits (s).
    """

    sharing: Sequence[Sequence[int]]
    interference_m: float
    sound_speed_mps: float
    packet_s: Callable[[int], float]


class Times(NamedTuple):
    """Length of a step, and end of the run if the missions do not complete before (s)."""

    tick_s: float
    duration_s: float


# Tables --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Numbers:
    """Numbers of a fleet in those of all: tables speak of all fleets, so what is numbered in one is renumbered there.

    Attributes:
        uids: of instances, those of vehicles among them, by the uid in the fleet.
    """

    uids: tuple[int, ...]

    @cached_property
    def item(self) -> Callable[[str], str]:
        """``item(name)``: the name of an item, status or block in tables, as ``exchange.packets`` makes it."""
        return lru_cache(maxsize=4096)(self._item)

    def _item(self, name: str) -> str:
        n_digits = next(at for at, character in enumerate(name) if not character.isdigit())
        origin, rest = self.uids[int(name[:n_digits])], name[n_digits:]
        if rest.startswith("@"):
            time_s, _, slot = rest.partition(":")
            subject, _, attribute = slot.partition(".")
            rest = f"{time_s}:{self.uids[int(subject)]}.{attribute}"
        return f"{origin}{rest}"


class _Renumbered(Rows):
    """Takes the rows of a table and hands them on with other names of items; it has the rows of all."""

    def __init__(self, rows: Rows, of_row: Callable[[Row], Row]) -> None:
        super().__init__()
        self._handed_on, self._of_row = rows, of_row
        self.append, self.extend = self._hand_on, self._hand_on_all

    def _hand_on(self, row: Row) -> None:
        self._handed_on.append(self._of_row(row))

    def _hand_on_all(self, rows: Iterable[Row]) -> None:
        self._handed_on.extend(map(self._of_row, rows))

    def __iter__(self) -> Iterator[Row]:
        return iter(self._handed_on)

    def __reversed__(self) -> Iterator[Row]:
        return reversed(self._handed_on)

    def __len__(self) -> int:
        return len(self._handed_on)


class _Tracks(Rows):
    """Hands on where vehicles are, but for second addresses of gateways."""

    def __init__(self, rows: Rows, elsewhere: Collection[str]) -> None:
        super().__init__()
        self._handed_on, self._elsewhere = rows, elsewhere
        self.append = self._hand_on

    def _hand_on(self, row: Row) -> None:
        if row[1] not in self._elsewhere:
            self._handed_on.append(row)


SINGLE, SEVERAL = ("uid", "item"), ("item_uids", "status_uids")
"""Columns with the name of an item, and with several."""
OF_ALL = ("time_s", "goal_fraction")
"""Columns of a table that says how far all have got: no rows of one fleet by itself."""


class RecorderOfFleet(Recorder):
    """Takes the rows of a fleet, and hands them on with the names that items have among all.

    Args:
        recorder: of all fleets.
        numbers: of the fleet.
        elsewhere: second addresses of gateways in the fleet, which have the tracks of the first ones.
    """

    def __init__(self, recorder: Recorder, numbers: Numbers, elsewhere: Collection[str]) -> None:
        self._recorder, self._numbers, self._elsewhere = recorder, numbers, elsewhere
        super().__init__(recorder.tables.values())
        self.bits = recorder.bits

    def declare(self, table: Table) -> None:
        """Take rows of another table, too."""
        self._recorder.declare(table)
        self.tables.setdefault(table.name, table)
        rows, names = self._recorder.rows(table.name), table.column_names
        single = [at for at, name in enumerate(names) if name in SINGLE]
        several = [at for at, name in enumerate(names) if name in SEVERAL]
        if names == OF_ALL:
            rows = Rows()
        elif single or several:
            rows = _Renumbered(rows, partial(self._of_row, single, several))
        elif table.name == FAULTS.name:
            rows = _Renumbered(rows, self._of_fault)
        elif table.name == TRAJECTORIES.name and self._elsewhere:
            rows = _Tracks(rows, self._elsewhere)
        self._rows.setdefault(table.name, rows)

    def _of_row(self, single: Sequence[int], several: Sequence[int], row: Row) -> Row:
        values = list(row)
        for at in single:
            values[at] = self._numbers.item(values[at])
        for at in several:
            values[at] = [self._numbers.item(name) for name in values[at]]
        return tuple(values)

    def _of_fault(self, row: Row) -> Row:
        """Details of suspected positions end with the name of the status."""
        if row[2] != SUSPECTED:
            return row
        text, _, name = row[3].rpartition("; ")
        return (*row[:3], f"{text}; {self._numbers.item(name)}")


# Gateways ------------------------------------------------------------------------------------------


class Address(Vehicle):
    """A gateway at its second address: it speaks and hears there, and is where its first address is.

    Its body, with sensors, motion and energy, is that of the first address, which moves it. So it neither acts nor
    decides; what it sends takes energy of that body.

    Args:
        first: gives the vehicle at the first address, as it is now.
        parts: what ``remoras.vehicle.Vehicle`` takes.
    """

    def __init__(self, first: Callable[[], Vehicle], *parts: Any) -> None:
        self._first = first
        super().__init__(*parts)

    @property
    def functional(self) -> FunctionalLayer:
        """The body at the first address."""
        return self._first().functional

    @functional.setter
    def functional(self, layer: FunctionalLayer) -> None:
        """It has none of its own."""

    @property
    def real(self) -> VehicleData:
        """As the fleet knows it: it has no body."""
        return self.data

    def step(self, now_s: float, dt_s: float, neighbours: Sequence[Neighbour], since_s: float = 0.0) -> None:
        """The first address acts."""

    def think(self, now_s: float, dt_s: float) -> None:
        """The first address decides."""

    def _adopt(self) -> None:
        """It plays no role."""


@dataclass(frozen=True)
class Passage:
    """What a gateway passes on from one of its fleets to the other.

    Attributes:
        fleets: all of them.
        here, there: fleet and node of its address here, and of that there.
        uids: of instances there, by those here.
        origins: those here whose facts go on; attributes: of what goes on; links: those with an instance as value.
        tells_own: True if it says there what it found out itself: at its first address.
    """

    fleets: list[Fleet]
    here: tuple[int, int]
    there: tuple[int, int]
    uids: Mapping[int, int]
    origins: frozenset[int]
    attributes: frozenset[int]
    links: frozenset[int]
    tells_own: bool

    def note(self, changes: Sequence[Change]) -> None:
        """Pass on what has changed here and is of use there."""
        for change in changes:
            block = change.block
            if block.sequence < 0 or not self.attributes.issuperset([fact.attribute for fact in block.facts]):
                continue
            if block.origin == self.here[1]:
                if self.tells_own:
                    self._say(block)
            elif block.origin in self.origins:
                self._bring(block)

    def _facts(self, block: Block) -> tuple[PropertyValue, ...] | None:
        """The facts of a block by the numbers there; None if something has no name there."""
        found = []
        for fact in block.facts:
            subject, value = self.uids.get(fact.subject), fact.value
            if fact.attribute in self.links:
                value = self.uids.get(fact.target, -1)
            if subject is None or value == -1:
                return None
            found.append(fact._replace(subject=subject, value=value))
        return tuple(found)

    def _say(self, block: Block) -> None:
        """Say there, under the name that it has there, what it found out itself; once."""
        fleet, facts = self.fleets[self.there[0]], self._facts(block)
        vehicle = fleet.vehicles[self.there[1]]
        history = vehicle.beliefs.model.history
        is_told = facts is not None and all(
            any(known.origin == self.there[1] and known.value == fact.value for known in history(*fact[:2]))
            for fact in facts
        )
        if facts is not None and not is_told:
            stated = [fact[:3] if fact.uncertainty is None else tuple(fact) for fact in facts]
            vehicle.conclude(stated, self._now_s)  # type: ignore[arg-type]  # a fact with or without its uncertainty

    def _bring(self, block: Block) -> None:
        """Let a block of somebody heard here be heard there, as what it is."""
        fleet, facts = self.fleets[self.there[0]], self._facts(block)
        if facts is None:
            return
        vehicle, now_s = fleet.vehicles[self.there[1]], self._now_s
        brought = block._replace(origin=self.uids[block.origin], facts=facts)
        changes = merge(vehicle.beliefs.model, [brought], now_s).changes
        for item in vehicle.radio.manager.offer(changes):
            origin = vehicle.beliefs.name(item.origin)
            fleet.recorder.knowledge.append((now_s, vehicle.name, str(item.uid), origin, "received"))
        vehicle.take_in(changes, now_s)

    @property
    def _now_s(self) -> float:
        return self.fleets[self.here[0]].now_s


# All fleets as one ---------------------------------------------------------------------------------


class _SharedWatch(Separation):
    """What the obstacle sonars of a fleet see of the vehicles of all fleets.

    Args:
        of_all: watches all vehicles.
        number: of the fleet.
    """

    def __init__(self, of_all: WatchOfAll, number: int) -> None:
        self._of_all, self._number = of_all, number
        self.separation_m = of_all.separation_m

    def look(self) -> dict[int, list[Neighbour]]:
        """What each vehicle of the fleet sees, by its node."""
        return self._of_all.seen[self._number]

    def conflicts(self, now_s: float) -> list[Row]:
        """Rows of all fleets, by the first."""
        return [] if self._number else self._of_all.conflicts(now_s)


class WatchOfAll(Separation):
    """Watches the distances between the vehicles of all fleets; second addresses of gateways are not looked at.

    Args:
        fleets: all of them.
        places: fleet and node of each vehicle.
        separation_m: that two vehicles keep.

    Attributes:
        seen: what the sonars saw last, by fleet and node.
    """

    def __init__(self, fleets: Sequence[Fleet], places: Sequence[tuple[int, int]], separation_m: float) -> None:
        self._fleets, self._places = fleets, places
        super().__init__(self._now, separation_m)
        self.seen: list[dict[int, list[Neighbour]]] = [{} for _ in fleets]

    @property
    def _now(self) -> list[Vehicle]:
        return [self._fleets[number].vehicles[node] for number, node in self._places]

    def look_around(self) -> None:
        """Look with all sonars, for a tick that begins."""
        self.vehicles = self._now
        self.seen = [{} for _ in self._fleets]
        for index, neighbours in self.look().items():
            number, node = self._places[index]
            self.seen[number][node] = neighbours


@dataclass(frozen=True)
class Carrier:
    """Carries the packets of a fleet, and lets those nearby that send at once be disturbed by them.

    Attributes:
        channel: of the fleet.
        number: of the fleet.
        disturb: lets the others be disturbed.
    """

    channel: Channel
    number: int
    disturb: Callable[[int, int, int, float], None]

    def transmit(
        self, slot: int, sender: int, data: bytes, now_s: float, positions_m: Sequence[tuple[float, float]]
    ) -> list[Arrival]:
        """Arrivals in the fleet."""
        arrivals = self.channel.transmit(slot, sender, data, now_s, positions_m)
        self.disturb(self.number, sender, 8 * len(data), now_s)
        return arrivals


class TruthOfAll:
    """The truths of all fleets as one: what they have in common counts by the number of their jobs.

    Args:
        fleets: all of them; crews: what they are.
    """

    def __init__(self, fleets: Sequence[Fleet], crews: Sequence[Crew]) -> None:
        self._fleets, self._crews = fleets, crews
        self._weights = [max(1, len(crew.jobs)) for crew in crews]

    def _mean(self, shares: Iterable[float]) -> float:
        if len(self._weights) == 1:
            return next(iter(shares))
        weighted = [weight * share for weight, share in zip(self._weights, shares, strict=True)]
        return math.fsum(weighted) / sum(self._weights)

    @property
    def milestones(self) -> Sequence[Milestone]:
        """What has happened so far, in time order; the mission is complete once that of each fleet is."""
        found = [milestone for fleet in self._fleets for milestone in fleet.truth.milestones]
        if len(self._fleets) == 1:
            return found
        found.sort(key=lambda milestone: milestone.time_s)
        complete = [milestone for milestone in found if milestone.name == COMPLETE]
        last = complete[-1:] if all(fleet.completed for fleet in self._fleets) else []
        return [milestone for milestone in found if milestone.name != COMPLETE] + last

    @property
    def goal_fraction(self) -> float:
        """Share of the goals that is reached."""
        return self._mean(fleet.truth.goal_fraction for fleet in self._fleets)

    def reachable_fraction(self, view: FleetView) -> float:
        """Share of the goals that is reached, or within reach of those left in each fleet."""
        pairs = zip(self._fleets, self._crews, strict=True)
        return self._mean(reachable_fraction(fleet.truth, crew.jobs, crew.groups, fleet.view) for fleet, crew in pairs)

    @property
    def is_over(self) -> bool:
        """True once nothing more comes of any fleet."""
        return all(fleet.completed or fleet.truth.is_over for fleet in self._fleets)

    def observe(self, fleet: FleetView, now_s: float) -> bool:
        """True if all fleets are done: each looks by itself."""
        return all(one.completed for one in self._fleets)

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Why fleets are not done."""
        names = [crew.name for crew in self._crews]
        reasons = [(name, one.truth.close(one.view, now_s)) for name, one in zip(names, self._fleets, strict=True)]
        if len(reasons) == 1:
            return reasons[0][1]
        left = [f"{name}: {reason}" for name, reason in reasons if reason]
        others = [f"and {len(left) - MOST_REASONS} others"] if len(left) > MOST_REASONS else []
        return "; ".join([*left[:MOST_REASONS], *others])


class Flotilla(Fleet):
    """The fleets of one sea.

    Args:
        make: makes each of the fleets, for this flotilla and the number of the fleet.
        order: numbers of the fleets, in the order in which they are made.
        seconds: second addresses of gateways, by the first.
        crews: what the fleets are.
        names: of all vehicles but second addresses, in their order.
        water: how the fleets disturb each other.
        recorder: takes the rows of all.
        times: of the run.
        separation_m: distance that vehicles in one depth layer are to keep.

    Attributes:
        fleets: by number.
    """

    def __init__(
        self,
        make: Callable[[Flotilla, int], Fleet],
        order: Sequence[int],
        seconds: Mapping[Place, Place],
        crews: Sequence[Crew],
        names: Sequence[str],
        water: Water,
        recorder: Recorder,
        times: Times,
        separation_m: float,
    ) -> None:
        super(Fleet, self).__init__(rng=0)  # it has no vehicles of its own
        self.recorder = recorder
        self.tick_s, self.duration_s = times
        self.clock = Clock()
        self.clocks, self.parts = {}, ()
        self.consulted, self.sent, self.acted, self.restarted = [], [], [], []
        self.completed, self.ended_s, self.reason, self.n_false_beliefs = False, 0.0, "", 0
        self.holders = HolderCount()
        self._water = water
        self._boxes: dict[int, tuple[float, Box]] = {}
        self.fleets: list[Fleet] = [self] * len(crews)  # until they are made
        for number in order:
            self.fleets[number] = make(self, number)
        for (here, _), (there, _) in seconds.items():
            self.fleets[here].restarted.append(partial(self._look_again, there))
        places = {
            vehicle.name: (number, node)
            for number, fleet in enumerate(self.fleets)
            for node, vehicle in enumerate(fleet.vehicles)
        }
        self._hulls = [places[name] for name in names]
        self._watch = WatchOfAll(self.fleets, self._hulls, separation_m)
        for number, fleet in enumerate(self.fleets):
            fleet.separation = _SharedWatch(self._watch, number)
        self.truth: Truth = TruthOfAll(self.fleets, crews)
        self._goal_fraction = self.truth.goal_fraction
        self._progress = [
            recorder.rows(name)
            for name, table in recorder.tables.items()
            if table.column_names == OF_ALL and len(crews) > 1
        ]
        self._take_stock()
        for fleet in self.fleets:
            fleet.restarted.append(lambda anew: self._take_stock())

    def _look_again(self, number: int, anew: Vehicle) -> None:
        """The body of a vehicle that begins anew is another one, at its second address in a fleet, too."""
        self.fleets[number].view = ReadOnlyFleet.of(self.fleets[number].vehicles)

    def disturb(self, number: int, sender: int, size_bits: int, now_s: float) -> None:
        """Let a packet be noise to vehicles of other fleets that send at once, whom it reaches.

        Args:
            number: of the fleet; sender: node of it.
            size_bits: of the packet.
            now_s: when it is sent.
        """
        if not self._water.sharing[number] or self.fleets[number].vehicles[sender].condition.is_mute:
            return
        motion, until_s = (
            self.fleets[number].vehicles[sender].functional.motion,
            now_s + self._water.packet_s(size_bits),
        )
        at_m = motion.x_m, motion.y_m
        for other in self._water.sharing[number]:
            fleet = self.fleets[other]
            if boxes_apart_m((*at_m, *at_m), self._box(other)) > self._water.interference_m:
                continue
            arrivals = []
            for node, vehicle in enumerate(fleet.vehicles):
                there = vehicle.functional.motion
                range_m = length(there.x_m - at_m[0], there.y_m - at_m[1])
                if range_m <= self._water.interference_m:
                    arrivals.append(Arrival(node, until_s + range_m / self._water.sound_speed_mps, b""))
            fleet.traffic.disturb(now_s, until_s, arrivals, fleet.names, fleet.recorder)

    def _box(self, number: int) -> Box:
        """Where the vehicles of a fleet are, as of this tick."""
        tick_s = self.clock.now_s
        known = self._boxes.get(number)
        if known is None or known[0] != tick_s:
            motions = [vehicle.functional.motion for vehicle in self.fleets[number].vehicles]
            x_m, y_m = [motion.x_m for motion in motions], [motion.y_m for motion in motions]
            known = self._boxes[number] = tick_s, (min(x_m), min(y_m), max(x_m), max(y_m))
        return known[1]

    def step(self) -> None:
        """One motion tick of all fleets, and all that is said and heard before it."""
        now_s, since_s = (self.steps - 1) * self.tick_s, (self.steps - 2) * self.tick_s
        self._happen_before(now_s)
        self.clock.now_s = now_s
        for fleet in self.fleets:
            fleet.clock.now_s = now_s
        self._watch.look_around()
        for fleet in self.fleets:
            fleet.move(now_s, since_s)
        for fleet in self.fleets:
            fleet.look(now_s)
        self.recorder.pack()
        self.completed = self.truth.observe(self.view, now_s)
        if self._progress and (goal_fraction := self.truth.goal_fraction) != self._goal_fraction:
            self._goal_fraction = goal_fraction
            for rows in self._progress:
                rows.append((now_s, self._goal_fraction))
        is_late = now_s + self.tick_s > self.duration_s
        if self.completed or is_late or self.is_nobody_left or self.truth.is_over:
            self.running = False
            for fleet in (self, *self.fleets):
                fleet.ended_s = now_s
            self.reason = self.truth.close(self.view, now_s)
            self._take_stock()

    def _happen_before(self, now_s: float) -> None:
        """Let the events of all happen, the earliest first; of one time, those of the first fleet first."""
        due = [(fleet.clock.next_s, number) for number, fleet in enumerate(self.fleets)]
        heapq.heapify(due)
        while due and due[0][0] <= now_s:
            number = due[0][1]
            fleet = self.fleets[number]
            event = fleet.clock.next_before(now_s)
            if event is None:
                heapq.heappop(due)
                continue
            event.act(fleet)
            heapq.heapreplace(due, (fleet.clock.next_s, number))

    @property
    def is_nobody_left(self) -> bool:
        """True once no vehicle of any fleet is alive or ever will be."""
        return all(fleet.is_nobody_left for fleet in self.fleets)

    def _take_stock(self) -> None:
        """Have what is so of all vehicles, each once."""
        self.vehicles = tuple(self.fleets[number].vehicles[node] for number, node in self._hulls)
        self.view = ReadOnlyFleet.of(self.vehicles)
        self.n_false_beliefs = sum(fleet.n_false_beliefs for fleet in self.fleets)
        self.holders.n_believed = sum(fleet.holders.n_believed for fleet in self.fleets)
        self.holders.n_wrong = sum(fleet.holders.n_wrong for fleet in self.fleets)

    def close(self) -> None:
        """Let go of the vehicles and the record of all fleets."""
        for fleet in self.fleets:
            fleet.close()
        super().close()
