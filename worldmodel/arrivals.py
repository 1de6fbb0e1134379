"""Arrived blocks that are not accepted: pending or refused.

A pending block is discarded after ``waiting_s``, or as the oldest if more than ``waiting_blocks`` of its origin are
pending. Its origin may then send it again, and its creations no longer count (``worldmodel.merge.expire``).
"""

from collections.abc import Callable
from typing import NamedTuple

from worldmodel.facts import Block, Guid, Lacking, Merged
from worldmodel.ontology.tbox import TYPE_UID

NOTHING = Merged((), ())

WAITING_S = 600.0
"""Default time after which a pending block is discarded (s)."""
WAITING_BLOCKS = 64
"""Default maximum number of pending blocks per origin."""

Rank = tuple[bool, int, int]
"""Creation order of an origin's blocks: items before private blocks, then as recorded."""


class _Wait(NamedTuple):
    uid: int
    since_s: float


def rank_of(block: Block) -> Rank:
    """Return the rank of a block; of two first types of an instance, the lower rank counts."""
    return (not block.is_item, block.epoch, abs(block.sequence))


class Arrivals:
    """Pending and refused blocks, and the class of creation of each run-time instance."""

    def __init__(self, links: frozenset[int], waiting_s: float, waiting_blocks: int) -> None:
        """Create an empty set; ``links`` are the attributes with instances as values."""
        self.waiting: dict[Guid, Block] = {}
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
        self._waits: dict[Guid, _Wait] = {}
        self._waiting_for: dict[int, list[Guid]] = {}  # missing instance uid -> pending blocks
        self._of_origin: dict[int, list[Guid]] = {}  # pending blocks, by origin
        self._about: dict[int, set[Guid]] = {}  # instance uid -> pending and refused blocks
        self._created: dict[int, tuple[Rank, int, Guid]] = {}  # run-time instance uid -> rank, class uid, block

    def get(self, guid: Guid) -> Block | None:
        """Return a pending or refused block."""
        return self.waiting.get(guid) or self.refused.get(guid)

    def about(self, uid: int) -> list[Block]:
        """Return the pending and refused blocks that refer to an instance."""
        return [self.waiting.get(guid) or self.refused[guid] for guid in sorted(self._about.get(uid, ()))]

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
        self._index(block)

    def wait(self, block: Block, missing: tuple[int, ...], since_s: float | None = None) -> Block | None:
        """Suspend a block until ``missing[0]`` is announced; return the oldest one of too many."""
        guid = block.guid
        if since_s is None:
            since_s = block.time_s if self.now_s is None else self.now_s
        self.waiting[guid] = block
        self._waits[guid] = _Wait(missing[0], since_s)
        self._waiting_for.setdefault(missing[0], []).append(guid)
        others = self._of_origin.setdefault(block.origin, [])
        others.append(guid)
        self._index(block)
        if len(others) <= self.waiting_blocks:
            return None
        return self.waiting[min(others, key=lambda waiting_guid: (self._waits[waiting_guid].since_s, waiting_guid))]

    def since_s(self, guid: Guid) -> float | None:
        """Return the start of pending (s); None if the block is not pending."""
        wait = self._waits.get(guid)
        return None if wait is None else wait.since_s

    def take(self, guid: Guid) -> None:
        """Remove a pending or refused block."""
        block = self.refused.pop(guid, None) or self.waiting.pop(guid)
        for uid in self.uids_of(block):
            self._about[uid].discard(guid)
            if not self._about[uid]:
                del self._about[uid]
        if (wait := self._waits.pop(guid, None)) is not None:
            self._of_origin[block.origin].remove(guid)
            if guid in (others := self._waiting_for.get(wait.uid, [])):
                others.remove(guid)

    def release(self, block: Block) -> list[tuple[Block, float]]:
        """Remove and return the blocks pending for ``block``, with their start of pending (s)."""
        freed = []
        for fact in block.facts:
            if fact.attribute == TYPE_UID:
                for guid in self._waiting_for.pop(fact.subject, ()):
                    freed.append((self.waiting[guid], self._waits[guid].since_s))
                    self.take(guid)
        return freed

    def overdue(self, now_s: float) -> list[Block]:
        """Return the blocks pending longer than ``waiting_s``, by GUID."""
        late = (guid for guid, wait in self._waits.items() if now_s - wait.since_s > self.waiting_s)
        return [self.waiting[guid] for guid in sorted(late)]

    def lacking(self, now_s: float, owner_of: Callable[[int], int | None]) -> tuple[Lacking, ...]:
        """Return the missing instances, by uid; see ``Store.lacking``."""
        waiting = []
        for uid in sorted(self._waiting_for):
            if guids := sorted(self._waiting_for[uid]):
                age_s = now_s - min(self._waits[guid].since_s for guid in guids)
                waiting.append(Lacking(uid, owner_of(uid), age_s, tuple(guids)))
        return tuple(waiting)

    def uids_of(self, block: Block) -> set[int]:
        """Return the instances that a block refers to."""
        uids = {fact.subject for fact in block.facts}
        return uids | {fact.target for fact in block.facts if fact.attribute in self._links}

    def _index(self, block: Block) -> None:
        for uid in self.uids_of(block):
            self._about.setdefault(uid, set()).add(block.guid)
