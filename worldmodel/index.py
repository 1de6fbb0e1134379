"""Index of one store: facts by property, classes of instances, and dependencies on them.

A property (here: slot) is an attribute of an instance. Its facts are sorted from old to new; of statuses, only the
newest of each origin is present. For memory, properties are nested dictionaries by attribute and instance, and the only
fact of a block is stored as the block itself. Facts of excluded origins are stored separately, so that queries cost the
same.

Attributes are compiled to functions for the fast paths of record and merge. ``Attribute.quantise`` explains a bad
value; a compiled function only rejects it.
"""

import math
from bisect import bisect_left, insort
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

from worldmodel.bans import Bans, deciding
from worldmodel.facts import Block, BlockKey, Guid, Instance, Observation, PropertyValue
from worldmodel.ontology.fields import Field, bytes_of
from worldmodel.ontology.tbox import TYPE_UID, Attribute, TBox, ValueKind

Quantise = Callable[[Any], Any]
"""Return the stored value, or None for a value that needs the full check."""

MOST_SHARED = 1 << 16
"""Maximum number of grid steps for which a field caches and shares its values."""

NO_CLASS = -1


class AttributeRow(NamedTuple):
    """Compiled attribute: quantiser, class of the subject, class of the target or ``NO_CLASS``."""

    quantise: Quantise
    domain: int
    range_class: int


class CompiledAttributes:
    """Compiled attributes of one TBox; ``rows`` maps uids to them, ``type`` left out."""

    def __init__(self, tbox: TBox) -> None:
        self._tbox = tbox
        self.rows = {
            attribute.uid: AttributeRow(
                _quantiser(attribute),
                attribute.domain,
                NO_CLASS if attribute.range_class is None else attribute.range_class,
            )
            for attribute in tbox.attributes
            if attribute.kind is not ValueKind.TYPE
        }
        self.unpacked = {uid: (row.quantise, row.domain, row.range_class) for uid, row in self.rows.items()}
        """Rows as bare tuples, which unpack faster."""
        self.latest_only = frozenset(attribute.uid for attribute in tbox.attributes if attribute.latest_only)
        self.deciding = deciding(tbox)
        """Attributes that exclude origins."""
        followed = tbox.rules.heeded | self.deciding
        self.unlinked = frozenset(
            uid for uid, row in self.rows.items() if row.range_class == NO_CLASS and uid not in followed
        )
        """Attributes whose values affect nothing else: no links, exclusions or rules."""
        self.plain = {
            uid: (row.quantise, row.domain)
            for uid, row in self.rows.items()
            if uid in self.unlinked and uid not in self.latest_only
        }
        """Quantiser and subject class, by uid, of unlinked attributes of items."""
        self.statuses = {
            uid: (row.quantise, row.domain)
            for uid, row in self.rows.items()
            if uid in self.unlinked and uid in self.latest_only
        }
        """Quantiser and subject class, by uid, of unlinked attributes with rm:latestOnly."""
        below = [sum(1 << d for d in tbox.subclasses(c.uid)) for c in tbox.classes]
        self._descendants = tuple(below)

    def trust(self) -> Bans:
        """Return exclusions without any excluded origin."""
        return Bans(self._tbox)

    def have_common_subclass(self, c: int, d: int) -> bool:
        """True if a class is below, or equal to, both."""
        return bool(self._descendants[c] & self._descendants[d])

    def __reduce__(self) -> tuple[Callable[[TBox], "CompiledAttributes"], tuple[TBox]]:
        return compiled_attributes, (self._tbox,)


@lru_cache(maxsize=8)
def compiled_attributes(tbox: TBox) -> CompiledAttributes:
    """Return the compiled attributes of an ontology, shared by its world models."""
    return CompiledAttributes(tbox)


def _quantiser(attribute: Attribute) -> Quantise:
    match attribute.kind:
        case ValueKind.NUMBER:
            return _number(attribute.fields[0])
        case ValueKind.POINT:
            return _point(*attribute.fields)
        case ValueKind.BOOLEAN:
            return lambda value: value if value is True or value is False else None
        case ValueKind.SYMBOL:
            return _index(len(attribute.symbols))
        case ValueKind.TEXT:
            return _text(attribute.most_bytes)
        case _:
            return _index(math.inf)


def _index(n_indices: float) -> Quantise:
    return lambda value: value if type(value) is int and 0 <= value < n_indices else None


def _text(most_bytes: int) -> Quantise:
    def quantise(value: Any) -> str | None:
        try:
            bytes_of(value, most_bytes)
        except (TypeError, ValueError):
            return None
        text: str = value
        return text

    return quantise


