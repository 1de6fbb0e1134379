"""Individual information needs, ``[[need]]``: requests for an attribute by single vehicles.

A need is an instance of ``InformationNeed``. Its statements go to all vehicles, as all need each other's needs (steps 1
and 2 of the cooperation paper, section IV). Needs agreed before the mission are not sent. Priority 0 withdraws a need.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING

from pydantic import Field

from exchange.policy.candidates import Expired
from missions.errors import ConfigurationFault, one_of
from missions.feature import Feature, Joining
from missions.files import shown
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric
from missions.scenarios.knowledge import words_in, words_of
from remoras.events import Host, Observer, say_at
from remoras.fleet.run_log import DELIVERIES
from remoras.organisation.needs import GroupNeeds
from remoras.table import NotNegative, Positive, Section
from worldmodel import (
    NOBODY,
    PLAIN,
    InformationNeed,
    Instance,
    NeedError,
    NeedsIndex,
    PropertyValue,
    TBox,
    Terms,
    Wanted,
    WorldModel,
    ontology_path,
)

if TYPE_CHECKING:
    from pathlib import Path

    from missions.scenarios.scenario import Scenario
    from remoras.beliefs import Beliefs
    from remoras.beliefs import Fact as Named
    from remoras.mission import Mission
    from remoras.organisation import Organisation
    from remoras.sensor import Fact

KEY = "need"
NEED = "InformationNeed"
NEEDED_BY, ATTRIBUTE, OF_CLASS, OF_INSTANCE = "neededBy", "neededAttribute", "neededOfClass", "neededOfInstance"
PRIORITY, TIME_TO_LIVE, BLACKOUT = "needPriority", "needTimeToLive", "needBlackout"
QUEUE_LIMIT, NEWEST_FIRST, ACKNOWLEDGED = "needQueueLimit", "needNewestFirst", "needAcknowledged"
OF_TERMS = (TIME_TO_LIVE, BLACKOUT, QUEUE_LIMIT, NEWEST_FIRST, ACKNOWLEDGED)
"""Attributes of the delivery requirements, in the order of ``Terms``."""
NEED_ATTRIBUTES = (NEEDED_BY, ATTRIBUTE, OF_CLASS, OF_INSTANCE, PRIORITY, *OF_TERMS)


ALL = "all"  # value of ``vehicle`` for a need of every vehicle


class NeedTable(Section):
    """One ``[[need]]``."""

    attribute: str = Field(description="attribute whose values are needed")
    of: str = Field("", description="class or instance with these values; all with the attribute if absent")
    vehicle: str = Field(ALL, description='vehicle that needs them, or "all"')
    priority: int = Field(1, ge=1, le=1000, description="priority")
    ttl_s: Positive | None = Field(None, description="age at which a value expires; none if absent")
    blackout_s: NotNegative = Field(0.0, description="minimum time between two packets of one vehicle with such values")
    queue_limit: int | None = Field(None, ge=1, description="longest queue of such values per vehicle; any if absent")
    newest_first: bool = Field(False, description="true: the newest value is sent first; false: the one queued longest")
    acknowledged: bool = Field(True, description="true: sent until all that need it acknowledge; false: once")
    from_s: NotNegative = Field(0.0, description="start of the need; agreed before the mission if 0 or absent")
    until_s: Positive | None = Field(None, description="withdrawal of the need; never if absent")

    def contradictions(self) -> Iterator[tuple[str, str]]:
        if self.ttl_s is not None and self.blackout_s >= self.ttl_s:
            yield (
                "blackout_s",
                f"must be below ttl_s = {self.ttl_s:g}, else values expire before they may be sent: shorten the "
                "blackout",
            )
        if self.until_s is not None and self.until_s <= self.from_s:
            yield "until_s", f"must be above from_s = {self.from_s:g}"

    def terms(self) -> Terms:
        """Return the delivery requirements."""
        return Terms(
            math.inf if self.ttl_s is None else self.ttl_s,
            self.blackout_s,
            self.queue_limit,
            self.newest_first,
            self.acknowledged,
        )


def need_name(vehicle: str, number: int) -> str:
    """Return the instance name of a vehicle's need, such as ``need 2 of AUV01``; ``number`` counts from 1."""
    return f"need {number} of {vehicle}"


@dataclass(frozen=True, slots=True)
class StatedNeed:
    """Need of one vehicle; ``number`` counts from 1, ``from_s`` is 0 if agreed beforehand."""

    vehicle: str
    number: int
    need: InformationNeed
    from_s: float = 0.0
    until_s: float = math.inf

    def facts(self) -> tuple[Fact, ...]:
        """Return the facts that state the need, by names, as in ``Observation.facts``."""
        name, need, terms = need_name(self.vehicle, self.number), self.need, self.need.terms
        subject = (OF_INSTANCE, need.instance) if need.instance is not None else (OF_CLASS, need.class_uid)
        facts: list[Fact] = [
            (name, NEEDED_BY, self.vehicle),
            (name, ATTRIBUTE, float(need.attribute)),
            (name, subject[0], float(subject[1] or 0)),
            (name, PRIORITY, float(need.priority)),
        ]
        for attribute, value, usual in zip(OF_TERMS, astuple(terms), astuple(PLAIN), strict=True):
            if value != usual:
                facts.append((name, attribute, value if isinstance(value, bool) else float(value)))
        return tuple(facts)

    def taken_back(self) -> tuple[Fact, ...]:
        """Return the facts that withdraw the need."""
        return ((need_name(self.vehicle, self.number), PRIORITY, 0.0),)


