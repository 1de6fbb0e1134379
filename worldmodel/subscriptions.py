"""Subscriptions: what is new of an attribute, of one instance or of all instances of a class, fetched when it suits.

Nobody is called. A subscription is a value; the store keeps what came in for it until its news are fetched. A block
pays for one look-up in a dictionary per fact, and nothing at all while nobody has subscribed.
"""

from collections.abc import Callable
from typing import NamedTuple

from worldmodel.errors import FactError
from worldmodel.facts import Observation
from worldmodel.ontology.tbox import TBox


class Subscription(NamedTuple):
    """A wish for the news of ``attribute``: of one ``instance``, or of all instances of ``class_uid``.

    ``number`` tells two of the same wish apart: each fetches all news.
    """

    number: int
    attribute: int
    instance: int | None = None
    class_uid: int | None = None


class Subscriptions:
    """The subscriptions of one store, and what came in for each since its news were fetched.

    Args:
        tbox: of the store.
        class_mask: classes that an instance is known to belong to, bit c for class c.
    """

    __slots__ = ("_class_mask", "_n", "_news", "_tbox", "n_noted", "waiting", "watching")

    def __init__(self, tbox: TBox, class_mask: Callable[[int], int]) -> None:
        self._tbox = tbox
        self._class_mask = class_mask
        self._n = 0
        self._news: dict[Subscription, list[Observation]] = {}
        self.watching: dict[int, list[Subscription]] = {}
        """Subscriptions by attribute; while there is none, nothing need be noted."""
        self.waiting: set[Subscription] = set()
        """Those that have news."""
        self.n_noted = 0
        """How often something was kept for somebody: as long as it stays, nobody has news."""

    def add(self, attribute: int, *, instance: int | None = None, class_uid: int | None = None) -> Subscription:
        """Keep, from now on, what comes in of an attribute of one instance, or of all of a class; see ``Store.news``.

        Args:
            attribute: its uid.
            instance: uid of the instance.
            class_uid: of a class, instead; its subclasses are meant too.

        Raises:
            FactError: there is no such attribute or class, or not exactly one of instance and class.
        """
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
        """Keep no news any more; raises FactError for a subscription that is not one of this store."""
        self._kept(subscription)
        self.waiting.discard(subscription)
        del self._news[subscription]
        of_attribute = self.watching[subscription.attribute]
        of_attribute.remove(subscription)
        if not of_attribute:
            del self.watching[subscription.attribute]

    def note(self, observation: Observation) -> None:
        """Keep an observation that has come in for whoever watches its attribute and instance."""
        fact = observation.block.facts[observation.position]
        for subscription in self.watching.get(fact.attribute, ()):
            if subscription.instance == fact.subject or (
                subscription.class_uid is not None and self._class_mask(fact.subject) >> subscription.class_uid & 1
            ):
                self._news[subscription].append(observation)
                self.waiting.add(subscription)
                self.n_noted += 1

    def fetch(self, subscription: Subscription) -> tuple[Observation, ...]:
        """Return what has come in since the last time, in the order of arrival."""
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
