"""Arrived blocks that are not accepted: pending or refused.

A pending block is discarded after ``waiting_s``, or as the oldest if more than ``waiting_blocks`` of its origin pend.
"""

from collections.abc import Callable
from typing import NamedTuple

from worldmodel.facts import Block, Guid, Lacking, Merged
from worldmodel.ontology.tbox import TYPE_UID

NOTHING = Merged((), ())

WAITING_S = 600.0
"""Default time after which a pending block is discarded (s)."""
WAITING_BLOCKS = 64

Rank = tuple[bool, int, int]
"""Creation order of an origin's blocks: items before private blocks, then as recorded."""


class Waiting(NamedTuple):
    """Pending block: its missing instance, and the start of pending (s)."""

    block: Block
    missing: int
    since_s: float


def rank_of(block: Block) -> Rank:
    """Return the rank of a block; of two first types of an instance, the lower rank counts."""
    return (not block.is_item, block.epoch, abs(block.sequence))


class Arrivals:
    """Pending and refused blocks, and the class of creation of each run-time instance."""

    def __init__(self, links: frozenset[int], waiting_s: float, waiting_blocks: int) -> None:
        """Create an empty set; ``links`` are the attributes with instances as values."""
        self.waiting: dict[Guid, Waiting] = {}
        self.refused: dict[Guid, Block] = {}
        self.unreported = NOTHING
        """Blocks released by a local ``record`` or ``expire``; the next merge reports them."""
        self.dropped: list[Block] = []
        """Discarded blocks whose creations still count."""
        self.now_s: float | None = None
        """Arrival time of the current merge (s); None if unknown."""
        self.waiting_s = waiting_s
        self.waiting_blocks = waiting_blocks
        self._links = links
        self._created: dict[int, tuple[Rank, int, Guid]] = {}  # run-time instance uid -> rank, class uid, block

    def get(self, guid: Guid) -> Block | None:
        """Return a pending or refused block."""
        waiting = self.waiting.get(guid)
        return self.refused.get(guid) if waiting is None else waiting.block

    def about(self, uid: int) -> list[Block]:
        """Return the pending and refused blocks that refer to an instance, by GUID."""
        blocks = [*self.refused.values(), *(waiting.block for waiting in self.waiting.values())]
        return sorted((block for block in blocks if uid in self._uids_of(block)), key=lambda block: block.guid)

    # Creations -----------------------------------------------------------------------------------

    def created_as(self, uid: int) -> int | None:
        """Return the class of creation of a run-time instance; None if unknown."""
        entry = self._created.get(uid)
        return None if entry is None else entry[1]

    def created_by(self, uid: int) -> Guid | None:
        """Return the GUID of the block that creates a run-time instance; None if unknown."""
        entry = self._created.get(uid)
        return None if entry is None else entry[2]

    def note_creation(self, uid: int, class_uid: int, block: Block) -> bool:
        """Record a type given by an instance's owner; True if the class of creation changed."""
        known, rank = self._created.get(uid), rank_of(block)
        if known is not None and known[0] <= rank:
            return False
        self._created[uid] = (rank, class_uid, block.guid)
        return known is not None and known[1] != class_uid

    def forget_creation(self, uid: int) -> None:
        """Remove the creation of an instance."""
        self._created.pop(uid, None)

    # Waiting and refusing ------------------------------------------------------------------------

    def refuse(self, block: Block) -> None:
        """Store a block that can never fit."""
        self.refused[block.guid] = block

    def wait(self, block: Block, missing: int, since_s: float | None = None) -> Block | None:
        """Suspend a block until ``missing`` is announced; return the oldest one of too many."""
        if since_s is None:
            since_s = block.time_s if self.now_s is None else self.now_s
        self.waiting[block.guid] = Waiting(block, missing, since_s)
        others = [waiting for waiting in self.waiting.values() if waiting.block.origin == block.origin]
        if len(others) <= self.waiting_blocks:
            return None
        return min(others, key=lambda waiting: (waiting.since_s, waiting.block.guid)).block

    def since_s(self, guid: Guid) -> float | None:
        """Return the start of pending (s); None if the block is not pending."""
        waiting = self.waiting.get(guid)
        return None if waiting is None else waiting.since_s

    def take(self, guid: Guid) -> None:
        """Remove a pending or refused block."""
        if self.waiting.pop(guid, None) is None:
            del self.refused[guid]

    def release(self, block: Block) -> list[Waiting]:
        """Remove and return the blocks pending for ``block``."""
        announced = dict.fromkeys(fact.subject for fact in block.facts if fact.attribute == TYPE_UID)
        freed = [waiting for uid in announced for waiting in self.waiting.values() if waiting.missing == uid]
        for waiting in freed:
            self.take(waiting.block.guid)
        return freed

    def overdue(self, now_s: float) -> list[Block]:
        """Return the blocks pending longer than ``waiting_s``, by GUID."""
        return [self.waiting[g].block for g in sorted(self.waiting) if now_s - self.waiting[g].since_s > self.waiting_s]

    def lacking(self, now_s: float, owner_of: Callable[[int], int | None]) -> tuple[Lacking, ...]:
        """Return the missing instances, by uid; see ``Store.lacking``."""
        of_uid: dict[int, list[Waiting]] = {}
        for guid in sorted(self.waiting):
            of_uid.setdefault(self.waiting[guid].missing, []).append(self.waiting[guid])
        return tuple(
            Lacking(
                uid,
                owner_of(uid),
                now_s - min(waiting.since_s for waiting in of_uid[uid]),
                tuple(waiting.block.guid for waiting in of_uid[uid]),
            )
            for uid in sorted(of_uid)
        )

    def _uids_of(self, block: Block) -> set[int]:
        uids = {fact.subject for fact in block.facts}
        return uids | {fact.target for fact in block.facts if fact.attribute in self._links}
