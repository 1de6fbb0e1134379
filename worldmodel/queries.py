"""Queries of a world model: values, history, members of a class, subscriptions.

A subscription collects new observations until the caller fetches them; there are no callbacks. Each fact of a block
costs one dictionary look-up, and nothing without subscriptions.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple, overload

from worldmodel.errors import FactError
from worldmodel.facts import Block, Instance, Lacking, Observation
from worldmodel.holdings import Keeping, StoredItems
from worldmodel.index import EMPTY, Entry, observation_of, observed_at_s
from worldmodel.inference import Inference
from worldmodel.ontology.fields import Value
from worldmodel.ontology.tbox import TYPE_UID, TBox, ValueKind


class History(Sequence[Observation]):
    """View of the observations of a property from ``since_s`` to ``until_s`` (s, inclusive)."""

    __slots__ = ("_entries", "_positions")

    def __init__(self, entries: Sequence[Entry], since_s: float | None = None, until_s: float | None = None) -> None:
        first = 0 if since_s is None else bisect_left(entries, since_s, key=observed_at_s)
        end = len(entries) if until_s is None else bisect_right(entries, until_s, key=observed_at_s)
        self._entries = entries
        self._positions = range(first, max(first, end))

    def __len__(self) -> int:
        return len(self._positions)

    @overload
    def __getitem__(self, position: int) -> Observation: ...
    @overload
    def __getitem__(self, position: slice) -> tuple[Observation, ...]: ...
    def __getitem__(self, position: int | slice) -> Observation | tuple[Observation, ...]:
        if isinstance(position, slice):
            return tuple(observation_of(self._entries[index]) for index in self._positions[position])
        return observation_of(self._entries[self._positions[position]])

    def __iter__(self) -> Iterator[Observation]:
        return (observation_of(self._entries[index]) for index in self._positions)

    def __reversed__(self) -> Iterator[Observation]:
        return (observation_of(self._entries[index]) for index in reversed(self._positions))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and len(self) == len(other) and all(map(_same, self, other))

    def __hash__(self) -> int:
        return hash(tuple(self))

    def __repr__(self) -> str:
        return f"<History of {len(self)} observations>"


def _same(value: object, other: object) -> bool:
    return value == other


class Subscription(NamedTuple):
    """Subscription to an attribute of an instance or a class; ``number`` makes it unique."""

    number: int
    attribute: int
    instance: int | None = None
    class_uid: int | None = None


class Subscriptions:
    """Subscriptions of one store, and the observations not yet fetched."""

    __slots__ = ("_class_mask", "_n", "_news", "_tbox", "n_noted", "waiting", "watching")

    def __init__(self, tbox: TBox, class_mask: Callable[[int], int]) -> None:
        self._tbox = tbox
        self._class_mask = class_mask
        self._n = 0
        self._news: dict[Subscription, list[Observation]] = {}
        self.watching: dict[int, list[Subscription]] = {}
        """Subscriptions by attribute; without any, the store skips ``note``."""
        self.waiting: set[Subscription] = set()
        """Subscriptions with updates."""
        self.n_noted = 0
        """Number of updates collected; while it stays, no subscription has a new one."""

    def add(self, attribute: int, *, instance: int | None = None, class_uid: int | None = None) -> Subscription:
        """Subscribe to an attribute of exactly one instance or class; raises FactError otherwise."""
        if not 0 <= attribute < len(self._tbox.attributes):
            allowed = len(self._tbox.attributes) - 1
            raise FactError(f"attribute {attribute} cannot be subscribed to; allowed: 0..{allowed}")
        if (instance is None) == (class_uid is None):
            raise FactError(f"instance is {instance} and class_uid is {class_uid}; allowed: exactly one of the two")
        if class_uid is not None and not 0 <= class_uid < len(self._tbox.classes):
            raise FactError(f"class {class_uid} is unknown; allowed: 0..{len(self._tbox.classes) - 1}")
        subscription = Subscription(self._n, attribute, instance, class_uid)
        self._n += 1
        self._news[subscription] = []
        self.watching.setdefault(attribute, []).append(subscription)
        return subscription

    def remove(self, subscription: Subscription) -> None:
        """Remove a subscription; raises FactError if it is not one of this store."""
        self._kept(subscription)
        self.waiting.discard(subscription)
        del self._news[subscription]
        of_attribute = self.watching[subscription.attribute]
        of_attribute.remove(subscription)
        if not of_attribute:
            del self.watching[subscription.attribute]

    def note(self, observation: Observation) -> None:
        """Collect an observation for the subscriptions that match it."""
        fact = observation.block.facts[observation.position]
        for subscription in self.watching.get(fact.attribute, ()):
            if subscription.instance == fact.subject or (
                subscription.class_uid is not None and self._class_mask(fact.subject) >> subscription.class_uid & 1
            ):
                self._news[subscription].append(observation)
                self.waiting.add(subscription)
                self.n_noted += 1

    def fetch(self, subscription: Subscription) -> tuple[Observation, ...]:
        """Return the observations since the last fetch, in order of arrival."""
        kept = self._kept(subscription)
        news = tuple(kept)
        kept.clear()
        self.waiting.discard(subscription)
        return news

    def _kept(self, subscription: Subscription) -> list[Observation]:
        try:
            return self._news[subscription]
        except KeyError:
            raise FactError(f"{subscription} is none of this world model; subscribe here first") from None


class Answers(StoredItems):
    """Answers about stored facts, without excluded origins."""

    def __init__(
        self,
        tbox: TBox,
        instances: Sequence[Instance],
        time_resolution_s: float,
        n_origins: int,
        run_time_instances_per_origin: int,
        keeping: Keeping,
    ) -> None:
        """Create an empty store; see ``Store`` for the arguments."""
        super().__init__(tbox, instances, time_resolution_s, n_origins, run_time_instances_per_origin, keeping)
        self.subscriptions = Subscriptions(tbox, self.class_mask)
        """Updates for subscribers."""
        self._members: dict[int, tuple[Instance, ...]] = {}
        self._members_of = (0, 0)  # versions of types and conclusions of this cache
        self.common_facts = tuple(keeping.common_facts)
        self._common_values = {
            (f.subject, f.attribute): f.value
            for f in keeping.common_facts
            if tbox.attributes[f.attribute].kind is not ValueKind.LINK
        }
        self.inference = Inference(tbox, self, instances, self.index.touched, keeping.common_facts)
        """Conclusions from the visible facts."""
        self.index.heeded = self.inference.heeded

    def latest(self, subject: int, attribute: int, at_s: float | None = None) -> Observation | None:
        """Return the newest observation of a property by ``at_s`` (s); of statuses the newest only."""
        entries = self.index.slots.get(attribute, EMPTY).get(subject)
        if entries is None:
            return None
        if at_s is None:
            return observation_of(entries[-1])
        position = bisect_right(entries, at_s, key=observed_at_s)
        return observation_of(entries[position - 1]) if position else None

    def history(
        self, subject: int, attribute: int, since_s: float | None = None, until_s: float | None = None
    ) -> History:
        """Return the observations of a property, oldest first, as a view.

        Of statuses only the newest per origin is present. Copy the view to a ``tuple`` before recording further facts.
        ``since_s`` and ``until_s`` (s) are inclusive; None for no limit.
        """
        return History(self.index.slots.get(attribute, EMPTY).get(subject, ()), since_s, until_s)

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

    def news(self, subscription: Subscription) -> tuple[Observation, ...]:
        """Return new observations in order of arrival; raises FactError for a foreign subscription."""
        news = self.subscriptions.fetch(subscription)
        return (
            tuple([observation for observation in news if self.is_seen(observation.block)])
            if self.index.trust.from_s
            else news
        )

    def value(self, subject: int, attribute: int, default: Value | None = None) -> Value | None:
        """Return the latest value of a property, else the common initial value, else ``default``."""
        entries = self.index.slots.get(attribute, EMPTY).get(subject)
        if entries is None:
            return self._common_values.get((subject, attribute), default)
        newest = entries[-1]
        return newest.facts[0].value if isinstance(newest, Block) else newest.value

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
