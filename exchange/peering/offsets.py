"""Clock offset of a vehicle to its peers, estimated from arrival times.

A packet of duration L over distance d is complete at t + L + d/c, with t the start of its slot by the sender's clock.
The lead is the excess of the own clock over this time. Distances come from believed positions: 15 m of error make 10 ms
at c = 1500 m/s. The median suppresses single wrong positions and indirect paths.
"""

from __future__ import annotations

from collections import deque
from statistics import median

KEPT = 9
"""Arrivals per peer in the median."""
LEAST = 3
"""Minimum number of arrivals for an estimate."""


class Offsets:
    """Lead of one vehicle's clock over each peer's.

    >>> offsets = Offsets(3)
    >>> for lead_s in (0.101, 0.099, 7.0, 0.1): offsets.note(2, lead_s)
    >>> round(offsets.estimate_s(2), 4), offsets.estimate_s(1)
    (0.1005, None)
    """

    def __init__(self, n_nodes: int) -> None:
        self._leads_s: list[deque[float]] = [deque(maxlen=KEPT) for _ in range(n_nodes)]

    def note(self, peer: int, lead_s: float) -> None:
        """Record the lead shown by one arrival."""
        self._leads_s[peer].append(lead_s)

    def estimate_s(self, peer: int) -> float | None:
        """Return the lead over a peer's clock; None below ``LEAST`` arrivals."""
        leads_s = self._leads_s[peer]
        return median(leads_s) if len(leads_s) >= LEAST else None

    def correction_s(self) -> float:
        """Return the clock correction: half the way to the median of all clocks, own included.

        A single wrong clock thus converges to a fleet whose clocks agree.
        """
        known = [offset_s for peer in range(len(self._leads_s)) if (offset_s := self.estimate_s(peer)) is not None]
        return -median([0.0, *known]) / 2.0

    def shift(self, by_s: float) -> None:
        """Correct all leads after the own clock was advanced."""
        for leads_s in self._leads_s:
            for k in range(len(leads_s)):
                leads_s[k] += by_s
