"""Sequential probability ratio test at given error rates.

For independent observations the likelihood ratios are multiplied until the product leaves the bounds ::

    accept where log ratio >= log((1 - p_missed) / p_mistaken)
    reject where log ratio <= log(p_missed / (1 - p_mistaken))

(A. Wald, Sequential tests of statistical hypotheses, Annals of Mathematical Statistics 16, 1945). The test accepts a
false hypothesis with probability about p_mistaken and rejects a true one with p_missed; the sum of both rates is at
most p_mistaken + p_missed. No test with these rates needs fewer observations on average.
"""

from __future__ import annotations

from exchange.arithmetic import log

LEAST = 1e-12
"""Probabilities are clipped to this distance from 0 and 1."""


def sequential_verdict(p_true: float, p_mistaken: float, p_missed: float) -> bool | None:
    """Return True (accept), False (reject), or None while another observation is needed.

    Args:
        p_true: posterior probability of the hypothesis, with prior 1/2.
        p_mistaken, p_missed: rates of false acceptance and false rejection, above 0 and below 1/2.

    >>> three_to_one = 0.85**3 / (0.85**3 + 0.15**3)  # three looks that are right in 85 of 100
    >>> [sequential_verdict(p_true, 0.01, 0.01) for p_true in (0.85, three_to_one, 1.0 - three_to_one)]
    [None, True, False]
    """
    p_true = min(1.0 - LEAST, max(LEAST, p_true))
    log_ratio = log(p_true / (1.0 - p_true))
    if log_ratio >= log((1.0 - p_missed) / p_mistaken):
        return True
    return False if log_ratio <= log(p_missed / (1.0 - p_mistaken)) else None
