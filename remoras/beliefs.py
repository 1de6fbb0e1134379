"""Beliefs of a vehicle: facts by name, for missions and plug-ins.

A key is ``(attribute, instance)``, for example ``("hasMission", "Operational")``. Its value is the latest in the
vehicle's world model; links are given by the name of their target, symbols by their text.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar, cast

from exchange.arithmetic import distance
from remoras.sensor import SELF, Observation
from worldmodel import (
    TYPE_UID,
    Attribute,
    Change,
    FactError,
    Instance,
    PropertyValue,
    TBox,
    UnknownNameError,
    ValueKind,
    WorldModel,
    fused,
)
from worldmodel.facts import Observation as Latest

T = TypeVar("T")


class Known:
    """Facts known to a vehicle, by ``(attribute, instance)``; empty without a world model.

    >>> Known().get(("position", "AUV01"), "unknown")
    'unknown'
    """

    def take_read(self) -> Set[Key]:
        """Return the facts read by ``values`` since the last call."""
        return frozenset()

    def take_changed(self) -> Set[Key]:
        """Return the facts read by ``values`` before that have changed since the last call."""
        return frozenset()

    def derived(self, key: object, derive: Callable[[], T], /) -> T:
        """Return a value that ``derive`` computes from facts read by ``values``, kept by key until one changes."""
        return derive()

    def get(self, key: Key, default: Any = None, /) -> Any:
        """Return the latest value of a fact, or ``default`` if unknown."""
        return default

    def values(self, key: Key) -> Set[Any]:
        """Return all values ever asserted for a fact, except by excluded origins."""
        return frozenset()

    def instances(self, of_class: str, /) -> tuple[str, ...]:
        """Return the names of all known instances of a class, asserted or inferred."""
        return ()


NOTHING_KNOWN = Known()


Key = tuple[str, str]
Point = tuple[float, float]
Fact = tuple[int, int, Any] | tuple[int, int, Any, float]
"""Subject, attribute, value and optional uncertainty, ready to be recorded."""


@dataclass(slots=True)
class _Collected:
    key: Key
    attribute: Attribute
    values: set[Any]


class Fused(NamedTuple):
    """Combined observations of several vehicles about one fact, by names.

    ``value`` is the mean of numbers and points, else the most probable one; ``uncertainty`` its standard deviation or
    probability, None if not stated. ``time_s``: newest observation; ``probabilities``: of all symbols.
    """

    value: Any
    uncertainty: float | None
    time_s: float
    origins: tuple[str, ...]
    probabilities: Mapping[Any, float]


class Beliefs(Known):
    """Facts of one vehicle by names, read from and written for its world model."""

    def __init__(self, model: WorldModel) -> None:
        self.model = model
        self._tbox: TBox = model.tbox
        self._uids: dict[str, int] = {}
        self._names = [instance.name for instance in model.common_instances]
        self._slots: dict[Key, tuple[int, Attribute]] = {}
        self._collected: dict[tuple[int, int], _Collected] = {}  # by (subject, attribute), on request
        self._by_key: dict[Key, _Collected] = {}  # by key
        self._read: set[Key] = set()
        self._changed: set[Key] = set()
        self._derived: dict[object, tuple[Any, set[Key]]] = {}
        self._trust = model.index.trust
        self._banned = self._trust.from_s
        self._from_s: dict[tuple[int, int], float] = {}  # by (subject, attribute), where old values are invalid
        self._n_over = Counter[tuple[int, int]]()

    # From the world model ------------------------------------------------------------------------

    def get(self, key: Key, default: Any = None, /) -> Any:
        subject, attribute = self._slots.get(key) or self._slot(key)
        value = self.model.value(subject, attribute.uid)
        if value is None or (self._from_s and self._latest(key) is None):
            return default
        return self._plain(attribute, value)

    def count_from(self, key: Key, from_s: float) -> None:
        """Invalidate all values of a fact observed before ``from_s``."""
        subject, attribute = self._slots.get(key) or self._slot(key)
        slot = subject, attribute.uid
        self._n_over[slot] += from_s > self._from_s.get(slot, -math.inf)
        self._from_s[slot] = from_s
        if slot in self._collected:
            self._set_anew(slot, self._collected[slot])

    def n_over(self, key: Key) -> int:
        """Return how many times values of a fact have been invalidated."""
        subject, attribute = self._slots.get(key) or self._slot(key)
        return self._n_over[subject, attribute.uid]

    def _slot(self, key: Key) -> tuple[int, Attribute]:
        attribute = self._tbox.attribute_named(key[0])
        slot = self._slots[key] = self.uid(key[1]), attribute
        return slot

    def values(self, key: Key) -> Set[Any]:
        """Return all valid values of a fact; the set grows in place until values are invalidated."""
        if (collected := self._by_key.get(key)) is None:
            subject, attribute = self._slots.get(key) or self._slot(key)
            slot = subject, attribute.uid
            if slot not in self._collected:
                self.model.watched.add(slot)
                self._collected[slot] = _Collected(key, attribute, self._all(slot, attribute))
            collected = self._by_key[key] = self._collected[slot]
        self._read.add(collected.key)
        return collected.values

    def take_read(self) -> Set[Key]:
        read, self._read = self._read, set()
        return read

    def take_changed(self) -> Set[Key]:
        changed, self._changed = self._changed, set()
        return changed

    def derived(self, key: object, derive: Callable[[], T], /) -> T:
        if key not in self._derived:
            before, self._read = self._read, set()
            value = derive()
            self._derived[key], self._read = (value, self._read), before
        value, read = self._derived[key]
        self._read |= read
        return value

    def _all(self, slot: tuple[int, int], attribute: Attribute) -> set[Any]:
        from_s = self._from_s.get(slot, -math.inf)
        valid = [observation.value for observation in self.model.history(*slot) if observation.time_s >= from_s]
        # Common knowledge is valid until the first observation.
        return {self._plain(attribute, value) for value in valid or self.model.common_values(*slot)}

    def note(self) -> None:
        """Update ``values`` after facts were recorded or merged."""
        # An exclusion, or its end, also concerns values collected earlier.
        if self._banned is not self._trust.from_s:
            self._banned = self._trust.from_s
            self.model.take_news()
            for slot, collected in self._collected.items():
                self._set_anew(slot, collected)
            return
        for observation in self.model.take_news() if self.model.news else ():
            slot = observation.fact.subject, observation.fact.attribute
            if observation.time_s >= self._from_s.get(slot, -math.inf):
                collected = self._collected[slot]
                collected.values.add(self._plain(collected.attribute, observation.value))
                self._note_change(collected.key)

    def _note_change(self, fact: Key) -> None:
        self._changed.add(fact)
        for key in [key for key, (_, read) in self._derived.items() if fact in read]:
            del self._derived[key]

    def _set_anew(self, slot: tuple[int, int], collected: _Collected) -> None:
        collected.values = self._all(slot, collected.attribute)
        self._note_change(collected.key)

    def fused(
        self,
        key: Key,
        prior: Mapping[Any, float] | None = None,
        independent: bool = True,
        since_s: float | None = None,
        drift: float | None = None,
        shared: float = 0.0,
        by: str | None = None,
        at_s: float | None = None,
    ) -> Fused | None:
        """Combine the observations of all vehicles about a fact; None without any.

        ``prior`` weighs each symbol or truth value before observations; None: uniformly. ``independent`` is False if
        vehicles may have adopted each other's values, see ``worldmodel.fusion``. ``since_s`` is the earliest
        observation time, ``by`` the only vehicle to use, None for all. ``drift``, ``shared`` and ``at_s`` are as in
        ``worldmodel.fused``. Raises UnknownNameError, or FactError for an impossible prior, drift or error.
        """
        subject, attribute = self._slots.get(key) or self._slot(key)
        weights = None if prior is None else {self._value(attribute, value): w for value, w in prior.items()}
        observations: Sequence[Latest] = self.model.history(subject, attribute.uid, since_s)
        if by is not None:
            origin = self.uid(by)
            observations = [observation for observation in observations if observation.origin == origin]
        combined = fused(attribute, observations, weights, independent, drift, shared, at_s)
        if combined is None:
            return None
        return Fused(
            self._plain(attribute, combined.value),
            combined.uncertainty,
            combined.time_s,
            tuple(self.name(origin) for origin in combined.origins),
            {self._plain(attribute, value): share for value, share in combined.probabilities},
        )

    def count(self, key: Key, value: Any) -> int:
        """Return the number of observations of a value, excluded origins apart."""
        subject, attribute = self._slots.get(key) or self._slot(key)
        stored = self._value(attribute, value)
        return sum(observation.value == stored for observation in self.model.history(subject, attribute.uid))

    def observed_s(self, key: Key) -> float | None:
        """Return the time of the latest value of a fact; None if unknown."""
        latest = self._latest(key)
        return None if latest is None else latest.time_s

    def origin(self, key: Key) -> str | None:
        """Return the vehicle that observed the latest value of a fact; None if unknown."""
        latest = self._latest(key)
        return None if latest is None else self.name(latest.origin)

    def _latest(self, key: Key) -> Latest | None:
        subject, attribute = self._slots.get(key) or self._slot(key)
        latest = self.model.latest(subject, attribute.uid)
        if latest is not None and latest.time_s < self._from_s.get((subject, attribute.uid), -math.inf):
            return None
        return latest

    def is_a(self, name: str, of_class: str) -> bool:
        """Return whether an instance belongs to a class, asserted or inferred."""
        return bool(self.model.inference.classes(self.uid(name)) >> self._tbox.class_named(of_class).uid & 1)

    def instances(self, of_class: str) -> tuple[str, ...]:
        return tuple(instance.name for instance in self.model.instances_of(self._tbox.class_named(of_class).uid))

    def linked(self, key: Key) -> tuple[str, ...]:
        """Return the names of linked instances: latest value, common knowledge and inference."""
        subject, attribute = self._slots.get(key) or self._slot(key)
        return tuple(self.name(uid) for uid in self.model.inference.links(subject, attribute.uid))

    def name(self, uid: int) -> str:
        """Return the name of an instance; those created in the mission have class and uid."""
        if 0 <= uid < len(self._names):
            return self._names[uid]
        instance = self.model.instance(uid)
        return instance.name if instance is not None else f"instance {uid}"

    def uid(self, name: str) -> int:
        """Return the instance of that name; raise UnknownNameError."""
        if name not in self._uids:
            self._uids[name] = self._found(name).uid
        return self._uids[name]

    def _found(self, name: str) -> Instance:
        try:
            return self.model.instance_named(name)
        except UnknownNameError:
            # An instance created in the mission is named by class and uid.
            number = name.rpartition("-")[2]
            created = self.model.instance(int(number)) if number.isdecimal() else None
            if created is None or created.name != name:
                raise
            return created

    def keys_of(self, changes: Iterable[Change]) -> set[Key]:
        """Return the keys whose latest value has changed."""
        return {
            (self._tbox.attributes[fact.attribute].name, self.name(fact.subject))
            for change in changes
            for fact in change.new_latest
        }

    def by_name(self, fact: PropertyValue) -> tuple[str, str, Any]:
        """Return (subject, attribute, value) of a fact, by names."""
        attribute = self._tbox.attributes[fact.attribute]
        return self.name(fact.subject), attribute.name, self._plain(attribute, fact.value)

    def as_text(self, fact: PropertyValue) -> tuple[str, str, str]:
        """Return (subject, attribute, value) as texts; the value can be parsed back exactly."""
        attribute = self._tbox.attributes[fact.attribute]
        linked = attribute.kind is ValueKind.LINK
        value = self.name(fact.target) if linked else self._tbox.text_of(attribute, fact.value)
        return self.name(fact.subject), attribute.name, value

    def _plain(self, attribute: Attribute, value: Any) -> Any:
        if attribute.kind is ValueKind.LINK:
            return self.name(value)
        return attribute.symbols[value] if attribute.kind is ValueKind.SYMBOL else value

    # To the world model --------------------------------------------------------------------------

    def fact(
        self, subject: str, attribute: str, value: Any, uncertainty: float | None = None, *, new_uid: int | None = None
    ) -> Fact:
        """Return a fact ready to be recorded; UnknownNameError, or FactError for an unknown symbol.

        ``value`` is a name (link), symbol, number, point (x, y) or truth value. ``uncertainty`` is the standard
        deviation of numbers and points, else a probability; None if unknown. ``new_uid``: of a new instance, ``SELF``.
        """

        def uid(name: str) -> int:
            if name == SELF and new_uid is None:
                raise FactError("SELF is the instance that an observation creates; set its found")
            return new_uid if new_uid is not None and name == SELF else self.uid(name)

        kind = self._tbox.attribute_named(attribute)
        value = uid(value) if kind.kind is ValueKind.LINK and isinstance(value, str) else self._value(kind, value)
        if uncertainty is None:
            return uid(subject), kind.uid, value
        return uid(subject), kind.uid, value, uncertainty

    def facts_of(self, observation: Observation) -> list[Fact]:
        """Return the facts of an observation, recorded together; a detection is a new instance."""
        if not observation.found:
            return [self.fact(*fact) for fact in observation.facts]
        class_uid = self._tbox.class_named(observation.found).uid
        known = _nearest(self.model, observation, class_uid) if observation.within_m > 0.0 else None
        if known is not None:
            return [self.fact(*fact, new_uid=known) for fact in observation.facts]
        uid = self.model.new_instance_uid()
        return [(uid, TYPE_UID, class_uid), *(self.fact(*fact, new_uid=uid) for fact in observation.facts)]

    def _value(self, attribute: Attribute, value: Any) -> Any:
        if attribute.kind is not ValueKind.SYMBOL or not isinstance(value, str):
            return value
        if value not in attribute.symbols:
            raise FactError(f"{attribute.name} is {value!r}; allowed: {', '.join(attribute.symbols)}")
        return attribute.symbols.index(value)


def _nearest(model: WorldModel, observation: Observation, class_uid: int) -> int | None:
    """Return the nearest instance of a class in range by any report, even of excluded vehicles."""
    points = [fact for fact in observation.facts if fact[0] == SELF and isinstance(fact[2], tuple)]
    if not points:
        return None
    attribute, at_m = model.tbox.attribute_named(points[0][1]).uid, cast(Point, points[0][2])
    near: list[tuple[float, int]] = []
    for uid in model.instance_uids():
        if model.class_mask(uid) >> class_uid & 1:
            last = {fact.origin: cast(Point, fact.value) for fact in model.facts_of(uid, attribute)}
            near += [(distance(known_m, at_m), uid) for known_m in last.values()]
    way_m, nearest = min(near, default=(math.inf, -1))
    return nearest if way_m <= observation.within_m else None
