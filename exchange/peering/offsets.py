"""By how much a vehicle's clock is ahead of its peers', estimated from when their packets arrive.

A packet that takes the time L and travels the distance d is complete at t + L + d/c, where t is the start of its slot
by the clock of its sender. By how much the own clock shows more is its lead. Distances are those between positions as
the vehicle believes them, so 15 m of error make 10 ms at c = 1500 m/s. The median of the last few keeps a wrong
position, or a packet that took another way, from counting.
"""

from __future__ import annotations

from collections import deque
from statistics import median

KEPT = 9
"""Arrivals of a peer that the median is of."""
LEAST = 3
"""Fewer arrivals say nothing."""


class Offsets:
    """The lead of one vehicle's clock over each peer's.

    Args:
        n_nodes: size of the fleet.

    >>> offsets = Offsets(3)
    >>> for lead_s in (0.101, 0.099, 7.0, 0.1): offsets.note(2, lead_s)
    >>> round(offsets.estimate_s(2), 4), offsets.estimate_s(1)
    (0.1005, None)
    """

    def __init__(self, n_nodes: int) -> None:
        self._leads_s: list[deque[float]] = [deque(maxlen=KEPT) for _ in range(n_nodes)]

    def note(self, peer: int, lead_s: float) -> None:
        """Take in what one arrival says (s)."""
        self._leads_s[peer].append(lead_s)

    def estimate_s(self, peer: int) -> float | None:
        """The lead over a peer's clock (s); None while too little was heard of it."""
        leads_s = self._leads_s[peer]
        return median(leads_s) if len(leads_s) >= LEAST else None

    def correction_s(self) -> float:
        """By how much to set the own clock so that it goes half the way to the median of all clocks (s).

        The own clock counts as one of them, so a fleet whose clocks agree leaves one that is wrong to come to it.
        """
        known = [offset_s for peer in range(len(self._leads_s)) if (offset_s := self.estimate_s(peer)) is not None]
        return -median([0.0, *known]) / 2.0

    def shift(self, by_s: float) -> None:
        """The own clock was put forward by that much (s)."""
        for leads_s in self._leads_s:
            for k in range(len(leads_s)):
                leads_s[k] += by_s
