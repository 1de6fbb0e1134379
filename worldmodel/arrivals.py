"""The blocks that have arrived but are not in: those that wait, and those that were refused.

A block that waits has an age. It is dropped when it has waited for longer than ``waiting_s``, or when more than
``waiting_blocks`` of its origin wait and it came first; then it is forgotten, so that its origin may say it again.
Then the class that it gave an instance counts no longer, either (``worldmodel.merge.expire``).
"""

from collections.abc import Callable
from typing import NamedTuple

from worldmodel.facts import Block, Guid, Lacking, Merged
from worldmodel.ontology.tbox import TYPE_UID

NOTHING = Merged((), ())

WAITING_S = 600.0
"""For how long a block waits for what it rests on (s)."""
WAITING_BLOCKS = 64
"""How many blocks of one origin wait at most."""

Rank = tuple[bool, int, int]
"""The order in which an origin's blocks create instances: what it tells before what it keeps, as recorded."""


class _Wait(NamedTuple):
    uid: int
    since_s: float


def rank_of(block: Block) -> Rank:
    """Return the rank of a block; of two blocks that give an instance its first type, the lower one counts."""
    return (not block.is_item, block.epoch, abs(block.sequence))


class Arrivals:
    """The blocks that have arrived but are not in, and the class each run-time instance was created with."""

    def __init__(self, links: frozenset[int], waiting_s: float, waiting_blocks: int) -> None:
        """Know nothing.

        Args:
            links: the uids of attributes whose values are instances.
            waiting_s: for how long a block waits (s).
            waiting_blocks: how many blocks of one origin wait at most.
        """
        self.waiting: dict[Guid, Block] = {}
        self.refused: dict[Guid, Block] = {}
        self.unreported = NOTHING
        """What a local record set free; the next merge reports it."""
        self.dropped: list[Block] = []
        """Blocks that were forgotten, and of which creations are still kept in mind."""
        self.now_s: float | None = None
        """When what is merged now arrived (s); None if nobody said."""
        self.waiting_s = waiting_s
        self.waiting_blocks = waiting_blocks
        self._links = links
        self._waits: dict[Guid, _Wait] = {}
        self._waiting_for: dict[int, list[Guid]] = {}  # instance uid -> blocks
        self._of_origin: dict[int, list[Guid]] = {}  # those that wait
        self._about: dict[int, set[Guid]] = {}  # instance uid -> blocks that wait or were refused
        self._created: dict[int, tuple[Rank, int, Guid]] = {}  # run-time instance uid -> rank, class uid, block

    def get(self, guid: Guid) -> Block | None:
        """Return the block if it waits or was refused."""
        return self.waiting.get(guid) or self.refused.get(guid)

    def about(self, uid: int) -> list[Block]:
        """Return the blocks that wait or were refused and speak of an instance."""
        return [self.waiting.get(guid) or self.refused[guid] for guid in sorted(self._about.get(uid, ()))]

    # Creations -----------------------------------------------------------------------------------

    def created_as(self, uid: int) -> int | None:
        """Return the class a run-time instance was created with, if any block that arrived says so."""
        entry = self._created.get(uid)
        return None if entry is None else entry[1]

    def created_by(self, uid: int) -> Guid | None:
        """Return the name of the block that creates a run-time instance."""
        entry = self._created.get(uid)
        return None if entry is None else entry[2]

    def note_creation(self, uid: int, class_uid: int, block: Block) -> bool:
        """Enter that a block of its owner gives an instance a type; True if its class of creation has changed."""
        known, rank = self._created.get(uid), rank_of(block)
        if known is not None and known[0] <= rank:
            return False
        self._created[uid] = (rank, class_uid, block.guid)
        return known is not None and known[1] != class_uid

    def forget_creation(self, uid: int) -> None:
        """Be as if nobody had created the instance."""
        self._created.pop(uid, None)

    # Waiting and refusing ------------------------------------------------------------------------

    def refuse(self, block: Block) -> None:
        """Keep a block that does not fit and never will."""
        self.refused[block.guid] = block
        self._index(block)

    def wait(self, block: Block, missing: tuple[int, ...], since_s: float | None = None) -> Block | None:
        """Keep the block until the first of ``missing`` is announced; it is then checked again.

        Args:
            block: the block.
            missing: the instances that it lacks.
            since_s: since when it waits, if not since now (s).

        Returns:
            The block of the same origin that has to go for it, if too many wait.
        """
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
        """Return since when a block waits (s); None if it does not."""
        wait = self._waits.get(guid)
        return None if wait is None else wait.since_s

    def take(self, guid: Guid) -> None:
        """Take out a block that waits or was refused."""
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
        """Take out and return the blocks that waited for a type fact of this one, each with since when it waited."""
        freed = []
        for fact in block.facts:
            if fact.attribute == TYPE_UID:
                for guid in self._waiting_for.pop(fact.subject, ()):
                    freed.append((self.waiting[guid], self._waits[guid].since_s))
                    self.take(guid)
        return freed

    def overdue(self, now_s: float) -> list[Block]:
        """Return the blocks that have waited for longer than ``waiting_s``, by name."""
        late = (guid for guid, wait in self._waits.items() if now_s - wait.since_s > self.waiting_s)
        return [self.waiting[guid] for guid in sorted(late)]

    def lacking(self, now_s: float, owner_of: Callable[[int], int | None]) -> tuple[Lacking, ...]:
        """Return what blocks wait for, by uid; see ``Store.lacking``."""
        waiting = []
        for uid in sorted(self._waiting_for):
            if guids := sorted(self._waiting_for[uid]):
                age_s = now_s - min(self._waits[guid].since_s for guid in guids)
                waiting.append(Lacking(uid, owner_of(uid), age_s, tuple(guids)))
        return tuple(waiting)

    def uids_of(self, block: Block) -> set[int]:
        """Return the instances that a block speaks of."""
        uids = {fact.subject for fact in block.facts}
        return uids | {fact.target for fact in block.facts if fact.attribute in self._links}

    def _index(self, block: Block) -> None:
        for uid in self.uids_of(block):
            self._about.setdefault(uid, set()).add(block.guid)
