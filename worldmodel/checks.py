"""Closed-world checks of a block before it goes in. Faults are records; nothing here raises.

Two questions, kept apart because merging must not depend on the order of arrival:

*Form* - is the block right in itself? Known origin, attributes and classes, subjects out of a known range of
uids, values of the right kind, in range and on their grid. The answer depends on what never changes, so a
block of bad form is thrown away.

*Fit* - does it go with what is known? Its subjects and link targets must exist and be of the classes that
domain and range ask for. What may still come right is *missing*, and the block waits for it: an instance
nobody has announced yet, or one created as, say, an ObjectOfInterest, when the attribute is one of wrecks and
a Wreck is a kind of ObjectOfInterest. What cannot come right is a fault.

An instance may be given further types, each above or below the class it was created with; any other is a type
clash, be it declared disjoint or merely a stranger. Facts of one block count for one another.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from worldmodel.facts import Block, Fault, FaultCode, PropertyValue
from worldmodel.tbox import TYPE_UID, Attribute, ValueKind

if TYPE_CHECKING:
    from worldmodel.abox import WorldModel


@dataclass(frozen=True, slots=True)
class CheckResult:
    """``faults`` refuse the block; without any, it waits for the instances in ``missing``."""

    faults: tuple[Fault, ...] = ()
    missing: tuple[int, ...] = ()


_SOUND = CheckResult()


REMEMBERED = (ValueKind.NUMBER, ValueKind.BOOLEAN, ValueKind.SYMBOL)
"""Kinds of single values whose soundness depends on the attribute alone; that of points does too."""
FLOATS = (float, float)
"""Types of the numbers of a point that is remembered: True equals 1.0, and is no number."""
MOST_REMEMBERED = 1 << 14
"""Values; all are forgotten when there are more, since points come and go."""


def check(model: "WorldModel", block: Block) -> CheckResult:
    """Check ``block`` against all that ``model`` knows; changes nothing."""
    if faults := check_form(model, block):
        return CheckResult(faults)
    return check_fit(model, block)


def check_form(model: "WorldModel", block: Block) -> tuple[Fault, ...]:
    """Return what is wrong with the block whatever else is known."""
    found: list[tuple[FaultCode, str]] = []
    if not 0 <= block.origin < model.n_origins:
        found.append((FaultCode.UNKNOWN_ORIGIN, f"origin {block.origin} is outside 0..{model.n_origins - 1}"))
    if block.sequence < 0:
        found.append((FaultCode.BAD_SEQUENCE, f"sequence {block.sequence} is below zero"))
    if not math.isfinite(block.time_s) or block.time_s < 0:
        found.append((FaultCode.BAD_TIME, f"time {block.time_s} s is not a time since the mission began"))
    elif model.quantise_time(block.time_s) != block.time_s:
        found.append((FaultCode.BAD_TIME, f"time {block.time_s} s is not on the grid of {model.time_resolution_s} s"))
    if not block.facts:
        found.append((FaultCode.NO_FACTS, "a block needs at least one fact"))
    attributes = model.tbox.attributes
    for fact in block.facts:
        if not 0 <= fact.attribute < len(attributes):
            detail = f"attribute {fact.attribute} is outside 0..{len(attributes) - 1}"
            found.append((FaultCode.UNKNOWN_ATTRIBUTE, detail))
            continue
        if not 0 <= fact.subject < model.n_uids:
            detail = f"subject {fact.subject} is outside 0..{model.n_uids - 1}"
            found.append((FaultCode.UNKNOWN_INSTANCE, detail))
        _check_value(model, attributes[fact.attribute], fact, found)
    return _faults(block, found) if found else ()


def _check_value(
    model: "WorldModel", attribute: Attribute, fact: PropertyValue, found: list[tuple[FaultCode, str]]
) -> None:
    value = fact.value
    seen = (fact.attribute, type(value), value)
    if isinstance(value, tuple):
        remembered = attribute.kind is ValueKind.POINT and tuple(map(type, value)) == FLOATS
    else:
        remembered = attribute.kind in REMEMBERED and seen[1] in (int, float, bool)
    if remembered and seen in model.tbox.sound_values:
        return
    n_found = len(found)
    try:
        stored = attribute.quantise(fact.value)
    except TypeError as error:
        found.append((FaultCode.VALUE_KIND, f"{attribute.name} of {fact.subject}: {error}"))
        return
    except ValueError as error:
        found.append((FaultCode.VALUE_RANGE, f"{attribute.name} of {fact.subject}: {error}"))
        return
    if stored != fact.value:
        detail = f"{attribute.name} of {fact.subject}: {fact.value} is not on its grid; {stored} is"
        found.append((FaultCode.VALUE_GRID, detail))
    elif attribute.kind is ValueKind.LINK and fact.target >= model.n_uids:
        detail = f"{attribute.name} of {fact.subject}: target {stored} is outside 0..{model.n_uids - 1}"
        found.append((FaultCode.UNKNOWN_INSTANCE, detail))
    elif attribute.kind is ValueKind.TYPE and fact.target >= len(model.tbox.classes):
        detail = f"type of {fact.subject}: class {stored} is outside 0..{len(model.tbox.classes) - 1}"
        found.append((FaultCode.UNKNOWN_CLASS, detail))
    if remembered and len(found) == n_found:
        if len(model.tbox.sound_values) >= MOST_REMEMBERED:
            model.tbox.sound_values.clear()
        model.tbox.sound_values.add(seen)


def check_fit(model: "WorldModel", block: Block) -> CheckResult:
    """Compare a block of good form with the instances known: see the top of the file."""
    for fact in block.facts:
        if not _fits_as_known(model, fact):
            break
    else:
        return _SOUND
    fit = _Fit(model, block)
    for fact in block.facts:
        attribute = model.tbox.attributes[fact.attribute]
        if attribute.kind is ValueKind.TYPE:
            fit.retype(fact)
            continue
        fit.require(fact.subject, attribute.domain, FaultCode.DOMAIN, attribute)
        if attribute.range_class is not None:
            fit.require(fact.target, attribute.range_class, FaultCode.LINK_CLASS, attribute)
    if fit.found:
        return CheckResult(_faults(block, fit.found))
    return CheckResult(missing=tuple(fit.missing)) if fit.missing else _SOUND


def _fits_as_known(model: "WorldModel", fact: PropertyValue) -> bool:
    """Whether subject and target are known to be of the classes that the attribute, not a type, asks for."""
    attribute = model.tbox.attributes[fact.attribute]
    if attribute.kind is ValueKind.TYPE or not model.class_mask(fact.subject) >> attribute.domain & 1:
        return False
    return attribute.range_class is None or bool(model.class_mask(fact.target) >> attribute.range_class & 1)


class _Fit:
    """One block before one model: the types the block itself asserts count as known."""

    __slots__ = ("block", "created", "found", "masks", "missing", "model")

    def __init__(self, model: "WorldModel", block: Block) -> None:
        self.model = model
        self.block = block
        self.found: list[tuple[FaultCode, str]] = []
        self.missing: dict[int, None] = {}
        self.masks: dict[int, int] = {}  # instance -> the classes it has by this block
        self.created: dict[int, int] = {}  # instance -> the class this block creates it with
        for fact in block.facts:
            if fact.attribute == TYPE_UID:
                self._assert_type(fact.subject, fact.target)

    def _assert_type(self, uid: int, class_uid: int) -> None:
        if self.model.class_mask(uid) or self.model.owner_of(uid) == self.block.origin:
            self.masks[uid] = self.masks.get(uid, 0) | self.model.tbox.ancestor_mask(class_uid)
            self.created.setdefault(uid, class_uid)

    def _created_as(self, uid: int) -> int | None:
        announced = self.model.created_as(uid)
        return self.created.get(uid) if announced is None else announced

    def retype(self, fact: PropertyValue) -> None:
        """A type fact must go with the class its subject was created with."""
        tbox, uid, given = self.model.tbox, fact.subject, fact.target
        created = self._created_as(uid)
        if not (self.model.class_mask(uid) or uid in self.masks):
            self.missing[uid] = None
        if created is None or tbox.is_a(given, created) or tbox.is_a(created, given):
            return
        how = "is disjoint with" if tbox.are_disjoint(given, created) else "is neither above nor below"
        detail = f"{uid} is given the type {tbox.classes[given].name}, which {how} {tbox.classes[created].name}"
        self.found.append((FaultCode.TYPE_CLASH, detail))

    def require(self, uid: int, class_uid: int, code: FaultCode, attribute: Attribute) -> None:
        """Instance ``uid`` must be of class ``class_uid``, for ``attribute``."""
        mask = self.model.class_mask(uid) | self.masks.get(uid, 0)
        if mask >> class_uid & 1:
            return
        created = self._created_as(uid)
        if created is None or self.model.tbox.is_a(class_uid, created) or self.model.tbox.is_a(created, class_uid):
            self.missing[uid] = None
            return
        classes = self.model.tbox.classes
        detail = f"{attribute.name}: {uid} is a {classes[created].name}, not a {classes[class_uid].name}"
        self.found.append((code, detail))


def _faults(block: Block, found: list[tuple[FaultCode, str]]) -> tuple[Fault, ...]:
    return tuple(Fault(code, block.origin, detail, block.sequence) for code, detail in found)
