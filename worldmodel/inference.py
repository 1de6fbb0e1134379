"""Inference: classes whose definitions an instance meets, and further links.

Conclusions are a function of the *seen* facts: latest values, asserted types and common facts, without excluded
origins. They do not depend on the arrival order, and disappear with the values that they depend on. Block checks use
asserted types only, since the merge must not depend on a view.

After a change, ``Inference`` recomputes the classes of instances reachable along the links of conditions. After a
retraction it first drops everything that may depend on it, so two instances cannot support each other.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import NamedTuple, Protocol

from worldmodel.errors import FactError
from worldmodel.facts import Instance, PropertyValue
from worldmodel.ontology.axioms import CompiledAxioms, ValueCondition
from worldmodel.ontology.fields import Value
from worldmodel.ontology.tbox import TYPE_UID, TBox, ValueKind

Slot = tuple[int, int]
"""(subject, attribute)."""


class FactSource(Protocol):
    """Facts that inference reads, without those of excluded origins."""

    def value(self, subject: int, attribute: int) -> Value | None:
        """Return the latest value of a property."""

    def told_classes(self, uid: int) -> int:
        """Return the classes of the asserted types of an instance, bit c for class c."""

    @property
    def banned(self) -> Collection[int]:
        """Excluded origins; equal as long as nothing changes."""


class Concluded(NamedTuple):
    """Gained and lost memberships, each as (instance uid, class uid)."""

    gained: frozenset[tuple[int, int]]
    lost: frozenset[tuple[int, int]]


class Inference:
    """Conclusions of one world model; ``heeded`` are the attributes used.

    ``version`` grows whenever a class or link may have changed.
    """

    def __init__(
        self,
        tbox: TBox,
        seen: FactSource,
        instances: Sequence[Instance],
        touched: set[Slot],
        common_facts: Iterable[PropertyValue] = (),
    ) -> None:
        """Create the conclusions; the store adds changed properties to the shared set ``touched``."""
        self.rules = tbox.rules
        self.version = 0
        self._seen = seen
        self._common: dict[Slot, tuple[Value, ...]] = {}
        self.touched = touched
        for fact in common_facts:
            slot = (fact.subject, fact.attribute)
            kind = tbox.attributes[fact.attribute].kind
            if kind is ValueKind.TYPE:
                raise FactError(f"common fact {tuple(fact)} is a type; allowed: the class of a common instance")
            if kind is ValueKind.LINK:
                self._common[slot] = (*self._common.get(slot, ()), fact.value)
            elif fact.attribute in self.rules.heeded:
                self.touched.add(slot)
        of_rules = {TYPE_UID, *self.rules.heeded} if self.rules.is_needed else set()
        self.heeded = frozenset({*of_rules, *(attribute for _, attribute in self._common)})
        self.touched.update(self._common)
        self._banned: Collection[int] = seen.banned
        self._graph = _Links(self.rules)
        self._base = {instance.uid: self.rules.closed(tbox.ancestor_mask(instance.class_uid)) for instance in instances}
        self._met: dict[int, int] = {}  # instance uid -> conditions met by links
        self._classes: dict[int, int] = {}
        self._links = {a.uid for a in tbox.attributes if a.kind is ValueKind.LINK}
        self._bits_on: dict[int, int] = {}  # attribute -> conditions on its links
        for condition in self.rules.of_links:
            bits = self._bits_on.get(condition.attribute, 0)
            self._bits_on[condition.attribute] = bits | self.rules.bit_of(condition)
        self._of_values: dict[int, list[ValueCondition]] = {}
        for condition in self.rules.conditions:
            if condition.filler is None:
                self._of_values.setdefault(condition.attribute, []).append(condition)

    # Questions -----------------------------------------------------------------------------------

    def classes(self, uid: int) -> int:
        """Return the asserted and inferred classes of an instance, bit c for class c."""
        if not self.rules.is_needed:
            return self._seen.told_classes(uid)
        self.settle()
        return self._classes_of(uid) & (1 << self.rules.n_classes) - 1

    def concluded_classes(self, uid: int) -> int:
        """Return the inferred classes that are not asserted, bit c for class c."""
        return self.classes(uid) & ~self._seen.told_classes(uid)

    def links(self, subject: int, attribute: int) -> tuple[int, ...]:
        """Return the sorted targets of an instance: latest value, common facts and inferred links."""
        self.settle()
        return tuple(sorted({*self.told_links(subject, attribute), *self._graph.reached(subject, attribute)}))

    def told_links(self, subject: int, attribute: int) -> tuple[int, ...]:
        """Return the asserted targets: common facts and latest value."""
        value = self._seen.value(subject, attribute)
        return tuple(dict.fromkeys(map(_uid, (*self._common.get((subject, attribute), ()), *_all(value)))))

    def linked_attributes(self) -> frozenset[int]:
        """Return the attributes that may have links beyond the latest value."""
        return self.rules.derived | {attribute for _, attribute in self._common}

    # Changes -------------------------------------------------------------------------------------

    def settle(self) -> Concluded:
        """Process the changed properties; return the gained and lost classes."""
        if self._banned != self._seen.banned:
            self._banned = self._seen.banned
            self.version += 1
        if not self.touched:
            return _NOTHING
        touched = list(self.touched)
        self.touched.clear()
        before: dict[int, int] = {}
        doubted: dict[int, int] = {}
        grown: set[int] = set()
        for slot in touched:
            self._look_at(slot, doubted, grown)
        self._forget(doubted, before)
        self._conclude(grown.union(doubted), before)
        self.version += 1
        return self._changed(before)

    def _look_at(self, slot: Slot, doubted: dict[int, int], grown: set[int]) -> None:
        """Read one property; collect instances with conditions in doubt and instances with gains."""
        subject, attribute = slot
        if attribute in self._links:
            graph, old, new = self._graph, self._graph.told(slot), self.told_links(subject, attribute)
            for target in (linked for linked in old if linked not in new):
                for uid, asked in graph.concerned(subject, attribute, target, self._bits_on):
                    doubted[uid] = doubted.get(uid, 0) | self._bits_on[asked]
                graph.take(subject, attribute, target)
            for target in (linked for linked in new if linked not in old):
                graph.add(subject, attribute, target)
                grown.update(uid for uid, _ in graph.concerned(subject, attribute, target, self._bits_on))
        if attribute == TYPE_UID or attribute in self._of_values:
            old_base, base = self._base_of(subject), self._base_now(subject)
            self._classes.setdefault(subject, old_base)
            self._base[subject] = base
            if old_base & ~base:
                doubted.setdefault(subject, 0)
            if base & ~old_base:
                grown.add(subject)

    def _base_now(self, uid: int) -> int:
        """Return the classes and conditions that follow from an instance's own types and values."""
        mask = self._seen.told_classes(uid)
        for attribute, conditions in self._of_values.items():
            value = self._seen.value(uid, attribute)
            for condition in conditions:
                if value is not None and condition.value == value:
                    mask |= self.rules.bit_of(condition)
        return self.rules.closed(mask)

    def _base_of(self, uid: int) -> int:
        return self._base.get(uid, 0)

    def _classes_of(self, uid: int) -> int:
        known = self._classes.get(uid)
        return self._base_of(uid) if known is None else known

    def _forget(self, doubted: dict[int, int], before: dict[int, int]) -> None:
        """Drop the conditions in doubt and all that may depend on them; extend ``doubted`` by these."""
        front = list(doubted)
        while front:
            uid = front.pop()
            old = self._classes_of(uid)
            before.setdefault(uid, old)
            self._met[uid] = self._met.get(uid, 0) & ~doubted[uid]
            now = self._classes[uid] = self.rules.closed(self._base_of(uid) | self._met[uid])
            for resting, bit in self._resting_on(uid, old & ~now):
                if not doubted.get(resting, 0) & bit:
                    doubted[resting] = doubted.get(resting, 0) | bit
                    front.append(resting)

    def _conclude(self, front: set[int], before: dict[int, int]) -> None:
        """Infer the classes of ``front`` and of all instances that depend on their gains."""
        while front:
            uid = front.pop()
            old = self._classes_of(uid)
            before.setdefault(uid, old)
            met = self._met.get(uid, 0)
            for condition in self.rules.of_links:
                bit = self.rules.bit_of(condition)
                if not (old | met) & bit and self._meets(uid, condition):
                    met |= bit
            self._met[uid] = met
            now = self._classes[uid] = self.rules.closed(self._base_of(uid) | met)
            front.update(resting for resting, _ in self._resting_on(uid, now & ~old))

    def _meets(self, uid: int, condition: ValueCondition) -> bool:
        assert condition.filler is not None
        ends = self._graph.reached(uid, condition.attribute)
        return any(self._classes_of(end) >> condition.filler & 1 for end in ends)

    def _resting_on(self, uid: int, classes: int) -> Iterator[tuple[int, int]]:
        """Yield each instance and bit of a condition met by a link to ``uid`` as one of ``classes``."""
        for condition in self.rules.of_links:
            if condition.filler is not None and classes >> condition.filler & 1:
                bit = self.rules.bit_of(condition)
                for resting in self._graph.reached(uid, condition.attribute, backward=True):
                    yield resting, bit

    def _changed(self, before: dict[int, int]) -> Concluded:
        n = self.rules.n_classes
        gained: set[tuple[int, int]] = set()
        lost: set[tuple[int, int]] = set()
        for uid, old in before.items():
            now = self._classes[uid]
            gained.update((uid, c) for c in range(n) if now & ~old & 1 << c)
            lost.update((uid, c) for c in range(n) if old & ~now & 1 << c)
        return Concluded(frozenset(gained), frozenset(lost))


