"""When and from whom a vehicle received what it did not observe itself."""

from typing import NamedTuple

from worldmodel.facts import Block


class Reception(NamedTuple):
    """A block that a vehicle received.

    Attributes:
        block: what it received.
        sender: the vehicle whose packet brought it, or the last part of it, by number; not always its origin.
        time_s: when that packet had been heard (s).
    """

    block: Block
    sender: int
    time_s: float
