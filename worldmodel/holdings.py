"""Blocks and instances of one store.

``digest`` covers the items that have arrived: accepted, pending, refused or pruned. ``state_hash`` covers their
content. Pruning changes neither, so vehicles that prune differently still agree.
"""

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from worldmodel.arrivals import WAITING_BLOCKS, WAITING_S, Arrivals
from worldmodel.bans import deciding
from worldmodel.errors import FactError, unknown_name
from worldmodel.facts import STATUS, Block, Guid, Instance, PropertyValue
from worldmodel.index import Index
from worldmodel.ontology.fields import Grid
from worldmodel.ontology.tbox import TYPE_UID, Attribute, TBox, ValueKind

CLOCK_TOLERANCE_S = 1.0
"""Tolerated lead of an observation time over its arrival (s)."""


def prunable(tbox: TBox) -> tuple[Attribute, ...]:
    """Return the attributes whose old values may be dropped: all but ``type`` and exclusions."""
    kept = deciding(tbox)
    return tuple(attribute for attribute in tbox.attributes if attribute.uid != TYPE_UID and attribute.uid not in kept)


class PruneRule(NamedTuple):
    """Rule: drop values of an attribute in a class once older than ``older_than_s`` (s)."""

    class_uid: int
    attribute: int
    older_than_s: float

    def check(self, tbox: TBox) -> None:
        """Raise FactError for an unknown class, a negative age or an attribute not ``prunable``."""
        if not 0 <= self.class_uid < len(tbox.classes):
            raise FactError(f"pruning: class {self.class_uid} is unknown; allowed: 0..{len(tbox.classes) - 1}")
        allowed = {attribute.uid for attribute in prunable(tbox)}
        if self.attribute not in allowed:
            kept = ", ".join(attribute.name for attribute in tbox.attributes if attribute.uid not in allowed)
            within = f"1..{len(tbox.attributes) - 1}; values of {kept} are never pruned"
            raise FactError(f"pruning: attribute {self.attribute}; allowed: {within}")
        if not self.older_than_s >= 0:
            raise FactError(f"pruning: older_than_s is {self.older_than_s}; allowed: 0 s or more")


class Keeping(NamedTuple):
    """Initial facts and acceptance limits of a store; equal at all vehicles of a fleet.

    Attributes:
        clock_tolerance_s: tolerated lead of an observation time over its arrival (s).
        waiting_s, waiting_blocks: see ``worldmodel.arrivals``.
        common_facts: facts about common instances that all vehicles know initially, without time and origin.
    """

    clock_tolerance_s: float = CLOCK_TOLERANCE_S
    waiting_s: float = WAITING_S
    waiting_blocks: int = WAITING_BLOCKS
    pruning: Sequence[PruneRule] = ()
    common_facts: Sequence[PropertyValue] = ()


class BlockLog:
    """Blocks of one origin and epoch by sequence, and which sequences have arrived."""

    __slots__ = ("blocks", "mask", "n_whole")

    def __init__(self) -> None:
        self.blocks: dict[int, Block | None] = {}
        """Arrived sequences; None for one whose block is not stored."""
        self.n_whole = 0
        """Number of sequences up to the first gap."""
        self.mask = 0
        """Bit k is set if the sequence ``n_whole + k`` has arrived."""

    @property
    def digest(self) -> tuple[int, int]:
        """Highest contiguous sequence or -1, and mask of later ones: bit k stands for that + 1 + k."""
        return self.n_whole - 1, self.mask

    def __iter__(self) -> Iterator[Block]:
        """Yield the stored blocks, by sequence."""
        return (block for sequence in sorted(self.blocks) if (block := self.blocks[sequence]) is not None)

    def put(self, sequence: int, block: Block | None) -> None:
        """Mark a sequence as arrived and store its block, or None."""
        self.blocks[sequence] = block
        if sequence >= self.n_whole:
            self.mask |= 1 << sequence - self.n_whole
            while self.mask & 1:
                self.mask >>= 1
                self.n_whole += 1

    def forget(self, sequence: int) -> None:
        """Mark an arrived sequence as missing again."""
        del self.blocks[sequence]
        if sequence >= self.n_whole:
            self.mask ^= 1 << sequence - self.n_whole
            return
        n_behind = self.n_whole - sequence - 1
        self.mask = self.mask << n_behind + 1 | (1 << n_behind) - 1 << 1
        self.n_whole = sequence


