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
from collections.abc import Iterable, Iterator, Sequence

from worldmodel.arrivals import WAITING_BLOCKS, WAITING_S, Arrivals
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
)
from worldmodel.fields import Grid
from worldmodel.index import Entry, Index, block_of, observation_of
from worldmodel.log import Log
from worldmodel.tables import tables_of
from worldmodel.tbox import TYPE_UID, TBox, Value, ValueKind

CLOCK_TOLERANCE_S = 1.0
"""By how much a fact may be later than its arrival (s)."""


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
        epoch: int = 0,
        clock_tolerance_s: float = CLOCK_TOLERANCE_S,
        waiting_s: float = WAITING_S,
        waiting_blocks: int = WAITING_BLOCKS,
    ) -> None:
        """Know the common ``instances``, and no fact about them.

        All vehicles of a fleet must be given the same arguments, except ``owner`` and ``epoch``.

        Args:
            tbox: the classes and attributes that facts may use.
            owner: the origin of what is recorded here, 0 to ``n_origins - 1``.
            instances: the common instances, with the uids 0, 1, ... in this order and different names; the first
                ``n_origins`` of them are the vehicles, each the origin of its number.
            time_resolution_s: the step of all times (s).
            n_origins: the number of vehicles that may record facts.
            run_time_instances_per_origin: the number of instances that each origin may create.
            epoch: how often the owner has restarted without its memory, 0 to 15.
            clock_tolerance_s: by how much a fact may be later than its arrival (s).
            waiting_s: for how long a block waits for what it rests on (s).
            waiting_blocks: how many blocks of one origin wait at most; the oldest is dropped.

        Raises:
            FactError: an argument cannot be right; the message names all bad instances.
        """
        _refuse_bad_instances(tbox, instances)
        if not 0 <= owner < n_origins:
            raise FactError(f"owner {owner} is not an origin; allowed: 0..{n_origins - 1}")
        if run_time_instances_per_origin < 0:
            raise FactError(f"run_time_instances_per_origin is {run_time_instances_per_origin}; allowed: 0 or more")
        if not 0 <= epoch < EPOCHS:
            raise FactError(f"epoch is {epoch}; allowed: 0..{EPOCHS - 1}")
        for name, given, least in (("clock_tolerance_s", clock_tolerance_s, 0), ("waiting_s", waiting_s, 0)):
            if not given >= least:
                raise FactError(f"{name} is {given}; allowed: {least} s or more")
        if waiting_blocks < 1:
            raise FactError(f"waiting_blocks is {waiting_blocks}; allowed: 1 or more")
        try:
            self._clock_grid = Grid(0.0, time_resolution_s)
        except ValueError as error:
            raise FactError(f"time_resolution_s: {error}") from None
        self.tbox = tbox
        self.owner = owner
        self.epoch = epoch
        self.time_resolution_s = time_resolution_s
        self.clock_tolerance_s = clock_tolerance_s
        self.n_origins = n_origins
        self.run_time_instances_per_origin = run_time_instances_per_origin
        self.common_instances = tuple(instances)
        self.n_uids = len(instances) + n_origins * run_time_instances_per_origin
        self.version = 0
        links = frozenset(a.uid for a in tbox.attributes if a.kind is ValueKind.LINK)
        self.arrivals = Arrivals(links, waiting_s, waiting_blocks)
        self.next_sequence = 0
        """The sequence of the next item that the owner records."""
        self.next_private = STATUS - 1
        """The sequence of the next block that the owner keeps to itself."""
        self.own_instances: set[int] = set()
        """The uids taken out of the owner's range, as far as is known."""
        self.tables = tables_of(tbox)
        """The attributes, compiled for the checks."""
        self.index = Index(tbox, instances)
        self._instance_named = {instance.name: instance for instance in instances}
        self._banned: set[int] = set()
        self._logs: dict[tuple[int, int], Log] = {}  # (origin, epoch): items
        self._private: dict[tuple[int, int], Log] = {}  # the same for private blocks, counted up
        self._members: dict[int, tuple[Instance, ...]] = {}
        self._members_of = (0, 0)  # version of types, number of bans, for which they hold
        self._pruned = 0  # sum of the contents of items that are no longer held

    # Questions -----------------------------------------------------------------------------------

    def latest(self, subject: int, attribute: int) -> Observation | None:
        """Return the newest observation of a slot, banned origins left out."""
        entry = self._latest(subject, attribute)
        return None if entry is None else observation_of(entry)

    def _latest(self, subject: int, attribute: int) -> Entry | None:
        entries = self.index.slots.get((subject, attribute))
        if entries is None:
            return None
        if not self._banned:
            return entries[-1]
        return next((entry for entry in reversed(entries) if block_of(entry).origin not in self._banned), None)

    def history(self, subject: int, attribute: int) -> tuple[Observation, ...]:
        """Return all observations of a slot, oldest first, banned origins left out.

        Of statuses the newest of each origin is there.
        """
        entries = self.index.slots.get((subject, attribute), ())
        found = (observation_of(entry) for entry in entries)
        return tuple(o for o in found if o.block.origin not in self._banned)

    def value(self, subject: int, attribute: int, default: Value | None = None) -> Value | None:
        """Return the latest value of a slot, or ``default`` when there is none."""
        observation = self.latest(subject, attribute)
        return default if observation is None else observation.value

    def block(self, guid: Guid) -> Block | None:
        """Return the item or private block if it is in."""
        log, sequence = self._place(guid)
        return None if log is None else log.get(sequence)

    def blocks(self) -> Iterator[Block]:
        """Yield the items that are in, by origin, epoch and sequence."""
        for key in sorted(self._logs):
            yield from self._logs[key]

    def private_blocks(self) -> Iterator[Block]:
        """Yield what the owner has recorded and keeps to itself."""
        for key in sorted(self._private):
            yield from self._private[key]

    def statuses(self) -> Iterator[Block]:
        """Yield the statuses that are held, the newest of each slot and origin, each as a block of one fact."""
        for slot in sorted(self.index.statuses):
            yield self.index.statuses[slot]

    def arrived(self, guid: Guid) -> Block | None:
        """Return the block if it is in, waits or was refused."""
        return self.block(guid) or self.arrivals.get(guid)

    def has_arrived(self, guid: Guid) -> bool:
        """True if the block need not come again, even if it was pruned since."""
        log, sequence = self._place(guid)
        return log is not None and log.has(sequence)

    def digest(self) -> dict[tuple[int, int], tuple[int, int]]:
        """Return which items need not come again, by (origin, epoch).

        Each is (highest contiguous sequence or -1, mask of those above): bit k of the mask stands for that sequence
        + 1 + k. Items count that are in, wait, were refused or were pruned. Stores that hold the same, pruned or
        not, have equal digests.
        """
        return {key: log.digest for key, log in self._logs.items() if log.blocks or log.ahead}

    def lacking(self, now_s: float) -> tuple[Lacking, ...]:
        """Return what blocks wait for, and who can announce it, by uid.

        Args:
            now_s: to which ages are counted (s).
        """
        return self.arrivals.lacking(now_s, self.owner_of)

    # Instances -----------------------------------------------------------------------------------

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
        return self.index.masks.keys()

    def instance_named(self, name: str) -> Instance:
        """Return a common instance by its name; raises UnknownNameError, which proposes a similar name."""
        try:
            return self._instance_named[name]
        except KeyError:
            raise unknown_name("common instance", name, self._instance_named) from None

    def instances_of(self, class_uid: int) -> tuple[Instance, ...]:
        """Return the instances of a class and of its subclasses, by uid, banned origins left out."""
        holds_for = self.index.version_of_types, len(self._banned)
        if self._members_of != holds_for:
            self._members_of, self._members = holds_for, {}
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
        return self.index.masks.get(uid, 0)

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
        self.version += 1

    @property
    def banned(self) -> frozenset[int]:
        """The origins that the view leaves out."""
        return frozenset(self._banned)

    # State ---------------------------------------------------------------------------------------

    def state_hash(self) -> str:
        """Return a digest of TBox, common instances and set of items: equal if, and only if, these are.

        An item that went in counts also after it was pruned. So stores that pruned differently have equal hashes.
        Statuses and private blocks do not count.
        """
        total = self._pruned + sum(self._content_number(block) for block in self.blocks())
        state = (self.tbox.hash, self.common_instances, self.n_origins, self.n_uids, total % (1 << 256))
        return hashlib.sha256(repr(state).encode()).hexdigest()

    def content(self, block: Block) -> bytes:
        """Return a digest of all that a block of good form says, taken over integers."""
        attributes = self.tbox.attributes
        facts = [(f.subject, f.attribute, attributes[f.attribute].encode(f.value), f.uncertainty) for f in block.facts]
        tick = self._clock_grid.index_of(block.time_s)
        return hashlib.sha256(repr((block.guid, tick, facts)).encode()).digest()

    def _content_number(self, block: Block) -> int:
        return int.from_bytes(self.content(block), "big")

    def quantise_time(self, time_s: float) -> float:
        """Return the time on the grid of ``time_resolution_s`` that is nearest to ``time_s`` (s)."""
        return self._clock_grid.value_at(self._clock_grid.index_of(time_s))

    # For checks and merging ----------------------------------------------------------------------

    def _place(self, guid: Guid, create: bool = False) -> tuple[Log | None, int]:
        """Return the log that a block belongs into, if there is one, and its sequence there."""
        origin, epoch, sequence = guid
        logs, index = (self._logs, sequence) if sequence >= 0 else (self._private, STATUS - 1 - sequence)
        log = logs.get((origin, epoch))
        if log is None and create:
            log = logs[origin, epoch] = Log()
        return log, index

    def hold(self, guid: Guid, block: Block | None = None) -> None:
        """Note that an item or private block has arrived; ``block`` is what is held of it."""
        log, sequence = self._place(guid, create=True)
        if log is not None:
            log.put(sequence, block)

    def latest_time_s(self, now_s: float) -> float:
        """Return the latest time of observation that what arrives at ``now_s`` may have; times are on a grid (s)."""
        return max(now_s + self.clock_tolerance_s, self.quantise_time(now_s))

    def insert(self, block: Block) -> Change:
        """Index an item or private block that is not in and has passed the checks. Call ``merge`` to add blocks."""
        origin, sequence, _, facts, epoch = block
        log = self._logs.get((origin, epoch))
        if log is not None and sequence == len(log.blocks) and not log.ahead:
            log.blocks.append(block)
        else:
            self.hold(block.guid, block)
        self.version += 1
        if len(facts) == 1:
            fact = facts[0]
            self.index.enter(fact, block)
            return Change(block, facts if self._latest(fact.subject, fact.attribute) is block else ())
        entries = [Observation(block, position) for position in range(len(facts))]
        for fact, entry in zip(facts, entries, strict=True):
            self.index.enter(fact, entry)
        pairs = zip(facts, entries, strict=True)
        return Change(block, tuple([f for f, entry in pairs if self._latest(f.subject, f.attribute) is entry]))

    def place_status(self, block: Block) -> Change:
        """Let a status that has passed the checks replace what its origin said before."""
        placed = self.index.place(block)
        self.version += bool(placed)
        return Change(block, tuple([f for f, one in placed if self._latest(f.subject, f.attribute) is one]))

    def drop(self, block: Block) -> None:
        """Be as if a block that waits or was refused had not arrived."""
        self.arrivals.take(block.guid)
        log, sequence = self._place(block.guid)
        if log is not None:
            log.forget(sequence)

    def facts_of(self, subject: int, attribute: int) -> list[Observation]:
        """Return all observations of a slot, those of banned origins too."""
        return [observation_of(entry) for entry in self.index.slots.get((subject, attribute), ())]

    def base_mask(self, uid: int, is_created_anew: bool = False) -> int:
        """Return the classes that an instance has whatever others say of it, bit c for class c.

        Args:
            uid: the instance.
            is_created_anew: True while its class of creation is in question.
        """
        if 0 <= uid < len(self.common_instances):
            return self.tbox.ancestor_mask(self.common_instances[uid].class_uid)
        creator, created = self.arrivals.created_by(uid), self.arrivals.created_as(uid)
        if is_created_anew or creator is None or created is None or self.block(creator) is None:
            return 0
        return self.tbox.ancestor_mask(created)

    def take_out(self, block: Block) -> None:
        """Take an item or private block out of all indexes; it has still arrived."""
        self.hold(block.guid)
        self.version += 1
        for position, fact in enumerate(block.facts):
            self.index.leave(fact, block if len(block.facts) == 1 else Observation(block, position))

    def note_creations(self, block: Block) -> set[int]:
        """Enter the instances that a block creates; return those whose class of creation is now another."""
        if block.origin == self.owner:
            self._note_own(block)
        changed: set[int] = set()
        noted: set[int] = set()
        for fact in block.facts:
            uid = fact.subject
            if fact.attribute == TYPE_UID and uid not in noted and self.owner_of(uid) == block.origin:
                noted.add(uid)
                if self.arrivals.note_creation(uid, fact.target, block):
                    changed.add(uid)
        return changed

    def _note_own(self, block: Block) -> None:
        """Never use again the sequence or a uid of this block, which the owner sent before a restart."""
        if block.epoch == self.epoch:
            self.next_sequence = max(self.next_sequence, block.sequence + 1)
            self.next_private = min(self.next_private, block.sequence - 1)
        for fact in block.facts:
            if fact.attribute == TYPE_UID and self.owner_of(fact.subject) == self.owner:
                self.own_instances.add(fact.subject)


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
