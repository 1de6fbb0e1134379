"""Store of one vehicle: blocks of time-stamped facts, their index and their instances.

No fact is overwritten: blocks have a GUID and "merely add to the total knowledge store" (Maurelli et al., Multi-robot
cooperation, section IV). Current values are a view. Of the facts of one property (instance and attribute), the *latest*
has the greatest (time_s, origin, sequence, position in its block). This total order does not depend on arrival, so
vehicles with equal blocks have equal views.

The common instances of a scenario have the uids 0, 1, ... An origin creates further instances with uids from its own
range and announces them by a value of the attribute ``type``.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence

from worldmodel.errors import FactError
from worldmodel.facts import EPOCHS, STATUS, Block, Change, Instance, Lacking, Observation, PropertyValue
from worldmodel.holdings import BlockLog, Keeping, StoredItems
from worldmodel.index import EMPTY, sort_key
from worldmodel.inference import Inference
from worldmodel.ontology.fields import Value
from worldmodel.ontology.tbox import TYPE_UID, TBox, ValueKind

USUAL = Keeping()
_NONE = (None,)


class Store(StoredItems):
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
        self.watched: set[tuple[int, int]] = set()
        """Properties (instance uid, attribute uid) whose new observations ``take_news`` returns."""
        self.news: list[Observation] = []
        """Observations of watched properties since ``take_news``, those of excluded origins included."""
        self._members: dict[int, tuple[Instance, ...]] = {}
        self._members_of = (0, 0)  # versions of types and conclusions of this cache
        self.common_facts = tuple(keeping.common_facts)
        self._common_values = {
            (f.subject, f.attribute): f.value
            for f in keeping.common_facts
            if tbox.attributes[f.attribute].kind is not ValueKind.LINK
        }
        self.inference = Inference(tbox, self, instances, self.index.touched, keeping.common_facts)
        self.index.heeded = self.inference.heeded
        self.next_sequence = 0
        self.logs[owner, epoch] = BlockLog()
        self.next_private = STATUS - 1
        self.own_instances: set[int] = set()
        """Known uids already allocated in the owner's range."""

    def latest(self, subject: int, attribute: int, at_s: float | None = None) -> Observation | None:
        """Return the newest observation of a property by ``at_s`` (s); of statuses the newest only."""
        entries = self.index.slots.get(attribute, EMPTY).get(subject)
        if entries is None or at_s is None:
            return entries[-1] if entries else None
        position = bisect_right(entries, at_s, key=_time_s)
        return entries[position - 1] if position else None

    def history(
        self, subject: int, attribute: int, since_s: float | None = None, until_s: float | None = None
    ) -> tuple[Observation, ...]:
        """Return the observations of a property, oldest first; of statuses only the newest per origin.

        ``since_s`` and ``until_s`` (s) are inclusive; None for no limit.
        """
        entries = self.index.slots.get(attribute, EMPTY).get(subject, [])
        first = 0 if since_s is None else bisect_left(entries, since_s, key=_time_s)
        end = len(entries) if until_s is None else bisect_right(entries, until_s, key=_time_s)
        return tuple(entries[first:end])

    def since(self, origin: int, time_s: float) -> Iterator[Block]:
        """Yield an origin's items observed at ``time_s`` (s) or later, by epoch and sequence."""
        for key in sorted(key for key in self.logs if key[0] == origin):
            for block in self.logs[key]:
                if block.time_s >= time_s and self.is_seen(block):
                    yield block

    def is_seen(self, block: Block) -> bool:
        """True unless the origin of the block is excluded at its time."""
        return not self.index.trust.hides(block.origin, block.time_s)

    @property
    def banned(self) -> Mapping[int, float]:
        """Start (s) of the exclusion of each excluded origin; replaced on each change."""
        return self.index.trust.from_s

    def take_news(self) -> list[Observation]:
        """Return and clear the new observations of watched properties, in order of arrival."""
        news, self.news = self.news, []
        return [observation for observation in news if self.is_seen(observation.block)]

    def value(self, subject: int, attribute: int, default: Value | None = None) -> Value | None:
        """Return the latest value of a property, else the common initial value, else ``default``."""
        entries = self.index.slots.get(attribute, EMPTY).get(subject)
        return entries[-1].value if entries else self._common_values.get((subject, attribute), default)

    def common_values(self, subject: int, attribute: int) -> tuple[Value, ...]:
        """Return the common initial value of a property, if any, without inferred links."""
        value = self._common_values.get((subject, attribute))
        return () if value is None else (value,)

    def statuses(self) -> Iterator[Block]:
        """Yield the newest status per property and origin, each as a block of one fact."""
        for slot in sorted(self.index.statuses):
            yield self.index.statuses[slot]

    def lacking(self, now_s: float) -> tuple[Lacking, ...]:
        """Return the missing instances of pending blocks, by uid, with ages at ``now_s`` (s)."""
        return self.arrivals.lacking(now_s, self.owner_of)

    def instances_of(self, class_uid: int) -> tuple[Instance, ...]:
        """Return the asserted and inferred instances of a class, by uid."""
        self.inference.settle()
        holds_for = self.index.version_of_types, self.inference.version
        if self._members_of != holds_for:
            self._members_of, self._members = holds_for, {}
        members = self._members.get(class_uid)
        if members is None:
            known = (self.instance(uid) for uid in sorted(self.instance_uids()))
            classes = self.inference.classes
            members = tuple(i for i in known if i is not None and classes(i.uid) >> class_uid & 1)
            self._members[class_uid] = members
        return members

    def told_classes(self, uid: int) -> int:
        """Return the classes of the asserted types of an instance, bit c for class c."""
        common = self.common_instances[uid : uid + 1]
        mask = self.tbox.ancestor_mask(common[0].class_uid) if common else 0
        for observation in self.history(uid, TYPE_UID):
            mask |= self.tbox.ancestor_mask(observation.fact.target)
        return mask

    # For checks and merging ----------------------------------------------------------------------

    def latest_time_s(self, now_s: float) -> float:
        """Return the latest acceptable observation time of a block that arrives at ``now_s`` (s)."""
        return max(now_s + self.clock_tolerance_s, self.quantise_time(now_s))

    def insert(self, block: Block) -> Change:
        """Index a new, checked item or private block. Callers use ``merge`` instead."""
        self.hold(block.guid, block)
        self.version += 1
        return self._indexed(block)

    def _indexed(self, block: Block) -> Change:
        entries = [Observation(block, position) for position in range(len(block.facts))]
        for entry in entries:
            self.index.enter(entry)
        self._note(entries)
        return Change(block, self._turned() if self.index.turned else self._latest_of(entries))

    def _note(self, entries: Iterable[Observation]) -> None:
        for entry in entries:
            subject, attribute, *_ = entry.block.facts[entry.position]
            if (subject, attribute) in self.watched:
                self.news.append(entry)

    def _latest_of(self, entries: Iterable[Observation]) -> tuple[PropertyValue, ...]:
        latest = []
        for entry in entries:
            fact = entry.block.facts[entry.position]
            if self.index.slots.get(fact.attribute, EMPTY).get(fact.subject, _NONE)[-1] is entry:
                latest.append(fact)
        return tuple(latest)

    def _turned(self) -> tuple[PropertyValue, ...]:
        """Return the latest facts of all properties whose valid facts an exclusion changed."""
        turned = [self.latest(*slot) for slot in sorted(self.index.turned)]
        self.index.turned.clear()
        return tuple(observation.fact for observation in turned if observation is not None)

    def place_status(self, block: Block) -> Change:
        """Replace older statuses of the origin by a checked status."""
        placed = self.index.place(block)
        self.version += bool(placed)
        self._note(placed)
        return Change(block, self._latest_of(placed))

    def facts_of(self, subject: int, attribute: int) -> list[Observation]:
        """Return all observations of a property, excluded origins included."""
        return sorted(self.index.all_of((subject, attribute)), key=sort_key)

    def take_out(self, block: Block) -> None:
        """Remove an item or private block from all indexes; it still counts as arrived."""
        self.hold(block.guid)
        self.version += 1
        for position in range(len(block.facts)):
            self.index.leave(Observation(block, position))

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


def _time_s(observation: Observation) -> float:
    return observation.block.time_s
