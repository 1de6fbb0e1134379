"""The world model of one vehicle: its store, and the recording of what the vehicle itself observes.

What a vehicle knows: its world model, and when and from whom it received what it did not observe itself.

Keeping a store small: what is old and was said anew since may go.

Of a slot the newest value of each origin always stays, and so does all that a ban hides. So a ban leaves what other
origins have said, and of the banned one the newest value from before the ban. An item goes as a whole or not at all:
only if every one of its facts may go, by whichever rule. Types never go, nor who is believed, nor do statuses, which
replace one another, nor what the owner keeps to itself.

The latest values and the classes of all instances are the same as before, and so are ``digest`` and ``state_hash``: a
pruned item has still arrived, is passed over when it comes again, and its content still counts. What is lost are the
old values: of history, of a value as of a time before, and of an origin that is banned later from an earlier time on.
Do not prune an attribute of which all values ever told matter, as of a list of findings. An item not held cannot be
compared with another content of the same GUID. If an origin is caught in such a contradiction, what was pruned stays
counted even where it rested on the content that went.

Taking over what a world model knew into one that begins anew, in another epoch of the same owner.
"""

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from worldmodel.checks import CheckResult, check_fit, check_form
from worldmodel.errors import FactError
from worldmodel.facts import EPOCHS, MOST_ITEMS, STATUS, Block, Change, Fault, Guid, Merged, PropertyValue
from worldmodel.index import EMPTY, Entry, block_of
from worldmodel.merge import enter, expire, merge
from worldmodel.ontology.fields import Value
from worldmodel.store import PruneRule, Store

_NEVER_S = math.inf
_new = tuple.__new__  # makes a named tuple of a tuple, in half the time

Stated = tuple[int, int, Value] | tuple[int, int, Value, float | None]
"""Subject, attribute, value; and the uncertainty of the value, if there is one."""

PLACES = 16
"""Epochs whose instances begin far apart in the range of their owner."""


