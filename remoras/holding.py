"""How long answers hold: whoever says so is not asked meanwhile, and whoever says nothing is asked every time.

An answer holds until a time, near the place where it was given, and without news. News is any fact that is told or
found out but where vehicles are and what energy they have left, another organisation, other sensors of the vehicle that
answer, and a call that a vehicle did not hear before. ``remoras stress --answers`` asks all the same, and compares.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from typing import NamedTuple

from remoras.motion import Motion


class Holds(NamedTuple):
    """What an answer rests on beside news.

    Attributes:
        until_s: time by the vehicle's clock (s); infinite if time alone changes nothing, and in the past if the answer
            holds at no other time than its own.
        within_m: it holds as long as the vehicle is within so much of where it was asked (m).
        peers: another report of where these vehicles are is news.
        facts: False if only those facts are news that the organisation, plans or a meeting rest on.
    """

    until_s: float = math.inf
    within_m: float = math.inf
    peers: frozenset[str] = frozenset()
    facts: bool = True


NOT = Holds(-math.inf)
"""Of an answer that has to be asked for every time."""
UNTIL_NEWS = Holds()
"""Of one that nothing but news changes."""
UNLESS_CONCERNED = Holds(facts=False)
"""Of one that rests on the organisation, plans and meetings alone."""


def all_hold(answers: Iterable[Holds]) -> Holds:
    """As long as all of these hold.

    >>> all_hold([Holds(5.0), Holds(within_m=2.0, peers=frozenset({"AUV01"}))])
    Holds(until_s=5.0, within_m=2.0, peers=frozenset({'AUV01'}), facts=True)
    """
    until_s, within_m, peers, facts = UNLESS_CONCERNED
    for one in answers:
        until_s, within_m = min(until_s, one.until_s), min(within_m, one.within_m)
        peers, facts = peers | one.peers, facts or one.facts
    return Holds(until_s, within_m, peers, facts)


class Kept:
    """An answer as long as it is kept; nothing is at first.

    Attributes:
        until_s: it holds before this time (s), unless something ends it earlier.
    """

    __slots__ = ("_at_x_m", "_at_y_m", "_facts", "_peers", "_within_m", "until_s")

    def __init__(self) -> None:
        self.until_s, self._within_m, self._peers, self._facts = NOT
        self._at_x_m = self._at_y_m = 0.0

    def keep(self, holds: Holds, motion: Motion) -> None:
        """Keep the answer that a vehicle has been given where it is."""
        self.until_s, self._within_m, self._peers, self._facts = holds
        self._at_x_m, self._at_y_m = motion.x_m, motion.y_m

    def holds(self, now_s: float, motion: Motion) -> bool:
        """True if it need not be asked for again, at a time by a vehicle that is there."""
        if not now_s < self.until_s:
            return False
        within_m, dx_m, dy_m = self._within_m, motion.x_m - self._at_x_m, motion.y_m - self._at_y_m
        return dx_m * dx_m + dy_m * dy_m <= within_m * within_m

    def is_over(self, located: Collection[str] | None, is_concerned: bool) -> bool:
        """True if it may be another one now.

        Args:
            located: peers of which it was reported where they are; None if other facts have changed.
            is_concerned: the organisation, plans or a meeting rest on the facts.
        """
        return is_concerned or (self._facts if located is None else not self._peers.isdisjoint(located))

    def end(self) -> None:
        """Keep it no longer."""
        self.until_s = -math.inf
