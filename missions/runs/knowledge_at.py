"""Knowledge of a vehicle at a given time, reconstructed from the tables of a run.

A vehicle has a block of facts from when it recorded the block, received its last item, or received it as a status. With
instant sharing it has the block from when the origin recorded it, and again after a restart without memory. Merging
does not depend on order, so the model built from these blocks equals the vehicle's.
"""

from __future__ import annotations

import math
from collections import defaultdict, deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, count, takewhile
from numbers import Real
from operator import itemgetter
from typing import Any, NamedTuple, TypeVar

from exchange.packets import guid_of
from exchange.schedule import TdmaSchedule
from missions.errors import OutputError
from missions.fault import OVER, absences, kind_of_row
from missions.figure import RunResults
from missions.runs.setup import Setup, world_model
from missions.spans import spans
from missions.statements import rows_by_item
from remoras.activities import Objective
from remoras.beliefs import Beliefs, Fused
from remoras.fleet.radio import SUSPECTED
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.organisation.membership import acted_on
from remoras.recorder import ITEMS, KNOWLEDGE, MEMBERSHIP, ORGANISATION, PACKETS, SETTLING
from remoras.social.agreement import Agreement
from remoras.social.planning import missions_of
from remoras.table import card
from worldmodel import (
    STATUS,
    Block,
    FaultCode,
    Observation,
    PropertyValue,
    Reception,
    UnknownNameError,
    ValueKind,
    WorldModel,
    doubted,
    merge,
    suggestion,
    tidy,
)

T = TypeVar("T")
Row = Mapping[str, Any]
GAVE_UP = frozenset({f"dropped block: {FaultCode.TIMED_OUT}", f"refused block: {FaultCode.CROWDED_OUT}"})
"""Faults by which a vehicle discarded received blocks; see ``remoras.fleet.radio``."""


class RebuiltLife(NamedTuple):
    """Incarnation of a vehicle; ``epoch`` counts the previous ones."""

    from_s: float
    epoch: int
    remembers: bool


def lives_of(faults: Iterable[Row], vehicle: str) -> list[RebuiltLife]:
    """Return the incarnations of a vehicle from the table ``faults``."""
    lives, remembers = [RebuiltLife(0.0, 0, False)], dict[str, bool]()
    for row in (fault for fault in faults if fault["vehicle"] == vehicle):
        kind = row["kind"]
        if row["detail"] == OVER and kind in remembers:
            lives.append(RebuiltLife(row["time_s"], len(lives), remembers[kind]))
        elif (declared := kind_of_row(kind)) is not None and (keeps := declared.began_anew(row["detail"])) is not None:
            remembers[kind] = keeps
    return lives


def tidied_s(faults: Iterable[Row], vehicle: str, schedule: TdmaSchedule, end_s: float) -> list[float]:
    """Return the times (s) of pruning: the vehicle's frame ends, up to the mission's end."""
    rows = map(itemgetter("time_s", "vehicle", "kind", "detail"), faults)
    away = spans((since_s, is_absent) for since_s, name, is_absent in absences(rows) if name == vehicle)
    ends_s = takewhile(lambda time: time <= end_s, (schedule.frame_start_s(frame) for frame in count(1)))
    return [at_s for at_s in ends_s if not any(gap.holds(at_s) for gap in away)]


def fill(
    model: WorldModel,
    known: Iterable[tuple[float, Block]],
    at_s: float,
    given_up_s: Iterable[float],
    frame_ends_s: Iterable[float],
) -> None:
    """Replay a vehicle's merges and pruning into an empty model, until ``at_s``.

    ``known`` has times of possession (s) and blocks; ``given_up_s`` are times of discards, ``frame_ends_s`` of pruning.
    """
    # Merging does not depend on order, but discarding and pruning do: an exclusion protects what it hides from pruning.
    rest = deque(sorted((arrival for arrival in known if arrival[0] <= at_s), key=itemgetter(0)))
    times_s = [(time_s, True) for time_s in given_up_s]
    if model.pruning:
        times_s += [(time_s, False) for time_s in frame_ends_s]
    # At equal times, pruning at a frame's end (False) precedes what the vehicle records then.
    for time_s, with_it in sorted(moment for moment in times_s if moment[0] <= at_s):
        while rest and (rest[0][0] <= time_s if with_it else rest[0][0] < time_s):
            since_s, block = rest.popleft()
            merge(model, [block], since_s)
        tidy(model, time_s)
    for since_s, block in rest:
        merge(model, [block], since_s)


