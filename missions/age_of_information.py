"""Age of information: time since the sending of the newest packet received from a vehicle.

Between receptions at a and b of packets sent at s and later, the age grows from a - s to b - s, its peak. A vehicle
sends every F seconds, a packet takes d and is lost with probability p. Then the time X between receptions is F times a
geometric number, and (Kadota, Sinha, Uysal-Biyikoglu, Singh, Modiano, IEEE/ACM Trans. Networking 26(6), 2018)

    mean age = E[X^2] / (2 E[X]) + d = F (1 + p) / (2 (1 - p)) + d,     peak age = E[X] + d = F / (1 - p) + d

>>> mean, peak = expected_s(frame_s=7.09, p_loss=0.5, delay_s=0.62)
>>> round(mean, 2), round(peak, 2)
(11.25, 14.8)
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from missions.figure import Figure, RunResults, Style
from missions.metric import Better, MeasuredRun, Metric


class Interval(NamedTuple):
    """Time between receptions from one sender: begin and end (s), and the sending time of the newer packet at begin."""

    begin_s: float
    end_s: float
    sent_s: float

    @property
    def peak_s(self) -> float:
        """Age (s) just before the next packet."""
        return self.end_s - self.sent_s

    @property
    def integral(self) -> float:
        """Integral (s^2) of the age."""
        least_s = self.begin_s - self.sent_s
        return (self.peak_s * self.peak_s - least_s * least_s) / 2.0


def expected_s(frame_s: float, p_loss: float, delay_s: float) -> tuple[float, float]:
    """Return mean and peak age (s) by the formula, for a packet per frame."""
    return frame_s * (1.0 + p_loss) / (2.0 * (1.0 - p_loss)) + delay_s, frame_s / (1.0 - p_loss) + delay_s


def intervals(packets: Iterable[tuple[float, Sequence[str], Sequence[float], str]]) -> Iterator[tuple[str, Interval]]:
    """Yield (receiver, interval) between receptions; ``packets`` are time sent, receivers, arrivals (s) and sender."""
    received: dict[tuple[str, str], list[tuple[float, float]]] = defaultdict(list)
    for sent_s, receivers, arrivals_s, sender in packets:
        for receiver, arrival_s in zip(receivers, arrivals_s, strict=True):
            received[receiver, sender].append((arrival_s, sent_s))
    for (receiver, _), arrivals in received.items():
        for (begin_s, sent_s), (end_s, _) in pairwise(arrivals):
            yield receiver, Interval(begin_s, end_s, sent_s)


def of_run(run: MeasuredRun) -> list[Interval]:
    """Return all intervals between receptions of a run."""
    rows = run.recorder.rows("packets")
    return [interval for _, interval in intervals((row[1], row[6], row[9], row[2]) for row in rows)]


def mean_age_s(run: MeasuredRun) -> float | None:
    """Mean age (s) over time and pairs of vehicles, from the first to the last reception; None without two."""
    found = of_run(run)
    span_s = math.fsum(one.end_s - one.begin_s for one in found)
    return round(math.fsum(one.integral for one in found) / span_s, 4) if found else None


def peak_age_s(run: MeasuredRun) -> float | None:
    """Mean age (s) just before a reception; None without two receptions."""
    found = of_run(run)
    return round(math.fsum(one.peak_s for one in found) / len(found), 4) if found else None


MEAN_AGE = Metric("mean_age_s", "s", Better.LOWER, "mean age of information", mean_age_s)
PEAK_AGE = Metric("peak_age_s", "s", Better.LOWER, "peak age of information", peak_age_s)


def draw(axes: Any, results: RunResults, style: Style) -> str:
    """Draw the share of peak ages above an age, a line for each receiver."""
    peaks: dict[str, list[float]] = defaultdict(list)
    rows = results.rows("packets")
    for receiver, one in intervals((row["time_s"], row["receivers"], row["arrivals_s"], row["sender"]) for row in rows):
        peaks[receiver].append(one.peak_s)
    for vehicle, look in style.looks.items():
        ordered = sorted(peaks[vehicle])
        shares = [1.0 - number / len(ordered) for number in range(len(ordered))]
        axes.step(ordered, shares, where="pre", color=look.colour, linestyle=look.line, label=vehicle)
    axes.set_yscale("log")
    axes.set_xlabel(style.axis("peak age of information", "s"))
    axes.set_ylabel("share at or above")
    every = [peak for own in peaks.values() for peak in own]
    mean = f"; mean {style.time(math.fsum(every) / len(every))}" if every else ""
    return f"Age of information just before each reception, all senders, by receiver{mean}."


AGE = Figure("age", "Distribution of the peak age of information", draw, needs=("packets",))
