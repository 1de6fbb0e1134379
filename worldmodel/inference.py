"""What follows from the facts that are seen: classes that an instance meets the definition of, and further links.

Conclusions are a function of the *seen* facts: of each slot the latest value, the types that an instance was given,
and the common facts; banned origins left out. So they depend on no order of arrival, and what rested on a value that
was replaced or banned goes with it. The checks of blocks ask for told types alone: what is merged must not depend on
a view.

``Inference`` reads the slots that changed since it was last asked, and only those of attributes that the rules heed.
Classes are worked out for the instances that such a change can reach along the links that conditions are about, and
kept. Where something was taken back, what may have rested on it is forgotten first, and then concluded anew as far as
it still holds; so two instances cannot hold up each other. Links that follow are walked when they are asked for.
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
    """The facts that conclusions are drawn from."""

    def value(self, subject: int, attribute: int) -> Value | None:
        """Return the latest value of a slot, banned origins left out."""

    def told_classes(self, uid: int) -> int:
        """Return the classes of the types that an instance was given, bit c for class c, banned origins left out."""

    @property
    def banned(self) -> Collection[int]:
        """The origins that are left out, equal as long as nothing changes."""


class Concluded(NamedTuple):
    """What became true and what is true no longer: (instance uid, class uid) each."""

    gained: frozenset[tuple[int, int]]
    lost: frozenset[tuple[int, int]]


class Inference:
    """The conclusions from one world model.

    Attributes:
        heeded: the attributes from whose values something is concluded.
        touched: their slots that changed and were not looked at since.
        version: grows whenever a class of an instance or a link may have changed.
    """

    def __init__(
        self,
        tbox: TBox,
        seen: FactSource,
        instances: Sequence[Instance],
        touched: set[Slot],
        common_facts: Iterable[PropertyValue] = (),
    ) -> None:
        """Know the common instances and facts.

        Args:
            tbox: the ontology; its rules are what is concluded by.
            seen: answers what is told.
            instances: the common instances.
            touched: to which slots of attributes ``heeded`` are added as they change.
            common_facts: facts about them that all know before the mission; those of one slot hold side by side.
        """
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
        self._met: dict[int, int] = {}  # conditions that are met by links
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
        """Return the classes that an instance is seen to be of, told and concluded, bit c for class c."""
        if not self.rules.is_needed:
            return self._seen.told_classes(uid)
        self.settle()
        return self._classes_of(uid) & (1 << self.rules.n_classes) - 1

    def concluded_classes(self, uid: int) -> int:
        """Return the classes among ``classes`` that no type of the instance has above it."""
        return self.classes(uid) & ~self._seen.told_classes(uid)

    def links(self, subject: int, attribute: int) -> tuple[int, ...]:
        """Return what an instance links to: by its latest value, by common facts, and by conclusion; uids in order."""
        self.settle()
        return tuple(sorted({*self.told_links(subject, attribute), *self._graph.reached(subject, attribute)}))

    def linking(self, target: int, attribute: int) -> tuple[int, ...]:
        """Return the instances that link to ``target`` in the same sense, by one of ``linked_attributes``."""
        self.settle()
        return tuple(sorted(set(self._graph.reached(target, attribute, backward=True))))

    def told_links(self, subject: int, attribute: int) -> tuple[int, ...]:
        """Return those of ``links`` that are told: the latest value, and common facts."""
        value = self._seen.value(subject, attribute)
        return tuple(dict.fromkeys(map(_uid, (*self._common.get((subject, attribute), ()), *_all(value)))))

    def linked_attributes(self) -> frozenset[int]:
        """Return the attributes of which there may be links that are not the latest value of a slot."""
        return self.rules.derived | {attribute for _, attribute in self._common}

    # Changes -------------------------------------------------------------------------------------

    def settle(self) -> Concluded:
        """Draw the conclusions from what was touched; return what has changed."""
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
        """Read one slot; note whose conditions are in doubt by what it said, and who gained something."""
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
        """Return the classes and conditions that follow from the types and values of an instance by themselves."""
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
        """Drop the conditions in doubt, with all that may rest on them, which is added to ``doubted``."""
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
        """Work out the classes of those in ``front``, and of all that rest on what they gain."""
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
        """Yield the instances that meet a condition by linking to this one if it is of ``classes``, and its bit."""
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
    """Told links, from both ends; those that follow from them are walked when asked."""

    def __init__(self, rules: CompiledAxioms) -> None:
        """Hold no link; ``rules`` have the links that follow from others."""
        self._rules = rules
        self._targets: dict[Slot, tuple[int, ...]] = {}
        self._linking: dict[Slot, dict[int, None]] = {}  # (target, attribute) -> subjects
        self._leading = [
            [(leading, flipped) for leading, flipped in sources if leading in rules.transitive]
            for sources in rules.sources
        ]

    def told(self, slot: Slot) -> tuple[int, ...]:
        """Return the targets that were told last."""
        return self._targets.get(slot, ())

    def add(self, subject: int, attribute: int, target: int) -> None:
        """Add a told link."""
        self._targets[subject, attribute] = (*self.told((subject, attribute)), target)
        self._linking.setdefault((target, attribute), {})[subject] = None

    def take(self, subject: int, attribute: int, target: int) -> None:
        """Take a told link away."""
        slot = (subject, attribute)
        self._targets[slot] = tuple(linked for linked in self._targets[slot] if linked != target)
        del self._linking[target, attribute][subject]

    def reached(self, uid: int, attribute: int, backward: bool = False) -> Iterator[int]:
        """Yield what the links of an attribute lead to, or come from if ``backward``; some more than once."""
        yield from self._step(uid, attribute, backward)
        for leading, flipped in self._leading[attribute]:
            yield from self._walk(uid, leading, backward != flipped)

    def _walk(self, uid: int, attribute: int, backward: bool) -> Iterator[int]:
        """Yield all that an attribute that leads on reaches."""
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
        """Yield the instances of whose links a told one is a part, each with the attribute of those; it is still there.

        Args:
            subject, attribute, target: the told link.
            conditional: the attributes that count.
        """
        entailed = self._rules.entailed[attribute]
        for asked in conditional:
            for flipped in (False, True):
                if (asked, flipped) in entailed:
                    yield target if flipped else subject, asked
            for leading, turned in self._leading[asked]:
                for flipped in (False, True):
                    if (leading, flipped) in entailed:
                        # the end of the link from which the condition is asked, and all from which one gets there
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
