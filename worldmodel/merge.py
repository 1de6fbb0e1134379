"""Commutative, associative, idempotent merge of blocks into a store.

The state is the set A of arrived blocks of valid form, one per GUID. From A follow

- the class of creation of each run-time instance: the type in the owner's block of least rank (``rank_of``);
- the set S of accepted blocks: the least set with every block of A that fits (``check_fit``) these classes and S.

Blocks of A outside S are refused or pending. Which of both may depend on the arrival order, since a pending block is
checked again only after its dependency arrives.

More facts never make a fitting block unfit as long as the classes of creation stay. S thus grows to the same set in any
order. Two rare events break this growth. An origin contradicts or refines a class of creation and its blocks arrive out
of order. Or it uses a GUID for two contents, of which the smaller digest stays. All of A is then settled anew.

The paper's recipient may discard a block with missing dependencies or request them (Maurelli et al., Multi-robot
cooperation, section IV). Here the block is pending, ``Store.lacking`` lists the missing instances, and ``expire``
discards it after a timeout. Blocks that need instances of one another stay pending.

Statuses are outside A and S: per property and origin the newest stays, and one that does not fit is dropped.

The checks of a block are closed-world; they return faults and raise nothing:

*Form* (intrinsic validity): known origin, attributes and classes, subjects in a known uid range, values of the right
kind, in range and on their grid. The result depends on constants only, so an invalid block is dropped.

*Fit* (consistency with the store): subjects and link targets exist and have the classes of domain and range. A
dependency that may still arrive is *missing*, and the block is pending: an unannounced instance, or an ObjectOfInterest
with an attribute of wrecks, which may become a Wreck. A dependency that cannot arrive is a fault.

Further types of an instance must be above or below its class of creation. Type facts of the checked block count as
known.
"""

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from operator import itemgetter

from worldmodel.facts import EPOCHS, MOST_ITEMS, STATUS, Block, Change, Fault, FaultCode, Merged, PropertyValue
from worldmodel.holdings import NOTHING
from worldmodel.ontology.tbox import TYPE_UID, Attribute, ValueKind
from worldmodel.store import Store


def merge(store: Store, blocks: Iterable[Block], now_s: float | None = None, checked: bool = False) -> Merged:
    """Merge local or received blocks in any order; skip known ones.

    ``now_s`` is the arrival time (s); None accepts any time and counts pending time from the observation. ``checked``
    blocks have valid form. The result includes blocks that an earlier ``record`` or ``expire`` released.
    """
    arrivals = store.arrivals
    unreported, arrivals.unreported = arrivals.unreported, NOTHING
    changes, faults = [*unreported.changes], [*unreported.faults]
    arrivals.now_s = now_s
    latest_s = math.inf if now_s is None else now_s
    for block in blocks:
        # Few blocks are ahead of their arrival: the tolerance is rounded to the grid for these only.
        if block.time_s > latest_s and now_s is not None:
            latest_s = store.latest_time_s(now_s)
        went_in, refused = _taken(store, block, latest_s, checked)
        changes += went_in
        faults += refused
    return Merged(tuple(changes), tuple(faults))


def expire(store: Store, now_s: float) -> tuple[Fault, ...]:
    """Discard blocks pending longer than ``waiting_s``, so that they can be received again; return one fault each.

    Their creations no longer count; the next ``merge`` reports released blocks.
    """
    arrivals = store.arrivals
    faults = tuple(
        _dropped(store, block, FaultCode.TIMED_OUT, f"what it rests on has not come for {arrivals.waiting_s:g} s")
        for block in arrivals.overdue(now_s)
    )
    # Discarded types may have decided classes of creation, and thereby which blocks fit.
    if arrivals.dropped:
        arrivals.dropped = []
        changes, others = _settled_anew(store)
        before = arrivals.unreported
        arrivals.unreported = Merged((*before.changes, *changes), (*before.faults, *others))
    return faults


def enter(store: Store, block: Block, known: Block | None = None) -> Merged:
    """Add a valid item or private block; ``known`` is another content of its GUID, if any."""
    if known is None:
        # A changed class of creation can make accepted blocks unfit.
        return _settled_anew(store, block) if store.note_creations(block) else _settle(store, block)
    detail = f"origin {block.origin} used sequence {block.sequence} twice; the smaller digest stays"
    conflict = Fault(FaultCode.GUID_CONFLICT, block.origin, detail, block.sequence, block.epoch)
    # A rule on contents, not on arrival, so that all vehicles keep the same one.
    if store.content(block) >= store.content(known):
        return Merged((), (conflict,))
    changes, faults = _settled_anew(store, block, known)
    return Merged(changes, (conflict, *faults))


def _taken(store: Store, block: Block, latest_s: float, checked: bool) -> Merged:
    known = None
    is_status = block.sequence == STATUS
    if not is_status:
        known = store.arrived(block.guid)
        # Without content (pruned) there is nothing to compare: it counts as the same block.
        if known == block if known is not None else store.has_arrived(block.guid):
            return NOTHING
    if not checked and (bad_form := check_form(store, block)):
        return Merged((), bad_form)
    # As after a bit error in its time: it does not count as arrived, so that a correct copy follows.
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
    change = store.place_status(block)
    return NOTHING if change is None else Merged((change,), ())


