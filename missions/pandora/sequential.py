"""Sequential tests: a two-sided cumulative sum (CUSUM) with a stated rate of false alarms, and what it estimates.

Of readings with standard deviation 1 that should have mean 0, each side adds up what goes beyond k = 1/2::

    s+ <- max(0, s+ + z - k)        s- <- max(0, s- - z - k)

and alarms where its sum exceeds h. Where nothing is wrong, a side alarms once in about ::

    (exp(2 k b) - 2 k b - 1) / (2 k^2)        readings, b = h + 1.166

(D. Siegmund, Sequential Analysis, Springer 1985), and both together twice as often. The mean of the readings since the
side left 0 last estimates by how much they are off.
"""

from __future__ import annotations

from functools import cache

from exchange.arithmetic import exp

SLACK = 0.5
"""Half of the shift, in standard deviations, that is found soonest."""
OVERSHOOT = 1.166
"""Siegmund's correction: by 2 x 0.583 a sum lies beyond its threshold on average when it passes it."""


def readings_between_alarms(threshold: float) -> float:
    """Readings between two false alarms of both sides together, on average.

    >>> round(readings_between_alarms(4.0), 1)  # exactly 168 for both sides
    169.0
    """
    b = 2.0 * SLACK * (threshold + OVERSHOOT)
    return (exp(b) - b - 1.0) / (2.0 * SLACK * SLACK) / 2.0


@cache
def threshold(readings: float) -> float:
    """The threshold at which both sides together raise one false alarm in so many readings, at least 0.

    >>> round(readings_between_alarms(threshold(1000.0)), 6)
    1000.0
    """
    low, high = 0.0, 60.0
    for _ in range(80):
        middle = (low + high) / 2.0
        if readings_between_alarms(middle) < readings:
            low = middle
        else:
            high = middle
    return high


class Cusum:
    """A two-sided test of readings with standard deviation 1.

    Args:
        alarm_at: its threshold.

    >>> test = Cusum(4.0)
    >>> [test.add(z) for z in (0.0, 2.0, 2.0, 2.0)]
    [None, None, None, 2.0]
    """

    def __init__(self, alarm_at: float) -> None:
        self._alarm_at = alarm_at
        self._begin()

    def _begin(self) -> None:
        self._sides = {1.0: (0.0, 0.0, 0), -1.0: (0.0, 0.0, 0)}  # of a sign: cumulative sum, sum and number since 0

    def add(self, z: float) -> float | None:
        """Take a reading in; by how much readings are off on average if this raises an alarm, after which it begins
        anew, else None."""
        for sign, (cumulative, total, number) in self._sides.items():
            grown = cumulative + sign * z - SLACK
            self._sides[sign] = (grown, total + z, number + 1) if grown > 0.0 else (0.0, 0.0, 0)
        for grown, total, number in self._sides.values():
            if grown > self._alarm_at:
                self._begin()
                return total / number
        return None
