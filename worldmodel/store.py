"""The store of one vehicle: blocks of time-stamped facts, an index over them, and the instances they are about.

Nothing that is known is ever overwritten: blocks are told apart by their GUID and "merely add to the total
knowledge store" (Maurelli et al., Multi-robot cooperation, section IV). What is current is a view. Of the
facts of one slot, an attribute of an instance, the *latest* is the one with the greatest (time_s, origin,
sequence, position in its block). That order is total and does not depend on arrival, so two vehicles with the
same blocks see the same. A vehicle whose clock lags can therefore record a value that is not the latest of its
slot; times are kept as observed, and the guard against bad clocks is left to those who read them.

The common instances of a scenario have the uids 0, 1, ... before the mission. An origin that creates an
instance takes its uid out of a range of its own and announces it by a value of the attribute ``type``.

Checks and merging work on a ``Store``; they are the only ones who put blocks in.
"""

import hashlib
from bisect import insort
from collections.abc import Iterable, Sequence
from functools import lru_cache

from worldmodel.errors import FactError, unknown_name
from worldmodel.facts import Block, BlockKey, Change, Guid, Instance, Merged, Observation
from worldmodel.fields import Grid
from worldmodel.tbox import TYPE_UID, TBox, Value

NOTHING = Merged((), ())


class Arrivals:
    """The blocks that have arrived but are not in, and the class each run-time instance was created with."""

    def __init__(self) -> None:
        self.waiting: dict[Guid, Block] = {}
        self.refused: dict[Guid, Block] = {}
        self.unreported = NOTHING
        """What a local record set free; the next merge reports it."""
        self._waiting_for: dict[int, list[Guid]] = {}  # instance uid -> blocks
        self._created: dict[int, tuple[int, int]] = {}  # run-time instance uid -> (sequence, class uid)

    def get(self, guid: Guid) -> Block | None:
        """Return the block if it waits or was refused."""
        return self.waiting.get(guid) or self.refused.get(guid)

    def created_as(self, uid: int) -> int | None:
        """Return the class a run-time instance was created with, if any block that arrived says so."""
        entry = self._created.get(uid)
        return None if entry is None else entry[1]

    def note_creations(self, store: "Store", block: Block) -> bool:
        """Enter the instances that the block creates; True if a class of creation known before has changed."""
        changed = False
        noted: set[int] = set()
        for fact in block.facts:
            uid = fact.subject
            if fact.attribute != TYPE_UID or store.owner_of(uid) != block.origin or uid in noted:
                continue
            noted.add(uid)
            known = self._created.get(uid)
            if known is None or block.sequence < known[0]:
                self._created[uid] = (block.sequence, fact.target)
                changed |= known is not None and known[1] != fact.target
        return changed

    def wait(self, block: Block, missing: tuple[int, ...]) -> None:
        """Keep the block until the first of ``missing`` is announced; it is then checked again."""
        self.waiting[block.guid] = block
        self._waiting_for.setdefault(missing[0], []).append(block.guid)

    def release(self, block: Block) -> list[Block]:
        """Take out and return the blocks that waited for a type fact of this one."""
        guids: list[Guid] = []
        for fact in block.facts:
            if fact.attribute == TYPE_UID:
                guids += self._waiting_for.pop(fact.subject, ())
        return [self.waiting.pop(guid) for guid in guids]

    def clear(self) -> None:
        """Forget everything but what is still unreported."""
        self.waiting.clear()
        self.refused.clear()
        self._waiting_for.clear()
        self._created.clear()


