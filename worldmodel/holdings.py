"""Blocks that have arrived at a store: accepted, pending, refused or excluded, and limits on keeping them.

A pending block is discarded after ``waiting_s``, or as the oldest if more than ``waiting_blocks`` of its origin pend.

An *exclusion* is a fact about a vehicle, ``rm:bannedFrom``: its observations from that time (s) on are ignored. The
attribute's maximum revokes the exclusion. The excluded origins are a function of the set of such facts, evaluated in
the order of keys, oldest first:

- a vehicle's statement about itself is ignored;
- an issuer's statement is ignored if earlier facts exclude the issuer from that time or before;
- of the others, the newest about a vehicle counts, from any issuer.

The total order makes the result independent of arrival. If two vehicles exclude each other, the earlier fact wins.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple, cast

from worldmodel.errors import FactError
from worldmodel.facts import Block, Guid, Merged, Observation, PropertyValue
from worldmodel.ontology.tbox import TYPE_UID, Attribute, TBox, ValueKind

BANNED_FROM = "bannedFrom"  # attribute name; without it an ontology has no exclusions
CLOCK_TOLERANCE_S = 1.0  # tolerated lead of an observation time over its arrival (s)
WAITING_S = 600.0
WAITING_BLOCKS = 64


def ban_attribute(tbox: TBox) -> Attribute | None:
    """Return the attribute that excludes origins; None if the ontology declares none."""
    declared = (a for a in tbox.attributes if a.name == BANNED_FROM and a.kind is ValueKind.NUMBER)
    return next(declared, None)


def prunable(tbox: TBox) -> tuple[Attribute, ...]:
    """Return the attributes whose old values may be dropped: all but ``type`` and exclusions."""
    return tuple(a for a in tbox.attributes if a.uid != TYPE_UID and a != ban_attribute(tbox))


class PruneRule(NamedTuple):
    """Rule: drop values of an attribute in a class once older than ``older_than_s`` (s)."""

    class_uid: int
    attribute: int
    older_than_s: float

    def check(self, tbox: TBox) -> None:
        """Raise FactError for an unknown class, a negative age or an attribute not ``prunable``."""
        if not 0 <= self.class_uid < len(tbox.classes):
            raise FactError(f"pruning: class {self.class_uid} is unknown; allowed: 0..{len(tbox.classes) - 1}")
        allowed = {attribute.uid for attribute in prunable(tbox)}
        if self.attribute not in allowed:
            kept = ", ".join(attribute.name for attribute in tbox.attributes if attribute.uid not in allowed)
            within = f"1..{len(tbox.attributes) - 1}; values of {kept} are never pruned"
            raise FactError(f"pruning: attribute {self.attribute}; allowed: {within}")
        if not self.older_than_s >= 0:
            raise FactError(f"pruning: older_than_s is {self.older_than_s}; allowed: 0 s or more")


class Keeping(NamedTuple):
    """Acceptance limits of a store, and initial facts without time or origin; equal at all vehicles of a fleet."""

    clock_tolerance_s: float = CLOCK_TOLERANCE_S
    waiting_s: float = WAITING_S
    waiting_blocks: int = WAITING_BLOCKS
    pruning: Sequence[PruneRule] = ()
    common_facts: Sequence[PropertyValue] = ()


NOTHING = Merged((), ())

Rank = tuple[bool, int, int]  # creation order of an origin's blocks: items before private blocks, then as recorded


class Waiting(NamedTuple):
    """Pending block; ``missing`` is the uid of the instance that it needs, ``since_s`` the start of pending (s)."""

    block: Block
    missing: int
    since_s: float


def rank_of(block: Block) -> Rank:
    """Return the rank of a block; of two first types of an instance, the lower rank counts."""
    return (not block.is_item, block.epoch, abs(block.sequence))


class Arrivals:
    """Pending and refused blocks, and the class of creation of each run-time instance."""

    def __init__(self, waiting_s: float, waiting_blocks: int) -> None:
        self.waiting: dict[Guid, Waiting] = {}
        self.refused: dict[Guid, Block] = {}
        self.unreported = NOTHING
        """Blocks released by a local ``record`` or ``expire``; the next merge reports them."""
        self.dropped: list[Block] = []
        """Discarded blocks whose creations still count."""
        self.now_s: float | None = None
        """Arrival time of the current merge (s); None if unknown."""
        self.waiting_s = waiting_s
        self.waiting_blocks = waiting_blocks
        self._created: dict[int, tuple[Rank, int]] = {}  # run-time instance uid -> rank of the block, class uid

    def get(self, guid: Guid) -> Block | None:
        """Return a pending or refused block."""
        waiting = self.waiting.get(guid)
        return self.refused.get(guid) if waiting is None else waiting.block

    def created_as(self, uid: int) -> int | None:
        """Return the class of creation of a run-time instance; None if unknown."""
        entry = self._created.get(uid)
        return None if entry is None else entry[1]

    def note_creation(self, uid: int, class_uid: int, block: Block) -> bool:
        """Record a type given by an instance's owner; True if the class of creation changed."""
        known, rank = self._created.get(uid), rank_of(block)
        # The lowest rank counts, not the first arrival.
        if known is not None and known[0] <= rank:
            return False
        self._created[uid] = (rank, class_uid)
        return known is not None and known[1] != class_uid

    def forget_all(self) -> None:
        """Remove all blocks and classes of creation."""
        self.waiting.clear()
        self.refused.clear()
        self._created.clear()

    def wait(self, block: Block, missing: int, since_s: float | None = None) -> Block | None:
        """Suspend a block until ``missing`` is announced; return the oldest one of too many."""
        # Without an arrival time, the pending time counts from the observation.
        if since_s is None:
            since_s = block.time_s if self.now_s is None else self.now_s
        self.waiting[block.guid] = Waiting(block, missing, since_s)
        others = [waiting for waiting in self.waiting.values() if waiting.block.origin == block.origin]
        if len(others) <= self.waiting_blocks:
            return None
        return min(others, key=lambda waiting: (waiting.since_s, waiting.block.guid)).block

    def take(self, guid: Guid) -> None:
        """Remove a pending or refused block."""
        if self.waiting.pop(guid, None) is None:
            del self.refused[guid]

    def release(self, block: Block) -> list[Waiting]:
        """Remove and return the blocks pending for ``block``."""
        # A dict keeps the order of the block, which decides the order of the changes.
        announced = dict.fromkeys(fact.subject for fact in block.facts if fact.attribute == TYPE_UID)
        freed = [waiting for uid in announced for waiting in self.waiting.values() if waiting.missing == uid]
        for waiting in freed:
            self.take(waiting.block.guid)
        return freed

    def overdue(self, now_s: float) -> list[Block]:
        """Return the blocks pending longer than ``waiting_s``, by GUID."""
        return [self.waiting[g].block for g in sorted(self.waiting) if now_s - self.waiting[g].since_s > self.waiting_s]


