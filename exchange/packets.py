"""The messages of the exchange: what a vehicle says in its slot.

A packet carries four things: acknowledgement bits, fragments of blocks (observations and
organisational facts alike; the world model does not tell them apart), and influence signals.
Blocks are delimited and acknowledged; influence signals are ephemeral bytes in the room that is left.
"""

from __future__ import annotations

from enum import Enum
from functools import cache, lru_cache
from typing import NamedTuple

from exchange.ack import Acknowledged
from worldmodel import STATUS, Block, PropertyValue
from worldmodel.facts import Guid

_new = tuple.__new__  # makes a named tuple of a tuple, in half the time
MASK_BITS = 8
"""Sequences that the mask of a summary tells of."""


class Met(Enum):
    """What a packet shows of its sender: it was there, it was away, or it has begun anew."""

    USUAL = "usual"
    BACK = "back"
    NEW_LIFE = "new life"


class ItemUid(NamedTuple):
    """Name of one exchange item: a fragment of the block ``(origin, epoch, sequence)``."""

    origin: int
    sequence: int
    part: int
    epoch: int = 0

    def __str__(self) -> str:
        return _item_name(*self)


class StatusUid(NamedTuple):
    """Name of one status: when its origin said what of which instance; ``subject, attribute`` are of its first fact."""

    origin: int
    time_s: float
    subject: int
    attribute: int

    def __str__(self) -> str:
        return f"{self.origin}@{self.time_s:.15g}:{self.subject}.{self.attribute}"


@cache
def _origin(origin: int, epoch: int) -> str:
    return f"{origin}.e{epoch}" if epoch else str(origin)


@lru_cache(maxsize=4096)  # tables name an item again and again
def _item_name(origin: int, sequence: int, part: int, epoch: int) -> str:
    return f"{_origin(origin, epoch)}-{sequence}" + (f".{part}" if part else "")


def name_of(block: Block) -> str:
    """Name of a block in tables; the items that it is sent in have the number of their part behind it.

    >>> [name_of(Block(2, sequence, 1.5, (PropertyValue(7, 3, True),))) for sequence in (17, STATUS, STATUS - 1)]
    ['2-17', '2@1.5:7.3', '2-p1']
    """
    if block.sequence >= 0:
        return str(ItemUid(block.origin, block.sequence, 0, block.epoch))
    if block.sequence == STATUS:
        subject, attribute, *_ = block.facts[0]
        return str(_new(StatusUid, (block.origin, block.time_s, subject, attribute)))
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


class Fragment(NamedTuple):
    """Part ``index`` of ``count`` of a block; a block that fits one packet has ``count == 1``, as every status has."""

    origin: int
    sequence: int
    time_s: float
    facts: tuple[PropertyValue, ...]
    index: int = 0  # type: ignore[assignment]  # a tuple has methods of these names
    count: int = 1  # type: ignore[assignment]
    epoch: int = 0

    @property
    def uid(self) -> ItemUid:
        """Name of the exchange item that it is, unless it is a status."""
        return _new(ItemUid, (self.origin, self.sequence, self.index, self.epoch))

    @property
    def guid(self) -> Guid:
        """Name of the block that it is a part of."""
        return self.origin, self.epoch, self.sequence

    @property
    def is_status(self) -> bool:
        """True for a status: it is said once, and nobody acknowledges it."""
        return self.sequence == STATUS

    @property
    def block(self) -> Block:
        """The block that it is by itself, if it is no part of a larger one."""
        return _new(Block, (self.origin, self.sequence, self.time_s, self.facts, self.epoch))


class Named(NamedTuple):
    """An item with its names, which all who hear it share.

    Attributes:
        fragment: itself; uid: its name as an item.
        guid: name of the block that it is a part of.
        block: that block, if it is all of it.
    """

    fragment: Fragment
    uid: ItemUid
    guid: Guid
    block: Block | None


def name_of_item(fragment: Fragment) -> Named:
    """An item, with names that are made once."""
    origin, sequence, time_s, facts, index, count, epoch = fragment
    block = _new(Block, (origin, sequence, time_s, facts, epoch)) if count == 1 else None
    return _new(Named, (fragment, _new(ItemUid, (origin, sequence, index, epoch)), (origin, epoch, sequence), block))


class InfluenceSignal(NamedTuple):
    """Personal satisfaction of the sender in one role of one group, -128..127 (REMORAS, section V.A).

    ``role`` is the instance uid of the role; a role exists in one group only, so it names the group too.
    The emitter is the sender of the packet, the target is the whole group.
    """

    role: int
    value: int


