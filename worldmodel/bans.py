"""Bans: whose observations do not count from which time on, decided by facts that vehicles tell each other.

A ban is a fact about a vehicle, ``rm:bannedFrom``: from which time on nobody is to believe what that vehicle observed.
The greatest value of the attribute takes the ban back. So a ban is told, acknowledged and repeated as any item is, and
whoever has the same facts believes the same.

Who is banned is a function of the set of these facts. They are gone through from old to new, in the order of keys:

- what a vehicle says of itself does not count;
- what an issuer says does not count if the facts before have banned it from that time or earlier;
- of what counts, the newest word about a vehicle holds, whoever said it.

The order is total and the same on all vehicles, so the order of arrival makes no difference: a ban that arrives late is
put in its place, and what rested on the facts before it is decided anew. Of two vehicles that ban each other the first
prevails. A ban of an issuer does not undo what it had said about others before; a newer fact does.

``Bans`` keeps the facts. The store asks ``hides`` when an observation comes in, and keeps what is hidden apart: so a
question costs the same with a ban and without.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple, cast

from worldmodel.facts import Observation
from worldmodel.ontology.tbox import TBox, ValueKind

BANNED_FROM = "bannedFrom"
"""Name of the attribute; an ontology without it has no bans."""


def deciding(tbox: TBox) -> frozenset[int]:
    """Return the uids of the attributes whose values decide who is believed; they are never pruned."""
    return frozenset(attribute.uid for attribute in tbox.attributes if attribute.name == BANNED_FROM)


class BanFact(NamedTuple):
    """One fact about whom to believe, ordered as the blocks are.

    Attributes:
        key: of its block, (time_s, origin, epoch, sequence).
        position: in its block.
        issuer: the origin of the block.
        vehicle: the origin that it is about.
        from_s: from which time on its observations do not count; None takes the ban back.
    """

    key: tuple[float, int, int, int]
    position: int
    issuer: int
    vehicle: int
    from_s: float | None


def decided(facts: Iterable[BanFact]) -> dict[int, float]:
    """Return from which time on each banned origin is not believed (s), for facts in any order.

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
    """The ban facts that one vehicle holds, and what follows from them.

    Args:
        tbox: has the attribute ``bannedFrom``, or there are no bans. The instance of a vehicle has the uid of its
            origin.
    """

    __slots__ = ("_facts", "_taken_back", "attribute", "from_s")

    def __init__(self, tbox: TBox) -> None:
        declared = [
            attribute
            for attribute in tbox.attributes
            if attribute.name == BANNED_FROM and attribute.kind is ValueKind.NUMBER
        ]
        self.attribute = declared[0].uid if declared else -1
        """Uid of the attribute; -1, which no fact has, without one."""
        self._taken_back = declared[0].fields[0].maximum if declared else 0.0
        self._facts: dict[tuple[tuple[float, int, int, int], int], BanFact] = {}
        self.from_s: Mapping[int, float] = {}
        """From which time on each banned origin is not believed (s); a new mapping whenever that changes."""

    def hides(self, origin: int, time_s: float) -> bool:
        """True if what ``origin`` observed at ``time_s`` does not count."""
        from_s = self.from_s.get(origin)
        return from_s is not None and from_s <= time_s

    def note(self, observation: Observation) -> frozenset[int]:
        """Take in a fact of the attribute; the origins of which other observations count from now on."""
        fact, block = observation.fact, observation.block
        from_s: float | None = cast(float, fact.value)
        if cast(float, fact.value) >= self._taken_back:
            from_s = None
        self._facts[block.key, observation.position] = BanFact(
            block.key, observation.position, block.origin, fact.subject, from_s
        )
        return self._decide()

    def forget(self, observation: Observation) -> frozenset[int]:
        """Be as if a fact had not been heard; the origins of which other observations count from now on."""
        self._facts.pop((observation.block.key, observation.position), None)
        return self._decide()

    def _decide(self) -> frozenset[int]:
        before, now = self.from_s, decided(self._facts.values())
        if before == now:
            return frozenset()
        self.from_s = now
        return frozenset(origin for origin in {*before, *now} if before.get(origin) != now.get(origin))