# Exclusions ---------------------------------------------------------------------------------------


def decided(facts: Iterable[Observation], revokes_s: float = math.inf) -> dict[int, float]:
    """Return the start (s) of the exclusion of each excluded origin, for facts in any order."""
    banned: dict[int, float] = {}
    for observation in sorted(facts, key=lambda each: (each.block.key, each.position)):
        # The uid of a vehicle as an instance equals its number as an origin.
        issuer, vehicle, from_s = observation.origin, observation.fact.subject, cast(float, observation.value)
        # An exclusion of the issuer by a later fact does not undo this one.
        if issuer == vehicle or banned.get(issuer, math.inf) <= observation.time_s:
            continue
        if from_s >= revokes_s:
            banned.pop(vehicle, None)
        else:
            banned[vehicle] = from_s
    return dict(sorted(banned.items()))


class Bans:
    """Excluded origins of one store."""

    __slots__ = ("_revokes_s", "attribute", "from_s")

    def __init__(self, tbox: TBox) -> None:
        declared = ban_attribute(tbox)
        self.attribute = -1 if declared is None else declared.uid
        """Attribute uid; -1, which no fact has, if the ontology declares none."""
        self._revokes_s = math.inf if declared is None else declared.fields[0].maximum
        self.from_s: Mapping[int, float] = {}
        """Start (s) of the exclusion of each excluded origin; replaced on each change."""

    def hides(self, origin: int, time_s: float) -> bool:
        """True if an observation of ``origin`` at ``time_s`` is excluded."""
        from_s = self.from_s.get(origin)
        return from_s is not None and from_s <= time_s

    def decide(self, facts: Iterable[Observation]) -> frozenset[int]:
        """Evaluate all exclusion facts; return the origins whose exclusion changed."""
        before, now = self.from_s, decided(facts, self._revokes_s)
        if before == now:
            return frozenset()
        self.from_s = now
        return frozenset(origin for origin in {*before, *now} if before.get(origin) != now.get(origin))
