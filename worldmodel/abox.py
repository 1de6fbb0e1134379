"""The world model of one vehicle: its store, and the recording of what the vehicle itself observes."""

import math
from collections.abc import Iterable

from worldmodel.checks import CheckResult, check_fit, check_form
from worldmodel.errors import FactError
from worldmodel.facts import EPOCHS, MOST_ITEMS, STATUS, Block, Change, Merged, PropertyValue
from worldmodel.merge import enter
from worldmodel.ontology.fields import Value
from worldmodel.store import Store

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
