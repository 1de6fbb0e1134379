"""What the blocks that one vehicle holds come to: the values of an attribute, the members of a class, what is new."""

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence

from worldmodel.facts import Block, Instance, Lacking, Observation, PropertyValue
from worldmodel.history import History
from worldmodel.holdings import StoredItems
from worldmodel.index import EMPTY, observation_of, observed_at_s
from worldmodel.inference import Inference
from worldmodel.ontology.fields import Value
from worldmodel.ontology.tbox import TYPE_UID, TBox, ValueKind
from worldmodel.subscriptions import Subscription, Subscriptions


class Answers(StoredItems):
    """Answers about what is held; what banned vehicles said is no part of them."""

    def __init__(
        self,
        tbox: TBox,
        instances: Sequence[Instance],
        time_resolution_s: float,
        n_origins: int,
        run_time_instances_per_origin: int,
        waiting_s: float,
        waiting_blocks: int,
        common_facts: Sequence[PropertyValue],
    ) -> None:
        """Hold nothing; see ``Store`` for the arguments."""
        super().__init__(
            tbox, instances, time_resolution_s, n_origins, run_time_instances_per_origin, waiting_s, waiting_blocks
        )
        self.subscriptions = Subscriptions(tbox, self.class_mask)
        """What is kept for whoever has subscribed."""
        self._members: dict[int, tuple[Instance, ...]] = {}
        self._members_of = (0, 0)  # versions of types and of conclusions for which they hold
        self.common_facts = tuple(common_facts)
        self._common_values = {
            (f.subject, f.attribute): f.value
            for f in common_facts
            if tbox.attributes[f.attribute].kind is not ValueKind.LINK
        }
        self.inference = Inference(tbox, self, instances, self.index.touched, common_facts)
        """What follows from the facts that are seen."""
        self.index.heeded = self.inference.heeded

    def latest(self, subject: int, attribute: int, at_s: float | None = None) -> Observation | None:
        """Return the newest observation of a slot, what is banned left out.

        Args:
            subject: uid of the instance.
            attribute: its uid.
            at_s: of those observed by this time, in s; of all if None. Of statuses only the newest is held.
        """
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
        """Return the observations of a slot, oldest first, what is banned left out, without copying them.

        Of statuses the newest of each origin is there. Keep a ``tuple`` of it where more is recorded meanwhile.

        Args:
            subject: uid of the instance.
            attribute: its uid.
            since_s: observed at this time or later, in s; from the first if None.
            until_s: observed at this time or before, in s; to the last if None.
        """
        return History(self.index.slots.get(attribute, EMPTY).get(subject, ()), since_s, until_s)

    def since(self, origin: int, time_s: float) -> Iterator[Block]:
        """Yield the items of an origin that it observed at a time (s) or later, in order of epoch and sequence.

        What is banned is left out.
        """
        for key in sorted(key for key in self.logs if key[0] == origin):
            for block in self.logs[key]:
                if block.time_s >= time_s and self.is_seen(block):
                    yield block

    def is_seen(self, block: Block) -> bool:
        """True unless its origin is banned from its time on or from an earlier one."""
        return not self.index.trust.hides(block.origin, block.time_s)

    @property
    def banned(self) -> Mapping[int, float]:
        """From which time on vehicles are not believed (s), by origin; another mapping whenever that changes."""
        return self.index.trust.from_s

    def news(self, subscription: Subscription) -> tuple[Observation, ...]:
        """Return what has come in since the last time, in the order in which it did, what is banned left out.

        Raises FactError for a subscription that is not one of this store; see ``subscriptions.add``.
        """
        news = self.subscriptions.fetch(subscription)
        return (
            tuple([observation for observation in news if self.is_seen(observation.block)])
            if self.index.trust.from_s
            else news
        )

    def value(self, subject: int, attribute: int, default: Value | None = None) -> Value | None:
        """Return the latest value of a slot, else what all know from the start, or ``default`` when there is none."""
        entries = self.index.slots.get(attribute, EMPTY).get(subject)
        if entries is None:
            return self._common_values.get((subject, attribute), default)
        newest = entries[-1]
        return newest.facts[0].value if isinstance(newest, Block) else newest.value

    def common_values(self, subject: int, attribute: int) -> tuple[Value, ...]:
        """Return what all know of a slot from the start: one value, or none; links are the inference's."""
        value = self._common_values.get((subject, attribute))
        return () if value is None else (value,)

    def statuses(self) -> Iterator[Block]:
        """Yield the statuses that are held, the newest of each slot and origin, each as a block of one fact."""
        for slot in sorted(self.index.statuses):
            yield self.index.statuses[slot]

    def lacking(self, now_s: float) -> tuple[Lacking, ...]:
        """Return what blocks wait for, and who can announce it, by uid.

        Args:
            now_s: to which ages are counted (s).
        """
        return self.arrivals.lacking(now_s, self.owner_of)

    def instances_of(self, class_uid: int) -> tuple[Instance, ...]:
        """Return the instances of a class, told or concluded, by uid, what is banned left out."""
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
        """Return the classes of the types an instance was given, bit c for class c, what is banned left out."""
        common = self.common_instances[uid : uid + 1]
        mask = self.tbox.ancestor_mask(common[0].class_uid) if common else 0
        for observation in self.history(uid, TYPE_UID):
            mask |= self.tbox.ancestor_mask(observation.fact.target)
        return mask
