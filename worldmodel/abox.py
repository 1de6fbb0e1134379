"""The ABox: what one vehicle knows, as blocks of time-stamped facts and an index over them.

Nothing that is known is ever overwritten: blocks are told apart by their GUID and "merely add to the total
knowledge store" (Maurelli et al., Multi-robot cooperation, section IV). What is current is a view: of the
facts of one slot, an attribute of an instance, the *latest* is the one with the greatest (time_s, origin,
sequence, position in its block). That is a total order and does not depend on arrival, so two vehicles with
the same blocks see the same. It also means that a vehicle whose clock lags can record a value that is not the
latest of its slot; times are kept as observed, and the guard against bad clocks is left to those who read
them.

The common instances of a scenario have the uids 0, 1, ... before the mission. An origin that creates an
instance takes its uid out of a range of its own and announces it by a value of the attribute ``type``.
"""

import hashlib
import math
from bisect import insort
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from worldmodel.checks import CheckResult, check_fit, check_form
from worldmodel.errors import FactError, UnknownNameError, nearest
from worldmodel.facts import (
    Block,
    BlockKey,
    Change,
    Guid,
    Instance,
    Observation,
    PropertyValue,
)
from worldmodel.fields import Grid
from worldmodel.merge import Arrivals, Merged, enter
from worldmodel.tbox import TYPE_UID, TBox, Value


@dataclass(frozen=True, slots=True)
class Holdings:
    """Which sequences of an origin are in: all to ``highest_contiguous``, all but ``gaps`` to ``highest``.

    ``highest_contiguous`` is -1 when sequence 0 is not in.
    """

    highest_contiguous: int
    highest: int
    gaps: tuple[int, ...]


def _refuse_bad_instances(tbox: TBox, instances: Sequence[Instance]) -> None:
    faults = []
    for expected, instance in enumerate(instances):
        if instance.uid != expected:
            faults.append(f"instance {instance.name!r} has uid {instance.uid}; allowed here: {expected}")
        if not 0 <= instance.class_uid < len(tbox.classes):
            faults.append(
                f"instance {instance.name!r} is of class {instance.class_uid}; allowed: 0..{len(tbox.classes) - 1}"
            )
    names = [instance.name for instance in instances]
    for name in sorted({name for name in names if names.count(name) > 1}):
        faults.append(f"{names.count(name)} instances are named {name!r}; allowed: one")
    if faults:
        raise FactError("\n".join(faults))


def _key(observation: Observation) -> BlockKey:
    return observation.block.key


