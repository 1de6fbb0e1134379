"""Index of one store: facts by property, classes of instances, and dependencies on them.

A property (here: slot) is an attribute of an instance. Its facts are sorted from old to new; of statuses, only the
newest of each origin is present. For memory, properties are nested dictionaries by attribute and instance. Facts of
excluded origins are stored separately, so that queries cost the same.
"""

from bisect import bisect_left, insort
from collections.abc import Iterable, Sequence

from worldmodel.bans import Bans
from worldmodel.facts import Block, BlockKey, Guid, Instance, Observation
from worldmodel.ontology.tbox import TYPE_UID, TBox

Slot = tuple[int, int]
"""(subject, attribute)."""
StatusSlot = tuple[int, int, int]
"""(subject, attribute, origin)."""
Slots = dict[int, dict[int, list[Observation]]]
"""Facts by attribute and subject, oldest first; no list is empty."""
EMPTY: dict[int, list[Observation]] = {}


def sort_key(observation: Observation) -> tuple[BlockKey, int]:
    """Return the sort key of a fact."""
    return observation.block.key, observation.position


class Index:
    """Facts by property, and the consequences of types and links."""

    def __init__(self, tbox: TBox, instances: Sequence[Instance]) -> None:
        self._tbox = tbox
        self._base = [tbox.ancestor_mask(instance.class_uid) for instance in instances]
        self.slots: Slots = {}
        """Facts that count."""
        self.apart: Slots = {}
        """Facts of excluded origins, which do not count."""
        self.trust = Bans(tbox)
        self.turned: set[Slot] = set()
        """Properties whose counting facts an exclusion changed; the reader clears the set."""
        self.statuses: dict[StatusSlot, Block] = {}
        """Newest status per property and origin, as a block of one fact."""
        self.masks: dict[int, int] = dict(enumerate(self._base))
        """Known classes of each instance, bit c for class c."""
        self.heeded: frozenset[int] = frozenset()
        """Attributes used by inference."""
        self.touched: set[Slot] = set()
        """Changed properties of these attributes since the last inference."""
        self.version_of_types = 0
        """Counter of added and removed type facts."""

    def enter(self, observation: Observation) -> None:
        """Add a fact."""
        block, position = observation
        fact = block.facts[position]
        subject, attribute = fact.subject, fact.attribute
        slots = self._slots_of(block) if self.trust.from_s else self.slots
        entries = slots.setdefault(attribute, {}).setdefault(subject, [])
        if not entries or entries[-1].block.time_s < block.time_s:
            entries.append(observation)
        else:
            insort(entries, observation, key=sort_key)
        if attribute in self.heeded:
            self.touched.add((subject, attribute))
        if attribute == TYPE_UID:
            self.masks[subject] = self.masks.get(subject, 0) | self._tbox.ancestor_mask(fact.target)
            self.version_of_types += 1
        elif attribute == self.trust.attribute:
            self._turn(self.trust.note(observation))

    def leave(self, observation: Observation) -> None:
        """Remove a fact."""
        fact, block = observation.fact, observation.block
        slot = fact.subject, fact.attribute
        of_attribute = self._slots_of(block)[fact.attribute]
        entries = of_attribute[fact.subject]
        del entries[bisect_left(entries, sort_key(observation), key=sort_key)]
        if not entries:
            del of_attribute[fact.subject]
        if fact.attribute in self.heeded:
            self.touched.add(slot)
        if fact.attribute == TYPE_UID:
            self._work_out_types(fact.subject)
        elif fact.attribute == self.trust.attribute:
            self._turn(self.trust.forget(observation))

    def all_of(self, slot: Slot) -> Sequence[Observation]:
        """Return all facts of a property: counting ones in order, then excluded ones in order."""
        subject, attribute = slot
        counting = self.slots.get(attribute, EMPTY).get(subject, ())
        return (*counting, *self.apart.get(attribute, EMPTY).get(subject, ())) if self.apart else counting

    def _slots_of(self, block: Block) -> Slots:
        return self.apart if self.trust.hides(block.origin, block.time_s) else self.slots

    def _turn(self, origins: frozenset[int]) -> None:
        """Redistribute counting and excluded facts of properties observed by these origins."""
        if not origins:
            return
        both = self.slots, self.apart
        for slot in {(subject, uid) for slots in both for uid, subjects in slots.items() for subject in subjects}:
            entries = sorted(self.all_of(slot), key=sort_key)
            if origins.isdisjoint(entry.origin for entry in entries):
                continue
            self.turned.add(slot)
            subject, attribute = slot
            if attribute in self.heeded:
                self.touched.add(slot)
            for slots in both:
                slots.get(attribute, EMPTY).pop(subject, None)
            for entry in entries:
                of_attribute = self._slots_of(entry.block).setdefault(attribute, {})
                of_attribute.setdefault(subject, []).append(entry)

    def _work_out_types(self, uid: int) -> None:
        mask = self._base[uid] if uid < len(self._base) else 0
        for entry in self.all_of((uid, TYPE_UID)):
            mask |= self._tbox.ancestor_mask(entry.fact.target)
        if mask:
            self.masks[uid] = mask
        else:
            self.masks.pop(uid, None)
        self.version_of_types += 1

    # Statuses ------------------------------------------------------------------------------------

    def place(self, status: Block) -> list[Observation]:
        """Replace older statuses of the origin, fact by fact; return the facts stored now."""
        placed = []
        for fact in status.facts:
            single = Observation(status if len(status.facts) == 1 else status._replace(facts=(fact,)), 0)
            slot = (fact.subject, fact.attribute, status.origin)
            held = self.statuses.get(slot)
            if held is not None:
                if status.time_s <= held.time_s and self._order(single.block) <= self._order(held):
                    continue
                if self._replaces_newest(held, single):
                    placed.append(single)
                    continue
                self.leave(Observation(held, 0))
            self.statuses[slot] = single.block
            self.enter(single)
            placed.append(single)
        return placed

    def _replaces_newest(self, held: Block, new: Observation) -> bool:
        """Replace the newest fact of a property if nothing else follows from it; else return False."""
        subject, attribute, _, _ = held.facts[0]
        if attribute in self.heeded or self.trust.from_s or attribute == self.trust.attribute:
            return False
        entries = self.slots[attribute][subject]
        if self._tbox.attributes[attribute].range_class is not None or entries[-1].block is not held:
            return False
        if new.block.time_s <= held.time_s:
            return False
        entries[-1] = new
        self.statuses[subject, attribute, held.origin] = new.block
        return True

    def _order(self, status: Block) -> tuple[float, int, tuple[int, ...], bool, float]:
        """Return the order of statuses of one property and origin; content breaks ties."""
        (fact,) = status.facts
        index = self._tbox.attributes[fact.attribute].encode(fact.value)
        return status.time_s, status.epoch, index, fact.uncertainty is not None, fact.uncertainty or 0.0

    # What rests on the classes of an instance ----------------------------------------------------

    def resting_on(self, uid: int, base: int, creator: Guid | None) -> Iterable[Block]:
        """Return items and private blocks, without ``creator``, that may not fit classes ``base``."""
        blocks: dict[Guid, Block] = {}
        for attribute in self._tbox.attributes:
            if attribute.uid == TYPE_UID or not base >> attribute.domain & 1:
                for entry in self.all_of((uid, attribute.uid)):
                    block = entry.block
                    if not block.is_status and (attribute.uid != TYPE_UID or block.guid != creator):
                        blocks[block.guid] = block
        for block in self._linking(uid, base):
            if not block.is_status:
                blocks[block.guid] = block
        return blocks.values()

    def drop_statuses(self, uid: int, base: int) -> None:
        """Drop the statuses that do not fit if an instance has only the classes of mask ``base``."""
        dropped = [
            block
            for attribute in self._tbox.attributes
            if attribute.uid != TYPE_UID and not base >> attribute.domain & 1
            for entry in self.all_of((uid, attribute.uid))
            if (block := entry.block).is_status
        ]
        dropped += [block for block in self._linking(uid, base) if block.is_status]
        for block in dropped:
            fact = block.facts[0]
            if self.statuses.pop((fact.subject, fact.attribute, block.origin), None) is not None:
                self.leave(Observation(block, 0))

    def _linking(self, uid: int, base: int) -> list[Block]:
        """Return the blocks that link to an instance by an attribute whose range is not in ``base``."""
        return [
            entry.block
            for attribute in self._tbox.attributes
            if attribute.range_class is not None and not base >> attribute.range_class & 1
            for slots in (self.slots, self.apart)
            for entries in slots.get(attribute.uid, EMPTY).values()
            for entry in entries
            if entry.fact.target == uid
        ]
