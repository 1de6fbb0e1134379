"""Commutative, associative, idempotent merge of blocks into a store.

The state is the set A of arrived blocks of valid form, one per GUID. From A follow

- the class of creation of each run-time instance: the type in the owner's block of least rank (``rank_of``);
- the set S of accepted blocks: the least set with every block of A that fits (``check_fit``) these classes and S.

Blocks of A outside S are refused or pending. Which of both may depend on the arrival order, since a pending block is
checked again only after its dependency arrives.

More facts never make a fitting block unfit as long as the classes of creation stay. S thus grows to the same set in any
order. Two rare events break this growth. An origin contradicts or refines a class of creation and its blocks arrive out
of order. Or it uses a GUID for two contents, of which the smaller digest stays. ``Revision`` then removes exactly the
blocks that depend on the changed classes, transitively, and ``merge`` settles them again.

The paper's recipient may discard a block with missing dependencies or request them (Maurelli et al., Multi-robot
cooperation, section IV). Here the block is pending, ``Store.lacking`` lists the missing instances, and ``expire``
discards it after a timeout. Blocks that need instances of one another stay pending: put such facts in one block.

Statuses are outside A and S: per property and origin the newest stays, and one that does not fit is dropped. A block
from the future beyond the clock tolerance, as after a bit error in its time, is dropped too and does not count as
arrived.
"""

import math
from collections import deque
from collections.abc import Iterable

from worldmodel.arrivals import NOTHING
from worldmodel.checks import check_fit, check_form
from worldmodel.facts import STATUS, Block, Change, Fault, FaultCode, Guid, Merged
from worldmodel.ontology.tbox import TYPE_UID
from worldmodel.store import Store


class Revision:
    """Blocks removed from a store because classes that they depend on changed."""

    def __init__(self, store: Store, created_anew: Iterable[int]) -> None:
        """Remove the blocks that depend on classes of instances with another class of creation."""
        self._store = store
        self._loose: dict[Guid, tuple[Block, float | None]] = {}
        self._in_question: deque[tuple[int, bool]] = deque()  # instance uid, whether its class of creation changed
        self.was_in: set[Guid] = set()
        """GUIDs of removed blocks that had been accepted."""
        self.was_refused: set[Guid] = set()
        """GUIDs of removed blocks that had been refused."""
        self._question((uid, True) for uid in created_anew)

    def replace(self, old: Block, new: Block) -> None:
        """Replace a block by another content of its GUID."""
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
        """Redo the creations of a discarded block from the remaining blocks."""
        arrivals = self._store.arrivals
        created = {f.subject: arrivals.created_as(f.subject) for f in block.facts if f.attribute == TYPE_UID}
        for uid in created:
            if arrivals.created_by(uid) == block.guid:
                self._create_anew(uid)
        self._question((uid, True) for uid, class_uid in created.items() if arrivals.created_as(uid) != class_uid)

    def loose(self, block: Block | None = None) -> list[tuple[Block, float | None]]:
        """Return removed blocks and ``block`` by GUID, with the start of pending (s) or None."""
        if block is not None:
            self._loose[block.guid] = (block, None)
        return [self._loose[guid] for guid in sorted(self._loose)]

    def _create_anew(self, uid: int) -> None:
        store = self._store
        store.arrivals.forget_creation(uid)
        others = [observation.block for observation in store.facts_of(uid, TYPE_UID)]
        others += [block for block, _ in self._loose.values()]
        for block in (*others, *store.arrivals.about(uid)):
            store.note_creations(block)

    def _question(self, uids: Iterable[tuple[int, bool]]) -> None:
        """Remove the blocks that depend on the classes of these instances, transitively."""
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


