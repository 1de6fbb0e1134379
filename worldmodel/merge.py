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
two contents the one of smaller digest stays. Then S is worked out anew from A.

The paper's recipient may discard a block whose dependencies are missing, or request what is lacking (Maurelli
et al., Multi-robot cooperation, section IV); here it is kept until they come. Blocks that need one another's
instances would wait for ever: such facts belong into one block.
"""

from collections import deque
from collections.abc import Iterable

from worldmodel.checks import check_fit, check_form
from worldmodel.facts import Block, Fault, FaultCode, Guid, Merged
from worldmodel.store import NOTHING, Store


def merge(store: Store, blocks: Iterable[Block]) -> Merged:
    """Add ``blocks``, local or received, in whatever order; those already known are passed over.

    Args:
        store: the store or world model to add them to.
        blocks: the blocks; nothing that a block contains raises an error.

    Returns:
        The blocks that went in, with those that an earlier ``record`` set free, and the faults found.
    """
    arrivals = store.arrivals
    changes, faults = list(arrivals.unreported.changes), list(arrivals.unreported.faults)
    arrivals.unreported = NOTHING
    for block in blocks:
        known = store.arrived(block.guid)
        if known is not None and known == block:
            continue
        if bad_form := check_form(store, block):
            faults += bad_form
            continue
        went_in, refused = enter(store, block, known)
        changes += went_in
        faults += refused
    return Merged(tuple(changes), tuple(faults))


def enter(store: Store, block: Block, known: Block | None = None) -> Merged:
    """Add a block of good form; blocks that waited for it go in with it.

    Args:
        store: the store or world model to add it to.
        block: a block that has not arrived yet with this content.
        known: the block of other content that has arrived under the same GUID, if any.
    """
    if block.origin == store.owner:
        store.note_own(block)
    if known is None:
        if store.arrivals.note_creations(store, block):
            return _work_out_anew(store, block)
        return _settle(store, block)
    detail = f"origin {block.origin} used sequence {block.sequence} twice; the smaller digest stays"
    conflict = Fault(FaultCode.GUID_CONFLICT, block.origin, detail, block.sequence)
    if store.content(block) >= store.content(known):
        return Merged((), (conflict,))
    changes, faults = _work_out_anew(store, block, replaced=known)
    return Merged(changes, (conflict, *faults))


def _settle(store: Store, block: Block) -> Merged:
    """Put a block of A where it belongs, and then the blocks that waited for it."""
    merged = _put(store, block)
    if not merged.changes or not store.arrivals.waiting:
        return merged
    changes, faults = list(merged.changes), list(merged.faults)
    unsettled = deque(store.arrivals.release(block))
    while unsettled:
        freed = unsettled.popleft()
        merged = _put(store, freed)
        changes += merged.changes
        faults += merged.faults
        if merged.changes:
            unsettled += store.arrivals.release(freed)
    return Merged(tuple(changes), tuple(faults))


def _put(store: Store, block: Block) -> Merged:
    """Put one block of A in, among the waiting or among the refused."""
    result = check_fit(store, block)
    if result.faults:
        store.arrivals.refused[block.guid] = block
        return Merged((), result.faults)
    if result.missing:
        store.arrivals.wait(block, result.missing)
        return NOTHING
    return Merged((store.insert(block),), ())


def _work_out_anew(store: Store, block: Block, replaced: Block | None = None) -> Merged:
    """Work out S from A and ``block``, which takes the place of ``replaced``; return what is new in it."""
    arrivals = store.arrivals
    was_in = {b.guid: b for b in store.blocks()}
    was_refused = set(arrivals.refused)
    everything = {**was_in, **arrivals.waiting, **arrivals.refused, block.guid: block}
    if replaced is not None:
        was_in.pop(replaced.guid, None)
        was_refused.discard(replaced.guid)
    store.clear()
    arrivals.clear()
    in_order = [everything[guid] for guid in sorted(everything)]
    for each in in_order:
        arrivals.note_creations(store, each)
    settled = [_settle(store, each) for each in in_order]
    return Merged(
        tuple(change for merged in settled for change in merged.changes if change.block.guid not in was_in),
        tuple(fault for merged in settled for fault in merged.faults if _guid_of(fault) not in was_refused),
    )


def _guid_of(fault: Fault) -> Guid:
    return (fault.origin, fault.sequence)
