"""Items known to one vehicle, per item the nodes believed to hold it, and summaries of the items held.

An item is a *column*, an index that is never reused; packets name it by `ItemUid`. A set of items is an integer with
bit c for column c. Acknowledgements add items to those that a node is believed to hold (see
`exchange.policy.acknowledgement.PacketLog`); a restarted peer or a duplicate node id removes them.

Items of an origin and epoch are numbered without gaps. A *summary* of the received set has the highest number below
the first gap, and a mask of the few items behind it. Only whole blocks count. A receiver believes exactly the content:
the sender holds the named items and lacks the others within the mask; beliefs about later items stay. Reports of peers
(summaries, and those of `exchange.manager.holdings`) are stored by number, so that they also apply to items received
later.

A summary above the largest possible number is an alarm: two vehicles share that node id, and their items cannot be
summarised.

All summaries are sent, packet by packet, after this vehicle restarts, or receives a peer that restarted or was absent.
Otherwise spare capacity carries one summary with changes since its last transmission.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from exchange.manager.peers import PeerStates
from exchange.packets import FULL_MASK, Fragment, ItemUid, Life, Named, Summary, joined_block
from exchange.policy.acknowledgement import Acknowledgement, PacketLog, members
from exchange.policy.candidates import Candidate
from worldmodel import Block, PropertyValue
from worldmodel.facts import MOST_ITEMS, Guid

Encode = Callable[[Summary], tuple[int, int]]
"""Encoding of a summary: its bits, as a number, and their count."""
MOST_AHEAD = 1 << 12
"""Blocks beyond the known ones of an origin that reports may name; bounds the memory that a corrupt report takes."""
ADDRESSED_SHARE = 10
"""Divisor of an item's priority once all nodes it is addressed to hold it."""


@dataclass(slots=True)
class Sendable:
    """Item that this node may send.

    ``about`` are the facts that decide which nodes need it: those of the whole block, if known. ``addressed`` are peers
    (bit mask) beside those that need it, ``spared`` those without need; ``is_eased``: the former hold it, which lowers
    its priority.
    """

    fragment: Fragment
    about: tuple[PropertyValue, ...]
    priority: int = 0
    addressed: int = 0
    spared: int = 0
    is_eased: bool = False
    candidate: Candidate | None = None


