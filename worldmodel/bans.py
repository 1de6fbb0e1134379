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

import math
from collections.abc import Iterable, Mapping
from typing import cast

from worldmodel.facts import Observation
from worldmodel.ontology.tbox import Attribute, TBox, ValueKind

BANNED_FROM = "bannedFrom"
"""Attribute name; without it an ontology has no exclusions."""


def ban_attribute(tbox: TBox) -> Attribute | None:
    """Return the attribute that excludes origins; None if the ontology declares none."""
    declared = (a for a in tbox.attributes if a.name == BANNED_FROM and a.kind is ValueKind.NUMBER)
    return next(declared, None)


def decided(facts: Iterable[Observation], revokes_s: float = math.inf) -> dict[int, float]:
    """Return the start (s) of the exclusion of each excluded origin, for facts in any order.

    A vehicle's instance uid equals its origin; a value of ``revokes_s`` or more revokes its exclusion.
    """
    banned: dict[int, float] = {}
    for observation in sorted(facts, key=lambda one: (one.block.key, one.position)):
        issuer, vehicle, from_s = observation.origin, observation.fact.subject, cast(float, observation.value)
        if issuer == vehicle or banned.get(issuer, math.inf) <= observation.time_s:
            continue
        if from_s >= revokes_s:
            banned.pop(vehicle, None)
        else:
            banned[vehicle] = from_s
    return dict(sorted(banned.items()))


class Bans:
    """Excluded origins of one store."""

    __slots__ = ("_revokes_s", "attribute", "from_s")

    def __init__(self, tbox: TBox) -> None:
        declared = ban_attribute(tbox)
        self.attribute = -1 if declared is None else declared.uid
        """Attribute uid; -1, which no fact has, if the ontology declares none."""
        self._revokes_s = math.inf if declared is None else declared.fields[0].maximum
        self.from_s: Mapping[int, float] = {}
        """Start (s) of the exclusion of each excluded origin; replaced on each change."""

    def hides(self, origin: int, time_s: float) -> bool:
        """True if an observation of ``origin`` at ``time_s`` is excluded."""
        from_s = self.from_s.get(origin)
        return from_s is not None and from_s <= time_s

    def decide(self, facts: Iterable[Observation]) -> frozenset[int]:
        """Evaluate all exclusion facts; return the origins whose exclusion changed."""
        before, now = self.from_s, decided(facts, self._revokes_s)
        if before == now:
            return frozenset()
        self.from_s = now
        return frozenset(origin for origin in {*before, *now} if before.get(origin) != now.get(origin))
