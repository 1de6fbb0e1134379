"""Two-sided cumulative sum test (CUSUM) with a given false-alarm rate and an estimate.

For readings z of standard deviation 1 and expected mean 0, each side accumulates the excess over k = 1/2::

    s+ <- max(0, s+ + z - k)        s- <- max(0, s- - z - k)

and raises an alarm if its sum exceeds h. Without a change, one side raises an alarm about once in ::

    (exp(2 k b) - 2 k b - 1) / (2 k^2)        readings, b = h + 1.166

(D. Siegmund, Sequential Analysis, Springer 1985), both sides together twice as often. The mean of the readings since
the side last left 0 estimates the shift.
"""

from __future__ import annotations

from functools import cache

from exchange.arithmetic import exp

SLACK = 0.5
"""Half the shift that is detected soonest, in standard deviations."""
OVERSHOOT = 1.166
"""Siegmund's correction: 2 x 0.583, the mean overshoot over the threshold."""


def readings_between_alarms(threshold: float) -> float:
    """Mean number of readings between false alarms of both sides together.

    >>> round(readings_between_alarms(4.0), 1)  # exactly 168 for both sides
    169.0
    """
    b = 2.0 * SLACK * (threshold + OVERSHOOT)
    return (exp(b) - b - 1.0) / (2.0 * SLACK * SLACK) / 2.0


@cache
def threshold(readings: float) -> float:
    """Threshold, at least 0, for one false alarm of both sides in ``readings`` readings.

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
    """Two-sided test of readings with standard deviation 1.

    >>> test = Cusum(4.0)
    >>> [test.add(z) for z in (0.0, 2.0, 2.0, 2.0)]
    [None, None, None, 2.0]
    """

    def __init__(self, alarm_at: float) -> None:
        self._alarm_at = alarm_at
        self._begin()

    def _begin(self) -> None:
        self._sides = {1.0: (0.0, 0.0, 0), -1.0: (0.0, 0.0, 0)}  # by sign: cumulative sum, sum and number since 0

    def add(self, z: float) -> float | None:
        """Add a reading; at an alarm restart and return the mean shift, else None."""
        for sign, (cumulative, total, number) in self._sides.items():
            grown = cumulative + sign * z - SLACK
            self._sides[sign] = (grown, total + z, number + 1) if grown > 0.0 else (0.0, 0.0, 0)
        for grown, total, number in self._sides.values():
            if grown > self._alarm_at:
                self._begin()
                return total / number
        return None
