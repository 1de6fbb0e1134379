"""What faults leave of a vehicle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from remoras.sensor import Observation
    from worldmodel import TBox


@dataclass(frozen=True, slots=True)
class Condition:
    """What a fault, or all that hold, leave of a vehicle.

    Attributes:
        is_there: False before it joins; it is then no obstacle either.
        is_running: False while it is lost or off.
        is_mute: nobody hears it; is_deaf: it hears nobody.
        speed_factor: what its speeds are multiplied by.
        dead_sensors: names of the sensors that yield nothing.
        drain_w: power that the battery loses beside what the vehicle uses; the reserve does not know of it.
        readings: each is given the name of a sensor, what it has read, and the words of the mission, and returns what
            is recorded of it.
        lost_for_good: it will not come back; will_return: it is out of contact, but not for good.
        dead_for_good: those of the dead sensors that never will yield anything again.
    """

    is_there: bool = True
    is_running: bool = True
    is_mute: bool = False
    is_deaf: bool = False
    speed_factor: float = 1.0
    dead_sensors: frozenset[str] = frozenset()
    drain_w: float = 0.0
    readings: tuple[Callable[[str, Observation, TBox], Observation], ...] = ()
    lost_for_good: bool = False
    will_return: bool = False
    dead_for_good: frozenset[str] = frozenset()

    @property
    def is_alive(self) -> bool:
        """True while it is there and running."""
        return self.is_there and self.is_running

    @property
    def hears(self) -> bool:
        """True while it is able to hear."""
        return self.is_alive and not self.is_deaf

    @property
    def is_in_contact(self) -> bool:
        """True while it is able to hear and to be heard."""
        return self.hears and not self.is_mute


SOUND = Condition()
"""The condition of a vehicle without faults."""