class WorldModel:
    """What one vehicle knows of the world."""

    def __init__(
        self,
        tbox: TBox,
        owner: int,
        instances: Sequence[Instance],
        time_resolution_s: float = 0.1,
        *,
        n_origins: int,
        run_time_instances_per_origin: int = 256,
    ) -> None:
        """Know the common ``instances`` (uids 0, 1, ... in order), and nothing about them.

        All vehicles of a fleet must be given the same arguments, but for ``owner``, the origin of what is
        recorded here. Raises FactError when they cannot be right.
        """
        _refuse_bad_instances(tbox, instances)
        if not 0 <= owner < n_origins:
            raise FactError(f"owner {owner} is not an origin; allowed: 0..{n_origins - 1}")
        if run_time_instances_per_origin < 0:
            raise FactError(f"run_time_instances_per_origin is {run_time_instances_per_origin}; allowed: 0 or more")
        try:
            self._clock_grid = Grid(0.0, time_resolution_s)
        except ValueError as error:
            raise FactError(f"time_resolution_s: {error}") from None
        self.tbox = tbox
        self.owner = owner
        self.time_resolution_s = time_resolution_s
        self.n_origins = n_origins
        self.run_time_instances_per_origin = run_time_instances_per_origin
        self.common_instances = tuple(instances)
        self.n_uids = len(instances) + n_origins * run_time_instances_per_origin
        self.version = 0
        self.arrivals = Arrivals()
        self._instance_named = {instance.name: instance for instance in instances}
        self._banned: set[int] = set()
        self._next_sequence = 0
        self._n_own_instances = 0
        self._blocks: dict[Guid, Block] = {}
        self._slots: dict[tuple[int, int], list[Observation]] = {}  # (subject, attribute)
        self._masks: dict[int, int] = {}
        self._members: dict[int, tuple[Instance, ...]] = {}
        self.clear()

    # Recording

    def record(self, facts: Iterable[tuple[int, int, Value]], now_s: float) -> Change:
        """Record (subject, attribute uid, value) observed together by the owner at ``now_s``.

        Values and time are rounded to their grids first; what is returned is what is stored here and
        everywhere. Raises FactError, and records nothing, when the checks refuse the facts or an instance is
        not known. Blocks of others that waited for these facts go in at once, and the next ``merge`` tells of
        them.
        """
        if not math.isfinite(now_s) or now_s < 0:
            raise FactError(f"now_s is {now_s}; allowed: seconds since the mission began")
        block = Block(self.owner, self._next_sequence, self.quantise_time(now_s), self._quantised(facts))
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
        merged = enter(self, block)
        change = next(change for change in merged.changes if change.block is block)
        others = tuple(c for c in merged.changes if c is not change)
        if others or merged.faults:
            before = self.arrivals.unreported
            self.arrivals.unreported = Merged((*before.changes, *others), (*before.faults, *merged.faults))
        return change

    def _quantised(self, facts: Iterable[tuple[int, int, Value]]) -> tuple[PropertyValue, ...]:
        attributes = self.tbox.attributes
        stored = []
        for subject, uid, value in facts:
            if not 0 <= uid < len(attributes):
                raise FactError(f"attribute {uid} is unknown; allowed: 0..{len(attributes) - 1}")
            try:
                stored.append(PropertyValue(subject, uid, attributes[uid].quantise(value)))
            except (TypeError, ValueError) as error:
                raise FactError(f"{attributes[uid].name} of instance {subject}: {error}") from None
        return tuple(stored)

    def new_instance_uid(self) -> int:
        """Take the next uid out of the owner's range; record its type to create the instance."""
        if self._n_own_instances >= self.run_time_instances_per_origin:
            allowed = self.run_time_instances_per_origin
            raise FactError(f"origin {self.owner} has created its {allowed} instances (run_time_instances_per_origin)")
        self._n_own_instances += 1
        return self._first_uid_of(self.owner) + self._n_own_instances - 1

    def _first_uid_of(self, origin: int) -> int:
        return len(self.common_instances) + origin * self.run_time_instances_per_origin

    # Asking

    def latest(self, subject: int, attribute: int) -> Observation | None:
        """Return the newest observation of a slot, as seen without the banned origins."""
        observations = self._slots.get((subject, attribute))
        if observations is None:
            return None
        if not self._banned:
            return observations[-1]
        return next((o for o in reversed(observations) if o.block.origin not in self._banned), None)

    def history(self, subject: int, attribute: int) -> Sequence[Observation]:
        """Return all observations of a slot, oldest first, without those of the banned origins."""
        observations = self._slots.get((subject, attribute), ())
        return tuple(o for o in observations if o.block.origin not in self._banned)

    def value(self, subject: int, attribute: int, default: Value | None = None) -> Value | None:
        """Return the latest value of a slot, or ``default`` when there is none."""
        observation = self.latest(subject, attribute)
        return default if observation is None else observation.value

    def has(self, guid: Guid) -> bool:
        """Say whether the block is in."""
        return guid in self._blocks

    def block(self, guid: Guid) -> Block | None:
        """Return the block if it is in."""
        return self._blocks.get(guid)

    def blocks(self) -> Iterable[Block]:
        """Return the blocks that are in."""
        return self._blocks.values()

    def arrived(self, guid: Guid) -> Block | None:
        """Return the block if it is in, waits, or clashes with what is known: it need not come again."""
        return self._blocks.get(guid) or self.arrivals.get(guid)

    # Instances

    def instance(self, uid: int) -> Instance | None:
        """Return the instance if it is common or has been announced, by a banned origin too."""
        if 0 <= uid < len(self.common_instances):
            return self.common_instances[uid]
        created = self.arrivals.created_as(uid)
        if created is None or not self.class_mask(uid):
            return None
        return Instance(uid, created, f"{self.tbox.classes[created].name}-{uid}")

    def instance_uids(self) -> Iterable[int]:
        """Return the uids of all instances known, by a banned origin too."""
        return self._masks.keys()

    def instance_named(self, name: str) -> Instance:
        """Return a common instance by its name; raises UnknownNameError with the nearest known name."""
        try:
            return self._instance_named[name]
        except KeyError:
            known = nearest(name, self._instance_named)
            raise UnknownNameError([f"no common instance is named {name!r}; {known}"]) from None

    def instances_of(self, class_uid: int) -> tuple[Instance, ...]:
        """Return the instances of a class and of those below it, as seen without the banned origins."""
        members = self._members.get(class_uid)
        if members is None:
            known = (self.instance(uid) for uid in sorted(self.instance_uids()))
            members = tuple(i for i in known if i is not None and self._is_seen_as(i, class_uid))
            self._members[class_uid] = members
        return members

    def _is_seen_as(self, instance: Instance, class_uid: int) -> bool:
        types = [o.fact.target for o in self.history(instance.uid, TYPE_UID)]
        if instance.uid < len(self.common_instances):
            types.append(instance.class_uid)
        return any(self.tbox.is_a(c, class_uid) for c in types)

    def class_mask(self, uid: int) -> int:
        """Return the classes an instance is known to belong to, bit c for class c; 0 when it is not known."""
        return self._masks.get(uid, 0)

    def created_as(self, uid: int) -> int | None:
        """Return the class an instance was created with, even when the block that creates it still waits."""
        if 0 <= uid < len(self.common_instances):
            return self.common_instances[uid].class_uid
        return self.arrivals.created_as(uid)

    def owner_of(self, uid: int) -> int | None:
        """Return the origin whose range a uid is from; None for a common instance and outside all ranges."""
        if not len(self.common_instances) <= uid < self.n_uids:
            return None
        return (uid - len(self.common_instances)) // self.run_time_instances_per_origin

    # Disregarding a vehicle

    def ban(self, origin: int) -> None:
        """See the world as if ``origin`` had said nothing; what it said is kept, and still exchanged."""
        if not 0 <= origin < self.n_origins:
            raise FactError(f"origin {origin} is unknown; allowed: 0..{self.n_origins - 1}")
        self._banned.add(origin)
        self._members.clear()
        self.version += 1

    def unban(self, origin: int) -> None:
        """See again what ``origin`` said."""
        self._banned.discard(origin)
        self._members.clear()
        self.version += 1

    @property
    def banned(self) -> frozenset[int]:
        """The origins disregarded."""
        return frozenset(self._banned)

    # Comparing with others

    def digest(self) -> dict[int, Holdings]:
        """Return, for each origin that has a block in, which of its sequences are held."""
        held: dict[int, list[int]] = {}
        for origin, sequence in sorted(self._blocks):
            held.setdefault(origin, []).append(sequence)
        digest = {}
        for origin, sequences in held.items():
            gaps = tuple(sorted(set(range(sequences[-1])).difference(sequences)))
            digest[origin] = Holdings(gaps[0] - 1 if gaps else sequences[-1], sequences[-1], gaps)
        return digest

    def state_hash(self) -> str:
        """Return a digest of TBox, common instances and set of blocks: equal if, and only if, these are."""
        state = hashlib.sha256(repr((self.tbox.hash, self.common_instances, self.n_origins, self.n_uids)).encode())
        for guid in sorted(self._blocks):
            state.update(self.content(self._blocks[guid]))
        return state.hexdigest()

    def content(self, block: Block) -> bytes:
        """Return a digest of all a block of good form says, taken over integers."""
        attributes = self.tbox.attributes
        facts = [(f.subject, f.attribute, attributes[f.attribute].encode(f.value)) for f in block.facts]
        tick = self._clock_grid.index_of(block.time_s)
        return hashlib.sha256(repr((block.origin, block.sequence, tick, facts)).encode()).digest()

    def quantise_time(self, time_s: float) -> float:
        """Return the time on the grid of ``time_resolution_s`` that is nearest to ``time_s``."""
        return self._clock_grid.value_at(self._clock_grid.index_of(time_s))

    # What merge needs

    def insert(self, block: Block) -> Change:
        """Index a block that is not in and has passed the checks. To add blocks, call ``merge``."""
        self._blocks[block.guid] = block
        time_s = block.time_s
        for position, fact in enumerate(block.facts):
            observation = Observation(block, position)
            observations = self._slots.setdefault((fact.subject, fact.attribute), [])
            if not observations or observations[-1].block.time_s < time_s or observations[-1].block.key <= block.key:
                observations.append(observation)
            else:
                insort(observations, observation, key=_key)
            if fact.attribute == TYPE_UID:
                self._add_type(fact.subject, fact.target)
        self.version += 1
        return Change(block, tuple(f for n, f in enumerate(block.facts) if self._is_latest(block, n, f)))

    def _add_type(self, uid: int, class_uid: int) -> None:
        self._masks[uid] = self._masks.get(uid, 0) | self.tbox.ancestor_mask(class_uid)
        self._members.clear()

    def _is_latest(self, block: Block, position: int, fact: PropertyValue) -> bool:
        if self._banned:
            latest = self.latest(fact.subject, fact.attribute)
        else:
            latest = self._slots[fact.subject, fact.attribute][-1]
        return latest is not None and latest.block is block and latest.position == position

    def note_own(self, block: Block) -> None:
        """Never use again a sequence or a uid of this block of the owner's, sent before a restart."""
        self._next_sequence = max(self._next_sequence, block.sequence + 1)
        for fact in block.facts:
            if fact.attribute == TYPE_UID and self.owner_of(fact.subject) == self.owner:
                taken = fact.subject - self._first_uid_of(self.owner) + 1
                self._n_own_instances = max(self._n_own_instances, taken)

    def clear(self) -> None:
        """Forget all blocks that are in; ``merge`` does when it must work out anew which belong there."""
        self._blocks.clear()
        self._slots.clear()
        self._members.clear()
        self._masks = {i.uid: self.tbox.ancestor_mask(i.class_uid) for i in self.common_instances}
