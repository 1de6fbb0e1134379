"""Event queue: exact times, strong references, one total order.

Events come out by (time_s, priority, sequence): at equal times the lower priority number first, then in the
order in which they were put in. Nothing else decides, so two runs are alike in every Mesa and Python.
"""

from __future__ import annotations

import heapq
import math
from enum import IntEnum
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

if TYPE_CHECKING:
    from remoras.recorder import Recorder

Event = TypeVar("Event")


class Priority(IntEnum):
    """Order of events at the same time: what arrives is heard before anybody moves, decides or speaks.

    A fault comes first: a vehicle that is lost at a time does nothing at that time.
    """

    FAULT = 0
    ARRIVAL = 1
    MOTION = 2
    CONSULTATION = 3
    SLOT = 4


class ShownTime(Protocol):
    """The clock of a vehicle that may be off."""

    @property
    def is_exact(self) -> bool:
        """True if it shows the true time, and always will."""
        ...

    def reads(self, true_s: float) -> float:
        """What it shows at a true time (s)."""
        ...

    def true_time_s(self, shown_s: float) -> float:
        """True time (s) for a clock reading."""
        ...

    def set_by(self, by_s: float) -> None:
        """Put it forward by that much (s); back if it is negative."""
        ...

    def recording(self, recorder: Recorder) -> Recorder:
        """What takes the rows of its vehicle and hands them to a recorder in true time."""
        ...


class Clock(Generic[Event]):
    """Time of the simulation and what is still to happen.

    >>> clock = Clock()
    >>> clock.schedule(1.0, Priority.SLOT, "speak"); clock.schedule(1.0, Priority.ARRIVAL, "hear")
    >>> clock.next_before(2.0), clock.now_s, clock.next_before(1.0)
    ('hear', 1.0, None)
    """

    def __init__(self) -> None:
        self.now_s = 0.0
        self._heap: list[tuple[float, int, int, Event]] = []
        self._sequence = 0

    @property
    def next_s(self) -> float:
        """Time of the next event (s), infinite without one."""
        return self._heap[0][0] if self._heap else math.inf

    def schedule(self, time_s: float, priority: int, event: Event) -> None:
        """Let ``event`` come out at ``time_s``.

        Args:
            time_s: now or later.
            priority: order among events of the same time, the lower number first.
            event: what comes out.

        Raises:
            ValueError: ``time_s`` is in the past.
        """
        if time_s < self.now_s:
            raise ValueError(f"cannot schedule at {time_s} s, it is {self.now_s} s")
        heapq.heappush(self._heap, (time_s, int(priority), self._sequence, event))
        self._sequence += 1

    def next_before(self, time_s: float, priority: int = Priority.MOTION) -> Event | None:
        """The next event ordered before ``(time_s, priority)``, whose time is now from then on; None without one."""
        heap = self._heap
        if not heap or heap[0][0] > time_s or (heap[0][0] == time_s and heap[0][1] >= priority):
            return None
        self.now_s, _, _, event = heapq.heappop(heap)
        return event