def _block_of(uid: str) -> str | tuple[int, int, int]:
    return uid if "@" in uid else guid_of(uid)


def memories(lives: Sequence[RebuiltLife]) -> Iterator[tuple[float, float]]:
    """Yield the intervals (s) in which a vehicle kept its memory."""
    begins_s = [life.from_s for life in lives if not life.remembers]
    yield from zip(begins_s, [*begins_s[1:], math.inf], strict=True)


def left_over(events: Iterable[tuple[T, bool]]) -> frozenset[T]:
    """Return the members whose last event is an addition (True), not a removal."""
    members: set[T] = set()
    for member, is_in in events:
        (members.add if is_in else members.discard)(member)
    return frozenset(members)


def formed(agreement: Agreement, changes: Iterable[Row]) -> tuple[dict[str, Group], list[Row]]:
    """Return the groups after changes, and the assignments since their formation."""
    groups, objectives = dict(agreement.organisation.groups), list[Row]()
    for row in changes:
        name = row["group"]
        if row["event"] in ("formed", "dissolved"):
            groups.pop(name, None)
            objectives = [row for row in objectives if row["group"] != name or not row["issuer"]]
            if row["event"] == "formed":
                groups[name] = agreement.at_sea[name]
        elif row["event"] == "given":
            objectives.append(row)
    return groups, objectives


class Belief(NamedTuple):
    """Latest value of an attribute of an instance, with time and origin, by names.

    ``value`` is text as in the table ``items``, without decimal point for whole numbers. ``uncertainty`` is the
    standard deviation of a number or point, the probability of any other value, or None.
    """

    subject: str
    attribute: str
    value: str
    time_s: float
    origin: str
    uncertainty: float | None = None