def _settle(store: Store, block: Block, since_s: float | None = None) -> Merged:
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
    # Pending and refused blocks have arrived as well: peers need not repeat them.
    store.hold(block.guid)
    if result.faults:
        store.arrivals.refused[block.guid] = block
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


def _settled_anew(store: Store, added: Block | None = None, replaced: Block | None = None) -> Merged:
    """Settle all arrived blocks again, with ``added``, without ``replaced``; return only what differs from before."""
    arrivals, stored = store.arrivals, [*store.blocks(), *store.private_blocks()]
    was_refused, waiting = {**arrivals.refused}, {**arrivals.waiting}
    blocks = [*stored, *was_refused.values(), *(each.block for each in waiting.values()), *([added] if added else [])]
    unsettled = sorted((block for block in blocks if block is not replaced), key=lambda block: block.guid)
    for block in stored:
        store.take_out(block)
    arrivals.forget_all()
    # All creations before the first check, since the classes of creation decide it.
    for block in (*unsettled, *arrivals.dropped):
        store.note_creations(block)
    changes: list[Change] = []
    n_fitting = -1
    # Least fixed point: a block fits once those that it depends on are in.
    while n_fitting != len(changes):
        n_fitting, unfit = len(changes), list[Block]()
        for block in unsettled:
            if check_fit(store, block) == SOUND:
                changes.append(store.insert(block))
            else:
                unfit.append(block)
        unsettled = unfit
    settled = [_put(store, b, waiting[b.guid].since_s if b.guid in waiting else None) for b in unsettled]
    for status in store.statuses():
        if check_fit(store, status) != SOUND:
            store.index.drop(status)
    # Blocks accepted or refused before are no news.
    known = {block.guid for block in stored if block is not replaced}
    refused_before = {guid for guid, block in was_refused.items() if block is not replaced}
    return Merged(
        tuple(change for change in changes if change.block.guid not in known),
        tuple(fault for merged in settled for fault in merged.faults if fault.guid not in refused_before),
    )


# Checks ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class CheckResult:
    """Result of a check: refused with ``faults``, else pending for ``missing`` instances."""

    faults: tuple[Fault, ...] = ()
    missing: tuple[int, ...] = ()


SOUND = CheckResult()
_UIDS = (ValueKind.TYPE, ValueKind.LINK)
_ATTRIBUTE = itemgetter(1)


def check_form(store: Store, block: Block, quantised: bool = False) -> tuple[Fault, ...]:
    """Return the faults in the form of a block; ``quantised`` values are in range and on their grid."""
    faults: list[tuple[FaultCode, str]] = []
    if not 0 <= block.origin < store.n_origins:
        faults.append((FaultCode.UNKNOWN_ORIGIN, f"origin {block.origin} is outside 0..{store.n_origins - 1}"))
    if not 0 <= block.epoch < EPOCHS:
        faults.append((FaultCode.BAD_EPOCH, f"epoch {block.epoch} is outside 0..{EPOCHS - 1}"))
    if not -MOST_ITEMS <= block.sequence < MOST_ITEMS:
        faults.append((FaultCode.BAD_SEQUENCE, f"sequence {block.sequence} is outside 0..{MOST_ITEMS - 1}"))
    elif block.sequence < STATUS and block.origin != store.owner:
        faults.append((FaultCode.BAD_SEQUENCE, f"block {block.sequence} is private to origin {block.origin}"))
    elif block.sequence == STATUS and not store.latest_only.issuperset(map(_ATTRIBUTE, block.facts)):
        detail = "a status has facts of attributes with rm:latestOnly alone"
        faults.append((FaultCode.BAD_SEQUENCE, detail))
    if not math.isfinite(block.time_s) or block.time_s < 0:
        faults.append((FaultCode.BAD_TIME, f"time {block.time_s} s is not a time since the mission began"))
    elif store.quantise_time(block.time_s) != block.time_s:
        faults.append((FaultCode.BAD_TIME, f"time {block.time_s} s is not on the grid of {store.time_resolution_s} s"))
    if not block.facts:
        faults.append((FaultCode.NO_FACTS, "a block needs at least one fact"))
    attributes = store.tbox.attributes
    for fact in block.facts:
        if not 0 <= fact.attribute < len(attributes):
            detail = f"attribute {fact.attribute} is outside 0..{len(attributes) - 1}"
            faults.append((FaultCode.UNKNOWN_ATTRIBUTE, detail))
            continue
        if not 0 <= fact.subject < store.n_uids:
            detail = f"subject {fact.subject} is outside 0..{store.n_uids - 1}"
            faults.append((FaultCode.UNKNOWN_INSTANCE, detail))
        if not quantised or attributes[fact.attribute].kind in _UIDS:
            _check_value(store, attributes[fact.attribute], fact, faults)
    return _faults(block, faults) if faults else ()


