"""Store of one vehicle: blocks of time-stamped facts, their index and their instances.

No fact is overwritten: blocks "merely add to the total knowledge store" (Maurelli et al., Multi-robot cooperation,
section IV). Current values are a view: of the facts of one property (instance and attribute), the *latest* has the
greatest (time_s, origin, sequence, position in its block). This total order does not depend on arrival.

The common instances of a scenario have the uids 0, 1, ... An origin creates further instances with uids from its own
range and announces them by a value of the attribute ``type``. Facts of excluded origins are stored separately, so that
queries cost the same.
"""

import hashlib
from bisect import bisect_left, bisect_right, insort
from collections.abc import Iterable, Iterator, Mapping, Sequence

from worldmodel.errors import FactError, unknown_name
from worldmodel.facts import (
    EPOCHS,
    STATUS,
    Block,
    Change,
    Guid,
    Instance,
    Lacking,
    Observation,
    PropertyValue,
    sort_key,
)
from worldmodel.holdings import Arrivals, Bans, Keeping, rank_of
from worldmodel.inference import Inference
from worldmodel.ontology.fields import Grid, Value
from worldmodel.ontology.tbox import TYPE_UID, TBox, ValueKind

USUAL = Keeping()
_NONE = (None,)

Slot = tuple[int, int]  # (subject, attribute)
StatusSlot = tuple[int, int, int]  # (subject, attribute, origin)
# Nested, not keyed by pairs, to save memory.
Slots = dict[int, dict[int, list[Observation]]]  # facts by attribute and subject, oldest first; no list is empty
EMPTY: dict[int, list[Observation]] = {}


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
        # Usual case: facts arrive in order of time.
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
            self._decide()

    def leave(self, block: Block, position: int) -> None:
        """Remove a fact."""
        fact = block.facts[position]
        slot = fact.subject, fact.attribute
        of_attribute = (self._slots_of(block) if self.trust.from_s else self.slots)[fact.attribute]
        entries = of_attribute[fact.subject]
        is_newest = entries[-1].block is block and entries[-1].position == position  # as statuses are
        del entries[-1 if is_newest else bisect_left(entries, (block.key, position), key=sort_key)]
        if not entries:
            del of_attribute[fact.subject]
        if fact.attribute in self.heeded:
            self.touched.add(slot)
        if fact.attribute == TYPE_UID:
            self._work_out_types(fact.subject)
        elif fact.attribute == self.trust.attribute:
            self._decide()

    def all_of(self, slot: Slot) -> Sequence[Observation]:
        """Return all facts of a property: counting ones in order, then excluded ones in order."""
        subject, attribute = slot
        counting = self.slots.get(attribute, EMPTY).get(subject, ())
        return (*counting, *self.apart.get(attribute, EMPTY).get(subject, ())) if self.apart else counting

    def _slots_of(self, block: Block) -> Slots:
        return self.apart if self.trust.hides(block.origin, block.time_s) else self.slots

    def _decide(self) -> None:
        both, attribute = (self.slots, self.apart), self.trust.attribute
        of_trust = [each for slots in both for entries in slots.get(attribute, EMPTY).values() for each in entries]
        origins = self.trust.decide(of_trust)
        if not origins:
            return
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
                # A newer time decides alone, without the encoding that breaks ties.
                if status.time_s <= held.time_s and self._order(single.block) <= self._order(held):
                    continue
                self.leave(held, 0)
            self.statuses[slot] = single.block
            self.enter(single)
            placed.append(single)
        return placed

    def _order(self, status: Block) -> tuple[float, int, tuple[int, ...], bool, float]:
        # Statuses have no sequence: contents break ties, so that the result does not depend on arrival.
        (fact,) = status.facts
        index = self._tbox.attributes[fact.attribute].encode(fact.value)
        return status.time_s, status.epoch, index, fact.uncertainty is not None, fact.uncertainty or 0.0

    def drop(self, status: Block) -> None:
        """Remove a status."""
        fact = status.facts[0]
        del self.statuses[fact.subject, fact.attribute, status.origin]
        self.leave(status, 0)