class WorldModel(Store):
    """What one vehicle knows of the world.

    The owner adds facts with ``record``; blocks of other vehicles come in through ``worldmodel.merge``.
    """

    def record(self, facts: Iterable[Stated], now_s: float, private: bool = False) -> Change:
        """Record facts that the owner observed together; blocks that waited for them go in at once.

        They become a status if their attributes all have rm:latestOnly, else an item. The next ``merge`` reports the
        blocks that were set free.

        Args:
            facts: (subject, attribute uid, value) each, or with the uncertainty behind; both are rounded to the grids
                of the attribute. It is a standard deviation or a probability, see ``PropertyValue``.
            now_s: time of observation since the mission began (s), rounded to ``time_resolution_s``.
            private: True for what the owner keeps to itself: it is numbered apart and is no part of ``digest``.

        Returns:
            The block as it is stored here and everywhere, and those of its facts that are now the latest.

        Raises:
            FactError: the checks refuse the facts or an instance is not known; nothing is recorded.
        """
        if type(facts) is not tuple:
            facts = tuple(facts)
        sequence = self.next_sequence
        if len(facts) == 1 and len(facts[0]) == 3 and not private and 0 <= now_s < _NEVER_S and sequence < MOST_ITEMS:
            subject, attribute, value = facts[0]
            plain = self.tables.plain.get(attribute)
            if plain is not None and self.index.masks.get(subject, 0) >> plain[1] & 1:
                stored = plain[0](value)
                if stored is not None:  # one fact that is right at first sight, and no type, link or status
                    numerator, denominator = self.time_ratio
                    time_s = round(now_s / self.time_resolution_s) * numerator / denominator
                    stored_facts = (_new(PropertyValue, (subject, attribute, stored, None)),)
                    block = _new(Block, (self.owner, sequence, time_s, stored_facts, self.epoch))
                    self.next_sequence = sequence + 1
                    if sequence == len(own := self.own_log.blocks):
                        own.append(block)
                    else:
                        self.own_log.put(sequence, block)
                    return self.index_plain(block, subject, attribute, time_s)
            status = self.tables.statuses.get(attribute)
            if status is not None and self.index.masks.get(subject, 0) >> status[1] & 1:
                stored = status[0](value)
                if stored is not None:
                    numerator, denominator = self.time_ratio
                    time_s = round(now_s / self.time_resolution_s) * numerator / denominator
                    stored_facts = (_new(PropertyValue, (subject, attribute, stored, None)),)
                    return self.place_status(_new(Block, (self.owner, STATUS, time_s, stored_facts, self.epoch)))
        return self._record_closely(facts, now_s, private)

    def _record_closely(self, facts: tuple[Stated, ...], now_s: float, private: bool) -> Change:
        """Record any facts."""
        if not math.isfinite(now_s) or now_s < 0:
            raise FactError(f"now_s is {now_s}; allowed: seconds since the mission began")
        stored = self._quantised(facts)
        block = Block(self.owner, self._sequence(stored, private), self.quantise_time(now_s), stored, self.epoch)
        result = CheckResult(check_form(self, block))
        if not result.faults:
            result = check_fit(self, block)
        if result.faults:
            raise FactError("; ".join(f"{fault.code}: {fault.detail}" for fault in result.faults))
        if result.missing:
            uids = ", ".join(map(str, result.missing))
            raise FactError(
                f"not known, or not of the class that is asked for: instance {uids}; announce its type first"
            )
        if block.is_status:
            return self.place_status(block)
        changes, faults = enter(self, block)
        change = next(change for change in changes if change.block is block)
        others = tuple(c for c in changes if c is not change)
        if others or faults:
            before = self.arrivals.unreported
            self.arrivals.unreported = Merged((*before.changes, *others), (*before.faults, *faults))
        return change

    def _sequence(self, facts: tuple[PropertyValue, ...], private: bool) -> int:
        """The sequence of the next block with these facts."""
        if private:
            return self.next_private
        is_status = facts and self.tables.latest_only.issuperset(fact.attribute for fact in facts)
        return STATUS if is_status else self.next_sequence

    def _quantised(self, facts: Iterable[Stated]) -> tuple[PropertyValue, ...]:
        attributes = self.tbox.attributes
        stored = []
        for subject, uid, value, *uncertain in facts:
            if not 0 <= uid < len(attributes):
                raise FactError(f"attribute {uid} is unknown; allowed: 0..{len(attributes) - 1}")
            try:
                attribute = attributes[uid]
                uncertainty = uncertain[0] if uncertain else None
                if uncertainty is not None:
                    uncertainty = attribute.quantise_uncertainty(uncertainty)
                stored.append(PropertyValue(subject, uid, attribute.quantise(value), uncertainty))
            except (TypeError, ValueError) as error:
                raise FactError(f"{attributes[uid].name} of instance {subject}: {error}") from None
        return tuple(stored)

    def new_instance_uid(self) -> int:
        """Take the next uid out of the owner's range; record its type to create the instance.

        Each epoch begins at a place of its own in the range, the first ``PLACES`` far apart and later ones between,
        since after a restart the owner may not know yet which instances it has created.

        Raises FactError when the owner has created all instances that it may.
        """
        allowed, first = self.run_time_instances_per_origin, self.first_uid_of(self.owner)
        start = (self.epoch % PLACES * allowed + self.epoch // PLACES * allowed // (EPOCHS // PLACES)) // PLACES
        for offset in range(start, start + allowed):
            uid = first + offset % allowed
            if uid not in self.own_instances:
                self.own_instances.add(uid)
                return uid
        raise FactError(f"origin {self.owner} has created its {allowed} instances (run_time_instances_per_origin)")


class Reception(NamedTuple):
    """A block that a vehicle received.

    Attributes:
        block: what it received.
        sender: the vehicle whose packet brought it, or the last part of it, by number; not always its
            origin. None where that was not noted.
        time_s: when that packet had been heard (s).
    """

    block: Block
    sender: int | None
    time_s: float


class Knowledge(NamedTuple):
    """What one vehicle knows.

    Attributes:
        model: its world model.
        receptions: of blocks that the model holds; none where nobody noted them.
    """

    model: Store
    receptions: tuple[Reception, ...] = ()


def prune(store: Store, class_uid: int, attribute: int, before_s: float) -> int:
    """Drop the values of one attribute that are old and not the newest of their origin.

    Args:
        store: the store or world model.
        class_uid: whose instances are concerned.
        attribute: its uid; see ``store.prunable`` for those that are allowed.
        before_s: values observed at this time or later stay (s).

    Returns:
        The number of items dropped.

    Raises:
        FactError: there is no such class or attribute, or its values never go.
    """
    PruneRule(class_uid, attribute, 0.0).check(store.tbox)
    return _drop(store, [(class_uid, attribute, before_s)])


def tidy(store: Store, now_s: float) -> tuple[Fault, ...]:
    """Drop what waited for too long, with a fault for each, and what the rules of pruning say.

    Args:
        store: the store or world model.
        now_s: the time now (s).
    """
    if store.pruning:
        _drop(store, [(rule.class_uid, rule.attribute, now_s - rule.older_than_s) for rule in store.pruning])
    return expire(store, now_s)


def _drop(store: Store, limits: Iterable[tuple[int, int, float]]) -> int:
    """Drop the items of which each fact may go by one of the limits (class, attribute, before_s); return how many."""
    may_go: dict[Guid, set[int]] = {}
    blocks: dict[Guid, Block] = {}
    for class_uid, attribute, before_s in limits:
        for uid in store.instance_uids():
            if store.class_mask(uid) >> class_uid & 1:
                for entry in _outdated(store.index.slots.get(attribute, EMPTY).get(uid, []), before_s):
                    block = block_of(entry)
                    blocks[block.guid] = block
                    may_go.setdefault(block.guid, set()).add(0 if isinstance(entry, Block) else entry.position)
    gone = [block for guid, block in blocks.items() if len(may_go[guid]) == len(block.facts)]
    for block in gone:
        store.prune(block)
    return len(gone)


def _outdated(entries: list[Entry], before_s: float) -> Iterator[Entry]:
    """Of the facts that count in a slot those of items older than ``before_s`` that are not the newest of an origin."""
    if not entries or block_of(entries[0]).time_s >= before_s:
        return
    newest: set[int] = set()
    for entry in reversed(entries):
        block = block_of(entry)
        if not block.is_item:
            continue
        if block.origin in newest and block.time_s < before_s:
            yield entry
        newest.add(block.origin)


def remember(model: WorldModel, kept: WorldModel, now_s: float) -> Merged:
    """Let a model know what another one knew; what waited there waits here from now on.

    What was recorded while a clock was ahead stays known, though it is of the future now.

    Args:
        model: that knows nothing yet.
        kept: of the same fleet.
        now_s: the time now (s).

    Returns:
        What items and statuses changed, and the faults; of what the owner keeps to itself nothing is said.
    """
    private, blocks = list(kept.private_blocks()), []
    merge(model, private, _by(private, now_s))
    for guid, block in kept.items():
        if block is None:
            model.hold(guid)
        else:
            blocks.append(block)
    model.content_of_pruned = kept.content_of_pruned
    blocks += kept.statuses()
    return merge(model, blocks, _by(blocks, now_s))


def _by(blocks: Iterable[Block], now_s: float) -> float:
    """The time now, or of the newest of the blocks, whichever is later (s)."""
    return max(now_s, max((block.time_s for block in blocks), default=now_s))
