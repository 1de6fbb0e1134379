"""Taking out of a store what rests on classes that have changed, and nothing else.

A block rests on the classes of the instances that it speaks of. When the block that gave an instance a class is
replaced, or the instance turns out to have been created as something else, the blocks that ask for more than the
instance has in any case come out; so do, in turn, those that rest on the classes which these gave. What remains speaks
of no instance in question, or asks no more of it than it has. So it stays, and the outcome is the same as of working
everything out anew. The cost depends on the blocks about these instances, not on the size of the store.
"""

from collections import deque
from collections.abc import Iterable

from worldmodel.facts import Block, Guid
from worldmodel.ontology.tbox import TYPE_UID
from worldmodel.store import Store


class Revision:
    """The blocks that have been taken out of one store, to be settled again."""

    def __init__(self, store: Store, created_anew: Iterable[int]) -> None:
        """Take out what rests on the classes of some instances.

        Args:
            store: the store.
            created_anew: the instances whose class of creation is now another.
        """
        self._store = store
        self._loose: dict[Guid, tuple[Block, float | None]] = {}
        self._in_question: deque[tuple[int, bool]] = deque()  # instance uid, whether it was created anew
        self.was_in: set[Guid] = set()
        """The names of blocks that were in before."""
        self.was_refused: set[Guid] = set()
        """The names of blocks that were refused before."""
        self._question((uid, True) for uid in created_anew)

    def replace(self, old: Block, new: Block) -> None:
        """Put a block of other content in the place of one that has arrived; it is settled with the others."""
        store, guid = self._store, old.guid
        self._loosen(old)
        for known in (self.was_in, self.was_refused):
            known.discard(guid)
        del self._loose[guid]
        created = {fact.subject: store.arrivals.created_as(fact.subject) for fact in (*old.facts, *new.facts)}
        for uid in created:
            if store.arrivals.created_by(uid) == guid:
                self._create_anew(uid)
        store.note_creations(new)
        changed = [uid for uid, class_uid in created.items() if store.arrivals.created_as(uid) != class_uid]
        self._question((uid, True) for uid in changed)

    def withdraw(self, block: Block) -> None:
        """Let what a block created be created by others, or by nobody, unless it has come again.

        Args:
            block: that was dropped.
        """
        arrivals = self._store.arrivals
        created = {f.subject: arrivals.created_as(f.subject) for f in block.facts if f.attribute == TYPE_UID}
        for uid in created:
            if arrivals.created_by(uid) == block.guid:
                self._create_anew(uid)
        self._question((uid, True) for uid, class_uid in created.items() if arrivals.created_as(uid) != class_uid)

    def loose(self, block: Block | None = None) -> list[tuple[Block, float | None]]:
        """Return what is to be settled, ``block`` too, by name, each with since when it waited (s), if it did."""
        if block is not None:
            self._loose[block.guid] = (block, None)
        return [self._loose[guid] for guid in sorted(self._loose)]

    def _create_anew(self, uid: int) -> None:
        """Work out the creation of an instance of the blocks that are left."""
        store = self._store
        store.arrivals.forget_creation(uid)
        others = [observation.block for observation in store.facts_of(uid, TYPE_UID)]
        others += [block for block, _ in self._loose.values()]
        for block in (*others, *store.arrivals.about(uid)):
            store.note_creations(block)

    def _question(self, uids: Iterable[tuple[int, bool]]) -> None:
        """Take out what rests on the classes of instances, and what rests on that."""
        store, arrivals = self._store, self._store.arrivals
        self._in_question.extend(uids)
        while self._in_question:
            uid, is_created_anew = self._in_question.popleft()
            creator = None if is_created_anew else arrivals.created_by(uid)
            base = store.base_mask(uid, creator is not None and store.block(creator) is not None)
            store.index.drop_statuses(uid, base)
            for block in list(store.index.resting_on(uid, base, creator)):
                self._loosen(block)
            if is_created_anew:
                for block in arrivals.about(uid):
                    self._loosen(block)

    def _loosen(self, block: Block) -> None:
        store, guid = self._store, block.guid
        since_s = store.arrivals.since_s(guid)
        if store.block(guid) is not None:
            self.was_in.add(guid)
            store.take_out(block)
            self._in_question.extend({(fact.subject, False) for fact in block.facts if fact.attribute == TYPE_UID})
        else:
            if guid in store.arrivals.refused:
                self.was_refused.add(guid)
            store.arrivals.take(guid)
        self._loose[guid] = (block, since_s)
