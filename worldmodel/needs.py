"""The needs of a vehicle: values of an attribute of a class, or of one instance, with a priority.

"Each need specifies a named attribute of either an ontological class or specific class instance, referenced
by UID" (Maurelli et al., Multi-robot cooperation, section IV). ``NeedsIndex`` groups the same needs of
different peers and answers for one fact in two dictionary look-ups, since it enters a need of a class for
every subclass. Needs that follow from something else answer in its place, see ``Needs``.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol

from worldmodel.errors import NeedError
from worldmodel.facts import PropertyValue
from worldmodel.tbox import TBox

Wanted = tuple[int, int]
"""(bit mask of the peers that need a fact, highest priority among them)."""

NOBODY: Wanted = (0, 0)
"""Nobody needs a fact."""


class Needs(Protocol):
    """Who needs what, as one vehicle believes; the answers may change while the program runs."""

    def priority_of(self, fact: PropertyValue, class_uid: int) -> Wanted:
        """Which peers need a fact, and the highest priority among them.

        Args:
            fact: told of an instance.
            class_uid: of the class of that instance.
        """
        ...


@dataclass(frozen=True, slots=True)
class InformationNeed:
    """The need for values of ``attribute``: of all instances of ``class_uid``, or of one ``instance``.

    >>> InformationNeed(attribute=3, priority=1, class_uid=2, instance=4)
    Traceback (most recent call last):
    worldmodel.errors.NeedError: class_uid is 2 and instance is 4; allowed: exactly one of the two
    """

    attribute: int
    priority: int
    class_uid: int | None = None
    instance: int | None = None

    def __post_init__(self) -> None:
        if (self.class_uid is None) == (self.instance is None):
            raise NeedError(
                f"class_uid is {self.class_uid} and instance is {self.instance}; allowed: exactly one of the two"
            )
        if self.priority < 1:
            raise NeedError(f"priority is {self.priority}; allowed: 1 or more")


class NeedsIndex:
    """The needs of all peers, indexed by class or instance and attribute."""

    def __init__(self, tbox: TBox, needs_by_peer: Mapping[int, Iterable[InformationNeed]]) -> None:
        """Index the needs of each peer (0, 1, ...); raises NeedError when a need names an unknown uid."""
        self._of_class: dict[tuple[int, int], Wanted] = {}
        self._of_instance: dict[tuple[int, int], Wanted] = {}
        for peer, needs in needs_by_peer.items():
            for need in needs:
                self._add(tbox, peer, need)

    def _add(self, tbox: TBox, peer: int, need: InformationNeed) -> None:
        if not 0 <= need.attribute < len(tbox.attributes):
            raise NeedError(f"peer {peer} needs attribute {need.attribute}; allowed: 0..{len(tbox.attributes) - 1}")
        wanted = (1 << peer, need.priority)
        if need.instance is not None:
            key = (need.instance, need.attribute)
            self._of_instance[key] = _together(self._of_instance.get(key, NOBODY), wanted)
        elif need.class_uid is not None:
            if not 0 <= need.class_uid < len(tbox.classes):
                raise NeedError(f"peer {peer} needs class {need.class_uid}; allowed: 0..{len(tbox.classes) - 1}")
            for class_uid in tbox.subclasses(need.class_uid):
                key = (class_uid, need.attribute)
                self._of_class[key] = _together(self._of_class.get(key, NOBODY), wanted)

    def priority_of(self, fact: PropertyValue, class_uid: int) -> Wanted:
        """Which peers need a fact, and the highest priority among them.

        Args:
            fact: told of an instance; its value makes no difference here.
            class_uid: of the class of that instance.
        """
        by_class = self._of_class.get((class_uid, fact.attribute), NOBODY)
        by_instance = self._of_instance.get((fact.subject, fact.attribute))
        return by_class if by_instance is None else _together(by_class, by_instance)


def _together(a: Wanted, b: Wanted) -> Wanted:
    return (a[0] | b[0], max(a[1], b[1]))
