"""What a vehicle believes, as facts an HTN planner can look up.

A key is ``(attribute, instance)`` by name, for example ``("hasMission", "Operational")``. Its value is
the latest in the vehicle's world model; links are given by the name of their target, symbols by their text.
"""

from __future__ import annotations

from collections.abc import Iterable, Set
from typing import Any

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
)
from worldmodel.facts import Observation as Latest
from worldmodel.snapshot import as_text

Key = tuple[str, str]
Fact = tuple[int, int, Any]
"""Subject, attribute and value, ready to be recorded."""


class Beliefs:
    """Facts of one vehicle, by names.

    Args:
        model: its world model.
    """

    def __init__(self, model: WorldModel) -> None:
        self.model = model
        self._tbox: TBox = model.tbox
        self._uids: dict[str, int] = {}
        self._slots: dict[Key, tuple[int, Attribute]] = {}
        self._collected: dict[tuple[int, int], set[Any]] = {}  # by subject and attribute, where asked for
        self._by_key: dict[Key, set[Any]] = {}  # the same sets
        self.n_told = 0
        """It grows whenever a set that ``values`` gave does."""

    # From the world model ------------------------------------------------------------------------

    def get(self, key: Key, default: Any = None, /) -> Any:
        """The latest value of a fact, or ``default`` if it is not known."""
        subject, attribute = self._slots.get(key) or self._slot(key)
        value = self.model.value(subject, attribute.uid)
        return default if value is None else self._plain(attribute, value)

    def _slot(self, key: Key) -> tuple[int, Attribute]:
        """Instance and attribute of a key, which stay what they are."""
        attribute = self._tbox.attribute_named(key[0])
        slot = self._slots[key] = self.uid(key[1]), attribute
        return slot

    def values(self, key: Key) -> Set[Any]:
        """Every value of a fact that was ever told; the same set, which grows, whenever it is asked for."""
        if (found := self._by_key.get(key)) is not None:
            return found
        subject, attribute = self._slot(key)
        slot = subject, attribute.uid
        if slot not in self._collected:
            self._collected[slot] = {self._plain(attribute, one.value) for one in self.model.history(*slot)}
        found = self._by_key[key] = self._collected[slot]
        return found

    def note(self, changes: Iterable[Change]) -> None:
        """Keep ``values`` up to date with what was recorded or merged."""
        collected = self._collected
        if not collected:
            return
        for change in changes:
            for fact in change.block.facts:
                values = collected.get((fact.subject, fact.attribute))
                if values is not None:
                    values.add(self._plain(self._tbox.attributes[fact.attribute], fact.value))
                    self.n_told += 1

    def observed_s(self, key: Key) -> float | None:
        """When the latest value of a fact was observed; None if it is not known."""
        latest = self._latest(key)
        return None if latest is None else latest.time_s

    def origin(self, key: Key) -> str | None:
        """Who observed the latest value of a fact; None if it is not known."""
        latest = self._latest(key)
        return None if latest is None else self.name(latest.origin)

    def _latest(self, key: Key) -> Latest | None:
        subject, attribute = self._slots.get(key) or self._slot(key)
        return self.model.latest(subject, attribute.uid)

    def name(self, uid: int) -> str:
        """Name of an instance; those created in the mission are named by class and uid."""
        instance = self.model.instance(uid)
        return instance.name if instance is not None else f"instance {uid}"

    def uid(self, name: str) -> int:
        """The instance of that name; raises UnknownNameError."""
        if name not in self._uids:
            self._uids[name] = self._found(name).uid
        return self._uids[name]

    def _found(self, name: str) -> Instance:
        try:
            return self.model.instance_named(name)
        except UnknownNameError:
            number = name.rpartition("-")[2]
            created = self.model.instance(int(number)) if number.isdecimal() else None
            if created is None or created.name != name:
                raise
            return created

    def keys_of(self, changes: Iterable[Change]) -> set[Key]:
        """Keys whose latest value has changed."""
        return {
            (self._tbox.attributes[fact.attribute].name, self.name(fact.subject))
            for change in changes
            for fact in change.new_latest
        }

    def by_name(self, fact: PropertyValue) -> tuple[str, str, Any]:
        """A fact by names: (subject, attribute, value)."""
        attribute = self._tbox.attributes[fact.attribute]
        return self.name(fact.subject), attribute.name, self._plain(attribute, fact.value)

    def as_text(self, fact: PropertyValue) -> tuple[str, str, str]:
        """A fact by names: (subject, attribute, value as text that can be read back exactly)."""
        attribute = self._tbox.attributes[fact.attribute]
        linked = attribute.kind is ValueKind.LINK
        value = self.name(fact.target) if linked else as_text(self.model, attribute, fact.value)
        return self.name(fact.subject), attribute.name, value

    def _plain(self, attribute: Attribute, value: Any) -> Any:
        if attribute.kind is ValueKind.LINK:
            return self.name(value)
        return attribute.symbols[value] if attribute.kind is ValueKind.SYMBOL else value

    # To the world model --------------------------------------------------------------------------

    def fact(self, subject: str, attribute: str, value: Any) -> Fact:
        """A fact ready to be recorded.

        Args:
            value: the name of the instance linked to, a symbol, a number, a point (x, y) or a truth value.

        Raises:
            UnknownNameError: no such instance or attribute.
            FactError: the attribute has no such symbol.
        """
        return self._fact(subject, attribute, value, None)

    def facts_of(self, observation: Observation) -> list[Fact]:
        """The facts of an observation, ready to be recorded together; what it has found becomes a new instance.

        Raises:
            UnknownNameError: no such instance, attribute or class.
            FactError: the attribute has no such symbol, or no more instances may be created.
        """
        if not observation.found:
            return [self._fact(*fact, None) for fact in observation.facts]
        found = self._tbox.class_named(observation.found).uid
        uid = self.model.new_instance_uid()
        return [(uid, TYPE_UID, found), *(self._fact(*fact, uid) for fact in observation.facts)]

    def _fact(self, subject: str, attribute: str, value: Any, found: int | None) -> Fact:
        def uid(name: str) -> int:
            return found if found is not None and name == SELF else self.uid(name)

        of = self._tbox.attribute_named(attribute)
        if of.kind is ValueKind.LINK and isinstance(value, str):
            value = uid(value)
        elif of.kind is ValueKind.SYMBOL and isinstance(value, str):
            if value not in of.symbols:
                raise FactError(f"{attribute} is {value!r}; allowed: {', '.join(of.symbols)}")
            value = of.symbols.index(value)
        return uid(subject), of.uid, value
