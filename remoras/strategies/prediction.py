"""Prediction of peers that are not received: an interval for the end of the job that a peer has stated.

The position of a peer is that of reception, its job began earlier, by the age of the statement. So the end is expected
between the time due if it had begun from there, and that plus the age: delays 0 and 1. Beyond, a delay of 1 is the
share ``OF_LENGTH`` of the job. In this unit delays are spread much alike at every loss. The report of a finished job,
however late it arrives, has the time of its end, hence its delay. The interval lies between order statistics of the
delays learned and of a prior: of n exchangeable delays, the next is below the k-th with probability k / (n + 1).

Source: Sotzing, Lane 2010 (DELPHIS: prediction of silent partners); Vovk, Gammerman, Shafer 2005 (conformal
prediction). Share and priors are fitted on ``mapping-patches``, seeds 101 to 108 and 501 to 504, and on
``recovery-field``, 101 to 104.
"""

from __future__ import annotations

from bisect import insort
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from remoras.beliefs import Key
from remoras.strategy import Heard
from remoras.work import Job

OF_LENGTH = 0.1
"""Unit of delays below 0 and above 1, as a share of the expected length of the job."""
PRIOR, PRIOR_WAITING = (-0.4, 0.7, 1.7), (0.5, 5.0, 60.0)
"""Delays of a vehicle that has learned none; of jobs whose vehicle waits for another."""
BELOW, MIDDLE, ABOVE = 0.1, 0.5, 0.9
"""Probabilities of an end before each time of a forecast."""


class Forecast(NamedTuple):
    """End of a job (s): median, and interval of 80 %."""

    earliest_s: float
    expected_s: float
    latest_s: float


class StatedJob(NamedTuple):
    """Job begun at ``since_s``, by a statement received at ``heard_s``; due from the position at reception.

    ``is_waiting``: it takes another vehicle at once, for which its vehicle may wait.
    """

    since_s: float
    due_s: float
    heard_s: float
    is_waiting: bool = False

    def delay(self, end_s: float) -> float:
        """Return the delay of an end, see the module docstring."""
        late_s, age_s, unit_s = end_s - self.due_s, *self._scales_s
        return late_s / unit_s if late_s <= 0.0 else min(1.0, late_s / age_s) + max(0.0, late_s - age_s) / unit_s

    def end_s(self, delay: float) -> float:
        """Return the end (s) of a delay."""
        age_s, unit_s = self._scales_s
        return self.due_s + min(max(0.0, delay), 1.0) * age_s + (min(0.0, delay) + max(0.0, delay - 1.0)) * unit_s

    @property
    def _scales_s(self) -> tuple[float, float]:
        return max(1e-3, self.heard_s - self.since_s), max(1.0, OF_LENGTH * (self.due_s - self.since_s))


class Delays:
    """Delays of peers against their expected ends, as one vehicle has learned them.

    >>> fresh, old = StatedJob(0.0, 1000.0, 0.0), StatedJob(0.0, 1000.0, 200.0)
    >>> [round(end_s) for end_s in Delays().end(fresh)], [round(end_s) for end_s in Delays().end(old)]
    ([960, 1000, 1070], [960, 1140, 1270])
    """

    def __init__(self) -> None:
        self._learned = {False: list(PRIOR), True: list(PRIOR_WAITING)}  # ascending, by whether a vehicle may wait
        self._expected: dict[tuple[str, Key], StatedJob] = {}  # by (vehicle, job)

    def expect(self, vehicle: str, job: Job, stated: StatedJob) -> None:
        """Remember a job as first stated, to learn from the report of its end."""
        self._expected.setdefault((vehicle, job.done), stated)

    def learn(self, heard: Iterable[Heard]) -> None:
        """Learn the delays of jobs that their vehicles report as done."""
        for message in heard:
            for subject, attribute, _ in message.facts:
                if (stated := self._expected.pop((message.issuer, (attribute, subject)), None)) is not None:
                    insort(self._learned[stated.is_waiting], stated.delay(message.time_s))

    def end(self, stated: StatedJob) -> Forecast:
        """Predict the end of a job."""
        learned = self._learned[stated.is_waiting]
        return Forecast(*[stated.end_s(_quantile(learned, share)) for share in (BELOW, MIDDLE, ABOVE)])


def _quantile(learned: Sequence[float], share: float) -> float:
    place = min(max(0.0, (len(learned) + 1) * share - 1.0), len(learned) - 1.0)
    low = int(place)
    return learned[low] + (place - low) * (learned[min(low + 1, len(learned) - 1)] - learned[low])
