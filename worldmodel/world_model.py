"""World model of one vehicle: recording of observations, pruning, restore after a restart.

Pruning drops an item if each of its facts matches some rule: it is older than a limit and not the newest of its origin.
Types, exclusions (``bannedFrom``), statuses, private blocks and facts of excluded origins stay. Latest values, classes,
``digest`` and ``state_hash`` do not change: a pruned item still counts as arrived. Lost are history, values as of an
earlier time, and values before an exclusion issued later.
"""

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from worldmodel.errors import FactError
from worldmodel.facts import EPOCHS, STATUS, Block, Change, Fault, Merged, Observation, PropertyValue
from worldmodel.merge import CheckResult, check_fit, check_form, enter, expire, merge
from worldmodel.ontology.fields import Value
from worldmodel.store import EMPTY, Store

Stated = tuple[int, int, Value] | tuple[int, int, Value, float | None]
"""Subject, attribute uid, value; optionally the uncertainty of the value."""

PLACES = 16  # number of epochs whose uid ranges start evenly spaced in the range of their owner


class WorldModel(Store):
    """Store that records observations of its owner; ``worldmodel.merge`` adds blocks of peers."""

    def record(self, facts: Iterable[Stated], now_s: float, private: bool = False) -> Change:
        """Record facts observed together; accept blocks that were pending for them.

        If all attributes have rm:latestOnly, the block is a status, else an item. Values, uncertainties and ``now_s``
        (s since mission start) are rounded to their grids. A ``private`` block is never sent and not part of
        ``digest``.

        Returns the block as stored, with those of its facts that are now the latest. If the checks refuse a fact or an
        instance is unknown, raises FactError and records nothing.
        """
        if not math.isfinite(now_s) or now_s < 0:
            raise FactError(f"now_s is {now_s}; allowed: seconds since the mission began")
        stored = self._quantised(facts)
        block = Block(self.owner, self._sequence(stored, private), self.quantise_time(now_s), stored, self.epoch)
        result = CheckResult(check_form(self, block, quantised=True))
        if not result.faults:
            result = check_fit(self, block)
        if result.faults:
            raise FactError("; ".join(f"{fault.code}: {fault.detail}" for fault in result.faults))
        if result.missing:
            uids = ", ".join(map(str, result.missing))
            raise FactError(f"instance {uids} is unknown, or not of the required class; announce its type first")
        if block.is_status:
            return self.place_status(block) or Change(block, ())
        changes, faults = enter(self, block)
        change = next(change for change in changes if change.block is block)
        others = tuple(c for c in changes if c is not change)
        if others or faults:
            before = self.arrivals.unreported
            self.arrivals.unreported = Merged((*before.changes, *others), (*before.faults, *faults))
        return change

    def _sequence(self, facts: tuple[PropertyValue, ...], private: bool) -> int:
        if private:
            return self.next_private
        is_status = facts and self.latest_only.issuperset(fact.attribute for fact in facts)
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
        """Allocate the next uid in the owner's range, or raise FactError; record its type to create the instance."""
        allowed, first = self.run_time_instances_per_origin, self.first_uid_of(self.owner)
        # Each epoch starts elsewhere: a vehicle without its memory would reuse uids of its earlier epochs.
        start = (self.epoch % PLACES * allowed + self.epoch // PLACES * allowed // (EPOCHS // PLACES)) // PLACES
        for offset in range(start, start + allowed):
            uid = first + offset % allowed
            if uid not in self.own_instances:
                self.own_instances.add(uid)
                return uid
        sets = "run_time_instances_per_origin, or instances_found_per_vehicle of a mission, sets how many"
        raise FactError(f"origin {self.owner} has created its {allowed} instances; {sets}")


class Reception(NamedTuple):
    """Block received at ``time_s`` (s); ``sender`` is not always its origin, None if not recorded."""

    block: Block
    sender: int | None
    time_s: float


class Knowledge(NamedTuple):
    """World model of one vehicle with the receptions of its blocks; empty if not recorded."""

    model: Store
    receptions: tuple[Reception, ...] = ()


def tidy(store: Store, now_s: float) -> tuple[Fault, ...]:
    """Discard blocks pending too long at ``now_s`` (s), one fault each; apply the pruning rules."""
    if store.pruning:
        _prune(store, now_s)
    return expire(store, now_s)


def _prune(store: Store, now_s: float) -> None:
    may_go: dict[Block, set[int]] = {}
    for class_uid, attribute, older_than_s in store.pruning:
        for uid in store.instance_uids():
            if store.class_mask(uid) >> class_uid & 1:
                entries = store.index.slots.get(attribute, EMPTY).get(uid, [])
                for entry in _outdated(entries, now_s - older_than_s):
                    may_go.setdefault(entry.block, set()).add(entry.position)
    for block, positions in may_go.items():
        if len(positions) == len(block.facts):
            store.prune(block)


def _outdated(entries: list[Observation], before_s: float) -> Iterator[Observation]:
    if not entries or entries[0].time_s >= before_s:
        return
    newest: set[int] = set()
    for entry in reversed(entries):
        block = entry.block
        if not block.is_item:
            continue
        if block.origin in newest and block.time_s < before_s:
            yield entry
        newest.add(block.origin)


def remember(model: WorldModel, kept: WorldModel, now_s: float) -> Merged:
    """Copy the contents of ``kept`` to the empty ``model`` of a new epoch; the result omits private blocks."""
    private, blocks = list(kept.private_blocks()), []
    # Private blocks first, in a merge of their own: the result covers the others only.
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
    # Blocks recorded while the clock was ahead must not count as from the future.
    return max(now_s, max((block.time_s for block in blocks), default=now_s))