class NeedsInForce:
    """Needs known to one vehicle: common needs (of all, or derived from groups) and stated needs, side by side.

    ``agreed`` holds node and need by the uid of the need's instance, ``on_demand`` the attributes stored as items even
    without a current need.
    """

    def __init__(
        self,
        model: WorldModel,
        common: NeedsIndex | GroupNeeds,
        agreed: Mapping[int, tuple[int, InformationNeed]],
        on_demand: Iterable[int],
    ) -> None:
        tbox = self._tbox = model.tbox
        self._model = model
        self._common = common
        self._agreed = dict(agreed)
        self._on_demand = frozenset(on_demand)
        self._uid = {name: tbox.attribute_named(name).uid for name in NEED_ATTRIBUTES}
        of_class = tbox.class_named(NEED).uid
        self._instances = [uid for uid in model.instance_uids() if _class_of(model, uid) == of_class]
        self._in_force: dict[int, tuple[int, InformationNeed]] = {}
        self._stated = NeedsIndex(tbox, {})
        self.renew(None)

    def renew(self, organisation: Organisation | None) -> bool:
        """Re-read the stated needs and apply another organisation view; return True after a change."""
        has_changed = False
        if organisation is not None and isinstance(self._common, GroupNeeds):
            has_changed = self._common.renew(organisation)
        in_force = {uid: stated for uid in self._instances if (stated := self._read(uid)) is not None}
        # An unchanged index keeps the caches of the exchange manager valid.
        if in_force == self._in_force:
            return has_changed
        self._in_force = in_force
        by_peer: dict[int, list[InformationNeed]] = {}
        for peer, need in in_force.values():
            by_peer.setdefault(peer, []).append(need)
        self._stated = NeedsIndex(self._tbox, by_peer)
        return True

    def wanted(self, fact: PropertyValue, class_uid: int) -> Wanted:
        """Return the merged need for a fact; of no node, with priority 1, if on demand."""
        needed = self._common.wanted(fact, class_uid).merged(self._stated.wanted(fact, class_uid))
        return Wanted(0, 1) if needed == NOBODY and fact.attribute in self._on_demand else needed

    def _read(self, uid: int) -> tuple[int, InformationNeed] | None:
        def value(name: str, default: float | None = None) -> float | None:
            stated = self._model.value(uid, self._uid[name])
            return default if stated is None else float(stated)  # type: ignore[arg-type]

        priority, by, attribute = value(PRIORITY), value(NEEDED_BY), value(ATTRIBUTE)
        if priority is None:
            return self._agreed.get(uid)
        of_class, of_instance = value(OF_CLASS), value(OF_INSTANCE)
        if priority < 1 or by is None or attribute is None or attribute >= len(self._tbox.attributes):
            return None
        limit = value(QUEUE_LIMIT)
        try:
            terms = Terms(
                value(TIME_TO_LIVE) or math.inf,
                value(BLACKOUT) or 0.0,
                None if limit is None else int(limit),
                bool(value(NEWEST_FIRST, 0.0)),
                bool(value(ACKNOWLEDGED, 1.0)),
            )
            need = InformationNeed(
                int(attribute),
                int(priority),
                None if of_class is None or of_instance is not None else int(of_class),
                None if of_instance is None else int(of_instance),
                PLAIN if terms == PLAIN else terms,
            )
            # The index refuses needs that the ontology does not permit, which a faulty peer may state.
            NeedsIndex(self._tbox, {int(by): [need]})
        except NeedError:
            return None
        return int(by), need


def _class_of(model: WorldModel, uid: int) -> int | None:
    instance = model.instance(uid)
    return None if instance is None else instance.class_uid


# Scenario settings ------------------------------------------------------------------------------


def words(scenario: Scenario) -> Sequence[Path]:
    """Return the Turtle file that defines needs."""
    return (ontology_path("needs"),)


def instances_of(scenario: Scenario) -> Sequence[tuple[str, str]]:
    """Return class and name of all needs that vehicles may state; each vehicle has equally many."""
    vehicles, n_needs = sorted(scenario.vehicle, key=lambda vehicle: vehicle.slot), len(scenario.of_feature(KEY))
    return [(NEED, need_name(vehicle.name, number + 1)) for vehicle in vehicles for number in range(n_needs)]


def needed(scenario: Scenario) -> list[str]:
    """Return the attributes that a ``[[need]]`` requests."""
    return [table.attribute for table in scenario.of_feature(KEY)]


