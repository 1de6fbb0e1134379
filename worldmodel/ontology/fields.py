"""Numbers on a grid with bounds and integer codes; bounded texts.

Two vehicles hold the same value only if they hold the same double: the one nearest to ``minimum + index * resolution``,
computed in exact integers and rounded once. Sizes follow the DCCL rule (Schneider and Schmidt 2010, table of field
encodings): ceil(log2((maximum - minimum) / resolution + 1)) bits.
"""

import math
from dataclasses import dataclass, field
from fractions import Fraction

Value = float | int | bool | str | tuple[float, float]
"""Stored value: uid of a TYPE or LINK, float, bool, str, (east, north) of a POINT, index of a SYMBOL."""

# Above 2**50 steps the rounding error of a double reaches the step: an index would not survive the round trip.
_MOST_STEPS = 2**50


@dataclass(frozen=True, slots=True)
class Grid:
    """Decimal numbers ``start + index * step``: equal on all vehicles, unlike sums of doubles.

    >>> Grid(0.0, 0.1).value_at(3), Grid(0.0, 0.1).index_of(0.3)
    (0.3, 3)
    """

    start: float
    step: float
    _start: int = field(init=False, repr=False, compare=False)
    _step: int = field(init=False, repr=False, compare=False)
    _denominator: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.start) and math.isfinite(self.step) and self.step > 0):
            raise ValueError(f"step {self.step} from {self.start}: both must be finite and the step above zero")
        start, step = Fraction(repr(float(self.start))), Fraction(repr(float(self.step)))
        denominator = math.lcm(start.denominator, step.denominator)
        object.__setattr__(self, "_start", int(start * denominator))
        object.__setattr__(self, "_step", int(step * denominator))
        object.__setattr__(self, "_denominator", denominator)

    def value_at(self, index: int) -> float:
        """Return the double nearest to the decimal number at ``index``."""
        return (self._start + index * self._step) / self._denominator

    def index_of(self, value: float) -> int:
        """Return the index of the grid value nearest to a finite ``value``."""
        return round((value - self.start) / self.step)

    @property
    def ratio(self) -> tuple[int, int]:
        """Step as a fraction: for start 0, a value is ``index * numerator / denominator``."""
        return self._step, self._denominator


@dataclass(frozen=True, slots=True)
class Field:
    """Bounded number with resolution and unit.

    >>> tenths = Field(0, 1000, 0.1, "m")
    >>> tenths.size_bits, tenths.encode(12.34), tenths.decode(123), tenths.quantise(12.34)
    (14, 123, 12.3, 12.3)
    """

    minimum: float
    maximum: float
    resolution: float
    unit: str
    n_values: int = field(init=False, repr=False, compare=False)
    size_bits: int = field(init=False, repr=False, compare=False)
    grid: Grid = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        bounds = (self.minimum, self.maximum, self.resolution)
        if not all(map(math.isfinite, bounds)):
            raise ValueError(f"minimum, maximum and resolution must be finite, not {bounds}")
        if self.resolution <= 0:
            raise ValueError(f"resolution {self.resolution} must be above zero")
        if self.maximum <= self.minimum:
            raise ValueError(f"maximum {self.maximum} must be above minimum {self.minimum}")
        low, high, step = (Fraction(repr(float(bound))) for bound in bounds)
        steps = (high - low) / step
        if steps.denominator != 1:
            raise ValueError(
                f"maximum {self.maximum} must be a whole number of resolutions {self.resolution} "
                f"above minimum {self.minimum}"
            )
        if max(abs(low), abs(high), high - low) / step > _MOST_STEPS:
            raise ValueError(f"resolution {self.resolution} is too fine for a double in {self._range()}")
        object.__setattr__(self, "n_values", int(steps) + 1)
        object.__setattr__(self, "size_bits", int(steps).bit_length())
        object.__setattr__(self, "grid", Grid(self.minimum, self.resolution))

    def _range(self) -> str:
        return f"[{self.minimum}, {self.maximum}] {self.unit}".rstrip()

    def __str__(self) -> str:
        return f"{self.minimum:g} to {self.maximum:g} {self.unit}".rstrip() + f", steps of {self.resolution:g}"

    @property
    def is_whole(self) -> bool:
        """True if every value is a whole number."""
        return float(self.minimum).is_integer() and float(self.resolution).is_integer()

    def encode(self, value: float) -> int:
        """Return the nearest grid index; raises ValueError out of range, TypeError for no number."""
        if not isinstance(value, (int, float)) or isinstance(value, bool):
            raise TypeError(f"{value!r} is not a number")
        if not self.minimum <= value <= self.maximum:
            raise ValueError(f"{value} is outside {self._range()}")
        return self.grid.index_of(value)

    def decode(self, index: int) -> float:
        """Return the value at ``index``; raises ValueError out of range."""
        if not 0 <= index < self.n_values:
            raise ValueError(f"index {index} is outside 0..{self.n_values - 1} of {self._range()}")
        return self.grid.value_at(index)

    def quantise(self, value: float) -> float:
        """Return the stored value: the grid value nearest to ``value``; raises as ``encode``."""
        return self.decode(self.encode(value))


LONGEST_BYTES = 255  # maximum length (bytes) that an attribute may allow; packets are small
_CONTROLS = frozenset(map(chr, (*range(0x20), *range(0x7F, 0xA0), 0xFFFE, 0xFFFF)))
"""Characters that XML forbids or that end a line."""


def bytes_of(text: object, most_bytes: int) -> bytes:
    """Return a text in UTF-8; raises TypeError, or ValueError by length or forbidden characters."""
    if not isinstance(text, str):
        raise TypeError(f"{text!r} is not a string")
    if not _CONTROLS.isdisjoint(text):
        raise ValueError(f"{text!r} has control characters; allowed: none")
    data = text.encode()  # UnicodeEncodeError is a ValueError
    if len(data) > most_bytes:
        raise ValueError(f"{text!r} takes {len(data)} bytes of UTF-8; allowed: at most {most_bytes}")
    return data