class StoredItems:
    """Items and private blocks by origin, epoch and sequence, and the instances that they create.

    Common instances have the uids 0, 1, ..., followed by one uid range per origin.
    """

    def __init__(
        self,
        tbox: TBox,
        instances: Sequence[Instance],
        time_resolution_s: float,
        n_origins: int,
        run_time_instances_per_origin: int,
        keeping: Keeping,
    ) -> None:
        """Create empty logs; see ``Store`` for the arguments."""
        _refuse_bad_instances(tbox, instances)
        if run_time_instances_per_origin < 0:
            raise FactError(f"run_time_instances_per_origin is {run_time_instances_per_origin}; allowed: 0 or more")
        if not keeping.waiting_s >= 0:
            raise FactError(f"waiting_s is {keeping.waiting_s}; allowed: 0 s or more")
        if keeping.waiting_blocks < 1:
            raise FactError(f"waiting_blocks is {keeping.waiting_blocks}; allowed: 1 or more")
        self.tbox = tbox
        self.n_origins = n_origins
        self.run_time_instances_per_origin = run_time_instances_per_origin
        self.common_instances = tuple(instances)
        self.n_uids = len(instances) + n_origins * run_time_instances_per_origin
        self.latest_only = frozenset(attribute.uid for attribute in tbox.attributes if attribute.latest_only)
        self.index = Index(tbox, instances)
        links = frozenset(a.uid for a in tbox.attributes if a.kind is ValueKind.LINK)
        self.arrivals = Arrivals(links, keeping.waiting_s, keeping.waiting_blocks)
        self._instance_named = {instance.name: instance for instance in instances}
        try:
            self.clock_grid = Grid(0.0, time_resolution_s)
        except ValueError as error:
            raise FactError(f"time_resolution_s: {error}") from None
        self.time_resolution_s = time_resolution_s
        self._time_ratio = self.clock_grid.ratio
        self.logs: dict[tuple[int, int], BlockLog] = {}
        """Items, by (origin, epoch)."""
        self._private: dict[tuple[int, int], BlockLog] = {}  # private blocks, numbered upwards here
        self.content_of_pruned = 0
        """Sum of the content digests of pruned items."""

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

    def base_mask(self, uid: int, has_creator: bool) -> int:
        """Return the classes by creation, bit c for class c; 0 without an accepted creator."""
        if 0 <= uid < len(self.common_instances):
            return self.tbox.ancestor_mask(self.common_instances[uid].class_uid)
        created = self.arrivals.created_as(uid)
        return self.tbox.ancestor_mask(created) if has_creator and created is not None else 0

    def block(self, guid: Guid) -> Block | None:
        """Return an item or private block if it is accepted and stored."""
        log, sequence = self._place(guid)
        return None if log is None else log.blocks.get(sequence)

    def blocks(self) -> Iterator[Block]:
        """Yield the accepted items, by origin, epoch and sequence."""
        for key in sorted(self.logs):
            yield from self.logs[key]

    def private_blocks(self) -> Iterator[Block]:
        """Yield the owner's private blocks."""
        for key in sorted(self._private):
            yield from self._private[key]

    def arrived(self, guid: Guid) -> Block | None:
        """Return a block that is accepted, pending or refused."""
        return self.block(guid) or self.arrivals.get(guid)

    def has_arrived(self, guid: Guid) -> bool:
        """True if peers need not send the block again, even if it was pruned since."""
        log, sequence = self._place(guid)
        return log is not None and sequence in log.blocks

    def digest(self) -> dict[tuple[int, int], tuple[int, int]]:
        """Return the arrived items by (origin, epoch), each as in ``BlockLog.digest``."""
        return {key: log.digest for key, log in self.logs.items() if log.blocks}

    def items(self) -> Iterator[tuple[Guid, Block | None]]:
        """Yield the arrived items, by origin, epoch and sequence; None for a pruned one."""
        for origin, epoch in sorted(self.logs):
            log = self.logs[origin, epoch]
            for sequence in sorted(log.blocks):
                guid = origin, epoch, sequence
                yield guid, self.arrived(guid)

    def state_hash(self) -> str:
        """Return a digest of TBox, common instances and accepted items, pruned ones included."""
        total = self.content_of_pruned + sum(self._content_number(block) for block in self.blocks())
        state = (self.tbox.hash, self.common_instances, self.n_origins, self.n_uids, total % (1 << 256))
        return hashlib.sha256(repr(state).encode()).hexdigest()

    def content(self, block: Block) -> bytes:
        """Return a digest of GUID, time and facts of a valid block, computed on integers."""
        attributes = self.tbox.attributes
        facts = [(f.subject, f.attribute, attributes[f.attribute].encode(f.value), f.uncertainty) for f in block.facts]
        tick = self.clock_grid.index_of(block.time_s)
        return hashlib.sha256(repr((block.guid, tick, facts)).encode()).digest()

    def _content_number(self, block: Block) -> int:
        return int.from_bytes(self.content(block), "big")

    def quantise_time(self, time_s: float) -> float:
        """Return the grid time nearest to ``time_s`` (s)."""
        step, denominator = self._time_ratio
        return round(time_s / self.time_resolution_s) * step / denominator

    def _place(self, guid: Guid, create: bool = False) -> tuple[BlockLog | None, int]:
        origin, epoch, sequence = guid
        logs, index = (self.logs, sequence) if sequence >= 0 else (self._private, STATUS - 1 - sequence)
        log = logs.get((origin, epoch))
        if log is None and create:
            log = logs[origin, epoch] = BlockLog()
        return log, index

    def hold(self, guid: Guid, block: Block | None = None) -> None:
        """Mark an item or private block as arrived and store ``block``, if given."""
        log, sequence = self._place(guid, create=True)
        if log is not None:
            log.put(sequence, block)

    def drop(self, block: Block) -> None:
        """Remove a pending or refused block so that it can be received again."""
        self.arrivals.take(block.guid)
        log, sequence = self._place(block.guid)
        if log is not None:
            log.forget(sequence)


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