class Beliefs:
    """Items, holders and peers, as one vehicle knows them."""

    def __init__(self, me: int, n_nodes: int, kind: Acknowledgement, encode: Encode, epoch: int = 0) -> None:
        self.me, self.n_nodes = me, n_nodes
        self.log = PacketLog(kind, me, n_nodes)
        """Packets of the last two frames."""
        self.peers = PeerStates(me, n_nodes, kind)
        """Incarnations and links of the other nodes."""
        self.column_of: dict[ItemUid, int] = {}
        """Column of each item that this node ever held."""
        self.fragments: list[Fragment] = []
        """Item by column."""
        self.uids: list[ItemUid] = []
        """Name by column."""
        self.held = [0] * n_nodes
        """Items (set) that a node is believed to hold, by node, this one included."""
        self.news: defaultdict[int, int] = defaultdict(int)
        """Items (set) by node that it is believed to hold since the present packet."""
        self.spared = [0] * n_nodes
        """Sendable items (set) that a node does not need, by node."""
        self.sendable: dict[int, Sendable] = {}
        """Details of sendable items by column."""
        self.origins = [0] * n_nodes
        """Item set by origin, recorded in its present incarnation."""
        self.ends: dict[Life, int] = {}
        """Highest known sequence plus 1, by origin and epoch."""
        self.parts: dict[Guid, int] = {}
        """Known items (set) of each block."""
        self.blocks: dict[Life, int] = {}
        """Received set of this vehicle: whole blocks (bit set of sequences) by origin and epoch."""
        self.discarded: dict[Life, set[int]] = {}
        """Blocks discarded for lack of their dependencies, until they are received again."""
        self.shared: set[Life] = set()
        """Incarnations with a duplicate node id."""
        # By incarnation and peer: blocks (set of numbers) that the peer reported as held.
        self._reported: defaultdict[Life, list[int]] = defaultdict(lambda: [0] * n_nodes)
        self.summaries = Summaries(self, encode)
        """Summaries that this vehicle sends."""
        if epoch:
            self.begin(me, epoch)

    # Items ---------------------------------------------------------------------------------------

    def fragment(self, uid: ItemUid) -> Fragment | None:
        """Return an item; None if this node never held it."""
        column = self.column_of.get(uid)
        return None if column is None else self.fragments[column]

    def entry(self, column: int) -> Sendable:
        """Return the details of a sendable item."""
        entry = self.sendable.get(column)
        if entry is None:
            fragment = self.fragments[column]
            entry = self.sendable[column] = Sendable(fragment, fragment.facts)
        return entry

    def add(self, item: Named, entry: Sendable | None = None) -> int:
        """Add a new item; return its column."""
        column, (fragment, uid, guid, _) = len(self.fragments), item
        origin, epoch, sequence = guid
        parts = self.parts.get(guid, 0)
        if not parts or self._count(parts) == fragment.count:  # else of another block of that name
            self.parts[guid] = parts | 1 << column
        self.column_of[uid] = column
        self.uids.append(uid)
        self.fragments.append(fragment)
        self.believe(self.me, 1 << column)
        if entry is not None:
            self.sendable[column] = entry
        self.ends[origin, epoch] = max(self.ends.get((origin, epoch), 0), sequence + 1)
        if epoch == self.peers.epochs[origin]:
            self.origins[origin] |= 1 << column
        for peer, numbers in enumerate(self._reported[origin, epoch]):
            if numbers >> sequence & 1:
                self.believe(peer, 1 << column)
        return column

    def is_whole(self, guid: Guid) -> bool:
        """True if every part of a block is known."""
        parts = self.parts.get(guid, 0)
        return parts.bit_count() == self._count(parts)

    def _count(self, parts: int) -> int:
        """Number of parts of the block to which these items (set) belong; -1 for none."""
        return self.fragments[parts.bit_length() - 1].count if parts else -1

    def half_blocks(self) -> list[Guid]:
        """Return the blocks with some parts known, others not."""
        return [guid for guid in self.parts if not self.is_whole(guid)]

    def block(self, guid: Guid) -> Block:
        """Join a block from its parts, all of which are known."""
        fragments = [self.fragments[column] for column in members(self.parts[guid])]
        return joined_block(sorted(fragments, key=lambda fragment: fragment.index))

    # Holders -------------------------------------------------------------------------------------

    def spare(self, column: int, entry: Sendable, nodes: int) -> None:
        """Set the peers (bit mask) without need of a sendable item."""
        for node in members(entry.spared ^ nodes):
            self.spared[node] ^= 1 << column
        entry.spared = nodes

    def items(self, life: Life, numbers: int) -> int:
        """Return the items (set) of the known blocks of an incarnation with these numbers (bit set)."""
        items = 0
        for number in members(numbers & (1 << self.ends.get(life, 0)) - 1):
            items |= self.parts.get((*life, number), 0)
        return items

    def believe(self, node: int, items: int) -> None:
        """Believe that a node holds these items (set)."""
        if new := items & ~self.held[node]:
            self.held[node] |= new
            self.news[node] |= new

    def report(self, peers: Iterable[int], life: Life, numbers: int) -> None:
        """Believe that peers hold these blocks (set of numbers) of an incarnation, as reported."""
        reported = self._reported[life]
        numbers &= (1 << self.ends.get(life, 0) + MOST_AHEAD) - 1
        for peer in peers:
            if new := numbers & ~reported[peer]:
                reported[peer] |= numbers
                self.believe(peer, self.items(life, new))

    def deny(self, peer: int, life: Life, numbers: int) -> int:
        """Believe that a peer lacks those of these blocks that are whole here; return the items (set) taken for held.

        Blocks received later count as lacked, too.
        """
        self._reported[life][peer] &= ~numbers
        numbers, denied = numbers & (1 << self.ends.get(life, 0)) - 1, 0
        for number in members(numbers) if numbers else ():
            items = self.parts.get((*life, number), 0)
            # A block of which the peer holds some parts is no contradiction: it reports whole blocks only.
            if items and not items & ~self.held[peer] and self.is_whole((*life, number)):
                denied |= items
        if denied:
            self.held[peer] &= ~denied
            self.news[peer] &= ~denied
        return denied

    def take(self, items: int, evidence: int | None) -> None:
        """Add holders of received items (set): their origins, and ``evidence``, the sender if carriers count as
        holders.

        5.: "Information contained within a successfully received packet is always added to the local world model".
        """
        for column in members(items):
            origin = self.uids[column].origin
            self.believe(origin, 1 << column & self.origins[origin])  # of an earlier life, its origin may have lost it
        if evidence is not None:
            self.believe(evidence, items)

    def lacked(self, items: int) -> int:
        """Return those items (set) that a present node needs, and is not believed to hold."""
        served, away = items, self.peers.away
        for node, held in enumerate(self.held):
            if not away >> node & 1:
                served &= held | self.spared[node]
        return items ^ served

    def gained(self) -> tuple[tuple[int, ItemUid], ...]:
        """Return the peers and items of ``news``, in order."""
        peers = sorted(self.news.keys() - {self.me})
        return tuple([(peer, self.uids[column]) for peer in peers for column in members(self.news[peer])])

    def ease(self, column: int) -> bool:
        """Lower the priority of an item once all addressed peers hold it; return True on the change."""
        entry = self.entry(column)
        if not entry.addressed or not all(self.held[peer] >> column & 1 for peer in members(entry.addressed)):
            return False
        entry.addressed, entry.is_eased = 0, True
        entry.priority = max(1, entry.priority // ADDRESSED_SHARE)
        return True

    def begin(self, node: int, epoch: int) -> None:
        """Start a new incarnation of a node, which holds only the items recorded in it."""
        self.peers.begin(node, epoch)
        self.forget(node)
        for reported in self._reported.values():
            reported[node] = 0
        own = [column for column, uid in enumerate(self.uids) if (uid.origin, uid.epoch) == (node, epoch)]
        self.origins[node] = sum([1 << column for column in own])
        self.held[node] |= self.origins[node]

    def forget(self, node: int) -> None:
        """Clear beliefs about the items and packets of a node."""
        self.held[node] = 0
        self.log.forget(node)

    def doubt(self, node: int, frame: int, by_alarm: bool = False) -> bool:
        """Record a duplicate node id seen in ``frame``; return True if it was unknown.

        ``by_alarm``: another node reported it; else this node sends the alarm.
        """
        is_new = self.peers.doubt(node, frame)
        # Peers may have acknowledged the packet of one vehicle for that of the other: beliefs about all are void.
        for peer in range(self.n_nodes) if is_new or node == self.me else (node,):
            if peer != self.me:
                self.forget(peer)
        if node == self.me:
            self.log.forget(node)
        life = node, self.peers.epochs[node]
        self.shared.add(life)
        self._reported.clear()
        if not by_alarm:
            self.summaries.raise_alarm(life)
        if is_new or node == self.me:
            for peer, items in enumerate(self.origins):
                if peer != node or node == self.me:
                    self.held[peer] |= items
        return is_new

    def orphans(self, life: Life | None = None, of_others: bool = False) -> list[int]:
        """Return columns of items without a sending origin (absent or restarted) that this node must send.

        Of the present holders the one with the lowest index sends; ``of_others``: include its items. ``life`` restricts
        the items to one incarnation.
        """
        sent_by_others = 0
        for node in () if of_others else members((1 << self.me) - 1 & ~self.peers.away):
            sent_by_others |= self.held[node]
        return [
            column
            for column, (origin, _, _, epoch) in enumerate(self.uids)
            if (life is None or life == (origin, epoch))
            and self.peers.is_over(origin, epoch)
            and not sent_by_others >> column & 1
        ]

    # Whole blocks --------------------------------------------------------------------------------

    def complete(self, guid: Guid) -> None:
        """Record that a block is whole."""
        origin, epoch, sequence = guid
        self.blocks[origin, epoch] = self.blocks.get((origin, epoch), 0) | 1 << sequence
        self.discarded.get((origin, epoch), set()).discard(sequence)

    def has_block(self, guid: Guid) -> bool:
        """True if a whole block is held."""
        origin, epoch, sequence = guid
        return bool(self.blocks.get((origin, epoch), 0) >> sequence & 1)

    def give_up(self, guids: Iterable[Guid]) -> None:
        """Discard blocks, so that they are reported as missing and received again."""
        for origin, epoch, sequence in guids:
            if sequence >= 0 and self.has_block((origin, epoch, sequence)):
                self.blocks[origin, epoch] ^= 1 << sequence
                self.discarded.setdefault((origin, epoch), set()).add(sequence)
                self.summaries.urge((origin, epoch))

    def given_up(self) -> Iterator[tuple[int, ItemUid]]:
        """Yield this node with the first item of each discarded block not received again."""
        for (origin, epoch), sequences in self.discarded.items():
            yield from ((self.me, ItemUid(origin, sequence, 0, epoch)) for sequence in sorted(sequences))

    def come_again(self, guid: Guid) -> Block | None:
        """Return a discarded block on the reception of one of its parts; None otherwise."""
        origin, epoch, sequence = guid
        if sequence not in self.discarded.get((origin, epoch), ()) or not self.is_whole(guid):
            return None
        self.complete(guid)
        return self.block(guid)


# Summaries ----------------------------------------------------------------------------------------


TIMES_TOLD = 2
"""Transmissions of an unchanged summary, against packet loss."""


def summary_of(life: Life, held: int) -> Summary:
    """Return the summary of an origin and epoch; ``held`` has a bit per sequence.

    >>> summary_of((2, 0), 0b1011)
    Summary(origin=2, epoch=0, highest=1, mask=1)
    """
    # ``~held & held + 1`` isolates the lowest zero bit, the first gap.
    n_first = (~held & held + 1).bit_length() - 1
    return Summary(*life, n_first - 1, held >> n_first + 1 & FULL_MASK)


class Summaries:
    """Summaries of one vehicle, as they are due."""

    def __init__(self, beliefs: Beliefs, encode: Encode) -> None:
        self._beliefs = beliefs
        self._encode = encode
        self._due: dict[Life, None] = {}
        self._told: dict[Life, tuple[Summary, int]] = {}  # last sent and how often in succession; oldest first
        self._alarms: dict[Life, None] = {}

    def raise_alarm(self, life: Life) -> None:
        """Send an alarm of a duplicate node id, whose summaries are no longer sent."""
        self._alarms[life] = None

    def urge(self, *lives: Life) -> None:
        """Make the summaries of these incarnations (default: all) due."""
        self._due |= dict.fromkeys(lives or sorted(self._beliefs.blocks))

    def urgent(self, room_bits: int) -> tuple[tuple[Summary, ...], int]:
        """Return the due summaries that fit, at least one, and their size (bits); the others stay due."""
        chosen: list[Summary] = []
        size_bits = 0
        for life in (*self._alarms, *self._due):
            is_alarm = life in self._alarms
            if life in self._beliefs.shared and not is_alarm:
                self._due.pop(life, None)
                continue
            summary = Summary(*life, MOST_ITEMS, 0) if is_alarm else summary_of(life, self._beliefs.blocks.get(life, 0))
            _, more_bits = self._encode(summary)
            if size_bits + more_bits > room_bits and chosen:
                break
            size_bits += more_bits
            self._alarms.pop(life, None)
            self._take(life, summary)
            chosen.append(summary)
        return tuple(chosen), size_bits

    def spare(self, room_bits: int) -> tuple[tuple[Summary, ...], int]:
        """Return one summary that fits and was changed, or sent less than ``TIMES_TOLD`` times, and its size (bits).

        A summary that reports a discarded block is repeated until the block arrives, in case its sender missed it.
        """
        beliefs, told = self._beliefs, self._told
        # First those never sent, then by time of transmission, as ``_take`` moves a summary to the end.
        for life in (*sorted(beliefs.blocks.keys() - told), *told):
            summary = summary_of(life, beliefs.blocks.get(life, 0))
            is_asked_for = any(summary.lacked >> sequence & 1 for sequence in beliefs.discarded.get(life, ()))
            if life in beliefs.shared or (told.get(life) == (summary, TIMES_TOLD) and not is_asked_for):
                continue
            _, size_bits = self._encode(summary)
            if size_bits <= room_bits:
                self._take(life, summary)
                return (summary,), size_bits
        return (), 0

    def _take(self, life: Life, summary: Summary) -> None:
        self._due.pop(life, None)
        before, times = self._told.pop(life, (None, 0))
        self._told[life] = summary, min(times + 1, TIMES_TOLD) if before == summary else 1
