"""The messages of the exchange: what a vehicle says in its slot.

A packet carries four things: acknowledgement bits, fragments of blocks (observations and
organisational facts alike; the world model does not tell them apart), and influence signals.
Blocks are delimited and acknowledged; influence signals are ephemeral bytes in the room that is left.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from worldmodel import PropertyValue


class ItemUid(NamedTuple):
    """Name of one exchange item: a fragment of the block ``(origin, sequence)``."""

    origin: int
    sequence: int
    part: int

    def __str__(self) -> str:
        part = f".{self.part}" if self.part else ""
        return f"{self.origin}-{self.sequence}{part}"


@dataclass(frozen=True, slots=True)
class Fragment:
    """Part ``index`` of ``count`` of a block; a block that fits one packet has ``count == 1``."""

    origin: int
    sequence: int
    time_s: float
    facts: tuple[PropertyValue, ...]
    index: int = 0
    count: int = 1
    uid: ItemUid = field(init=False, repr=False, compare=False)
    """Name of the exchange item that it is."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "uid", ItemUid(self.origin, self.sequence, self.index))


@dataclass(frozen=True, slots=True)
class InfluenceSignal:
    """Personal satisfaction of the sender in one role of one group, -128..127 (REMORAS, section V.A).

    ``role`` is the instance uid of the role; a role exists in one group only, so it names the group too.
    The emitter is the sender of the packet, the target is the whole group.
    """

    role: int
    value: int


@dataclass(frozen=True, slots=True)
class Packet:
    """Everything one vehicle says in one slot.

    ``rows`` holds one bit word per node: bit j of row i says that node i received the packet meant of
    node j (see ``exchange.ack``). ``acknowledgement`` bits that a policy does not send are zero.
    """

    sender: int
    rows: tuple[int, ...]
    fragments: tuple[Fragment, ...]
    signals: tuple[InfluenceSignal, ...] = ()