class _Links:
    """Asserted links, indexed from both ends."""

    def __init__(self, rules: CompiledAxioms) -> None:
        self._rules = rules
        self._targets: dict[Slot, tuple[int, ...]] = {}
        self._linking: dict[Slot, dict[int, None]] = {}  # (target, attribute) -> subjects
        self._leading = [
            [(leading, flipped) for leading, flipped in sources if leading in rules.transitive]
            for sources in rules.sources
        ]

    def told(self, slot: Slot) -> tuple[int, ...]:
        """Return the targets of the last assertion."""
        return self._targets.get(slot, ())

    def add(self, subject: int, attribute: int, target: int) -> None:
        self._targets[subject, attribute] = (*self.told((subject, attribute)), target)
        self._linking.setdefault((target, attribute), {})[subject] = None

    def take(self, subject: int, attribute: int, target: int) -> None:
        slot = (subject, attribute)
        self._targets[slot] = tuple(linked for linked in self._targets[slot] if linked != target)
        del self._linking[target, attribute][subject]

    def reached(self, uid: int, attribute: int, backward: bool = False) -> Iterator[int]:
        """Yield the targets of an attribute, or its sources if ``backward``; may repeat."""
        yield from self._step(uid, attribute, backward)
        for leading, flipped in self._leading[attribute]:
            yield from self._walk(uid, leading, backward != flipped)

    def _walk(self, uid: int, attribute: int, backward: bool) -> Iterator[int]:
        reached: set[int] = set()
        front = [uid]
        while front:
            for instance in self._step(front.pop(), attribute, backward):
                if instance not in reached:
                    reached.add(instance)
                    front.append(instance)
                    yield instance

    def _step(self, uid: int, attribute: int, backward: bool) -> Iterator[int]:
        for source, flipped in self._rules.sources[attribute]:
            links = self._linking if backward != flipped else self._targets
            yield from tuple(links.get((uid, source), ()))

    def concerned(
        self, subject: int, attribute: int, target: int, conditional: Iterable[int]
    ) -> Iterator[tuple[int, int]]:
        """Yield (uid, attribute) of the ``conditional`` links that use an asserted, present link."""
        entailed = self._rules.entailed[attribute]
        for asked in conditional:
            for flipped in (False, True):
                if (asked, flipped) in entailed:
                    yield target if flipped else subject, asked
            for leading, turned in self._leading[asked]:
                for flipped in (False, True):
                    if (leading, flipped) in entailed:
                        # the end that the condition starts from, and all instances that reach it
                        end = target if flipped != turned else subject
                        yield end, asked
                        for uid in self._walk(end, leading, not turned):
                            yield uid, asked


_NOTHING = Concluded(frozenset(), frozenset())


def _all(value: Value | None) -> tuple[Value, ...]:
    return () if value is None else (value,)


def _uid(value: Value) -> int:
    assert isinstance(value, int)
    return value
