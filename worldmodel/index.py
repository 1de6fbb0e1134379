"""The facts of one store by slot, the classes of its instances, and who rests on them.

A slot is an attribute of an instance. Its facts are sorted from old to new; of the statuses in it only the newest of
each origin is there. To save memory slots have no names of their own, but are found by attribute and then by instance,
and a fact stands in its slot as its block alone if the block has no other.
Facts of banned vehicles stand apart, so that to ask takes the same steps with a ban and without.

Attributes compiled to functions, for the two paths that every fact takes: recording and merging.

``Attribute.quantise`` explains what is wrong with a value; a compiled function only says that something is.
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
"""Returns the value as it is stored, or None for one that a closer look has to judge."""

MOST_SHARED = 1 << 16
"""The number of steps up to which the values of a field are kept and shared by all facts."""

NO_CLASS = -1


class AttributeRow(NamedTuple):
    """One attribute: how its values are stored, and the classes that it asks of subject and target."""

    quantise: Quantise
    domain: int
    range_class: int


class CompiledAttributes:
    """The compiled attributes of one TBox; ``rows`` has them by uid, all but those that need a closer look."""

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
        """The rows as bare tuples, which are unpacked faster."""
        self.latest_only = frozenset(attribute.uid for attribute in tbox.attributes if attribute.latest_only)
        self.deciding = deciding(tbox)
        """The attributes whose values decide who is believed."""
        followed = tbox.rules.heeded | self.deciding
        self.unlinked = frozenset(
            uid for uid, row in self.rows.items() if row.range_class == NO_CLASS and uid not in followed
        )
        """The attributes of whose values nothing follows: no links, no bans, none that a definition asks for."""
        self.plain = {
            uid: (row.quantise, row.domain)
            for uid, row in self.rows.items()
            if uid in self.unlinked and uid not in self.latest_only
        }
        """By uid, how values are stored and the class asked of the subject; without links and status."""
        self.statuses = {
            uid: (row.quantise, row.domain)
            for uid, row in self.rows.items()
            if uid in self.unlinked and uid in self.latest_only
        }
        """The same for attributes of which only the latest value counts."""
        below = [sum(1 << d for d in tbox.subclasses(c.uid)) for c in tbox.classes]
        self._descendants = tuple(below)

    def trust(self) -> Bans:
        """Return what a vehicle knows of who is believed, before it has heard anything: all are."""
        return Bans(self._tbox)

    def have_common_subclass(self, c: int, d: int) -> bool:
        """True if something may be of both classes by one of its types."""
        return bool(self._descendants[c] & self._descendants[d])

    def __reduce__(self) -> tuple[Callable[[TBox], "CompiledAttributes"], tuple[TBox]]:
        return compiled_attributes, (self._tbox,)


@lru_cache(maxsize=8)
def compiled_attributes(tbox: TBox) -> CompiledAttributes:
    """Return the compiled attributes of an ontology, the same for all its world models."""
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
    shared: list[float | None] = []  # made when the first value comes: few attributes of an ontology are used

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
"""A fact in a slot."""
StatusSlot = tuple[int, int, int]
"""(subject, attribute, origin)."""
Slots = dict[int, dict[int, list[Entry]]]
"""The facts of slots, oldest first, by attribute and subject; no slot is empty."""
EMPTY: dict[int, list[Entry]] = {}
"""The slots of an attribute of which nothing is known."""


def block_of(entry: Entry) -> Block:
    """Return the block of a fact in a slot."""
    return entry if isinstance(entry, Block) else entry.block


def observed_at_s(entry: Entry) -> float:
    """Return when a fact in a slot was observed (s)."""
    return entry.time_s


def sort_key(entry: Entry) -> tuple[BlockKey, int]:
    """Return what the facts of a slot are sorted by."""
    return (entry.key, 0) if isinstance(entry, Block) else (entry.block.key, entry.position)


def observation_of(entry: Entry) -> Observation:
    """Return a fact in a slot with its block and position."""
    return Observation(entry, 0) if isinstance(entry, Block) else entry


class Index:
    """Facts by slot, and what follows from types and links."""

    def __init__(self, tbox: TBox, instances: Sequence[Instance]) -> None:
        self._tbox = tbox
        self._tables = compiled_attributes(tbox)
        self._base = [tbox.ancestor_mask(instance.class_uid) for instance in instances]
        self.slots: Slots = {}
        """The facts that count."""
        self.apart: Slots = {}
        """Those of banned vehicles, which do not count."""
        self.trust = self._tables.trust()
        """Who is believed, by the facts that are held."""
        self.turned: set[Slot] = set()
        """Slots in which other facts count since a ban was told or taken back; who reads it empties it."""
        self.statuses: dict[StatusSlot, Block] = {}
        """The newest status of each slot and origin, as a block of one fact."""
        self.masks: dict[int, int] = dict(enumerate(self._base))
        """By uid, the classes an instance is known to belong to, bit c for class c."""
        self.heeded: frozenset[int] = frozenset()
        """The attributes from which something is concluded."""
        self.touched: set[Slot] = set()
        """Their slots that have changed since conclusions were drawn."""
        self.version_of_types = 0
        """It grows whenever a type fact goes in or out."""
        self._linking: dict[int, dict[tuple[Guid] | StatusSlot, Block]] = {}  # instance uid -> blocks that link to it

    def enter(self, fact: PropertyValue, entry: Entry) -> None:
        """Add a fact to its slot."""
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
        """Take a fact out of its slot."""
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
        """The facts of a slot, whether they count or not; in order among those that count, and among the others."""
        subject, attribute = slot
        counting = self.slots.get(attribute, EMPTY).get(subject, ())
        return (*counting, *self.apart.get(attribute, EMPTY).get(subject, ())) if self.apart else counting

    def _slots_of(self, block: Block) -> Slots:
        return self.apart if self.trust.hides(block.origin, block.time_s) else self.slots

    def _turn(self, origins: frozenset[int]) -> None:
        """Sort anew what counts and what does not, in the slots in which these origins have said anything."""
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
        """Let a status replace, fact by fact, what its origin said before; return the facts that are held now."""
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
        """Let a status of one fact take the place of an earlier one of its origin, if nothing follows from either.

        Returns:
            True if so; else nothing has changed.
        """
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
        """The order of statuses of one slot and origin; content breaks ties, so that any order gives the same."""
        (fact,) = status.facts
        index = self._tbox.attributes[fact.attribute].encode(fact.value)
        return status.time_s, status.epoch, index, fact.uncertainty is not None, fact.uncertainty or 0.0

    # What rests on the classes of an instance ----------------------------------------------------

    def resting_on(self, uid: int, base: int, creator: Guid | None) -> Iterable[Block]:
        """Return the items and private blocks that might not fit if an instance had but the classes of a mask.

        Those that give it a type are among them, but for the block that created it.

        Args:
            uid: the instance.
            base: the classes that it has in any case, bit c for class c.
            creator: the block that created it.
        """
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
        """Drop the statuses that would not fit if an instance had but the classes of the mask ``base``."""
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
        """True if a block links to the instance by an attribute whose range is not among the classes ``base``."""
        rows = self._tables.rows
        return any(
            fact.attribute != TYPE_UID
            and (range_class := rows[fact.attribute].range_class) >= 0
            and fact.target == uid
            and not base >> range_class & 1
            for fact in block.facts
        )


def _link_name(slot: Slot, block: Block) -> tuple[Guid] | StatusSlot:
    """What a block is called among those that link to an instance."""
    return (*slot, block.origin) if block.is_status else (block.guid,)