@dataclass(frozen=True, repr=False)
class KnownAt:
    """Knowledge of one vehicle at one time, after all events of that time.

    ``receptions`` has time and sender of received observations; ``organisation`` the roles as agreed and reported so
    far, ``present`` those without ``absent`` vehicles, on which the vehicle acts; ``missions`` are by group.
    """

    vehicle: str
    at_s: float
    model: WorldModel
    organisation: Organisation
    present: Organisation
    absent: frozenset[str]
    objectives: frozenset[Objective]
    missions: Mapping[str, tuple[str, ...]]
    receptions: tuple[Reception, ...] = ()

    def __repr__(self) -> str:
        return f"<Known to {self.vehicle} at {self.at_s:g} s>"

    def _repr_html_(self) -> str:
        played = self.organisation
        groups = []
        for group in played.groups:
            roles = [role for name in played.members(group) for role in played.roles_of(name, group)]
            groups.append((f"group {group}", ", ".join(f"{role.role}: {role.vehicle}" for role in roles)))
        rows = [("absent", ", ".join(sorted(self.absent)) or "none"), ("latest values", str(len(list(self.beliefs))))]
        return card(f"Known to {self.vehicle} at {self.at_s:g} s", [*groups, *rows], "known.beliefs has all of them")

    @property
    def beliefs(self) -> Iterator[Belief]:
        """Yield the latest value of each known property, by subject and attribute."""
        model = self.model
        held = chain(model.blocks(), model.private_blocks(), model.statuses())
        slots = {(fact.subject, fact.attribute) for block in held for fact in block.facts}
        yield from (self._belief(latest) for slot in sorted(slots) if (latest := model.latest(*slot)) is not None)

    def value(self, subject: str, attribute: str) -> Any:
        """Return the latest known value of a property, or None; raise UnknownNameError."""
        value = self._names.get((attribute, subject))
        return int(value) if value is not None and self._is_whole(attribute) else value

    def fused(
        self,
        subject: str,
        attribute: str,
        prior: Mapping[Any, float] | None = None,
        independent: bool = True,
        drift: float | None = None,
        shared: float = 0.0,
    ) -> Fused | None:
        """Fuse all observations of a property that this vehicle has received, at ``at_s``, by ``worldmodel.fusion``.

        Args:
            prior: weight of each symbol or truth value before any observation; uniform if None.
            independent: False if vehicles may repeat others' values: only the most certain one counts.
            drift: random walk of the property, per square root of a second; the ontology's if None.
            shared: standard deviation of the error common to all observations of one vehicle.

        Raises UnknownNameError for no such instance or attribute, FactError for an impossible prior, drift or shared
        error.
        """
        key = attribute, subject
        return self._names.fused(key, prior, independent, drift=drift, shared=shared, at_s=self.at_s)

    @property
    def doubted(self) -> tuple[str, ...]:
        """Vehicles whose numbers contradict others beyond their uncertainty (``worldmodel.fusion``)."""
        model = self.model
        slots = (
            (attribute, model.history(uid, attribute.uid))
            for attribute in model.tbox.attributes
            if attribute.uncertainty is not None
            for uid in model.instance_uids()
        )
        return tuple(map(self._names.name, doubted(slots)))

    def history(
        self, subject: str, attribute: str, since_s: float | None = None, until_s: float | None = None
    ) -> tuple[Belief, ...]:
        """Return known observations of a property, oldest first, without excluded origins; limits (s) are inclusive."""
        slot = self._names.uid(subject), self.model.tbox.attribute_named(attribute).uid
        return tuple(map(self._belief, self.model.history(*slot, since_s, until_s)))

    @property
    def banned(self) -> Mapping[str, float]:
        """Start (s) of the exclusion of each excluded vehicle."""
        return {self._names.name(origin): from_s for origin, from_s in self.model.banned.items()}

    @cached_property  # asked for each belief, and it lists the names of all instances
    def _names(self) -> Beliefs:
        return Beliefs(self.model)

    def _belief(self, observation: Observation) -> Belief:
        fact, origin = observation.fact, self._names.name(observation.origin)
        subject, attribute, value = self._names.as_text(fact)
        if self._is_whole(attribute):
            value = str(int(float(value)))
        return Belief(subject, attribute, value, observation.time_s, origin, fact.uncertainty)

    def _is_whole(self, attribute: str) -> bool:
        declared = self.model.tbox.attribute_named(attribute)
        return declared.kind is ValueKind.NUMBER and declared.fields[0].is_whole