class Store:
    """Indexed blocks of one vehicle."""

    def __init__(
        self,
        tbox: TBox,
        owner: int,
        instances: Sequence[Instance],
        time_resolution_s: float = 0.1,
        *,
        n_origins: int,
        run_time_instances_per_origin: int = 256,
        epoch: int = 0,
        keeping: Keeping = USUAL,
    ) -> None:
        """Create a store without facts; raises FactError for invalid arguments.

        All vehicles of a fleet pass equal arguments except ``owner``, the origin of the facts recorded here, and
        ``epoch``, its number of restarts. The first ``n_origins`` of the ``instances``, in uid order, are the vehicles.
        """
        _refuse_bad_instances(tbox, instances)
        if run_time_instances_per_origin < 0:
            raise FactError(f"run_time_instances_per_origin is {run_time_instances_per_origin}; allowed: 0 or more")
        if not keeping.waiting_s >= 0:
            raise FactError(f"waiting_s is {keeping.waiting_s}; allowed: 0 s or more")
        if keeping.waiting_blocks < 1:
            raise FactError(f"waiting_blocks is {keeping.waiting_blocks}; allowed: 1 or more")
        if not 0 <= owner < n_origins:
            raise FactError(f"owner {owner} is not an origin; allowed: 0..{n_origins - 1}")
        if not 0 <= epoch < EPOCHS:
            raise FactError(f"epoch is {epoch}; allowed: 0..{EPOCHS - 1}")
        if not keeping.clock_tolerance_s >= 0:
            raise FactError(f"clock_tolerance_s is {keeping.clock_tolerance_s}; allowed: 0 s or more")
        for rule in keeping.pruning:
            rule.check(tbox)
        try:
            self.clock_grid = Grid(0.0, time_resolution_s)
        except ValueError as error:
            raise FactError(f"time_resolution_s: {error}") from None
        self.tbox = tbox
        self.owner, self.epoch = owner, epoch
        self.n_origins = n_origins
        self.run_time_instances_per_origin = run_time_instances_per_origin
        self.common_instances = tuple(instances)
        self._instance_named = {instance.name: instance for instance in instances}
        self.n_uids = len(instances) + n_origins * run_time_instances_per_origin
        self.latest_only = frozenset(attribute.uid for attribute in tbox.attributes if attribute.latest_only)
        self.pruning = tuple(keeping.pruning)
        self.clock_tolerance_s = keeping.clock_tolerance_s
        self.time_resolution_s = time_resolution_s
        self._time_ratio = self.clock_grid.ratio
        self.index = Index(tbox, instances)
        self.arrivals = Arrivals(keeping.waiting_s, keeping.waiting_blocks)
        # Items and private blocks by (origin, epoch) and sequence; None without stored content.
        self._arrived: dict[tuple[int, int], dict[int, Block | None]] = {}
        self.content_of_pruned = 0
        """Sum of the content digests of pruned items."""
        self.watched: set[tuple[int, int]] = set()
        """Properties (instance uid, attribute uid) whose new observations ``take_news`` returns."""
        self.news: list[Observation] = []
        """Observations of watched properties since ``take_news``, those of excluded origins included."""
        self._members: dict[int, tuple[Instance, ...]] = {}
        self._members_of = (0, 0)  # versions of types and conclusions of this cache
        self.common_facts = tuple(keeping.common_facts)
        self._common_values = {
            (f.subject, f.attribute): f.value
            for f in keeping.common_facts
            if tbox.attributes[f.attribute].kind is not ValueKind.LINK
        }
        self.inference = Inference(tbox, self, instances, self.index.touched, keeping.common_facts)
        self.index.heeded = self.inference.heeded
        self.next_sequence = 0
        self.next_private = STATUS - 1
        self.own_instances: set[int] = set()
        """Known uids already allocated in the owner's range."""

    def instance(self, uid: int) -> Instance | None:
        """Return a common or announced instance, even if an excluded origin announced it."""
        if 0 <= uid < len(self.common_instances):
            return self.common_instances[uid]
        created = self.arrivals.created_as(uid)
        if created is None or not self.class_mask(uid):
            return None
        return Instance(uid, created, f"{self.tbox.classes[created].name}-{uid}")

    def instance_uids(self) -> Iterable[int]:
        """Return the uids of all known instances, those of excluded origins included."""
        return self.index.masks.keys()

    def instance_named(self, name: str) -> Instance:
        """Return a common instance by name; raises UnknownNameError with the nearest name."""
        try:
            return self._instance_named[name]
        except KeyError:
            raise unknown_name("common instance", name, self._instance_named) from None

    def class_mask(self, uid: int) -> int:
        """Return the known classes of an instance, bit c for class c; 0 if unknown."""
        return self.index.masks.get(uid, 0)

    def created_as(self, uid: int) -> int | None:
        """Return the class of creation of an instance, even while the creating block is pending."""
        if 0 <= uid < len(self.common_instances):
            return self.common_instances[uid].class_uid
        return self.arrivals.created_as(uid)

    def owner_of(self, uid: int) -> int | None:
        """Return the origin that owns the range of a uid; None for a common instance or no range."""
        if not len(self.common_instances) <= uid < self.n_uids:
            return None
        return (uid - len(self.common_instances)) // self.run_time_instances_per_origin

    def first_uid_of(self, origin: int) -> int:
        """Return the first uid in the range of ``origin``."""
        return len(self.common_instances) + origin * self.run_time_instances_per_origin

    def block(self, guid: Guid) -> Block | None:
        """Return an item or private block if it is accepted and stored."""
        return self._arrived.get(guid[:2], {}).get(guid[2])

    def blocks(self) -> Iterator[Block]:
        """Yield the accepted items, by origin, epoch and sequence."""
        return (block for block in map(self.block, self._item_guids()) if block is not None)

    def private_blocks(self) -> Iterator[Block]:
        """Yield the owner's private blocks, by epoch and in order of recording."""
        private = [block for log in self._arrived.values() for block in log.values() if block and not block.is_item]
        return iter(sorted(private, key=rank_of))

    def arrived(self, guid: Guid) -> Block | None:
        """Return a block that is accepted, pending or refused."""
        return self.block(guid) or self.arrivals.get(guid)

    def has_arrived(self, guid: Guid) -> bool:
        """True if peers need not send the block again, even if it was pruned since."""
        return guid[2] in self._arrived.get(guid[:2], {})

    def _item_guids(self) -> list[Guid]:
        return sorted([(*life, sequence) for life, log in self._arrived.items() for sequence in log if sequence >= 0])

    def digest(self) -> dict[tuple[int, int], tuple[int, int]]:
        """Return the arrived items by (origin, epoch): highest contiguous sequence or -1, and mask of later ones.

        Bit k of the mask stands for the sequence ``highest + 1 + k``.
        """
        digest: dict[tuple[int, int], tuple[int, int]] = {}
        for origin, epoch, sequence in self._item_guids():
            highest, mask = digest.get((origin, epoch), (-1, 0))
            if sequence == highest + 1:
                highest = sequence
            else:
                mask |= 1 << sequence - highest - 1
            digest[origin, epoch] = highest, mask
        return digest

    def items(self) -> Iterator[tuple[Guid, Block | None]]:
        """Yield the arrived items, by origin, epoch and sequence; None for a pruned one."""
        return ((guid, self.arrived(guid)) for guid in self._item_guids())

    def state_hash(self) -> str:
        """Return a digest of TBox, common instances and accepted items, pruned ones included."""
        # A sum depends on no order, and pruned items keep their term.
        total = self.content_of_pruned + sum(map(self.content, self.blocks()))
        state = (self.tbox.hash, self.common_instances, self.n_origins, self.n_uids, total % (1 << 256))
        return hashlib.sha256(repr(state).encode()).hexdigest()

    def content(self, block: Block) -> int:
        """Return a digest of GUID, time and facts of a valid block, computed on integers."""
        attributes = self.tbox.attributes
        facts = [(f.subject, f.attribute, attributes[f.attribute].encode(f.value), f.uncertainty) for f in block.facts]
        tick = self.clock_grid.index_of(block.time_s)
        return int.from_bytes(hashlib.sha256(repr((block.guid, tick, facts)).encode()).digest(), "big")

    def quantise_time(self, time_s: float) -> float:
        """Return the grid time nearest to ``time_s`` (s)."""
        step, denominator = self._time_ratio
        return round(time_s / self.time_resolution_s) * step / denominator

    def hold(self, guid: Guid, block: Block | None = None) -> None:
        """Mark an item or private block as arrived and store ``block``, if given."""
        self._arrived.setdefault(guid[:2], {})[guid[2]] = block

    def drop(self, block: Block) -> None:
        """Remove a pending or refused block so that it can be received again."""
        self.arrivals.take(block.guid)
        del self._arrived[block.guid[:2]][block.sequence]

    def latest(self, subject: int, attribute: int) -> Observation | None:
        """Return the newest observation of a property."""
        entries = self.index.slots.get(attribute, EMPTY).get(subject)
        return entries[-1] if entries else None

    def history(
        self, subject: int, attribute: int, since_s: float | None = None, until_s: float | None = None
    ) -> tuple[Observation, ...]:
        """Return observations of a time range (s, ends inclusive), oldest first; of statuses the newest per origin."""
        entries = self.index.slots.get(attribute, EMPTY).get(subject, [])
        first = 0 if since_s is None else bisect_left(entries, since_s, key=_time_s)
        end = len(entries) if until_s is None else bisect_right(entries, until_s, key=_time_s)
        return tuple(entries[first:end])

    def is_seen(self, block: Block) -> bool:
        """True unless the origin of the block is excluded at its time."""
        return not self.index.trust.hides(block.origin, block.time_s)

    @property
    def banned(self) -> Mapping[int, float]:
        """Start (s) of the exclusion of each excluded origin; replaced on each change."""
        return self.index.trust.from_s

    def take_news(self) -> list[Observation]:
        """Return and clear the new observations of watched properties, in order of arrival."""
        news, self.news = self.news, []
        return [observation for observation in news if self.is_seen(observation.block)]

    def value(self, subject: int, attribute: int, default: Value | None = None) -> Value | None:
        """Return the latest value of a property, else the common initial value, else ``default``."""
        entries = self.index.slots.get(attribute, EMPTY).get(subject)
        return entries[-1].value if entries else self._common_values.get((subject, attribute), default)

    def common_values(self, subject: int, attribute: int) -> tuple[Value, ...]:
        """Return the common initial value of a property, if any, without inferred links."""
        value = self._common_values.get((subject, attribute))
        return () if value is None else (value,)

    def statuses(self) -> Iterator[Block]:
        """Yield the newest status per property and origin, each as a block of one fact."""
        for slot in sorted(self.index.statuses):
            yield self.index.statuses[slot]

    def lacking(self) -> tuple[Lacking, ...]:
        """Return the missing instances of pending blocks, by uid."""
        of_uid: dict[int, list[Guid]] = {}
        for guid, waiting in sorted(self.arrivals.waiting.items()):
            of_uid.setdefault(waiting.missing, []).append(guid)
        return tuple(Lacking(uid, self.owner_of(uid), tuple(of_uid[uid])) for uid in sorted(of_uid))

    def instances_of(self, class_uid: int) -> tuple[Instance, ...]:
        """Return the asserted and inferred instances of a class, by uid."""
        # Before the versions are read, since it may raise one.
        self.inference.settle()
        holds_for = self.index.version_of_types, self.inference.version
        if self._members_of != holds_for:
            self._members_of, self._members = holds_for, {}
        members = self._members.get(class_uid)
        if members is None:
            known = (self.instance(uid) for uid in sorted(self.instance_uids()))
            classes = self.inference.classes
            members = tuple(i for i in known if i is not None and classes(i.uid) >> class_uid & 1)
            self._members[class_uid] = members
        return members

    def told_classes(self, uid: int) -> int:
        """Return the classes of the asserted types of an instance, bit c for class c."""
        common = self.common_instances[uid : uid + 1]
        mask = self.tbox.ancestor_mask(common[0].class_uid) if common else 0
        for observation in self.history(uid, TYPE_UID):
            mask |= self.tbox.ancestor_mask(observation.fact.target)
        return mask

    # For checks and merging ----------------------------------------------------------------------

    def latest_time_s(self, now_s: float) -> float:
        """Return the latest acceptable observation time of a block that arrives at ``now_s`` (s)."""
        return max(now_s + self.clock_tolerance_s, self.quantise_time(now_s))

    def insert(self, block: Block) -> Change:
        """Index a new, checked item or private block. Callers use ``merge`` instead."""
        self.hold(block.guid, block)
        entries = [Observation(block, position) for position in range(len(block.facts))]
        for entry in entries:
            self.index.enter(entry)
        latest = self._noted(entries)
        return Change(block, self._turned() if self.index.turned else latest)

    def _noted(self, entries: Iterable[Observation]) -> tuple[PropertyValue, ...]:
        latest = []
        for entry in entries:
            fact = entry.block.facts[entry.position]
            if (fact.subject, fact.attribute) in self.watched:
                self.news.append(entry)
            if self.index.slots.get(fact.attribute, EMPTY).get(fact.subject, _NONE)[-1] is entry:
                latest.append(fact)
        return tuple(latest)

    def _turned(self) -> tuple[PropertyValue, ...]:
        turned = [self.latest(*slot) for slot in sorted(self.index.turned)]
        self.index.turned.clear()
        return tuple(observation.fact for observation in turned if observation is not None)

    def place_status(self, block: Block) -> Change | None:
        """Replace older statuses of the origin by a checked status; None if all its facts are older."""
        placed = self.index.place(block)
        return Change(block, self._noted(placed)) if placed else None

    def facts_of(self, subject: int, attribute: int) -> list[Observation]:
        """Return all observations of a property, excluded origins included."""
        return sorted(self.index.all_of((subject, attribute)), key=sort_key)

    def take_out(self, block: Block) -> None:
        """Remove an item or private block from all indexes; it still counts as arrived."""
        self.hold(block.guid)
        for position in range(len(block.facts)):
            self.index.leave(block, position)

    def prune(self, block: Block) -> None:
        """Drop the content of an item, for ``worldmodel.tidy``, which applies the rules."""
        self.content_of_pruned += self.content(block)
        self.take_out(block)

    def note_creations(self, block: Block) -> set[int]:
        """Record the instances that a block creates; return those whose class of creation changed."""
        if block.origin == self.owner:
            self._note_own(block)
        changed: set[int] = set()
        noted: set[int] = set()
        for fact in block.facts:
            uid = fact.subject
            # The first type of an instance in a block creates it; further ones refine it.
            if fact.attribute == TYPE_UID and uid not in noted and self.owner_of(uid) == block.origin:
                noted.add(uid)
                if self.arrivals.note_creation(uid, fact.target, block):
                    changed.add(uid)
        return changed

    def _note_own(self, block: Block) -> None:
        # Peers return the own blocks after a restart: their numbers and uids are taken.
        if block.epoch == self.epoch:
            self.next_sequence = max(self.next_sequence, block.sequence + 1)
            self.next_private = min(self.next_private, block.sequence - 1)
        for fact in block.facts:
            if fact.attribute == TYPE_UID and self.owner_of(fact.subject) == self.owner:
                self.own_instances.add(fact.subject)


def _time_s(observation: Observation) -> float:
    return observation.block.time_s


def _refuse_bad_instances(tbox: TBox, instances: Sequence[Instance]) -> None:
    faults = []
    for expected, instance in enumerate(instances):
        if instance.uid != expected:
            faults.append(f"instance {instance.name!r} has uid {instance.uid}; allowed here: {expected}")
        if not 0 <= instance.class_uid < len(tbox.classes):
            faults.append(
                f"instance {instance.name!r} is of class {instance.class_uid}; allowed: 0..{len(tbox.classes) - 1}"
            )
    names = [instance.name for instance in instances]
    for name in sorted({name for name in names if names.count(name) > 1}):
        faults.append(f"{names.count(name)} instances are named {name!r}; allowed: one")
    if faults:
        raise FactError("\n".join(faults))