def _number(field: Field) -> Quantise:
    low, high, step = field.minimum, field.maximum, field.resolution
    value_at: Callable[[int], float] = field.grid.value_at
    n_shared = field.n_values if field.n_values <= MOST_SHARED else 0
    shared: list[float | None] = []  # lazy: few attributes of an ontology are used

    def of_few(value: Any) -> float | None:
        if (type(value) is not float and type(value) is not int) or not low <= value <= high:
            return None
        index: int = round((value - low) / step)
        try:
            stored = shared[index]
        except IndexError:
            shared.extend([None] * n_shared)
            stored = None
        if stored is None:
            shared[index] = stored = value_at(index)
        return stored

    def of_many(value: Any) -> float | None:
        if (type(value) is not float and type(value) is not int) or not low <= value <= high:
            return None
        return value_at(round((value - low) / step))

    return of_few if n_shared else of_many


def _point(east: Field, north: Field) -> Quantise:
    west, x_end, x_step = east.minimum, east.maximum, east.resolution
    south, y_end, y_step = north.minimum, north.maximum, north.resolution
    x_first, x_ticks, x_denominator = east.grid.whole_numbers
    y_first, y_ticks, y_denominator = north.grid.whole_numbers

    def quantise(value: Any) -> tuple[float, float] | None:
        if type(value) is not tuple or len(value) != 2:
            return None
        x, y = value
        if (type(x) is not float and type(x) is not int) or (type(y) is not float and type(y) is not int):
            return None
        if not (west <= x <= x_end and south <= y <= y_end):
            return None
        return (
            (x_first + round((x - west) / x_step) * x_ticks) / x_denominator,
            (y_first + round((y - south) / y_step) * y_ticks) / y_denominator,
        )

    return quantise


Slot = tuple[int, int]
"""(subject, attribute)."""
Entry = Block | Observation
"""Fact in the index."""
StatusSlot = tuple[int, int, int]
"""(subject, attribute, origin)."""
Slots = dict[int, dict[int, list[Entry]]]
"""Facts by attribute and subject, oldest first; no list is empty."""
EMPTY: dict[int, list[Entry]] = {}
"""Facts of an attribute without any."""


def block_of(entry: Entry) -> Block:
    """Return the block of an indexed fact."""
    return entry if isinstance(entry, Block) else entry.block


def observed_at_s(entry: Entry) -> float:
    """Return the observation time (s) of an indexed fact."""
    return entry.time_s


def sort_key(entry: Entry) -> tuple[BlockKey, int]:
    """Return the sort key of an indexed fact."""
    return (entry.key, 0) if isinstance(entry, Block) else (entry.block.key, entry.position)


def observation_of(entry: Entry) -> Observation:
    """Return an indexed fact with its block and position."""
    return Observation(entry, 0) if isinstance(entry, Block) else entry


