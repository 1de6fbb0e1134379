"""Adding blocks to a store, in any order, any number of times, with one outcome.

The state that counts is the set A of blocks of good form that have arrived, one for each GUID. From A follow

- the class that each run-time instance was created with: the type that the owner of its uid gave it in the
  block of least sequence;
- the set S of blocks that are *in*: the least set that contains every block of A which fits
  (checks.check_fit) with those classes and with S itself.

The blocks of A outside S are refused, or wait. Which of the two may depend on the order of arrival: a fault of
a block that waits is found only when the block is checked again.

Given those classes, more facts never turn a block that fits into one that does not. So S grows one block at a
time to the same set whatever the order, and a merge is the union of the A's: commutative, associative and
idempotent. Two rare events break this growth. The classes of creation change when an origin contradicts or
refines itself and its blocks come out of order. A block of A is replaced when an origin uses a GUID twice: of
two contents the one of smaller digest stays. Then ``worldmodel.merge`` takes out what rests on the classes
that have changed, and settles it anew.

The paper's recipient may discard a block whose dependencies are missing, or request what is lacking (Maurelli
et al., Multi-robot cooperation, section IV). Here it is kept, ``Store.lacking`` says what to request, and
``expire`` discards it after a time. Blocks that need one another's instances would wait in vain: such facts
belong into one block.

Statuses are outside A and S: of each slot and origin the newest is held. A status that does not fit when it comes
is dropped. So is a block of the future, later than its arrival and the tolerance allow: a flipped bit in a time
would hide the truth until that time comes. It has not arrived, so a sound copy may come later.

Taking out of a store what rests on classes that have changed, and nothing else.

A block rests on the classes of the instances that it speaks of. When the block that gave an instance a class is
replaced, or the instance turns out to have been created as something else, the blocks that ask for more than the
instance has in any case come out; so do, in turn, those that rest on the classes which these gave. What remains speaks
of no instance in question, or asks no more of it than it has. So it stays, and the outcome is the same as of working
everything out anew. The cost depends on the blocks about these instances, not on the size of the store.
"""

import math
from collections import deque
from collections.abc import Iterable

from worldmodel.arrivals import NOTHING
from worldmodel.checks import check_fit, check_form
from worldmodel.facts import EPOCHS, MOST_ITEMS, STATUS, Block, Change, Fault, FaultCode, Guid, Merged
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


_NEVER_S = math.inf
_new = tuple.__new__  # makes a named tuple of a tuple, in half the time


def merge(store: Store, blocks: Iterable[Block], now_s: float | None = None, judged: bool = False) -> Merged:
    """Add ``blocks``, local or received, in whatever order; those already known are passed over.

    Args:
        store: the store or world model to add them to.
        blocks: the blocks; nothing that a block contains raises an error.
        now_s: when they arrived (s); without it no block is of the future, and a block that waits is taken to have
            come when it was recorded.
        judged: True if all values are known to be as their attributes have them: who decoded them has said so.

    Returns:
        The blocks that went in, with those that an earlier ``record`` set free, and the faults found.
    """
    arrivals = store.arrivals
    unreported, arrivals.unreported = arrivals.unreported, NOTHING
    changes, faults = [*unreported.changes], [*unreported.faults]
    arrivals.now_s = now_s
    latest_s = math.inf if now_s is None else now_s
    for block in blocks:
        if block.time_s > latest_s and now_s is not None:
            latest_s = store.latest_time_s(now_s)
        if _is_sound(store, block, judged) and block.time_s <= latest_s:
            if block.sequence == STATUS:
                version, change = store.version, store.place_status(block)
                if store.version != version:
                    changes.append(change)
                continue
            added = store.append(block)
            if added is not None:
                changes.append(added)
                continue
        went_in, refused = _look_closer(store, block, latest_s)
        changes += went_in
        faults += refused
    return _new(Merged, (tuple(changes), tuple(faults)))


def _is_sound(store: Store, block: Block, judged: bool) -> bool:
    """Look quickly at an item or status of another vehicle: True if both checks pass, False if in doubt."""
    origin, sequence, time_s, facts, epoch = block
    if not (0 <= origin < store.n_origins and STATUS <= sequence < MOST_ITEMS and 0 <= epoch < EPOCHS and facts):
        return False
    if origin == store.owner or not 0 <= time_s < _NEVER_S:
        return False
    numerator, denominator = store.time_ratio
    if round(time_s / store.time_resolution_s) * numerator / denominator != time_s:
        return False
    tables, mask_of = store.tables, store.index.masks.get
    for subject, attribute, value, uncertainty in facts:
        row = tables.unpacked.get(attribute)
        if row is None or uncertainty is not None or (sequence == STATUS and attribute not in tables.latest_only):
            return False
        quantise, domain, range_class = row
        if not judged:
            stored = quantise(value)
            if stored is None or stored != value:
                return False
        if not mask_of(subject, 0) >> domain & 1:
            return False
        if range_class >= 0 and not mask_of(value, 0) >> range_class & 1:  # type: ignore[arg-type]  # a link
            return False
    return True


