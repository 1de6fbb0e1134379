"""Store of one vehicle: blocks of time-stamped facts, their index and their instances.

No fact is overwritten: blocks have a GUID and "merely add to the total knowledge store" (Maurelli et al., Multi-robot
cooperation, section IV). Current values are a view. Of the facts of one property (instance and attribute), the *latest*
has the greatest (time_s, origin, sequence, position in its block). This total order does not depend on arrival, so
vehicles with equal blocks have equal views. A vehicle with a slow clock can record a value that is not the latest;
times are stored as observed.

The common instances of a scenario have the uids 0, 1, ... An origin creates further instances with uids from its own
range and announces them by a value of the attribute ``type``. Only the checks and ``merge`` add blocks.
"""

from collections.abc import Sequence

from worldmodel.errors import FactError
from worldmodel.facts import (
    EPOCHS,
    STATUS,
    Block,
    Change,
    Instance,
    Observation,
    PropertyValue,
)
from worldmodel.holdings import BlockLog, Keeping
from worldmodel.index import EMPTY, Entry, observation_of, sort_key
from worldmodel.ontology.tbox import TYPE_UID, TBox
from worldmodel.queries import Answers

USUAL = Keeping()
_NONE = (None,)
_new = tuple.__new__  # builds a named tuple in half the time of its constructor


