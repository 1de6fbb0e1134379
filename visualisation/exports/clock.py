"""Mission time where a format wants a date: a run has none, so mission time 0 is the beginning of 1970 (UTC)."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
NS_PER_S = 1_000_000_000


def nanoseconds(time_s: float) -> int:
    """Nanoseconds of mission time; a time before the start counts as 0.

    >>> nanoseconds(1.8)
    1800000000
    """
    return max(0, round(time_s * NS_PER_S))


def date(time_s: float) -> str:
    """ISO 8601, in milliseconds.

    >>> date(61.5)
    '1970-01-01T00:01:01.500Z'
    """
    return (EPOCH + timedelta(seconds=max(0.0, time_s))).strftime("%Y-%m-%dT%H:%M:%S.%f")[:-3] + "Z"