def expire(store: Store, now_s: float) -> tuple[Fault, ...]:
    """Drop the blocks that have waited for too long, so that they may come again; return a fault for each.

    What they, and those that were crowded out since, said of the classes of instances counts no longer. The next
    ``merge`` reports what that set free.

    Args:
        store: the store or world model; its ``waiting_s`` says how long is too long.
        now_s: the time now (s).
    """
    arrivals = store.arrivals
    faults = tuple(
        _dropped(store, block, FaultCode.TIMED_OUT, f"what it rests on has not come for {arrivals.waiting_s:g} s")
        for block in arrivals.overdue(now_s)
    )
    dropped, arrivals.dropped = arrivals.dropped, []
    for block in dropped:
        revision = Revision(store, ())
        revision.withdraw(block)
        changes, others = _resettled(store, None, revision)
        before = arrivals.unreported
        arrivals.unreported = Merged((*before.changes, *changes), (*before.faults, *others))
    return faults


def enter(store: Store, block: Block, known: Block | None = None) -> Merged:
    """Add an item or private block of good form; blocks that waited for it go in with it.

    Args:
        store: the store or world model to add it to.
        block: a block that has not arrived yet with this content.
        known: the block of other content that has arrived under the same GUID, if any.
    """
    if known is None:
        changed = store.note_creations(block)
        if changed:
            return _resettled(store, block, Revision(store, changed))
        return _settle(store, block)
    detail = f"origin {block.origin} used sequence {block.sequence} twice; the smaller digest stays"
    conflict = Fault(FaultCode.GUID_CONFLICT, block.origin, detail, block.sequence, block.epoch)
    if store.content(block) >= store.content(known):
        return Merged((), (conflict,))
    revision = Revision(store, ())
    revision.replace(known, block)
    changes, faults = _resettled(store, block, revision)
    return Merged(changes, (conflict, *faults))


def _look_closer(store: Store, block: Block, latest_s: float) -> Merged:
    """Add one block of which it is not clear that it is new, right in itself, and fits."""
    known = None
    if not block.is_status:
        known = store.arrived(block.guid)
        if known == block if known is not None else store.has_arrived(block.guid):
            return NOTHING
    if bad_form := check_form(store, block):
        return Merged((), bad_form)
    if block.time_s > latest_s:
        detail = f"time {block.time_s} s is later than {latest_s:g} s, its arrival and the clock tolerance"
        return Merged((), (Fault(FaultCode.FUTURE, block.origin, detail, block.sequence, block.epoch),))
    return _take_status(store, block) if block.is_status else enter(store, block, known)


def _take_status(store: Store, block: Block) -> Merged:
    result = check_fit(store, block)
    faults, missing = result.faults, result.missing
    if missing and not faults:
        uids = ", ".join(map(str, missing))
        detail = f"a status about instance {uids}, which is not known, or not as of the class that is asked for"
        faults = (Fault(FaultCode.UNKNOWN_INSTANCE, block.origin, detail, block.sequence, block.epoch),)
    if faults:
        return Merged((), faults)
    version = store.version
    change = store.place_status(block)
    return Merged((change,), ()) if store.version != version else NOTHING


def _settle(store: Store, block: Block, since_s: float | None = None) -> Merged:
    """Put a block of A where it belongs, and then the blocks that waited for it."""
    merged = _put(store, block, since_s)
    if not merged.changes or not store.arrivals.waiting:
        return merged
    changes, faults = list(merged.changes), list(merged.faults)
    unsettled = deque(store.arrivals.release(block))
    while unsettled:
        freed, waits_since_s = unsettled.popleft()
        merged = _put(store, freed, waits_since_s)
        changes += merged.changes
        faults += merged.faults
        if merged.changes:
            unsettled += store.arrivals.release(freed)
    return Merged(tuple(changes), tuple(faults))


def _put(store: Store, block: Block, since_s: float | None) -> Merged:
    """Put one block of A in, among the waiting or among the refused."""
    result = check_fit(store, block)
    if not (result.faults or result.missing):
        return Merged((store.insert(block),), ())
    store.hold(block.guid)
    if result.faults:
        store.arrivals.refuse(block)
        return Merged((), result.faults)
    oldest = store.arrivals.wait(block, result.missing, since_s)
    if oldest is None:
        return NOTHING
    detail = f"more than {store.arrivals.waiting_blocks} blocks of origin {block.origin} wait; this one came first"
    return Merged((), (_dropped(store, oldest, FaultCode.CROWDED_OUT, detail),))


def _dropped(store: Store, block: Block, code: FaultCode, detail: str) -> Fault:
    """Forget a block that waits; return the fault that says so."""
    store.drop(block)
    if any(fact.attribute == TYPE_UID for fact in block.facts):
        store.arrivals.dropped.append(block)
    return Fault(code, block.origin, detail, block.sequence, block.epoch)


def _resettled(store: Store, block: Block | None, revision: Revision) -> Merged:
    """Settle what a revision took out, and ``block``, if there is one; return what is new."""
    settled = [_settle(store, each, since_s) for each, since_s in revision.loose(block)]
    changes: list[Change] = [change for merged in settled for change in merged.changes]
    faults = [fault for merged in settled for fault in merged.faults]
    return Merged(
        tuple(change for change in changes if change.block.guid not in revision.was_in),
        tuple(fault for fault in faults if fault.guid not in revision.was_refused),
    )
