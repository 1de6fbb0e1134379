"""What a vehicle knows: its world model, and when and from whom it received what it did not observe itself."""

from typing import NamedTuple

from worldmodel.facts import Block
from worldmodel.store import Store


class Reception(NamedTuple):
    """A block that a vehicle received.

    Attributes:
        block: what it received.
        sender: the vehicle whose packet brought it, or the last part of it, by number; not always its
            origin. None where that was not noted.
        time_s: when that packet had been heard (s).
    """

    block: Block
    sender: int | None
    time_s: float


class Knowledge(NamedTuple):
    """What one vehicle knows.

    Attributes:
        model: its world model.
        receptions: of blocks that the model holds; none where nobody noted them.
    """

    model: Store
    receptions: tuple[Reception, ...] = ()
