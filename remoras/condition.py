"""Effect of active faults on a vehicle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from remoras.sensor import Observation
    from worldmodel import TBox


@dataclass(frozen=True, slots=True)
class Condition:
    """Effect of one fault, or of all active faults of a vehicle.

    ``is_there`` is False before the vehicle joins: it is then no obstacle either; ``is_running`` is False while lost or
    switched off. ``is_mute``, ``is_deaf``: transmitter and receiver failure. ``drain_w``: extra battery power, unknown
    to the reserve. ``readings`` map (sensor name, observation, TBox) to the recorded observation. ``lost_for_good``,
    ``dead_for_good``: permanent loss, failed sensors; ``will_return``: temporarily out of contact.

    >>> Condition(is_mute=True).hears, Condition(is_running=False).hears
    (True, False)
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
        """True while the vehicle is present and running."""
        return self.is_there and self.is_running

    @property
    def hears(self) -> bool:
        """True while the vehicle can receive."""
        return self.is_alive and not self.is_deaf

    @property
    def is_in_contact(self) -> bool:
        """True while the vehicle can receive and transmit."""
        return self.hears and not self.is_mute


SOUND = Condition()