class Summary(NamedTuple):
    """What is held of one origin in one epoch.

    Attributes:
        origin: whose items; epoch: of which of its lives.
        highest: every item up to this number is held; -1 if not even the first; ``MOST_ITEMS`` for an alarm: two
            vehicles speak under the name of the origin.
        mask: bit k is set if the item ``highest + 2 + k`` is held; the one behind ``highest`` is not.

    >>> one = Summary(0, 0, highest=4, mask=0b101)
    >>> [one.holds(sequence) for sequence in (4, 5, 6, 7, 8, 13, 14)]
    [True, False, True, False, True, False, None]
    """

    origin: int
    epoch: int
    highest: int
    mask: int

    def held_from(self, first: int) -> int:
        """What is held as a word, bit k for the sequence ``first + k``."""
        return ((1 << self.highest + 1) - 1 | self.mask << self.highest + 2) >> first

    def beyond(self, sequence: int) -> bool:
        """True if it names an item of this number or a higher one."""
        return self.highest >= sequence or bool(self.mask >> max(0, sequence - self.highest - 2))

    def holds(self, sequence: int) -> bool | None:
        """True if the item is held, False if it is not; None if the summary does not say."""
        if sequence <= self.highest:
            return True
        if sequence >= self.highest + 2 + MASK_BITS:
            return None
        return sequence > self.highest + 1 and bool(self.mask >> (sequence - self.highest - 2) & 1)


class OriginStatement(NamedTuple):
    """What a packet states of its sender's holdings of one origin: all items below ``first``, and some from it on.

    Attributes:
        origin, epoch: whose items, of which of its lives.
        first: all items below it are held; of the ``length`` ones from it on bit k of ``mask`` says whether
            ``first + k`` is.
        is_known_to_all: all nodes are known to hold what is below ``first``.
    """

    origin: int
    epoch: int
    first: int
    length: int
    mask: int
    is_known_to_all: bool

    @property
    def held(self) -> int:
        """What is held, one bit for each sequence."""
        return self.mask << self.first | (1 << self.first) - 1


class HolderSet(NamedTuple):
    """Who is known to hold a block: ``holders``, one bit for each node, the sender among them."""

    origin: int
    epoch: int
    sequence: int
    holders: int


class Account(NamedTuple):
    """What a packet says of holdings, under a policy that states them; see `exchange.planning`.

    ``symbols`` are sums over the blocks that the statements say to be held and that are not in the packet themselves.
    """

    statements: tuple[OriginStatement, ...] = ()
    holder_sets: tuple[HolderSet, ...] = ()
    symbols: tuple[bytes, ...] = ()


NO_ACCOUNT = Account()
"""That of a packet which says nothing of holdings."""


class Head(NamedTuple):
    """What stands first in a packet and names its slot: who speaks, in which of its lives, in which frame modulo 4."""

    sender: int
    epoch: int
    frame: int


class Packet(NamedTuple):
    """Everything one vehicle says in one slot.

    ``rows`` holds one bit word per node: bit j of row i says that node i received the packet meant of
    node j (see ``exchange.ack``). ``acknowledgement`` bits that a policy does not send are zero. ``epoch`` is the
    sender's own, which grows whenever it begins anew; ``frame`` is the TDMA frame in which it speaks. ``summary`` says
    what it holds of some origins. ``account`` says more of holdings, where the policy states them.
    """

    sender: int
    rows: tuple[int, ...]
    fragments: tuple[Fragment, ...]
    signals: tuple[InfluenceSignal, ...] = ()
    epoch: int = 0
    frame: int = 0
    summary: tuple[Summary, ...] = ()
    account: Account = NO_ACCOUNT


class Judged(NamedTuple):
    """A packet, and what all who hear it have to know of it.

    Attributes:
        packet: itself.
        wrong: what value in it nobody can have recorded; None if there is none.
        latest_s: when the newest of its facts was observed.
        concerns: nodes, one bit each, of whose items or holdings it tells; all nodes if it has an alarm.
        relays: True if it tells items or statuses that are not its sender's own.
        statuses: its statuses, as blocks.
        items: its items and statuses, in their order, with the names of items; none if it tells no item.
        heard: nodes, one bit each, whose packets its sender, or one whose word it passes on, has heard lately.
        facts: what its acknowledgements state of the slots before it.
    """

    packet: Packet
    wrong: str | None
    latest_s: float
    concerns: int
    relays: bool
    statuses: tuple[Block, ...]
    items: tuple[Named | Block, ...]
    heard: int
    facts: tuple[Acknowledged, ...]


class Transmission(NamedTuple):
    """What a vehicle says in one slot, and what it decided in doing so.

    ``items`` are repeated until they are acknowledged, ``status`` are said this once. ``fragments`` has (attribute of
    the first fact, size_bits) of each of both; the rest of ``size_bits`` beside ``signals_bits`` and ``summary_bits``
    is the header. ``noticed`` has what was noticed of peers as the slot opened: node and event.
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
    """What one packet brought.

    ``blocks`` are whole and new to this vehicle, or contradict what it has under the same name, ready to be merged;
    ``signals`` are the influence signals of ``sender``; ``beliefs`` lists (peer, item) pairs that are believed from
    now on; ``settled`` lists items that all interested peers are now believed to hold; ``aside`` are those whose
    block this vehicle has no need of, which are not among ``items``; ``fault`` tells why a packet was refused, else
    None; ``is_stranger`` if that makes its sender one of another definition; ``met`` says whether the sender was away
    or has begun anew; ``conflict`` names a node under whose name two vehicles speak, when it is first noticed;
    ``told`` says of nodes that were not heard themselves when, at the earliest, they spoke: others have heard them, or
    pass on what they told.
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
