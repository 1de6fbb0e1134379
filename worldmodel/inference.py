"""Inference: classes whose definitions an instance meets, and further links.

Conclusions are a function of the *seen* facts: latest values, asserted types and common facts, without excluded
origins. They disappear with the values that they depend on, and do not depend on arrival. Block checks use asserted
types only, since the merge must not depend on a view. Inferred links are traversed on request, not stored.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Protocol, cast

from worldmodel.errors import FactError
from worldmodel.facts import Instance, PropertyValue
from worldmodel.ontology.axioms import CompiledAxioms, ValueCondition
from worldmodel.ontology.fields import Value
from worldmodel.ontology.tbox import TYPE_UID, TBox, ValueKind

Slot = tuple[int, int]  # (subject, attribute)


class FactSource(Protocol):
    """Facts that inference reads, without those of excluded origins."""

    def value(self, subject: int, attribute: int) -> Value | None:
        """Return the latest value of a property."""

    def told_classes(self, uid: int) -> int:
        """Return the classes of the asserted types of an instance, bit c for class c."""

    @property
    def banned(self) -> Collection[int]:
        """Excluded origins; equal as long as nothing changes."""


class Inference:
    """Conclusions of one world model; ``version`` grows whenever a class or link may have changed."""

    def __init__(
        self,
        tbox: TBox,
        seen: FactSource,
        instances: Sequence[Instance],
        touched: set[Slot],
        common_facts: Iterable[PropertyValue] = (),
    ) -> None:
        self.rules = tbox.rules
        self.version = 0
        self._seen = seen
        self._common: dict[Slot, tuple[int, ...]] = {}
        self.touched = touched
        for fact in common_facts:
            slot = (fact.subject, fact.attribute)
            kind = tbox.attributes[fact.attribute].kind
            if kind is ValueKind.TYPE:
                raise FactError(f"common fact {tuple(fact)} states a class; allowed: the class of a common instance")
            if kind is ValueKind.LINK:
                self._common[slot] = (*self._common.get(slot, ()), fact.target)
            elif fact.attribute in self.rules.heeded:
                self.touched.add(slot)
        of_rules = {TYPE_UID, *self.rules.heeded} if self.rules.is_needed else set()
        self.heeded = frozenset({*of_rules, *(attribute for _, attribute in self._common)})
        self.touched.update(self._common)
        self._banned: Collection[int] = seen.banned
        self._graph = _Links(self.rules)
        # classes and conditions of each instance that follow from its own types and values
        self._base = {instance.uid: self.rules.closed(tbox.ancestor_mask(instance.class_uid)) for instance in instances}
        self._classes: dict[int, int] = {}  # of linked instances, with conditions on links
        self._links = {a.uid for a in tbox.attributes if a.kind is ValueKind.LINK}
        self._of_values: dict[int, list[ValueCondition]] = {}  # by attribute
        self._of_links: dict[int, list[ValueCondition]] = {}
        for condition in self.rules.conditions:
            conditions = self._of_values if condition.filler is None else self._of_links
            conditions.setdefault(condition.attribute, []).append(condition)

    # Questions -----------------------------------------------------------------------------------

    def classes(self, uid: int) -> int:
        """Return the asserted and inferred classes of an instance, bit c for class c."""
        if not self.rules.is_needed:
            return self._seen.told_classes(uid)
        self.settle()
        mask = self._classes[uid] if uid in self._classes else self._base.get(uid, 0)
        return mask & (1 << self.rules.n_classes) - 1

    def concluded_classes(self, uid: int) -> int:
        """Return the inferred classes that are not asserted, bit c for class c."""
        return self.classes(uid) & ~self._seen.told_classes(uid)

    def links(self, subject: int, attribute: int) -> tuple[int, ...]:
        """Return the sorted targets of an instance: latest value, common facts and inferred links."""
        self.settle()
        return tuple(sorted({*self.told_links(subject, attribute), *self._graph.reached(subject, attribute)}))

    def told_links(self, subject: int, attribute: int) -> tuple[int, ...]:
        """Return the asserted targets: common facts and latest value."""
        targets, value = self._common.get((subject, attribute), ()), self._seen.value(subject, attribute)
        return tuple(dict.fromkeys(targets if value is None else (*targets, cast(int, value))))

    def linked_attributes(self) -> frozenset[int]:
        """Return the attributes that may have links beyond the latest value."""
        return self.rules.derived | {attribute for _, attribute in self._common}

    # Changes -------------------------------------------------------------------------------------

    def settle(self) -> None:
        """Process the changed properties, and classes and links that may follow from them."""
        # Properties outside all rules are not reported as touched, but their types and links may have changed.
        if self._banned != self._seen.banned:
            self._banned = self._seen.banned
            self.version += 1
        if not self.touched:
            return
        is_due = False
        for subject, attribute in self.touched:
            if attribute in self._links:
                is_due |= self._graph.tell((subject, attribute), self.told_links(subject, attribute))
            if attribute == TYPE_UID or attribute in self._of_values:
                before, now = self._base.get(subject, 0), self._base_now(subject)
                self._base[subject] = now
                # The classes of an instance without links follow from its own facts alone.
                is_due |= before != now and subject in self._classes
        self.touched.clear()
        self.version += 1
        if is_due:
            self._classes = self._concluded()

    def _base_now(self, uid: int) -> int:
        mask = self._seen.told_classes(uid)
        for attribute, conditions in self._of_values.items():
            value = self._seen.value(uid, attribute)
            for condition in conditions:
                if value is not None and condition.value == value:
                    mask |= self.rules.bit_of(condition)
        return self.rules.closed(mask)

    def _concluded(self) -> dict[int, int]:
        # Least fixed point from the own facts: after a withdrawal, two instances could otherwise support each other.
        classes = {uid: self._base.get(uid, 0) for uid in self._graph.ends()}
        before: dict[int, int] = {}
        while before != classes:
            before = {**classes}
            for uid, mask in classes.items():
                met = mask
                for attribute, conditions in self._of_links.items():
                    of_ends = 0
                    for end in self._graph.reached(uid, attribute):
                        of_ends |= classes[end]
                    met |= sum(self.rules.bit_of(each) for each in conditions if of_ends >> (each.filler or 0) & 1)
                classes[uid] = self.rules.closed(met)
        return classes


class _Links:
    def __init__(self, rules: CompiledAxioms) -> None:
        self._rules = rules
        self._targets: dict[Slot, tuple[int, ...]] = {}
        self._linking: dict[Slot, list[int]] = {}  # (target, attribute) -> subjects
        self._leading = [
            [(leading, flipped) for leading, flipped in sources if leading in rules.transitive]
            for sources in rules.sources
        ]

    def tell(self, slot: Slot, targets: tuple[int, ...]) -> bool:
        subject, attribute = slot
        before = self._targets.get(slot, ())
        if before == targets:
            return False
        self._targets[slot] = targets
        for target in before:
            self._linking[target, attribute].remove(subject)
        for target in targets:
            self._linking.setdefault((target, attribute), []).append(subject)
        return True

    def ends(self) -> Iterator[int]:
        for (subject, _), targets in self._targets.items():
            if targets:
                yield subject
            yield from targets

    def reached(self, uid: int, attribute: int) -> Iterator[int]:
        yield from self._step(uid, attribute)
        for leading, flipped in self._leading[attribute]:
            yield from self._walk(uid, leading, flipped)

    def _walk(self, uid: int, attribute: int, backward: bool) -> Iterator[int]:
        reached: set[int] = set()
        front = [uid]
        while front:
            for instance in self._step(front.pop(), attribute, backward):
                if instance not in reached:
                    reached.add(instance)
                    front.append(instance)
                    yield instance

    def _step(self, uid: int, attribute: int, backward: bool = False) -> Iterator[int]:
        for source, flipped in self._rules.sources[attribute]:
            links = self._linking if backward != flipped else self._targets
            yield from links.get((uid, source), ())
