"""Sequential tests of observations: probability ratio, and cumulative sum.

**Probability ratio test** at given error rates. For independent observations the likelihood ratios are multiplied until
the product leaves the bounds ::

    accept where log ratio >= log((1 - p_missed) / p_mistaken)
    reject where log ratio <= log(p_missed / (1 - p_mistaken))

(A. Wald, Sequential tests of statistical hypotheses, Annals of Mathematical Statistics 16, 1945). The test accepts a
false hypothesis with probability about p_mistaken and rejects a true one with p_missed. No test with these rates needs
fewer observations on average.

**Two-sided cumulative sum test** (CUSUM) with a given false-alarm rate and an estimate. For readings z of standard
deviation 1 and expected mean 0, each side accumulates the excess over k = 1/2::

    s+ <- max(0, s+ + z - k)        s- <- max(0, s- - z - k)

and raises an alarm if its sum exceeds h. Without a change, one side raises an alarm about once in ::

    (exp(2 k b) - 2 k b - 1) / (2 k^2)        readings, b = h + 1.166

(D. Siegmund, Sequential Analysis, Springer 1985), both sides together twice as often. The mean of the readings since
the side last left 0 estimates the shift.
"""

from __future__ import annotations

from exchange.arithmetic import exp, log

LEAST = 1e-12  # probabilities are clipped to this distance from 0 and 1


def sequential_verdict(p_true: float, p_mistaken: float, p_missed: float) -> bool | None:
    """Return True (accept), False (reject), or None while another observation is needed.

    ``p_true`` is the posterior probability of the hypothesis, with prior 1/2; ``p_mistaken`` and ``p_missed`` are the
    rates of false acceptance and false rejection, above 0 and below 1/2.

    >>> three_to_one = 0.85**3 / (0.85**3 + 0.15**3)  # three looks that are right in 85 of 100
    >>> [sequential_verdict(p_true, 0.01, 0.01) for p_true in (0.85, three_to_one, 1.0 - three_to_one)]
    [None, True, False]
    """
    p_true = min(1.0 - LEAST, max(LEAST, p_true))
    # With the prior 1/2, the posterior odds are the likelihood ratio.
    log_ratio = log(p_true / (1.0 - p_true))
    if log_ratio >= log((1.0 - p_missed) / p_mistaken):
        return True
    return False if log_ratio <= log(p_missed / (1.0 - p_mistaken)) else None


SLACK = 0.5  # half the shift that is detected soonest, in standard deviations
OVERSHOOT = 1.166  # Siegmund's correction: 2 x 0.583, the mean overshoot over the threshold


def readings_between_alarms(threshold: float) -> float:
    """Mean number of readings between false alarms of both sides together.

    >>> round(readings_between_alarms(4.0), 1)  # exactly 168 for both sides
    169.0
    """
    b = 2.0 * SLACK * (threshold + OVERSHOOT)
    return (exp(b) - b - 1.0) / (2.0 * SLACK * SLACK) / 2.0


def threshold(readings: float) -> float:
    """Threshold, at least 0, for one false alarm of both sides in ``readings`` readings."""
    low, high = 0.0, 60.0
    # The number of readings grows with the threshold; 80 halvings exhaust the precision of a float.
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
