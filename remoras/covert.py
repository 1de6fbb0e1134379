"""Covert operation: a vehicle hears, but does not send, or sends only what is urgent."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Covert:
    """A time in which a vehicle is covert.

    Attributes:
        vehicle: its name.
        above: only what has a higher priority is said; None if nothing is.
        from_s: when it begins; until_s: when it is over.
    """

    vehicle: str
    above: int | None = None
    from_s: float = 0.0
    until_s: float = math.inf


def least_priority(times: Iterable[Covert], now_s: float) -> float:
    """Priority above which things may be said now: 0 for all, infinite for nothing.

    >>> times = (Covert("AUV01", 50, 10.0, 40.0), Covert("AUV01", None, 20.0, 30.0))
    >>> [least_priority(times, now_s) for now_s in (5.0, 10.0, 25.0, 30.0)]
    [0, 50, inf, 50]
    """
    above = [math.inf if one.above is None else one.above for one in times if one.from_s <= now_s < one.until_s]
    return max(above, default=0)
