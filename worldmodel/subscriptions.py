"""Subscriptions to attributes of a world model.

A subscription collects new observations until the caller fetches them; there are no callbacks. Each fact of a block
costs one dictionary look-up, and nothing without subscriptions.
"""

from collections.abc import Callable
from typing import NamedTuple

from worldmodel.errors import FactError
from worldmodel.facts import Observation
from worldmodel.ontology.tbox import TBox


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
