"""The sea around one vehicle in one run: what moves it, what it knows of its place, what its sensors miss."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from remoras.current import Current
from remoras.navigation import Navigation


@dataclass(frozen=True, slots=True)
class Sea:
    """Each part is None where the sea does no such thing.

    Attributes:
        current: of the water.
        navigation: how far off the vehicle takes itself to be.
        misses: True where a sensor, by name, yields nothing in the tick of a time (s).
    """

    current: Current | None = None
    navigation: Navigation | None = None
    misses: Callable[[str, float], bool] | None = None


CALM = Sea()
"""Still water, perfect navigation, and sensors that never miss."""
