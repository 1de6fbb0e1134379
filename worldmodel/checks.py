"""Closed-world checks of a block before it goes in. Faults are values; nothing here raises an error.

Merging must not depend on the order of arrival. Therefore two questions are kept apart:

*Form*: is the block right in itself? Its origin, attributes and classes must be known, its subjects must be
from a known range of uids, its values of the right kind, in range and on their grid. The answer depends on
what never changes, so a block of bad form is thrown away.

*Fit*: does the block go with what is known? Its subjects and link targets must exist and be of the classes
that domain and range ask for. What may still come right is *missing*, and the block waits for it: an instance
that nobody has announced yet, or an ObjectOfInterest for an attribute of wrecks, since it may turn out to be a
Wreck. What cannot come right is a fault.

An instance may be given further types, each above or below the class it was created with. Any other type is a
clash, whether the two classes are declared disjoint or not. Facts of one block count for one another.
"""

import math
from dataclasses import dataclass

from worldmodel.facts import EPOCHS, MOST_ITEMS, STATUS, Block, Fault, FaultCode, PropertyValue
from worldmodel.ontology.tbox import TYPE_UID, Attribute, ValueKind
from worldmodel.store import Store


@dataclass(frozen=True, slots=True)
class CheckResult:
    """The outcome of a check: a block with ``faults`` is refused, else it waits for the instances ``missing``."""

    faults: tuple[Fault, ...] = ()
    missing: tuple[int, ...] = ()


_SOUND = CheckResult()


def check_form(store: Store, block: Block) -> tuple[Fault, ...]:
    """Return the faults that the block has in itself, whatever else is known."""
    faults: list[tuple[FaultCode, str]] = []
    if not 0 <= block.origin < store.n_origins:
        faults.append((FaultCode.UNKNOWN_ORIGIN, f"origin {block.origin} is outside 0..{store.n_origins - 1}"))
    if not 0 <= block.epoch < EPOCHS:
        faults.append((FaultCode.BAD_EPOCH, f"epoch {block.epoch} is outside 0..{EPOCHS - 1}"))
    if not -MOST_ITEMS <= block.sequence < MOST_ITEMS:
        faults.append((FaultCode.BAD_SEQUENCE, f"sequence {block.sequence} is outside 0..{MOST_ITEMS - 1}"))
    elif block.sequence < STATUS and block.origin != store.owner:
        faults.append((FaultCode.BAD_SEQUENCE, f"block {block.sequence} is private to origin {block.origin}"))
    elif block.is_status and not store.tables.latest_only.issuperset(fact.attribute for fact in block.facts):
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
    """Compare a block of good form with the known instances, as the top of this file says."""
    for fact in block.facts:
        if not _fits_as_known(store, fact):
            break
    else:
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


def _fits_as_known(store: Store, fact: PropertyValue) -> bool:
    """True if subject and target are known to be of the classes that the attribute asks for; not for types."""
    attribute = store.tbox.attributes[fact.attribute]
    if attribute.kind is ValueKind.TYPE or not store.class_mask(fact.subject) >> attribute.domain & 1:
        return False
    return attribute.range_class is None or bool(store.class_mask(fact.target) >> attribute.range_class & 1)


class _Fit:
    """The check of one block against one store: types that the block itself asserts count as known."""

    __slots__ = ("block", "created", "found", "masks", "missing", "store")

    def __init__(self, store: Store, block: Block) -> None:
        self.store = store
        self.block = block
        self.found: list[tuple[FaultCode, str]] = []
        self.missing: dict[int, None] = {}
        self.masks: dict[int, int] = {}  # instance -> the classes it has by this block
        self.created: dict[int, int] = {}  # instance -> the class this block creates it with
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
        """Note a fault if a type fact does not go with the class that its subject was created with."""
        tbox, uid, told = self.store.tbox, fact.subject, fact.target
        created = self._created_as(uid)
        if not (self.store.class_mask(uid) or uid in self.masks):
            self.missing[uid] = None
        if created is None or tbox.is_a(told, created) or tbox.is_a(created, told):
            return
        how = "is disjoint with" if tbox.are_disjoint(told, created) else "is neither above nor below"
        detail = f"{uid} is given the type {tbox.classes[told].name}, which {how} {tbox.classes[created].name}"
        self.found.append((FaultCode.TYPE_CLASH, detail))

    def require(self, uid: int, class_uid: int, code: FaultCode, attribute: Attribute) -> None:
        """Note a fault, or that it is missing, unless the instance is of the class that ``attribute`` asks for."""
        mask = self.store.class_mask(uid) | self.masks.get(uid, 0)
        if mask >> class_uid & 1:
            return
        created = self._created_as(uid)
        if created is None or self.store.tables.have_common_subclass(created, class_uid):
            self.missing[uid] = None
            return
        classes = self.store.tbox.classes
        detail = f"{attribute.name}: {uid} is a {classes[created].name}, not a {classes[class_uid].name}"
        self.found.append((code, detail))


def _faults(block: Block, coded: list[tuple[FaultCode, str]]) -> tuple[Fault, ...]:
    return tuple(Fault(code, block.origin, detail, block.sequence, block.epoch) for code, detail in coded)
