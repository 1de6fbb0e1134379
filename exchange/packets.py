"""The messages of the exchange: what a vehicle says in its slot.

A packet carries four things: acknowledgement bits, fragments of blocks (observations and
organisational facts alike; the world model does not tell them apart), and influence signals.
Blocks are delimited and acknowledged; influence signals are ephemeral bytes in the room that is left.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from worldmodel import STATUS, Block, PropertyValue
from worldmodel.facts import Guid


class ItemUid(NamedTuple):
    """Name of one exchange item: a fragment of the block ``(origin, epoch, sequence)``."""

    origin: int
    sequence: int
    part: int
    epoch: int = 0

    def __str__(self) -> str:
        part = f".{self.part}" if self.part else ""
        return f"{_origin(self.origin, self.epoch)}-{self.sequence}{part}"


class StatusUid(NamedTuple):
    """Name of one status: when its origin said what of which instance; ``subject, attribute`` are of its first fact."""

    origin: int
    time_s: float
    subject: int
    attribute: int

    def __str__(self) -> str:
        return f"{self.origin}@{self.time_s:.15g}:{self.subject}.{self.attribute}"


def _origin(origin: int, epoch: int) -> str:
    return f"{origin}.e{epoch}" if epoch else str(origin)


def name_of(block: Block) -> str:
    """Name of a block in tables; the items that it is sent in have the number of their part behind it.

    >>> [name_of(Block(2, sequence, 1.5, (PropertyValue(7, 3, True),))) for sequence in (17, STATUS, STATUS - 1)]
    ['2-17', '2@1.5:7.3', '2-p1']
    """
    if block.is_item:
        return str(ItemUid(block.origin, block.sequence, 0, block.epoch))
    if block.is_status:
        return str(StatusUid(block.origin, block.time_s, block.facts[0].subject, block.facts[0].attribute))
    return f"{_origin(block.origin, block.epoch)}-p{STATUS - block.sequence}"


def guid_of(name: str) -> Guid:
    """Origin, epoch and sequence of the block that a name in tables is of; all statuses of an origin have the same.

    >>> [guid_of(name) for name in ("2-17.1", "2.e3-17", "2@1.5:7.3", "2-p1")]
    [(2, 0, 17), (2, 3, 17), (2, 0, -1), (2, 0, -2)]
    """
    if "@" in name:
        return int(name.partition("@")[0]), 0, STATUS
    whose, _, which = name.partition("-")
    origin, _, epoch = whose.partition(".e")
    sequence = STATUS - int(which[1:]) if which.startswith("p") else int(which.partition(".")[0])
    return int(origin), int(epoch or 0), sequence


@dataclass(frozen=True, slots=True)
class Fragment:
    """Part ``index`` of ``count`` of a block; a block that fits one packet has ``count == 1``, as every status has."""

    origin: int
    sequence: int
    time_s: float
    facts: tuple[PropertyValue, ...]
    index: int = 0
    count: int = 1
    epoch: int = 0
    uid: ItemUid = field(init=False, repr=False, compare=False)
    """Name of the exchange item that it is, unless it is a status."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "uid", ItemUid(self.origin, self.sequence, self.index, self.epoch))

    @property
    def is_status(self) -> bool:
        """True for a status: it is said once, and nobody acknowledges it."""
        return self.sequence == STATUS

    @property
    def status_uid(self) -> StatusUid:
        """Name of the status that it is."""
        return StatusUid(self.origin, self.time_s, self.facts[0].subject, self.facts[0].attribute)

    @property
    def block(self) -> Block:
        """The block that it is by itself, if it is no part of a larger one."""
        return Block(self.origin, self.sequence, self.time_s, self.facts, self.epoch)


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
    node j (see ``exchange.ack``). ``acknowledgement`` bits that a policy does not send are zero. ``epoch`` is the
    sender's own, which grows when it has lost its counters.
    """

    sender: int
    rows: tuple[int, ...]
    fragments: tuple[Fragment, ...]
    signals: tuple[InfluenceSignal, ...] = ()
    epoch: int = 0
