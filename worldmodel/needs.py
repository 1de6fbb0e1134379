"""Information needs: values of an attribute of a class or of one instance, with a priority.

"Each need specifies a named attribute of either an ontological class or specific class instance, referenced by UID"
(Maurelli et al., Multi-robot cooperation, section IV). Delivery requirements are merged so that they serve all peers.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from worldmodel.errors import NeedError
from worldmodel.facts import PropertyValue
from worldmodel.ontology.tbox import TBox


@dataclass(frozen=True, slots=True)
class Terms:
    """Delivery requirements of a need; raises NeedError unless the blackout is below the time to live.

    Attributes:
        time_to_live_s: age beyond which a value is no longer sent (s).
        blackout_s: minimum time between packets of a vehicle with this attribute of an instance (s).
        queue_limit: maximum number of queued items per vehicle; None for the queue's capacity.
        acknowledged: repeat until all interested nodes are known to hold the value, else send once.
    """

    time_to_live_s: float = math.inf
    blackout_s: float = 0.0
    queue_limit: int | None = None
    newest_first: bool = False
    acknowledged: bool = True

    def __post_init__(self) -> None:
        if not self.time_to_live_s > 0.0:
            raise NeedError(f"time_to_live_s is {self.time_to_live_s:g}; allowed: above 0")
        if not 0.0 <= self.blackout_s < self.time_to_live_s:
            raise NeedError(
                f"blackout_s is {self.blackout_s:g} and time_to_live_s is {self.time_to_live_s:g}; "
                "allowed: a blackout below the time to live"
            )
        if self.queue_limit is not None and self.queue_limit < 1:
            raise NeedError(f"queue_limit is {self.queue_limit}; allowed: 1 or more, or None")

    def merged(self, other: "Terms") -> "Terms":
        """Return the requirements that satisfy both.

        >>> Terms(blackout_s=9.0, queue_limit=5).merged(Terms(time_to_live_s=60.0, newest_first=True))
        Terms(time_to_live_s=inf, blackout_s=0.0, queue_limit=None, newest_first=True, acknowledged=True)
        """
        if self is other:
            return self
        limits = self.queue_limit, other.queue_limit
        return Terms(
            max(self.time_to_live_s, other.time_to_live_s),
            min(self.blackout_s, other.blackout_s),
            None if None in limits else max(limit for limit in limits if limit is not None),
            self.newest_first or other.newest_first,
            self.acknowledged or other.acknowledged,
        )


PLAIN = Terms()  # default: no limits, longest queued first, acknowledged


class Wanted(NamedTuple):
    """Peers that need a fact (bit mask), their highest priority and merged delivery requirements."""

    peers: int
    priority: int
    terms: Terms = PLAIN

    def merged(self, other: "Wanted") -> "Wanted":
        """Return the peers of both, with requirements that serve all of them."""
        if not (self.peers and other.peers):
            terms = self.terms if self.peers else other.terms
        else:
            terms = self.terms.merged(other.terms)
        return Wanted(self.peers | other.peers, max(self.priority, other.priority), terms)


NOBODY = Wanted(0, 0)


class Needs(Protocol):
    """Needs of all peers as estimated by one vehicle; answers may change during the run."""

    def wanted(self, fact: PropertyValue, class_uid: int) -> Wanted:
        """Return the need for a fact about an instance of ``class_uid``."""


@dataclass(frozen=True, slots=True)
class InformationNeed:
    """Need for ``attribute`` values of all instances of ``class_uid``, or of one ``instance``; NeedError if both."""

    attribute: int
    priority: int
    class_uid: int | None = None
    instance: int | None = None
    terms: Terms = PLAIN

    def __post_init__(self) -> None:
        if (self.class_uid is None) == (self.instance is None):
            raise NeedError(
                f"class_uid is {self.class_uid} and instance is {self.instance}; allowed: exactly one of the two"
            )
        if self.priority < 1:
            raise NeedError(f"priority is {self.priority}; allowed: 1 or more")


class NeedsIndex:
    """Needs of all peers, indexed by class or instance and attribute."""

    def __init__(self, tbox: TBox, needs_by_peer: Mapping[int, Iterable[InformationNeed]]) -> None:
        """Index the needs of each peer (0, 1, ...); raises NeedError for an unknown uid."""
        self._of_class: dict[tuple[int, int], Wanted] = {}
        self._of_instance: dict[tuple[int, int], Wanted] = {}
        for peer, needs in needs_by_peer.items():
            for need in needs:
                self._add(tbox, peer, need)

    def _add(self, tbox: TBox, peer: int, need: InformationNeed) -> None:
        if not 0 <= need.attribute < len(tbox.attributes):
            raise NeedError(f"peer {peer} needs attribute {need.attribute}; allowed: 0..{len(tbox.attributes) - 1}")
        wanted = Wanted(1 << peer, need.priority, need.terms)
        if need.instance is not None:
            key = (need.instance, need.attribute)
            self._of_instance[key] = wanted.merged(self._of_instance.get(key, NOBODY))
        elif need.class_uid is not None:
            if not 0 <= need.class_uid < len(tbox.classes):
                raise NeedError(f"peer {peer} needs class {need.class_uid}; allowed: 0..{len(tbox.classes) - 1}")
            # Expanded here, once: every queued fact is looked up.
            for class_uid in tbox.subclasses(need.class_uid):
                key = (class_uid, need.attribute)
                self._of_class[key] = wanted.merged(self._of_class.get(key, NOBODY))

    def wanted(self, fact: PropertyValue, class_uid: int) -> Wanted:
        """Return the need for a fact of any value."""
        by_class = self._of_class.get((class_uid, fact.attribute), NOBODY)
        by_instance = self._of_instance.get((fact.subject, fact.attribute))
        return by_class if by_instance is None else by_class.merged(by_instance)
