"""Exclusions: origins whose observations do not count from a given time on.

An exclusion is a fact about a vehicle, ``rm:bannedFrom``: its observations from that time (s) on are ignored. The
attribute's maximum revokes the exclusion. The excluded origins are a function of the set of such facts, evaluated in
the order of keys, oldest first:

- a vehicle's statement about itself is ignored;
- an issuer's statement is ignored if earlier facts exclude the issuer from that time or before;
- of the others, the newest about a vehicle counts, from any issuer.

The total order makes the result independent of arrival. If two vehicles exclude each other, the earlier fact wins. An
issuer's own exclusion does not undo its earlier statements; a newer fact does.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple, cast

from worldmodel.facts import Observation
from worldmodel.ontology.tbox import TBox, ValueKind

BANNED_FROM = "bannedFrom"
"""Attribute name; without it an ontology has no exclusions."""


def deciding(tbox: TBox) -> frozenset[int]:
    """Return the uids of the attributes that exclude origins; their values are never pruned."""
    return frozenset(attribute.uid for attribute in tbox.attributes if attribute.name == BANNED_FROM)


class BanFact(NamedTuple):
    """Exclusion of a vehicle from ``from_s`` (s) on, or revocation if None; ordered like blocks."""

    key: tuple[float, int, int, int]
    position: int
    issuer: int
    vehicle: int
    from_s: float | None


def decided(facts: Iterable[BanFact]) -> dict[int, float]:
    """Return the start (s) of the exclusion of each excluded origin, for facts in any order.

    >>> by_1 = BanFact((10.0, 1, 0, 0), 0, issuer=1, vehicle=2, from_s=5.0)
    >>> back = BanFact((11.0, 2, 0, 0), 0, issuer=2, vehicle=2, from_s=None)
    >>> decided([back, by_1])
    {2: 5.0}
    """
    banned: dict[int, float] = {}
    for fact in sorted(facts, key=lambda fact_key: fact_key[:2]):
        time_s = fact.key[0]
        if fact.issuer == fact.vehicle or banned.get(fact.issuer, time_s + 1.0) <= time_s:
            continue
        if fact.from_s is None:
            banned.pop(fact.vehicle, None)
        else:
            banned[fact.vehicle] = fact.from_s
    return dict(sorted(banned.items()))


class Bans:
    """Exclusion facts and their result; a vehicle's instance uid equals its origin."""

    __slots__ = ("_facts", "_taken_back", "attribute", "from_s")

    def __init__(self, tbox: TBox) -> None:
        declared = [
            attribute
            for attribute in tbox.attributes
            if attribute.name == BANNED_FROM and attribute.kind is ValueKind.NUMBER
        ]
        self.attribute = declared[0].uid if declared else -1
        """Attribute uid; -1, which no fact has, if the ontology declares none."""
        self._taken_back = declared[0].fields[0].maximum if declared else 0.0
        self._facts: dict[tuple[tuple[float, int, int, int], int], BanFact] = {}
        self.from_s: Mapping[int, float] = {}
        """Start (s) of the exclusion of each excluded origin; replaced on each change."""

    def hides(self, origin: int, time_s: float) -> bool:
        """True if an observation of ``origin`` at ``time_s`` is excluded."""
        from_s = self.from_s.get(origin)
        return from_s is not None and from_s <= time_s

    def note(self, observation: Observation) -> frozenset[int]:
        """Add an exclusion fact; return the origins whose exclusion changed."""
        fact, block = observation.fact, observation.block
        from_s: float | None = cast(float, fact.value)
        if cast(float, fact.value) >= self._taken_back:
            from_s = None
        self._facts[block.key, observation.position] = BanFact(
            block.key, observation.position, block.origin, fact.subject, from_s
        )
        return self._decide()

    def forget(self, observation: Observation) -> frozenset[int]:
        """Remove an exclusion fact; return the origins whose exclusion changed."""
        self._facts.pop((observation.block.key, observation.position), None)
        return self._decide()

    def _decide(self) -> frozenset[int]:
        before, now = self.from_s, decided(self._facts.values())
        if before == now:
            return frozenset()
        self.from_s = now
        return frozenset(origin for origin in {*before, *now} if before.get(origin) != now.get(origin))