class Memory:
    """Knowledge of all vehicles in a recorded run; raises OutputError for damaged tables."""

    def __init__(self, results: RunResults, setup: Setup) -> None:
        self._setup = setup
        self._mission_s = results.ended_s
        self._end_s = self._mission_s + (results.summary.get("settling_s") or 0.0)
        self._views = {table: results.table(table.name).to_pylist() for table in (ORGANISATION, MEMBERSHIP)}
        self._names = world_model(setup, 0)
        self._faults = results.rows("faults")
        self._results = results
        self._lives = {name: lives_of(self._faults, name) for name in setup.database}
        self._known_s: dict[str, list[_Held]] = {name: [] for name in setup.database}
        self._read(results)

    @cached_property  # all packets
    def _heard(self) -> Mapping[tuple[str, str], list[tuple[float, str]]]:
        receptions: dict[tuple[str, str], list[tuple[float, str]]] = defaultdict(list)
        for row in self._results.table(PACKETS.name).to_pylist():
            for vehicle, at_s in zip(row["receivers"], row["arrivals_s"], strict=True):
                for uid in (*row["item_uids"], *row["status_uids"]):
                    receptions[vehicle, uid].append((at_s, row["sender"]))
        return receptions

    def known(self, vehicle: str, at_s: float) -> KnownAt:
        """Return a vehicle's knowledge; raise OutputError for an unknown vehicle or time."""
        setup = self._setup
        names = tuple(setup.database)
        if vehicle not in names:
            raise OutputError(f"no vehicle {vehicle!r}; there are {', '.join(names)}{suggestion(str(vehicle), names)}")
        if not isinstance(at_s, Real) or not 0.0 <= at_s <= self._end_s:
            value = at_s if isinstance(at_s, Real) else repr(at_s)
            raise OutputError(f"at_s is {value}; allowed: 0 to {self._end_s}, the end of the run")
        life = next(life for life in reversed(self._lives[vehicle]) if life.from_s <= at_s)
        model = world_model(setup, setup.database[vehicle].node, life.epoch)
        held = [holding for holding in self._known_s[vehicle] if holding.until_s > at_s]
        known = ((holding.since_s, holding.block) for holding in held)
        frame_ends_s = tidied_s(self._faults, vehicle, setup.schedule, self._mission_s) if model.pruning else []
        given_up_s = {row["time_s"] for row in self._faults if row["vehicle"] == vehicle and row["kind"] in GAVE_UP}
        fill(model, known, at_s, given_up_s, frame_ends_s)
        past = {
            table: [row for row in rows if row["vehicle"] == vehicle and life.from_s <= row["time_s"] <= at_s]
            for table, rows in self._views.items()
        }
        changes = past[ORGANISATION]
        played = left_over(
            (RoleAssignment(row["group"], row["role"], row["peer"]), row["event"] == "assigned")
            for row in changes
            if row["event"] in ("assigned", "left")
        )
        groups, objectives = formed(setup.agreement, changes)
        by_group: dict[str, list[str]] = {}
        for row in objectives:
            if not row["role"]:
                by_group.setdefault(row["group"], []).append(row["argument"])
        missions = missions_of(groups.values(), by_group)
        organisation = Organisation(groups, played)
        absent = left_over((row["peer"], row["event"] == "absent") for row in past[MEMBERSHIP])
        is_cut_off = absent == set(setup.database) - {vehicle}
        arguments = {
            (row["group"], row["role"], row["objective"]): row["argument"] for row in objectives if row["role"]
        }
        return KnownAt(
            vehicle,
            at_s,
            model,
            organisation,
            acted_on(organisation, vehicle, absent, is_cut_off, setup.database[vehicle].social_layer),
            absent,
            frozenset(Objective(*key, argument) for key, argument in arguments.items()),
            missions,
            tuple(self._receptions(vehicle, at_s, model)),
        )

    def _receptions(self, vehicle: str, at_s: float, model: WorldModel) -> Iterator[Reception]:
        setup, statuses = self._setup, set(model.statuses())
        nodes, by_packets = setup.nodes, setup.strategy.declaration.communicates
        for since_s, block, items, until_s in self._known_s[vehicle]:
            if block.origin == nodes[vehicle] or not since_s <= at_s < until_s:
                continue
            receptions = [r for uid in items for r in self._heard.get((vehicle, uid), ()) if r[0] <= since_s]
            # The packet that completed the block is the last one up to that time.
            sender = nodes[max(receptions, key=itemgetter(0))[1]] if receptions else None
            told_by = sender if by_packets else block.origin
            # The model keeps the facts of a status apart, each until a newer one of its property.
            parts = [block._replace(facts=(fact,)) for fact in block.facts] if block.is_status else [block]
            for candidate in parts:
                if candidate in statuses or (candidate.is_item and model.block(candidate.guid) == candidate):
                    yield Reception(candidate, told_by, since_s)

    # Reading -------------------------------------------------------------------------------------

    def _read(self, results: RunResults) -> None:
        setup = self._setup
        exhausted_s = {row["vehicle"]: row["time_s"] for row in self._faults if row["kind"] == "energy"}
        received: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))  # by item and vehicle
        for row in (*results.table(KNOWLEDGE.name).to_pylist(), *results.rows(SETTLING.name)):
            if row["event"] == "received":
                received[row["item"]][row["vehicle"]].append(row["time_s"])
        blocks = [self._told(rows) for rows in rows_by_item(results.table(ITEMS.name).to_pylist(), _block_of)]
        statuses = self._heard_statuses(results, blocks, exhausted_s)
        by_packets = setup.strategy.declaration.communicates  # else all vehicles know each block at once
        for number, (block, origin, recorded_s, kind, items) in enumerate(blocks):
            self._hold(origin, [[recorded_s]], block, items)
            receptions = [received[uid] for uid in items]
            if block.is_status:
                receptions = [statuses[number]] if number in statuses else receptions[:1]
            for name, data in setup.database.items():
                if kind == "kept" or (name == origin and block.is_status and by_packets):
                    continue
                if not by_packets:
                    # In the tick of its exhaustion a vehicle gets only the blocks of those before it in node order.
                    order = (recorded_s, block.origin) < (exhausted_s.get(name, math.inf), data.node)
                    told_s = [recorded_s] if order and name != origin else []
                    times_s = [told_s + [from_s for from_s, _ in memories(self._lives[name]) if from_s > recorded_s]]
                else:
                    times_s = [of_item.get(name, []) for of_item in receptions]
                self._hold(name, times_s, block, items)

    def _hold(self, name: str, times_s: Iterable[Sequence[float]], block: Block, items: tuple[str, ...]) -> None:
        """Record a block for each memory interval with receptions of all its items (``times_s``)."""
        for from_s, until_s in memories(self._lives[name]):
            heard_s = [[time_s for time_s in of_item if from_s <= time_s < until_s] for of_item in times_s]
            if all(heard_s):
                since_s = max(map(min, heard_s))
                again_s = [time_s for time_s in heard_s[0] if time_s > since_s]  # discarded and received again
                again_s = [] if block.is_status else again_s  # others may have relayed it
                self._known_s[name] += [_Held(one_s, block, items, until_s) for one_s in (since_s, *again_s)]

    def _heard_statuses(
        self, results: RunResults, blocks: Sequence[_Told], exhausted_s: Mapping[str, float]
    ) -> dict[int, dict[str, list[float]]]:
        recorded: dict[str, list[int]] = defaultdict(list)
        for number, status in enumerate(blocks):
            if status.block.is_status:
                recorded[status.items[0]].append(number)
        bad = {(row["vehicle"], row["time_s"]) for row in self._faults if row["kind"] == "bad packet"}
        aside = {  # by vehicle, time and name
            (row["vehicle"], row["time_s"], row["detail"].rpartition("; ")[2])
            for row in self._faults
            if row["kind"] == SUSPECTED
        }
        received: dict[int, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
        for row in results.table(PACKETS.name).to_pylist():
            heard_s = {
                name: at_s
                for name, at_s in zip(row["receivers"], row["arrivals_s"], strict=True)
                if at_s <= exhausted_s.get(name, math.inf) and (name, at_s) not in bad
            }
            for uid in row["status_uids"]:
                numbers = [n for n in recorded[uid] if blocks[n].recorded_s <= row["time_s"]]
                if not numbers:  # made up by damage, then relayed
                    continue
                of_uid = received[numbers[-1]]
                for name, at_s in heard_s.items():
                    if (name, at_s, uid) not in aside:
                        of_uid[name].append(at_s)
        return received

    def _told(self, rows: Sequence[Row]) -> _Told:
        first, model = rows[0], self._names
        origin, epoch, sequence = guid_of(first["uid"])
        if sequence == STATUS:  # the name has origin and time, not the incarnation
            epoch = max(life.epoch for life in self._lives[first["origin"]] if life.from_s <= first["recorded_s"])
        facts = tuple(fact_of_row(model, row) for row in rows)
        block = Block(origin, sequence, model.quantise_time(first["time_s"]), facts, epoch)
        items = tuple(dict.fromkeys(row["uid"] for row in rows))
        return _Told(block, first["origin"], first["recorded_s"], first["kind"], items)


class _Held(NamedTuple):
    since_s: float
    block: Block
    items: tuple[str, ...]
    until_s: float


class _Told(NamedTuple):
    block: Block
    origin: str
    recorded_s: float
    kind: str
    items: tuple[str, ...]


def _uid(model: WorldModel, name: str) -> int:
    """Return an instance uid by name; instances created at run time have it as suffix."""
    try:
        return model.instance_named(name).uid
    except UnknownNameError:
        return int(name.rpartition("-")[2])


def fact_of_row(model: WorldModel, row: Mapping[str, Any]) -> PropertyValue:
    """Return the fact of a row of the table ``items``; ``model`` needs only common instances."""
    attribute = model.tbox.attribute_named(row["attribute"])
    is_link = attribute.kind is ValueKind.LINK
    value = _uid(model, row["value"]) if is_link else model.tbox.value_of(attribute, row["value"])
    uncertainty = row.get("uncertainty", "")
    return PropertyValue(_uid(model, row["subject"]), attribute.uid, value, float(uncertainty) if uncertainty else None)