def merge(store: Store, blocks: Iterable[Block], now_s: float | None = None, checked: bool = False) -> Merged:
    """Merge local or received blocks in any order; skip known ones.

    Args:
        blocks: of any content; invalid ones become faults.
        now_s: arrival time (s); if None, accept any time and count pending time from the observation.
        checked: the decoder guarantees their form, see ``worldmodel.checks``.

    Returns the accepted blocks, with those that an earlier ``record`` or ``expire`` released, and the faults.
    """
    arrivals = store.arrivals
    unreported, arrivals.unreported = arrivals.unreported, NOTHING
    changes, faults = [*unreported.changes], [*unreported.faults]
    arrivals.now_s = now_s
    latest_s = math.inf if now_s is None else now_s
    for block in blocks:
        if block.time_s > latest_s and now_s is not None:
            latest_s = store.latest_time_s(now_s)
        went_in, refused = _taken(store, block, latest_s, checked)
        changes += went_in
        faults += refused
    return Merged(tuple(changes), tuple(faults))


def expire(store: Store, now_s: float) -> tuple[Fault, ...]:
    """Discard blocks pending longer than ``waiting_s`` at ``now_s`` (s); return one fault each.

    They can be received again. Their creations no longer count; the next ``merge`` reports released blocks.
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
    """Add a valid item or private block; ``known`` is another content of its GUID, if any."""
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


def _taken(store: Store, block: Block, latest_s: float, checked: bool) -> Merged:
    """Check and add a block, unless it is known."""
    known = None
    is_status = block.sequence == STATUS
    if not is_status:
        known = store.arrived(block.guid)
        if known == block if known is not None else store.has_arrived(block.guid):
            return NOTHING
    if not checked and (bad_form := check_form(store, block)):
        return Merged((), bad_form)
    if block.time_s > latest_s:
        detail = f"time {block.time_s} s is later than {latest_s:g} s, its arrival and the clock tolerance"
        return Merged((), (Fault(FaultCode.FUTURE, block.origin, detail, block.sequence, block.epoch),))
    return _take_status(store, block) if is_status else enter(store, block, known)


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
    """Accept, suspend or refuse a block of A; then settle the blocks pending for it."""
    merged = _put(store, block, since_s)
    if not merged.changes or not store.arrivals.waiting:
        return merged
    changes, faults = list(merged.changes), list(merged.faults)
    unsettled = deque(store.arrivals.release(block))
    while unsettled:
        freed, _, waits_since_s = unsettled.popleft()
        merged = _put(store, freed, waits_since_s)
        changes += merged.changes
        faults += merged.faults
        if merged.changes:
            unsettled += store.arrivals.release(freed)
    return Merged(tuple(changes), tuple(faults))


def _put(store: Store, block: Block, since_s: float | None) -> Merged:
    result = check_fit(store, block)
    if not (result.faults or result.missing):
        return Merged((store.insert(block),), ())
    store.hold(block.guid)
    if result.faults:
        store.arrivals.refuse(block)
        return Merged((), result.faults)
    oldest = store.arrivals.wait(block, result.missing[0], since_s)
    if oldest is None:
        return NOTHING
    detail = f"more than {store.arrivals.waiting_blocks} blocks of origin {block.origin} wait; this one came first"
    return Merged((), (_dropped(store, oldest, FaultCode.CROWDED_OUT, detail),))


def _dropped(store: Store, block: Block, code: FaultCode, detail: str) -> Fault:
    store.drop(block)
    if any(fact.attribute == TYPE_UID for fact in block.facts):
        store.arrivals.dropped.append(block)
    return Fault(code, block.origin, detail, block.sequence, block.epoch)


def _resettled(store: Store, block: Block | None, revision: Revision) -> Merged:
    """Settle the removed blocks and ``block``; return only what differs from before."""
    settled = [_settle(store, each, since_s) for each, since_s in revision.loose(block)]
    changes: list[Change] = [change for merged in settled for change in merged.changes]
    faults = [fault for merged in settled for fault in merged.faults]
    return Merged(
        tuple(change for change in changes if change.block.guid not in revision.was_in),
        tuple(fault for fault in faults if fault.guid not in revision.was_refused),
    )