def _check_value(store: Store, attribute: Attribute, fact: PropertyValue, faults: list[tuple[FaultCode, str]]) -> None:
    try:
        if fact.uncertainty is not None and attribute.quantise_uncertainty(fact.uncertainty) != fact.uncertainty:
            detail = f"{attribute.name} of {fact.subject}: the uncertainty {fact.uncertainty} is not on its grid"
            faults.append((FaultCode.VALUE_GRID, detail))
        stored = attribute.quantise(fact.value)
    except TypeError as error:
        faults.append((FaultCode.VALUE_KIND, f"{attribute.name} of {fact.subject}: {error}"))
        return
    except ValueError as error:
        faults.append((FaultCode.VALUE_RANGE, f"{attribute.name} of {fact.subject}: {error}"))
        return
    if stored != fact.value:
        detail = f"{attribute.name} of {fact.subject}: {fact.value} is not on its grid; {stored} is"
        faults.append((FaultCode.VALUE_GRID, detail))
    elif attribute.kind is ValueKind.LINK and fact.target >= store.n_uids:
        detail = f"{attribute.name} of {fact.subject}: target {stored} is outside 0..{store.n_uids - 1}"
        faults.append((FaultCode.UNKNOWN_INSTANCE, detail))
    elif attribute.kind is ValueKind.TYPE and fact.target >= len(store.tbox.classes):
        detail = f"type of {fact.subject}: class {stored} is outside 0..{len(store.tbox.classes) - 1}"
        faults.append((FaultCode.UNKNOWN_CLASS, detail))


def check_fit(store: Store, block: Block) -> CheckResult:
    """Check the fit of a block of valid form, as defined in the module docstring."""
    masks = store.index.masks
    fit: _Fit | None = None
    for fact in block.facts:
        attribute = store.tbox.attributes[fact.attribute]
        range_class = attribute.range_class
        is_known = attribute.kind is not ValueKind.TYPE and masks.get(fact.subject, 0) >> attribute.domain & 1
        # Usual case: subject and target are known to have the required classes.
        if is_known and (range_class is None or masks.get(fact.target, 0) >> range_class & 1):
            continue
        fit = fit or _Fit(store, block)
        if attribute.kind is ValueKind.TYPE:
            fit.retype(fact)
            continue
        fit.require(fact.subject, attribute.domain, FaultCode.DOMAIN, attribute)
        if range_class is not None:
            fit.require(fact.target, range_class, FaultCode.LINK_CLASS, attribute)
    if fit is None:
        return SOUND
    return CheckResult(_faults(block, fit.found)) if fit.found else CheckResult(missing=tuple(fit.missing))


class _Fit:
    __slots__ = ("block", "created", "found", "masks", "missing", "store")

    def __init__(self, store: Store, block: Block) -> None:
        self.store = store
        self.block = block
        self.found: list[tuple[FaultCode, str]] = []
        self.missing: dict[int, None] = {}
        self.masks: dict[int, int] = {}  # instance -> classes asserted by this block
        self.created: dict[int, int] = {}  # instance -> class of creation by this block
        for fact in block.facts:
            uid = fact.subject
            # Only the owner of a uid can create its instance; a type by another waits for that.
            if fact.attribute == TYPE_UID and (store.class_mask(uid) or store.owner_of(uid) == block.origin):
                self.masks[uid] = self.masks.get(uid, 0) | store.tbox.ancestor_mask(fact.target)
                self.created.setdefault(uid, fact.target)

    def _created_as(self, uid: int) -> int | None:
        announced = self.store.created_as(uid)
        return self.created.get(uid) if announced is None else announced

    def retype(self, fact: PropertyValue) -> None:
        tbox, uid, new = self.store.tbox, fact.subject, fact.target
        created = self._created_as(uid)
        if not (self.store.class_mask(uid) or uid in self.masks):
            self.missing[uid] = None
        if created is None or tbox.is_a(new, created) or tbox.is_a(created, new):
            return
        how = "is disjoint with" if tbox.are_disjoint(new, created) else "is neither above nor below"
        detail = f"{uid} is given the type {tbox.classes[new].name}, which {how} {tbox.classes[created].name}"
        self.found.append((FaultCode.TYPE_CLASH, detail))

    def require(self, uid: int, class_uid: int, code: FaultCode, attribute: Attribute) -> None:
        mask = self.store.class_mask(uid) | self.masks.get(uid, 0)
        if mask >> class_uid & 1:
            return
        created = self._created_as(uid)
        # A later type may still refine the instance to a class that satisfies both.
        if created is None or self.store.tbox.have_common_subclass(created, class_uid):
            self.missing[uid] = None
            return
        classes = self.store.tbox.classes
        detail = f"{attribute.name}: {uid} is a {classes[created].name}, not a {classes[class_uid].name}"
        self.found.append((code, detail))


def _faults(block: Block, coded: list[tuple[FaultCode, str]]) -> tuple[Fault, ...]:
    return tuple(Fault(code, block.origin, detail, block.sequence, block.epoch) for code, detail in coded)
