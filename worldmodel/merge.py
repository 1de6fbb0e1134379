"""Adding blocks to a world model, in any order, any number of times, with one outcome.

The state that counts is the set A of blocks of good form that have arrived, one for each GUID. From A follow

- the class each run-time instance was created with: what the owner of its uid said in his block of least
  sequence;
- the set S of blocks that are *in*: the least set that contains every block of A which fits
  (checks.check_fit) with those classes and with S itself.

The blocks of A outside S are refused, or wait; which of the two may depend on the order of arrival, for a
fault of a block that waits is found only when it is checked again.

More facts never turn a block that fits into one that does not, given those classes. So S grows one block at a
time to the same set whatever the order, and a merge is the union of the A's: commutative, associative and
idempotent. The classes of creation change only when an origin contradicts or refines itself and its blocks
come out of order, and a block of A is replaced only when an origin used a GUID twice (of two contents the one
of smaller digest stays). Both are rare, and then S is simply worked out anew from A.

The paper's recipient may discard a block whose dependencies are missing or request what is lacking (Maurelli
et al., Multi-robot cooperation, section IV); here it is kept until they come. Blocks that need one another's
instances would wait for ever: such facts belong into one block.
"""

from collections import deque
from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from worldmodel.checks import check_fit, check_form
from worldmodel.facts import Block, Change, Fault, FaultCode, Guid
from worldmodel.tbox import TYPE_UID

if TYPE_CHECKING:
    from worldmodel.abox import WorldModel


class Merged(NamedTuple):
    """``changes``: the blocks that went in, in that order. ``faults``: why others were refused."""

    changes: tuple[Change, ...]
    faults: tuple[Fault, ...]


NOTHING = Merged((), ())


class Arrivals:
    """The blocks of A that are not in, and the classes of creation that follow from A."""

    def __init__(self) -> None:
        self.waiting: dict[Guid, Block] = {}
        self.refused: dict[Guid, Block] = {}
        self.unreported = Merged((), ())  # what a local record set free; the next merge tells of it
        self._waiting_for: dict[int, list[Guid]] = {}  # instance uid -> blocks
        self._created: dict[int, tuple[int, int]] = {}  # run-time instance uid -> (sequence, class uid)

    def get(self, guid: Guid) -> Block | None:
        """Return the block if it waits or was refused."""
        return self.waiting.get(guid) or self.refused.get(guid)

    def created_as(self, uid: int) -> int | None:
        """Return the class a run-time instance was created with, if any block of A says so."""
        entry = self._created.get(uid)
        return None if entry is None else entry[1]

    def note_creations(self, model: "WorldModel", block: Block) -> bool:
        """Enter the instances the block creates; say whether a class of creation known before has changed."""
        changed = False
        noted: set[int] = set()
        for fact in block.facts:
            uid = fact.subject
            if fact.attribute != TYPE_UID or model.owner_of(uid) != block.origin or uid in noted:
                continue
            noted.add(uid)
            known = self._created.get(uid)
            if known is None or block.sequence < known[0]:
                self._created[uid] = (block.sequence, fact.target)
                changed |= known is not None and known[1] != fact.target
        return changed

    def wait(self, block: Block, missing: tuple[int, ...]) -> None:
        """Keep the block until the first of ``missing`` is announced; it is then checked again."""
        self.waiting[block.guid] = block
        self._waiting_for.setdefault(missing[0], []).append(block.guid)

    def release(self, block: Block) -> list[Block]:
        """Take out the blocks that waited for a type fact of this one."""
        guids: list[Guid] = []
        for fact in block.facts:
            if fact.attribute == TYPE_UID:
                guids += self._waiting_for.pop(fact.subject, ())
        return [self.waiting.pop(guid) for guid in guids]

    def clear(self) -> None:
        """Forget everything but what nobody has been told of."""
        self.waiting.clear()
        self.refused.clear()
        self._waiting_for.clear()
        self._created.clear()


def merge(model: "WorldModel", blocks: Iterable[Block]) -> Merged:
    """Add ``blocks`` to ``model``: local or received, in whatever order, known or not.

    A block known already is passed over. Never raises for what a block contains.
    """
    arrivals = model.arrivals
    changes, faults = list(arrivals.unreported.changes), list(arrivals.unreported.faults)
    arrivals.unreported = NOTHING
    for block in blocks:
        known = model.arrived(block.guid)
        if known is not None and known == block:
            continue
        if bad_form := check_form(model, block):
            faults += bad_form
        else:
            _enter(model, block, known, changes, faults)
    return Merged(tuple(changes), tuple(faults))


def enter(model: "WorldModel", block: Block) -> Merged:
    """Add a block of good form that is not known yet; blocks that waited for it go in with it."""
    changes: list[Change] = []
    faults: list[Fault] = []
    _enter(model, block, None, changes, faults)
    return Merged(tuple(changes), tuple(faults))


def _enter(model: "WorldModel", block: Block, known: Block | None, changes: list[Change], faults: list[Fault]) -> None:
    if block.origin == model.owner:
        model.note_own(block)
    if known is not None:
        detail = f"origin {block.origin} used sequence {block.sequence} twice; the smaller digest stays"
        faults.append(Fault(FaultCode.GUID_CONFLICT, block.origin, detail, block.sequence))
        if model.content(block) < model.content(known):
            _work_out_anew(model, known, block, changes, faults)
    elif model.arrivals.note_creations(model, block):
        _work_out_anew(model, None, block, changes, faults)
    else:
        _settle(model, block, changes, faults)


def _settle(model: "WorldModel", block: Block, changes: list[Change], faults: list[Fault]) -> None:
    """Put a block of A where it belongs, and then those that waited for it."""
    arrivals = model.arrivals
    unsettled = deque([block])
    while unsettled:
        block = unsettled.popleft()
        result = check_fit(model, block)
        if result.faults:
            arrivals.refused[block.guid] = block
            faults += result.faults
        elif result.missing:
            arrivals.wait(block, result.missing)
        else:
            changes.append(model.insert(block))
            unsettled += arrivals.release(block)


def _work_out_anew(
    model: "WorldModel", replaced: Block | None, block: Block, changes: list[Change], faults: list[Fault]
) -> None:
    """Work out S from A, to which ``block`` is added, in the place of ``replaced`` if that is given."""
    arrivals = model.arrivals
    was_in = {b.guid: b for b in model.blocks()}
    was_refused = set(arrivals.refused)
    everything = {**was_in, **arrivals.waiting, **arrivals.refused, block.guid: block}
    if replaced is not None:
        was_in.pop(replaced.guid, None)
        was_refused.discard(replaced.guid)
    model.clear()
    arrivals.clear()
    in_order = [everything[guid] for guid in sorted(everything)]
    for each in in_order:
        arrivals.note_creations(model, each)
    all_changes: list[Change] = []
    all_faults: list[Fault] = []
    for each in in_order:
        _settle(model, each, all_changes, all_faults)
    changes += [change for change in all_changes if change.block.guid not in was_in]
    faults += [fault for fault in all_faults if (fault.origin, fault.sequence) not in was_refused]