class Store(Answers):
    """Indexed blocks of one vehicle; ``version`` grows whenever an answer may change."""

    def __init__(
        self,
        tbox: TBox,
        owner: int,
        instances: Sequence[Instance],
        time_resolution_s: float = 0.1,
        *,
        n_origins: int,
        run_time_instances_per_origin: int = 256,
        epoch: int = 0,
        keeping: Keeping = USUAL,
    ) -> None:
        """Create a store without facts.

        All vehicles of a fleet pass equal arguments except ``owner`` and ``epoch``.

        Args:
            owner: origin of the facts recorded here, 0 to ``n_origins - 1``.
            instances: in uid order, with unique names; the first ``n_origins`` are the vehicles.
            time_resolution_s: step of all times (s).
            epoch: number of restarts of the owner, 0 to 255.

        Raises FactError for invalid arguments; the message lists all bad instances.
        """
        super().__init__(tbox, instances, time_resolution_s, n_origins, run_time_instances_per_origin, keeping)
        clock_tolerance_s, pruning = keeping.clock_tolerance_s, keeping.pruning
        if not 0 <= owner < n_origins:
            raise FactError(f"owner {owner} is not an origin; allowed: 0..{n_origins - 1}")
        if not 0 <= epoch < EPOCHS:
            raise FactError(f"epoch is {epoch}; allowed: 0..{EPOCHS - 1}")
        if not clock_tolerance_s >= 0:
            raise FactError(f"clock_tolerance_s is {clock_tolerance_s}; allowed: 0 s or more")
        for rule in pruning:
            rule.check(tbox)
        self.pruning = tuple(pruning)
        self.owner = owner
        self.epoch = epoch
        self.clock_tolerance_s = clock_tolerance_s
        self.version = 0
        self.next_sequence = 0
        """Sequence of the owner's next item."""
        self.own_log = self.logs[owner, epoch] = BlockLog()
        """Items recorded by the owner in this epoch."""
        self.next_private = STATUS - 1
        """Sequence of the owner's next private block."""
        self.own_instances: set[int] = set()
        """Known uids already allocated in the owner's range."""

    # For checks and merging ----------------------------------------------------------------------

    def latest_time_s(self, now_s: float) -> float:
        """Return the latest acceptable observation time of a block that arrives at ``now_s`` (s)."""
        return max(now_s + self.clock_tolerance_s, self.quantise_time(now_s))

    def append(self, block: Block) -> Change | None:
        """Index a checked item without type facts; return None if it has arrived before."""
        origin, sequence, time_s, facts, epoch = block
        log = self.logs.get((origin, epoch))
        if log is None:
            log = self.logs[origin, epoch] = BlockLog()
        if sequence == len(log.blocks) and not log.ahead:
            log.blocks.append(block)
        elif log.has(sequence):
            return None
        else:
            log.put(sequence, block)
        fact = facts[0]
        attribute = fact[1]
        if len(facts) == 1 and attribute in self.tables.unlinked:
            return self.index_plain(block, fact[0], attribute, time_s)
        self.version += 1
        return self._indexed(block)

    def index_plain(self, block: Block, subject: int, attribute: int, time_s: float) -> Change:
        """Index a logged item with one fact that affects no class, link or exclusion."""
        self.version += 1
        index = self.index
        if index.trust.from_s:
            return self._indexed(block)
        of_attribute = index.slots.get(attribute)
        if of_attribute is None:
            of_attribute = index.slots[attribute] = {}
        entries = of_attribute.get(subject)
        if entries is None:
            of_attribute[subject] = [block]
        elif entries[-1].time_s < time_s:
            entries.append(block)
        else:
            return self._indexed(block)
        if attribute in self.subscriptions.watching:
            self.subscriptions.note(_new(Observation, (block, 0)))
        return _new(Change, (block, block[3]))

    def insert(self, block: Block) -> Change:
        """Index a new, checked item or private block. Callers use ``merge`` instead."""
        self.hold(block.guid, block)
        self.version += 1
        return self._indexed(block)

    def _indexed(self, block: Block) -> Change:
        facts = block.facts
        entries: list[Entry]
        entries = [block] if len(facts) == 1 else [Observation(block, position) for position in range(len(facts))]
        for fact, entry in zip(facts, entries, strict=True):
            self.index.enter(fact, entry)
            if fact.attribute in self.subscriptions.watching:
                self.subscriptions.note(observation_of(entry))
        if self.index.turned:
            return Change(block, self._turned())
        slots, pairs = self.index.slots, zip(facts, entries, strict=True)
        return Change(
            block, tuple([f for f, entry in pairs if slots.get(f.attribute, EMPTY).get(f.subject, _NONE)[-1] is entry])
        )

    def _turned(self) -> tuple[PropertyValue, ...]:
        """Return the latest facts of all properties whose valid facts an exclusion changed."""
        turned = [self.latest(*slot) for slot in sorted(self.index.turned)]
        self.index.turned.clear()
        return tuple(observation.fact for observation in turned if observation is not None)

    def place_status(self, block: Block) -> Change:
        """Replace older statuses of the origin by a checked status."""
        facts, watching, slots = block.facts, self.subscriptions.watching, self.index.slots
        if len(facts) == 1 and facts[0].attribute not in watching and self.index.succeed(block):
            self.version += 1
            is_latest = slots[facts[0].attribute][facts[0].subject][-1] is block
            return _new(Change, (block, facts if is_latest else ()))
        placed = self.index.place(block)
        self.version += bool(placed)
        for fact, placed_block in placed if watching else ():
            if fact.attribute in watching:
                self.subscriptions.note(Observation(placed_block, 0))
        return Change(
            block, tuple([f for f, its in placed if slots.get(f.attribute, EMPTY).get(f.subject, _NONE)[-1] is its])
        )

    def facts_of(self, subject: int, attribute: int) -> list[Observation]:
        """Return all observations of a property, excluded origins included."""
        return [observation_of(entry) for entry in sorted(self.index.all_of((subject, attribute)), key=sort_key)]

    def take_out(self, block: Block) -> None:
        """Remove an item or private block from all indexes; it still counts as arrived."""
        self.hold(block.guid)
        self.version += 1
        for position, fact in enumerate(block.facts):
            self.index.leave(fact, block if len(block.facts) == 1 else Observation(block, position))

    def prune(self, block: Block) -> None:
        """Drop the content of an item, for ``worldmodel.world_model.prune``, which checks the rules."""
        self.content_of_pruned += int.from_bytes(self.content(block), "big")
        self.take_out(block)

    def note_creations(self, block: Block) -> set[int]:
        """Record the instances that a block creates; return those whose class of creation changed."""
        if block.origin == self.owner:
            self._note_own(block)
        changed: set[int] = set()
        noted: set[int] = set()
        for fact in block.facts:
            uid = fact.subject
            if fact.attribute == TYPE_UID and uid not in noted and self.owner_of(uid) == block.origin:
                noted.add(uid)
                if self.arrivals.note_creation(uid, fact.target, block):
                    changed.add(uid)
        return changed

    def _note_own(self, block: Block) -> None:
        """Advance the counters past a block that the owner sent before a restart."""
        if block.epoch == self.epoch:
            self.next_sequence = max(self.next_sequence, block.sequence + 1)
            self.next_private = min(self.next_private, block.sequence - 1)
        for fact in block.facts:
            if fact.attribute == TYPE_UID and self.owner_of(fact.subject) == self.owner:
                self.own_instances.add(fact.subject)