def stated_needs(scenario: Scenario, tbox: TBox, instances: Sequence[Instance]) -> tuple[StatedNeed, ...]:
    """Return the needs of ``[[need]]``; the n-th table is need n of each vehicle."""
    tables: tuple[NeedTable, ...] = scenario.of_feature(KEY)
    uids = {instance.name: instance.uid for instance in instances}
    classes = {ontology_class.name: ontology_class.uid for ontology_class in tbox.classes}
    stated = []
    for number, table in enumerate(tables, 1):
        attribute = tbox.attribute_named(table.attribute)
        class_uid = classes.get(table.of) if table.of else attribute.domain
        instance = uids[table.of] if class_uid is None else None
        need = InformationNeed(attribute.uid, table.priority, class_uid, instance, table.terms())
        until_s = math.inf if table.until_s is None else table.until_s
        for vehicle in scenario.vehicle:
            if table.vehicle in (ALL, vehicle.name):
                stated.append(StatedNeed(vehicle.name, number, need, table.from_s, until_s))
    return tuple(stated)


def need_faults(scenario: Scenario, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Yield faults: needs with unknown names or contradictory requirements."""
    tbox, communication = words_in(scenario, mission), scenario.communication
    if tbox is None:
        return
    attributes = [attribute.name for attribute in tbox.attributes]
    for number, table in enumerate(scenario.of_feature(KEY), 1):
        key = f"need.{number}"
        yield from one_of(f"{key}.attribute", table.attribute, attributes)
        yield from one_of(f"{key}.vehicle", table.vehicle, [ALL, *scenario.vehicle_names])
        yield from scenario.after_end(f"{key}.from_s", table.from_s)
        if table.attribute in communication.needs:  # the merged requirements apply
            names = [name for name in ("ttl_s", "blackout_s", "queue_limit") if getattr(table, name)]
            allowed = (
                f"limits nothing, for communication.needs lists {table.attribute}, without limits, for all: "
                "take it out there"
            )
            for name in [*names, *([] if table.acknowledged else ["acknowledged"])]:
                yield ConfigurationFault(f"{key}.{name}", "", allowed)


def of_faults(scenario: Scenario, made: Mission) -> Iterator[ConfigurationFault]:
    """Yield faults: needs of unknown classes or instances; ``made`` adds its own instances."""
    tables: tuple[NeedTable, ...] = scenario.of_feature(KEY)
    if not any(table.of for table in tables):
        return
    words = words_of(scenario.worldmodel.ontology_text, type(made))
    classes = [ontology_class.name for ontology_class in words.classes]
    named = [group.name for group in scenario.group]
    named += [f"{group.name}.{role.name}" for group in scenario.group for role in group.role]
    named += [vehicle.name for vehicle in scenario.vehicle] + [rally.name for rally in scenario.rally_point]
    named += [name for _, name in made.instances]
    for number, table in enumerate(tables, 1):
        if table.of:
            for fault in one_of(f"need.{number}.of", table.of, [*classes, *named]):
                yield ConfigurationFault(fault.key, shown(table.of), f"no class or instance; {fault.allowed}")


# Run hooks --------------------------------------------------------------------------------------


def n_expired(run: MeasuredRun) -> int | Absent:
    """Number of items or statuses that expired or exceeded a queue limit, if a need sets one."""
    tables: tuple[NeedTable, ...] = run.scenario.of_feature(KEY)
    if not any(table.ttl_s is not None or table.queue_limit is not None for table in tables):
        return NOT_APPLICABLE
    lost = (Expired.TIME_TO_LIVE.value, Expired.OVERFLOW.value)
    return sum(1 for row in run.recorder.rows(DELIVERIES.name) if row[3] == "expired" and row[4] in lost)


class StatedNeeds(Observer):
    """Run hooks that schedule need statements and serve received needs."""

    def __init__(self, joining: Joining) -> None:
        self._stated = stated_needs(joining.scenario, joining.tbox, joining.instances)
        uids, database = {instance.name: instance.uid for instance in joining.instances}, joining.database
        self._agreed = {
            uids[need_name(need.vehicle, need.number)]: (database[need.vehicle].node, need.need)
            for need in self._stated
            if need.from_s == 0.0
        }
        self._kept = [joining.tbox.attribute_named(name).uid for name in needed(joining.scenario)]

    def on_start(self, host: Host) -> None:
        for need in self._stated:
            if need.from_s > 0.0:
                say_at(host, need.from_s, need.vehicle, _named(need.facts()))
            say_at(host, need.until_s, need.vehicle, _named(need.taken_back()))

    def needs(self, model: WorldModel, common: NeedsIndex | GroupNeeds) -> NeedsInForce:
        return NeedsInForce(model, common, self._agreed, self._kept)


def _named(facts: Iterable[Fact]) -> Callable[[Beliefs], list[Named]]:
    return lambda beliefs: [beliefs.fact(*fact) for fact in facts]


FEATURE = Feature(
    {"": {KEY: (tuple[NeedTable, ...], ())}},
    StatedNeeds,
    need_faults,
    words,
    NEED_ATTRIBUTES,
    metrics=(Metric("n_expired", "", Better.LOWER, "expired items", n_expired, note="Too old, or queue full."),),
    instances=instances_of,
    needed=needed,
    made_checks=of_faults,
)
