"""What a vehicle believes, as facts an HTN planner can look up.

A key is ``(attribute, instance)`` by name, for example ``("hasMission", "Operational")``. Its value is
the latest in the vehicle's world model, links given by the name of their target.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from worldmodel import Change, PropertyValue, TBox, ValueKind, WorldModel

Key = tuple[str, str]


class Beliefs:
    """Facts of one vehicle: ``get(key, default)``."""

    def __init__(self, model: WorldModel) -> None:
        self.model = model
        self._tbox: TBox = model.tbox

    def get(self, key: Key, default: Any = None, /) -> Any:
        attribute = self._tbox.attribute_named(key[0])
        value = self.model.value(self.model.instance_named(key[1]).uid, attribute.uid)
        if value is None:
            return default
        if attribute.kind is ValueKind.LINK:
            return self.name(int(value))  # type: ignore[arg-type]  # a link is an instance uid
        return value

    def observed_s(self, key: Key) -> float | None:
        """When the latest value of a fact was observed; None if it is not known."""
        latest = self.model.latest(self.uid(key[1]), self._tbox.attribute_named(key[0]).uid)
        return None if latest is None else latest.time_s

    def name(self, uid: int) -> str:
        instance = self.model.instance(uid)
        return instance.name if instance is not None else f"instance {uid}"

    def uid(self, name: str) -> int:
        return self.model.instance_named(name).uid

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
        value = self.name(fact.target) if attribute.kind is ValueKind.LINK else fact.value
        return self.name(fact.subject), attribute.name, value

    def fact(self, subject: str, attribute: str, value: str | float | bool) -> tuple[int, int, Any]:
        """A fact ready to be recorded; a string value is the name of the instance linked to."""
        uid = self._tbox.attribute_named(attribute).uid
        return self.uid(subject), uid, self.uid(value) if isinstance(value, str) else value
