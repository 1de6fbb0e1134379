"""The sequential probability ratio test: looks are taken until a hypothesis is decided at error rates that are stated.

With looks that are independent under both hypotheses, their likelihood ratios are multiplied until the product leaves
the bounds ::

    accept where log ratio >= log((1 - p_missed) / p_mistaken)
    reject where log ratio <= log(p_missed / (1 - p_mistaken))

(A. Wald, Sequential tests of statistical hypotheses, Annals of Mathematical Statistics 16, 1945). What is false is then
accepted with probability p_mistaken, and what is true rejected with p_missed, about: together at most with their sum.
No test with these rates needs fewer looks on average.
"""

from __future__ import annotations

from exchange.arithmetic import log

LEAST = 1e-12
"""Nobody is surer than by so much."""


def sequential_verdict(p_true: float, p_mistaken: float, p_missed: float) -> bool | None:
    """Whether a hypothesis is accepted or rejected by the looks so far; None while another one is needed.

    Args:
        p_true: probability of the hypothesis by all looks, with even chances before the first.
        p_mistaken: rate at which what is false may be accepted, above 0 and below 1/2.
        p_missed: rate at which what is true may be rejected, above 0 and below 1/2.

    >>> three_to_one = 0.85**3 / (0.85**3 + 0.15**3)  # three looks that are right in 85 of 100
    >>> [sequential_verdict(p_true, 0.01, 0.01) for p_true in (0.85, three_to_one, 1.0 - three_to_one)]
    [None, True, False]
    """
    p_true = min(1.0 - LEAST, max(LEAST, p_true))
    log_ratio = log(p_true / (1.0 - p_true))
    if log_ratio >= log((1.0 - p_missed) / p_mistaken):
        return True
    return False if log_ratio <= log(p_missed / (1.0 - p_mistaken)) else None
