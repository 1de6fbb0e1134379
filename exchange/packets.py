"""Messages of the exchange.

A packet carries acknowledgement bits, fragments of blocks (observations and organisational facts alike), and influence
signals. Blocks are delimited and acknowledged; influence signals are ephemeral bytes in the remaining capacity.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum
from functools import lru_cache
from typing import NamedTuple

from exchange.errors import ConfigurationError
from worldmodel import STATUS, Block, PropertyValue
from worldmodel.facts import MOST_ITEMS, Guid

MASK_BITS = 8
"""Sequences in the mask of a summary."""
FULL_MASK = (1 << MASK_BITS) - 1
MAX_FRAGMENTS = 16
"""Fragments of one block at most."""
Life = tuple[int, int]
"""An origin and its epoch."""


class Met(Enum):
    """State of a sender as its packet shows: present, returned or restarted."""

    USUAL = "usual"
    BACK = "back"
    NEW_LIFE = "new life"


class ItemUid(NamedTuple):
    """Name of an exchange item: a fragment of the block ``(origin, epoch, sequence)``."""

    origin: int
    sequence: int
    part: int
    epoch: int = 0

    def __str__(self) -> str:
        return _item_name(*self)


class StatusUid(NamedTuple):
    """Name of a status: origin, time, and subject and attribute of its first fact."""

    origin: int
    time_s: float
    subject: int
    attribute: int

    def __str__(self) -> str:
        return f"{self.origin}@{self.time_s:.15g}:{self.subject}.{self.attribute}"


def _origin(origin: int, epoch: int) -> str:
    return f"{origin}.e{epoch}" if epoch else str(origin)


@lru_cache(maxsize=4096)  # 0.9 % of a mission: tables name an item again and again
def _item_name(origin: int, sequence: int, part: int, epoch: int) -> str:
    return f"{_origin(origin, epoch)}-{sequence}" + (f".{part}" if part else "")


def name_of(block: Block) -> str:
    """Return the name of a block in tables; its items append the number of their part.

    >>> [name_of(Block(2, sequence, 1.5, (PropertyValue(7, 3, True),))) for sequence in (17, STATUS, STATUS - 1)]
    ['2-17', '2@1.5:7.3', '2-p1']
    """
    if block.sequence >= 0:
        return str(ItemUid(block.origin, block.sequence, 0, block.epoch))
    if block.sequence == STATUS:
        subject, attribute, *_ = block.facts[0]
        return str(StatusUid(block.origin, block.time_s, subject, attribute))
    return f"{_origin(block.origin, block.epoch)}-p{STATUS - block.sequence}"


def guid_of(name: str) -> Guid:
    """Parse a name in tables into origin, epoch and sequence; statuses of an origin share one.

    >>> [guid_of(name) for name in ("2-17.1", "2.e3-17", "2@1.5:7.3", "2-p1")]
    [(2, 0, 17), (2, 3, 17), (2, 0, -1), (2, 0, -2)]
    """
    if "@" in name:
        return int(name.partition("@")[0]), 0, STATUS
    life, _, which = name.partition("-")
    origin, _, epoch = life.partition(".e")
    sequence = STATUS - int(which[1:]) if which.startswith("p") else int(which.partition(".")[0])
    return int(origin), int(epoch or 0), sequence


class Fragment(NamedTuple):
    """Part ``index`` of ``count`` of a block; ``count`` is 1 for a whole block and every status."""

    origin: int
    sequence: int
    time_s: float
    facts: tuple[PropertyValue, ...]
    index: int = 0  # type: ignore[assignment]  # a tuple has methods of these names
    count: int = 1  # type: ignore[assignment]
    epoch: int = 0

    @property
    def uid(self) -> ItemUid:
        """Name as an exchange item; meaningless for a status."""
        return ItemUid(self.origin, self.sequence, self.index, self.epoch)

    @property
    def guid(self) -> Guid:
        """Name of its block."""
        return self.origin, self.epoch, self.sequence

    @property
    def block(self) -> Block:
        """Its block, valid if ``count`` is 1."""
        return Block(self.origin, self.sequence, self.time_s, self.facts, self.epoch)


def fragments_of(block: Block, capacity_bits: int, size_bits: Callable[[Fragment], int]) -> tuple[Fragment, ...]:
    """Split ``block`` into the fewest fragments of at most ``capacity_bits`` each, in order.

    Raises ConfigurationError if a single fact is larger than a packet, or ``MAX_FRAGMENTS`` are too few.
    """

    whole = Fragment(block.origin, block.sequence, block.time_s, block.facts, 0, 1, block.epoch)
    if size_bits(whole) <= capacity_bits:
        return (whole,)
    parts: list[tuple[PropertyValue, ...]] = []
    part: tuple[PropertyValue, ...] = ()
    for fact in block.facts:
        # Index and count have fixed widths, so that any values give the size.
        if part and size_bits(whole._replace(facts=(*part, fact), count=2)) > capacity_bits:
            parts.append(part)
            part = ()
        part = (*part, fact)
        if (n_bits := size_bits(whole._replace(facts=part, count=2))) > capacity_bits:
            raise ConfigurationError(
                f"one fact needs {n_bits} bits, a packet has room for {capacity_bits}: "
                "take a modem with a larger payload"
            )
    parts.append(part)
    if len(parts) > MAX_FRAGMENTS:
        raise ConfigurationError(
            f"a block of {len(block.facts)} facts needs {len(parts)} fragments, {MAX_FRAGMENTS} are allowed"
        )
    return tuple(whole._replace(facts=facts, index=i, count=len(parts)) for i, facts in enumerate(parts))


def joined_block(parts: Sequence[Fragment]) -> Block:
    """Join all parts of a block, in order."""
    return parts[0].block._replace(facts=tuple(fact for part in parts for fact in part.facts))


class Named(NamedTuple):
    """Item with its names; ``block`` is its block, if the item is all of it."""

    fragment: Fragment
    uid: ItemUid
    guid: Guid
    block: Block | None


def name_of_item(fragment: Fragment) -> Named:
    """Return an item with its names."""
    origin, sequence, time_s, facts, index, count, epoch = fragment
    block = Block(origin, sequence, time_s, facts, epoch) if count == 1 else None
    return Named(fragment, ItemUid(origin, sequence, index, epoch), (origin, epoch, sequence), block)


class InfluenceSignal(NamedTuple):
    """Personal satisfaction of the sender in one role, -128..127 (REMORAS, section V.A).

    ``role`` is the instance uid of a role, which exists in one group only. The emitter is the sender of the packet, the
    target is the whole group.
    """

    role: int
    value: int


class Summary(NamedTuple):
    """Received set about one origin and epoch.

    Attributes:
        highest: all items up to this number are held; -1 for none; ``MOST_ITEMS`` for an alarm of a duplicate node id.
        mask: bit k is set if the item ``highest + 2 + k`` is held; the one behind ``highest`` is not.

    >>> one = Summary(0, 0, highest=4, mask=0b101)
    >>> bin(one.held), bin(one.lacked)
    ('0b101011111', '0b11111010100000')
    """

    origin: int
    epoch: int
    highest: int
    mask: int

    def beyond(self, sequence: int) -> bool:
        """True if it covers an item of this number or higher."""
        return self.highest >= sequence or bool(self.mask >> max(0, sequence - self.highest - 2))

    @property
    def is_alarm(self) -> bool:
        """True for an alarm of a duplicate node id."""
        return self.highest >= MOST_ITEMS

    @property
    def held(self) -> int:
        """Received set, one bit for each sequence; not of an alarm."""
        return (1 << self.highest + 1) - 1 | self.mask << self.highest + 2

    @property
    def lacked(self) -> int:
        """Items not held, of those that the summary covers, one bit for each sequence; not of an alarm."""
        return ((self.mask ^ FULL_MASK) << 1 | 1) << self.highest + 1


class OriginStatement(NamedTuple):
    """Statement of the sender's received set about one origin: all items below ``first`` are held.

    Bit k of ``mask`` is set if ``first + k`` is held, for k below ``length``. ``is_known_to_all``: all nodes are known
    to hold the items below ``first``.
    """

    origin: int
    epoch: int
    first: int
    length: int
    mask: int
    is_known_to_all: bool

    @property
    def life(self) -> tuple[int, int]:
        """Origin and epoch."""
        return self.origin, self.epoch

    @property
    def listed(self) -> int:
        """Sequences (bit set) that the mask reports as held."""
        return self.mask << self.first

    @property
    def held(self) -> int:
        """Received set, one bit for each sequence."""
        return self.listed | (1 << self.first) - 1


class HolderSet(NamedTuple):
    """Nodes known to hold a block (bit mask ``holders``), the sender included."""

    origin: int
    epoch: int
    sequence: int
    holders: int


class Account(NamedTuple):
    """Holdings section of a packet; ``symbols`` combine reported blocks not in the packet."""

    statements: tuple[OriginStatement, ...] = ()
    holder_sets: tuple[HolderSet, ...] = ()
    symbols: tuple[bytes, ...] = ()


NO_ACCOUNT = Account()
"""Empty holdings section."""


class Head(NamedTuple):
    """Head of a packet, which names its slot; epoch and frame modulo 4 as read from the wire."""

    sender: int
    epoch: int
    frame: int


class Packet(NamedTuple):
    """Content of a packet.

    ``acks`` has the receivers of the packets of the last two frames, see ``exchange.policy.acknowledgement.PacketLog``;
    bits that a policy does not send are zero. ``epoch`` is the sender's, ``frame`` its TDMA frame. ``summary`` has its
    received sets about some origins, ``account`` its holdings section.
    """

    sender: int
    acks: int
    fragments: tuple[Fragment, ...]
    signals: tuple[InfluenceSignal, ...] = ()
    epoch: int = 0
    frame: int = 0
    summary: tuple[Summary, ...] = ()
    account: Account = NO_ACCOUNT


class DecodedPacket(NamedTuple):
    """Packet with the checks that all receivers share.

    Attributes:
        latest_s: time of its newest observation.
        concerns: origins (bit mask) of its items and reports; all nodes for an alarm.
        relays: True if it has items or statuses of other origins.
        items: named items and statuses in order; empty if it has no item.
        own: nodes (bit mask) whose last packets its sender acknowledges; ``heard``: any node acknowledges.
        lives: origins and epochs of its items.
    """

    packet: Packet
    latest_s: float
    concerns: int
    relays: bool
    statuses: tuple[Block, ...]
    items: tuple[Named | Block, ...]
    own: int
    heard: int
    lives: frozenset[tuple[int, int]]


class Transmission(NamedTuple):
    """Packet sent in one slot, with its composition.

    ``items`` repeat until acknowledged, ``status`` are sent once. ``fragments`` has (attribute of the first fact,
    size_bits) of both; ``size_bits`` minus these, ``signals_bits`` and ``summary_bits`` is the header. ``noticed`` has
    (node, event) of peers as the slot opened.
    """

    slot: int
    data: bytes
    size_bits: int
    items: tuple[ItemUid, ...]
    n_acks: int
    fragments: tuple[tuple[int, int], ...] = ()
    signals_bits: int = 0
    status: tuple[StatusUid, ...] = ()
    signals: tuple[InfluenceSignal, ...] = ()
    summary: tuple[Summary, ...] = ()
    summary_bits: int = 0
    noticed: tuple[tuple[int, str], ...] = ()


class Reception(NamedTuple):
    """Effects of one received packet.

    Attributes:
        blocks: whole and new, or contradicting a known block of that name; ready to be merged.
        beliefs: new (peer, item) pairs.
        settled: items now believed to be delivered to all interested nodes.
        aside: filtered out, no local need; not among ``items``.
        fault: reason of refusal; None for an accepted packet.
        is_stranger: True if the sender became incompatible by it.
        conflict: duplicate node id on its first evidence.
        told: (node, earliest time of transmission) of nodes received by others only.
    """

    slot: int
    sender: int
    blocks: tuple[Block, ...] = ()
    signals: tuple[InfluenceSignal, ...] = ()
    items: tuple[ItemUid, ...] = ()
    beliefs: tuple[tuple[int, ItemUid], ...] = ()
    settled: tuple[ItemUid, ...] = ()
    aside: tuple[Fragment, ...] = ()
    fault: str | None = None
    is_stranger: bool = False
    met: Met = Met.USUAL
    conflict: int | None = None
    told: tuple[tuple[int, float], ...] = ()