class Index:
    """Facts by property, and the consequences of types and links."""

    def __init__(self, tbox: TBox, instances: Sequence[Instance]) -> None:
        self._tbox = tbox
        self._tables = compiled_attributes(tbox)
        self._base = [tbox.ancestor_mask(instance.class_uid) for instance in instances]
        self.slots: Slots = {}
        """Facts that count."""
        self.apart: Slots = {}
        """Facts of excluded origins, which do not count."""
        self.trust = self._tables.trust()
        """Exclusions that follow from the stored facts."""
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
        self._linking: dict[int, dict[tuple[Guid] | StatusSlot, Block]] = {}  # instance uid -> blocks linking to it

    def enter(self, fact: PropertyValue, entry: Entry) -> None:
        """Add a fact."""
        subject, attribute = fact.subject, fact.attribute
        slots = self._slots_of(block_of(entry)) if self.trust.from_s else self.slots
        of_attribute = slots.setdefault(attribute, {})
        entries = of_attribute.get(subject)
        if entries is None:
            of_attribute[subject] = [entry]
        elif entries[-1].time_s < entry.time_s or sort_key(entries[-1]) <= sort_key(entry):
            entries.append(entry)
        else:
            insort(entries, entry, key=sort_key)
        if attribute in self.heeded:
            self.touched.add((subject, attribute))
        if attribute == TYPE_UID:
            self.masks[subject] = self.masks.get(subject, 0) | self._tbox.ancestor_mask(fact.target)
            self.version_of_types += 1
        elif self._tables.rows[attribute].range_class >= 0:
            block = block_of(entry)
            self._linking.setdefault(fact.target, {})[_link_name((subject, attribute), block)] = block
        elif attribute == self.trust.attribute:
            self._turn(self.trust.note(observation_of(entry)))

    def leave(self, fact: PropertyValue, entry: Entry) -> None:
        """Remove a fact."""
        slot, block = (fact.subject, fact.attribute), block_of(entry)
        of_attribute = self._slots_of(block)[fact.attribute]
        entries = of_attribute[fact.subject]
        del entries[bisect_left(entries, sort_key(entry), key=sort_key)]
        if not entries:
            del of_attribute[fact.subject]
        if fact.attribute in self.heeded:
            self.touched.add(slot)
        if fact.attribute == TYPE_UID:
            self._work_out_types(fact.subject)
        elif self._tables.rows[fact.attribute].range_class >= 0:
            linking = self._linking.get(fact.target, {})
            linking.pop(_link_name(slot, block), None)
            if not linking:
                self._linking.pop(fact.target, None)
        elif fact.attribute == self.trust.attribute:
            self._turn(self.trust.forget(observation_of(entry)))

    def all_of(self, slot: Slot) -> Sequence[Entry]:
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
        for slot in {(subject, of) for slots in both for of, subjects in slots.items() for subject in subjects}:
            entries = sorted(self.all_of(slot), key=sort_key)
            if origins.isdisjoint(block_of(entry).origin for entry in entries):
                continue
            self.turned.add(slot)
            subject, attribute = slot
            if attribute in self.heeded:
                self.touched.add(slot)
            for slots in both:
                slots.get(attribute, EMPTY).pop(subject, None)
            for entry in entries:
                of_attribute = self._slots_of(block_of(entry)).setdefault(attribute, {})
                of_attribute.setdefault(subject, []).append(entry)

    def _work_out_types(self, uid: int) -> None:
        mask = self._base[uid] if uid < len(self._base) else 0
        for entry in self.all_of((uid, TYPE_UID)):
            mask |= self._tbox.ancestor_mask(observation_of(entry).fact.target)
        if mask:
            self.masks[uid] = mask
        else:
            self.masks.pop(uid, None)
        self.version_of_types += 1

    # Statuses ------------------------------------------------------------------------------------

    def place(self, status: Block) -> list[tuple[PropertyValue, Block]]:
        """Replace older statuses of the origin, fact by fact; return the facts stored now."""
        placed = []
        for fact in status.facts:
            single = status if len(status.facts) == 1 else status._replace(facts=(fact,))
            if not self.succeed(single):
                slot = (fact.subject, fact.attribute, status.origin)
                held = self.statuses.get(slot)
                if held is not None:
                    if single.time_s <= held.time_s and self._order(single) <= self._order(held):
                        continue
                    self.leave(held.facts[0], held)
                self.statuses[slot] = single
                self.enter(fact, single)
            placed.append((fact, single))
        return placed

    def succeed(self, new: Block) -> bool:
        """Replace an older status on the fast path; False, without change, if not possible."""
        subject, attribute, _, _ = new.facts[0]
        slot = subject, attribute, new.origin
        held = self.statuses.get(slot)
        if held is None or new.time_s <= held.time_s:
            return False
        if self.trust.from_s or attribute not in self._tables.unlinked or attribute in self.heeded:
            return False
        entries = self.slots[attribute][subject]
        if entries[-1] is held:
            entries[-1] = new
        else:
            entries.remove(held)
            if entries[-1].time_s < new.time_s:
                entries.append(new)
            else:
                insort(entries, new, key=sort_key)
        self.statuses[slot] = new
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
                    block = block_of(entry)
                    if not block.is_status and (attribute.uid != TYPE_UID or block.guid != creator):
                        blocks[block.guid] = block
        for block in self._linking.get(uid, {}).values():
            if not block.is_status and self._asks(block, uid, base):
                blocks[block.guid] = block
        return blocks.values()

    def drop_statuses(self, uid: int, base: int) -> None:
        """Drop the statuses that do not fit if an instance has only the classes of mask ``base``."""
        dropped = [
            block
            for attribute in self._tbox.attributes
            if attribute.uid != TYPE_UID and not base >> attribute.domain & 1
            for entry in self.all_of((uid, attribute.uid))
            if (block := block_of(entry)).is_status
        ]
        linking = self._linking.get(uid, {}).values()
        dropped += [block for block in linking if block.is_status and self._asks(block, uid, base)]
        for block in dropped:
            fact = block.facts[0]
            if self.statuses.pop((fact.subject, fact.attribute, block.origin), None) is not None:
                self.leave(fact, block)

    def _asks(self, block: Block, uid: int, base: int) -> bool:
        """True if a block links to the instance by an attribute whose range is not in ``base``."""
        rows = self._tables.rows
        return any(
            fact.attribute != TYPE_UID
            and (range_class := rows[fact.attribute].range_class) >= 0
            and fact.target == uid
            and not base >> range_class & 1
            for fact in block.facts
        )


def _link_name(slot: Slot, block: Block) -> tuple[Guid] | StatusSlot:
    return (*slot, block.origin) if block.is_status else (block.guid,)
