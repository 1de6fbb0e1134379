"""The blocks of one store: which have arrived, which are held, and by what two stores see whether they agree.

``digest`` says which items have arrived: in, waiting, refused or pruned. ``state_hash`` says what they say. Both are
the same before and after pruning, so vehicles that prune differently, or not at all, still agree.
"""

import hashlib
from collections.abc import Iterator, Sequence

from worldmodel.errors import FactError
from worldmodel.facts import STATUS, Block, Guid, Instance
from worldmodel.individuals import Individuals
from worldmodel.log import BlockLog
from worldmodel.ontology.fields import Grid
from worldmodel.ontology.tbox import TBox


class StoredItems(Individuals):
    """Items and private blocks, by origin, epoch and sequence."""

    def __init__(
        self,
        tbox: TBox,
        instances: Sequence[Instance],
        time_resolution_s: float,
        n_origins: int,
        run_time_instances_per_origin: int,
        waiting_s: float,
        waiting_blocks: int,
    ) -> None:
        """Hold nothing; see ``Store`` for the arguments."""
        super().__init__(tbox, instances, n_origins, run_time_instances_per_origin, waiting_s, waiting_blocks)
        try:
            self.clock_grid = Grid(0.0, time_resolution_s)
        except ValueError as error:
            raise FactError(f"time_resolution_s: {error}") from None
        self.time_resolution_s = time_resolution_s
        self.time_ratio = self.clock_grid.ratio
        """The step of times as (numerator, denominator), for the paths that every fact takes."""
        self.logs: dict[tuple[int, int], BlockLog] = {}
        """Items, by (origin, epoch)."""
        self._private: dict[tuple[int, int], BlockLog] = {}  # the same for private blocks, counted up
        self.content_of_pruned = 0
        """Sum of the contents of the items that are held no longer, as numbers."""

    def block(self, guid: Guid) -> Block | None:
        """Return the item or private block if it is in."""
        log, sequence = self._place(guid)
        return None if log is None else log.get(sequence)

    def blocks(self) -> Iterator[Block]:
        """Yield the items that are in, by origin, epoch and sequence."""
        for key in sorted(self.logs):
            yield from self.logs[key]

    def private_blocks(self) -> Iterator[Block]:
        """Yield what the owner has recorded and keeps to itself."""
        for key in sorted(self._private):
            yield from self._private[key]

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
        return {key: log.digest for key, log in self.logs.items() if log.blocks or log.ahead}

    def items(self) -> Iterator[tuple[Guid, Block | None]]:
        """Yield the items that have arrived, by origin, epoch and sequence; None for one that is held no longer."""
        for origin, epoch in sorted(self.logs):
            log = self.logs[origin, epoch]
            for sequence in sorted((*range(len(log.blocks)), *log.ahead)):
                guid = origin, epoch, sequence
                yield guid, self.arrived(guid)

    def state_hash(self) -> str:
        """Return a digest of TBox, common instances and set of items: equal if, and only if, these are.

        An item that went in counts also after it was pruned. So stores that pruned differently have equal hashes.
        Statuses and private blocks do not count.
        """
        total = self.content_of_pruned + sum(self._content_number(block) for block in self.blocks())
        state = (self.tbox.hash, self.common_instances, self.n_origins, self.n_uids, total % (1 << 256))
        return hashlib.sha256(repr(state).encode()).hexdigest()

    def content(self, block: Block) -> bytes:
        """Return a digest of all that a block of good form says, taken over integers."""
        attributes = self.tbox.attributes
        facts = [(f.subject, f.attribute, attributes[f.attribute].encode(f.value), f.uncertainty) for f in block.facts]
        tick = self.clock_grid.index_of(block.time_s)
        return hashlib.sha256(repr((block.guid, tick, facts)).encode()).digest()

    def _content_number(self, block: Block) -> int:
        return int.from_bytes(self.content(block), "big")

    def quantise_time(self, time_s: float) -> float:
        """Return the time on the grid of ``time_resolution_s`` that is nearest to ``time_s`` (s)."""
        return self.clock_grid.value_at(self.clock_grid.index_of(time_s))

    def _place(self, guid: Guid, create: bool = False) -> tuple[BlockLog | None, int]:
        """Return the log that a block belongs into, if there is one, and its sequence there."""
        origin, epoch, sequence = guid
        logs, index = (self.logs, sequence) if sequence >= 0 else (self._private, STATUS - 1 - sequence)
        log = logs.get((origin, epoch))
        if log is None and create:
            log = logs[origin, epoch] = BlockLog()
        return log, index

    def hold(self, guid: Guid, block: Block | None = None) -> None:
        """Note that an item or private block has arrived; ``block`` is what is held of it."""
        log, sequence = self._place(guid, create=True)
        if log is not None:
            log.put(sequence, block)

    def drop(self, block: Block) -> None:
        """Let a block that waits or was refused come again."""
        self.arrivals.take(block.guid)
        log, sequence = self._place(block.guid)
        if log is not None:
            log.forget(sequence)
