"""Closed-world checks of a block before acceptance; they return faults and raise nothing.

Two checks make the merge independent of the arrival order:

*Form* (intrinsic validity): known origin, attributes and classes, subjects in a known uid range, values of the right
kind, in range and on their grid. The result depends on constants only, so an invalid block is dropped.

*Fit* (consistency with the store): subjects and link targets exist and have the classes of domain and range. A
dependency that may still arrive is *missing*, and the block is pending: an unannounced instance, or an ObjectOfInterest
with an attribute of wrecks, which may become a Wreck. A dependency that cannot arrive is a fault.

Further types of an instance must be above or below its class of creation; any other type is a clash, declared disjoint
or not. Type facts of the checked block count as known.
"""

import math
from dataclasses import dataclass
from operator import itemgetter

from worldmodel.facts import EPOCHS, MOST_ITEMS, STATUS, Block, Fault, FaultCode, PropertyValue
from worldmodel.ontology.tbox import TYPE_UID, Attribute, ValueKind
from worldmodel.store import Store


@dataclass(frozen=True, slots=True)
class CheckResult:
    """Result of a check: refused with ``faults``, else pending for ``missing`` instances."""

    faults: tuple[Fault, ...] = ()
    missing: tuple[int, ...] = ()


_SOUND = CheckResult()
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
    """Check the fit of a block of valid form with the store, see the module docstring."""
    masks = store.index.masks
    for fact in block.facts:
        attribute = store.tbox.attributes[fact.attribute]
        if attribute.kind is ValueKind.TYPE or not masks.get(fact.subject, 0) >> attribute.domain & 1:
            break
        if attribute.range_class is not None and not masks.get(fact.target, 0) >> attribute.range_class & 1:
            break
    else:  # subjects and targets are known to have the required classes
        return _SOUND
    fit = _Fit(store, block)
    for fact in block.facts:
        attribute = store.tbox.attributes[fact.attribute]
        if attribute.kind is ValueKind.TYPE:
            fit.retype(fact)
            continue
        fit.require(fact.subject, attribute.domain, FaultCode.DOMAIN, attribute)
        if attribute.range_class is not None:
            fit.require(fact.target, attribute.range_class, FaultCode.LINK_CLASS, attribute)
    if fit.found:
        return CheckResult(_faults(block, fit.found))
    return CheckResult(missing=tuple(fit.missing)) if fit.missing else _SOUND


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
            if fact.attribute == TYPE_UID:
                self._assert_type(fact.subject, fact.target)

    def _assert_type(self, uid: int, class_uid: int) -> None:
        if self.store.class_mask(uid) or self.store.owner_of(uid) == self.block.origin:
            self.masks[uid] = self.masks.get(uid, 0) | self.store.tbox.ancestor_mask(class_uid)
            self.created.setdefault(uid, class_uid)

    def _created_as(self, uid: int) -> int | None:
        announced = self.store.created_as(uid)
        return self.created.get(uid) if announced is None else announced

    def retype(self, fact: PropertyValue) -> None:
        """Record a fault for a type neither above nor below the subject's class of creation."""
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
        """Record a fault or a missing instance unless the instance has class ``class_uid``."""
        mask = self.store.class_mask(uid) | self.masks.get(uid, 0)
        if mask >> class_uid & 1:
            return
        created = self._created_as(uid)
        if created is None or self.store.tbox.have_common_subclass(created, class_uid):
            self.missing[uid] = None
            return
        classes = self.store.tbox.classes
        detail = f"{attribute.name}: {uid} is a {classes[created].name}, not a {classes[class_uid].name}"
        self.found.append((code, detail))


def _faults(block: Block, coded: list[tuple[FaultCode, str]]) -> tuple[Fault, ...]:
    return tuple(Fault(code, block.origin, detail, block.sequence, block.epoch) for code, detail in coded)