class Store:
    """The blocks that one vehicle holds, indexed by slot; ``version`` grows whenever an answer may change."""

    def __init__(
        self,
        tbox: TBox,
        owner: int,
        instances: Sequence[Instance],
        time_resolution_s: float = 0.1,
        *,
        n_origins: int,
        run_time_instances_per_origin: int = 256,
    ) -> None:
        """Know the common ``instances``, and no fact about them.

        All vehicles of a fleet must be given the same arguments, except ``owner``.

        Args:
            tbox: the classes and attributes that facts may use.
            owner: the origin of what is recorded here, 0 to ``n_origins - 1``.
            instances: the common instances, with the uids 0, 1, ... in this order and different names.
            time_resolution_s: the step of all times (s).
            n_origins: the number of vehicles that may record facts.
            run_time_instances_per_origin: the number of instances that each origin may create.

        Raises:
            FactError: an argument cannot be right; the message names all bad instances.
        """
        _refuse_bad_instances(tbox, instances)
        if not 0 <= owner < n_origins:
            raise FactError(f"owner {owner} is not an origin; allowed: 0..{n_origins - 1}")
        if run_time_instances_per_origin < 0:
            raise FactError(f"run_time_instances_per_origin is {run_time_instances_per_origin}; allowed: 0 or more")
        try:
            self._clock_grid = Grid(0.0, time_resolution_s)
        except ValueError as error:
            raise FactError(f"time_resolution_s: {error}") from None
        self.tbox = tbox
        self.owner = owner
        self.time_resolution_s = time_resolution_s
        self.n_origins = n_origins
        self.run_time_instances_per_origin = run_time_instances_per_origin
        self.common_instances = tuple(instances)
        self.n_uids = len(instances) + n_origins * run_time_instances_per_origin
        self.version = 0
        self.arrivals = Arrivals()
        self.next_sequence = 0
        """The sequence of the next block that the owner records."""
        self.n_own_instances = 0
        """The number of uids taken out of the owner's range."""
        self.sound_values = _sound_values(tbox)
        """What the checks found sound: (attribute uid, type of the value, value)."""
        self._instance_named = {instance.name: instance for instance in instances}
        self._banned: set[int] = set()
        self._blocks: dict[Guid, Block] = {}
        self._slots: dict[tuple[int, int], list[Observation]] = {}  # (subject, attribute)
        self._masks: dict[int, int] = {}
        self._members: dict[int, tuple[Instance, ...]] = {}
        self.clear()

    def latest(self, subject: int, attribute: int) -> Observation | None:
        """Return the newest observation of a slot, banned origins left out."""
        observations = self._slots.get((subject, attribute))
        if observations is None:
            return None
        if not self._banned:
            return observations[-1]
        return next((o for o in reversed(observations) if o.block.origin not in self._banned), None)

    def history(self, subject: int, attribute: int) -> tuple[Observation, ...]:
        """Return all observations of a slot, oldest first, banned origins left out."""
        observations = self._slots.get((subject, attribute), ())
        return tuple(o for o in observations if o.block.origin not in self._banned)

    def value(self, subject: int, attribute: int, default: Value | None = None) -> Value | None:
        """Return the latest value of a slot, or ``default`` when there is none."""
        observation = self.latest(subject, attribute)
        return default if observation is None else observation.value

    def block(self, guid: Guid) -> Block | None:
        """Return the block if it is in."""
        return self._blocks.get(guid)

    def blocks(self) -> Iterable[Block]:
        """Return the blocks that are in, in the order in which they went in."""
        return self._blocks.values()

    def arrived(self, guid: Guid) -> Block | None:
        """Return the block if it is in, waits or was refused: it need not come again."""
        return self._blocks.get(guid) or self.arrivals.get(guid)

    def instance(self, uid: int) -> Instance | None:
        """Return the instance if it is common or has been announced, even by a banned origin."""
        if 0 <= uid < len(self.common_instances):
            return self.common_instances[uid]
        created = self.arrivals.created_as(uid)
        if created is None or not self.class_mask(uid):
            return None
        return Instance(uid, created, f"{self.tbox.classes[created].name}-{uid}")

    def instance_uids(self) -> Iterable[int]:
        """Return the uids of all known instances, also of those that a banned origin announced."""
        return self._masks.keys()

    def instance_named(self, name: str) -> Instance:
        """Return a common instance by its name; raises UnknownNameError, which proposes a similar name."""
        try:
            return self._instance_named[name]
        except KeyError:
            raise unknown_name("common instance", name, self._instance_named) from None

    def instances_of(self, class_uid: int) -> tuple[Instance, ...]:
        """Return the instances of a class and of its subclasses, by uid, banned origins left out."""
        members = self._members.get(class_uid)
        if members is None:
            known = (self.instance(uid) for uid in sorted(self.instance_uids()))
            members = tuple(i for i in known if i is not None and self._is_seen_as(i, class_uid))
            self._members[class_uid] = members
        return members

    def _is_seen_as(self, instance: Instance, class_uid: int) -> bool:
        types = [o.fact.target for o in self.history(instance.uid, TYPE_UID)]
        if instance.uid < len(self.common_instances):
            types.append(instance.class_uid)
        return any(self.tbox.is_a(c, class_uid) for c in types)

    def class_mask(self, uid: int) -> int:
        """Return the classes an instance is known to belong to, bit c for class c; 0 when it is not known."""
        return self._masks.get(uid, 0)

    def created_as(self, uid: int) -> int | None:
        """Return the class an instance was created with, even while the block that creates it waits."""
        if 0 <= uid < len(self.common_instances):
            return self.common_instances[uid].class_uid
        return self.arrivals.created_as(uid)

    def owner_of(self, uid: int) -> int | None:
        """Return the origin whose range a uid is from; None for a common instance and outside all ranges."""
        if not len(self.common_instances) <= uid < self.n_uids:
            return None
        return (uid - len(self.common_instances)) // self.run_time_instances_per_origin

    def first_uid_of(self, origin: int) -> int:
        """Return the first uid of the range from which ``origin`` takes the uids of its instances."""
        return len(self.common_instances) + origin * self.run_time_instances_per_origin

    def ban(self, origin: int) -> None:
        """See the world as if ``origin`` had said nothing; its blocks are kept, and still exchanged."""
        if not 0 <= origin < self.n_origins:
            raise FactError(f"origin {origin} is unknown; allowed: 0..{self.n_origins - 1}")
        self._banned.add(origin)
        self._members.clear()
        self.version += 1

    @property
    def banned(self) -> frozenset[int]:
        """The origins that the view leaves out."""
        return frozenset(self._banned)

    def state_hash(self) -> str:
        """Return a digest of TBox, common instances and set of blocks: equal if, and only if, these are."""
        state = hashlib.sha256(repr((self.tbox.hash, self.common_instances, self.n_origins, self.n_uids)).encode())
        for guid in sorted(self._blocks):
            state.update(self.content(self._blocks[guid]))
        return state.hexdigest()

    def content(self, block: Block) -> bytes:
        """Return a digest of all that a block of good form says, taken over integers."""
        attributes = self.tbox.attributes
        facts = [(f.subject, f.attribute, attributes[f.attribute].encode(f.value)) for f in block.facts]
        tick = self._clock_grid.index_of(block.time_s)
        return hashlib.sha256(repr((block.origin, block.sequence, tick, facts)).encode()).digest()

    def quantise_time(self, time_s: float) -> float:
        """Return the time on the grid of ``time_resolution_s`` that is nearest to ``time_s`` (s)."""
        return self._clock_grid.value_at(self._clock_grid.index_of(time_s))

    def insert(self, block: Block) -> Change:
        """Index a block that is not in and has passed the checks. Call ``merge`` to add blocks."""
        self._blocks[block.guid] = block
        time_s, inserted = block.time_s, []
        for position, fact in enumerate(block.facts):
            observation = Observation(block, position)
            inserted.append(observation)
            slot = (fact.subject, fact.attribute)
            observations = self._slots.get(slot)
            if observations is None:
                self._slots[slot] = [observation]
            elif observations[-1].block.time_s < time_s or observations[-1].block.key <= block.key:
                observations.append(observation)
            else:
                insort(observations, observation, key=_key)
            if fact.attribute == TYPE_UID:
                self._add_type(fact.subject, fact.target)
        self.version += 1
        facts = zip(block.facts, inserted, strict=True)
        return Change(block, tuple([fact for fact, one in facts if self.latest(fact.subject, fact.attribute) is one]))

    def _add_type(self, uid: int, class_uid: int) -> None:
        self._masks[uid] = self._masks.get(uid, 0) | self.tbox.ancestor_mask(class_uid)
        self._members.clear()

    def note_own(self, block: Block) -> None:
        """Never use again the sequence or a uid of this block, which the owner sent before a restart."""
        self.next_sequence = max(self.next_sequence, block.sequence + 1)
        for fact in block.facts:
            if fact.attribute == TYPE_UID and self.owner_of(fact.subject) == self.owner:
                taken = fact.subject - self.first_uid_of(self.owner) + 1
                self.n_own_instances = max(self.n_own_instances, taken)

    def clear(self) -> None:
        """Forget all blocks that are in; ``merge`` calls it before it works out anew which belong there."""
        self._blocks.clear()
        self._slots.clear()
        self._members.clear()
        self._masks = {i.uid: self.tbox.ancestor_mask(i.class_uid) for i in self.common_instances}


@lru_cache(maxsize=8)
def _sound_values(tbox: TBox) -> set[tuple[int, type, Value]]:
    """Return the memo of the checks for all stores of one ontology: soundness depends on its tables alone."""
    return set()


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


def _key(observation: Observation) -> BlockKey:
    return observation.block.key
