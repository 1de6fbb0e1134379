"""Draws of a schedule: a stream of numbers that is a pure function of its seed and purpose."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from exchange.acoustics import loss

T = TypeVar("T")
SCHEDULES = 1000
"""`trial` of the draws of schedules, beyond those of missions."""
PACKETS = 1001
"""`trial` of the draws that say which packets and readings a fault befalls."""
SETTINGS, STEERING = 1003, 1004
"""`trial` of the draws of settings, and of those that steer faults."""


class Draws:
    """Numbers drawn one by one.

    Args:
        seed: of the schedule.
        stream: of what; draws of one do not shift those of another.
        purpose: `trial` of the draws.

    >>> draws = Draws(7, 0)
    >>> first = draws.uniform()
    >>> 0.0 <= first < 1.0, first == Draws(7, 0).uniform(), first == draws.uniform()
    (True, True, False)
    """

    def __init__(self, seed: int, stream: int, purpose: int = SCHEDULES) -> None:
        self._seed = seed
        self._purpose = purpose
        self._stream = stream
        self._n_drawn = 0

    def uniform(self) -> float:
        """A number in [0, 1)."""
        self._n_drawn += 1
        return loss.uniform(self._seed, self._purpose, self._stream, self._n_drawn, 0)

    def between(self, low: float, high: float) -> float:
        """A number in [low, high)."""
        return low + (high - low) * self.uniform()

    def even(self, low: float, high: float) -> float:
        """A number from ``low`` to below ``high``, with three digits."""
        return float(f"{self.between(low, high):.3g}")

    def scaled(self, low: float, high: float) -> float:
        """A number from ``low`` to ``high``, even in its logarithm, with three digits."""
        return float(f"{low * (high / low) ** self.uniform():.3g}")

    def one_of(self, values: Sequence[T]) -> T:
        """One of some values."""
        return values[int(self.uniform() * len(values))]

    def some_of(self, values: Sequence[T], number: int) -> list[T]:
        """So many different ones, in the order of drawing; all if there are fewer."""
        left = list(values)
        return [left.pop(int(self.uniform() * len(left))) for _ in range(min(number, len(left)))]


def stream_of(name: str) -> int:
    """Number of the stream of what has a name."""
    return sum(ord(letter) * int(31**place) for place, letter in enumerate(name)) % (1 << 31)


def befalls(seed: int, fault: int, number: int, receiver: int, share: float) -> bool:
    """True if a fault befalls a packet or reading.

    Args:
        seed: of the schedule.
        fault: number of the fault in it.
        number: of the slot or tick.
        receiver: node.
        share: of all that it befalls.
    """
    return share >= 1.0 or loss.uniform(seed, PACKETS, fault, number & 0xFFFF, receiver | number >> 16 << 8) < share
