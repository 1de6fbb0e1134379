"""Information needs as one node believes them: items to send, and received blocks to keep.

Needs may change, for instance with group membership. An item is evaluated on arrival and again whenever needs change:
one that was delivered is reopened for a peer that needs it now, and one that no peer lacks is closed. Peers believed to
hold an item cause no repeats.

A selective node does not relay what it does not need, and filters it out on reception. Other nodes count it as a holder
of filtered blocks; it takes them from there if it needs them later.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from exchange.manager.beliefs import ADDRESSED_SHARE, Beliefs, Sendable
from exchange.packets import Fragment, ItemUid
from exchange.policy.acknowledgement import members
from exchange.policy.candidates import Expired, Expiry, item_candidate
from exchange.policy.queue import Queue
from worldmodel import NOBODY, TYPE_UID, Block, Needs, PropertyValue, Stated, ValueKind, Wanted, WorldModel


@dataclass(frozen=True, slots=True)
class Renewal:
    """Effect of changed needs on one vehicle.

    ``blocks`` were filtered out before and are needed now, ``items`` completed them; ``settled`` items are delivered to
    all interested nodes now; no node needs the queued items ``unneeded`` any more.
    """

    blocks: tuple[Block, ...] = ()
    items: tuple[ItemUid, ...] = ()
    settled: tuple[ItemUid, ...] = ()
    unneeded: tuple[Expiry, ...] = ()


class Interests:
    """Information needs of all nodes, applied to the items of one.

    ``selective``: this node neither keeps nor relays what it does not need. ``size_bits`` is approximate.
    """

    def __init__(
        self,
        model: WorldModel,
        needs: Needs,
        beliefs: Beliefs,
        queue: Queue,
        size_bits: Callable[[Fragment], int],
        selective: bool,
    ) -> None:
        self._me = beliefs.me
        self._model = model
        self._needs = needs
        self._beliefs = beliefs
        self._others = (1 << beliefs.n_nodes) - 1 & ~(1 << beliefs.me)
        self._queue = queue
        self._size_bits = size_bits
        self._selective = selective
        self._sendable = 0  # items (set) that this node may send
        self._addressed: set[int] = set()  # columns of items lacked by an addressed peer
        self._aside: list[tuple[Block, ItemUid]] = []  # blocks filtered out, with the items that completed them
        self.undecided: dict[int, None] = {}
        """Columns of items about instances of unknown class."""
        self._wanted: dict[tuple[int, int], Wanted] = {}  # by instance and attribute, until needs change

    def of(self, facts: tuple[PropertyValue, ...]) -> Wanted:
        """Return the need for any of the facts."""
        needed = NOBODY
        for fact in facts:
            wanted = self._wanted.get((fact.subject, fact.attribute)) or self._ask(fact, facts)
            needed = wanted if needed is NOBODY else needed.merged(wanted)
        return needed

    def is_of_use(self, facts: Iterable[Stated]) -> bool:
        """True if these facts have an attribute that is exchanged, regardless of present needs."""
        return self.of(tuple([PropertyValue(*fact) for fact in facts])).priority > 0

    def _ask(self, fact: PropertyValue, block: tuple[PropertyValue, ...]) -> Wanted:
        """Return the need of a fact; cache it until needs change if it is independent of the value."""
        wanted = self._needs.wanted(fact, self._class_of(fact, block))
        is_common = 0 <= fact.subject < len(self._model.common_instances)
        if is_common and self._model.tbox.attributes[fact.attribute].kind not in (ValueKind.LINK, ValueKind.TYPE):
            self._wanted[fact.subject, fact.attribute] = wanted
        return wanted

    def _class_of(self, fact: PropertyValue, block: tuple[PropertyValue, ...]) -> int:
        instance = self._model.instance(fact.subject)
        if instance is not None:
            return instance.class_uid
        # announced by the same block
        return next((f.target for f in block if f.subject == fact.subject and f.attribute == TYPE_UID), 0)

    def priority_here(self, column: int) -> int:
        """Priority of an item that this node needs; 0 if only others need it."""
        needed = self.of(self._beliefs.entry(column).about)
        return needed.priority if needed.peers >> self._me & 1 else 0

    # Sending -------------------------------------------------------------------------------------

    def take(self, column: int, now_s: float) -> None:
        """Add a new item that this node may send."""
        self._sendable |= 1 << column
        entry = self._beliefs.entry(column)
        if self._judge(column, entry):
            self._send(column, entry, now_s)

    def take_status(self, block: Block) -> None:
        """Queue the newest value of a status in place of the older one; drop it if no node needs it."""
        facts = block.facts
        nodes, priority, terms = self.of(facts)
        if nodes & ~(1 << self._me):
            fragment = Fragment(block.origin, block.sequence, block.time_s, facts, 0, 1, block.epoch)
            self._queue.take_status(fragment, priority, self._size_bits(fragment), terms)
        else:
            self._queue.drop_status((facts[0].subject, facts[0].attribute), block.time_s)

    def decide(self, now_s: float) -> None:
        """Evaluate again the items about instances of unknown class."""
        # ``_judge`` records again the items that remain undecided.
        undecided, self.undecided = self.undecided, {}
        for column in undecided:
            self._take_up(column, now_s)

    def adopt(self, columns: Iterable[int], now_s: float) -> None:
        """Start sending these items, where some node lacks them."""
        for column in columns:
            if not self._sendable >> column & 1:
                self._sendable |= 1 << column
                self._take_up(column, now_s)

    def _take_up(self, column: int, now_s: float) -> None:
        entry = self._beliefs.entry(column)
        if self._judge(column, entry) and self._beliefs.lacked(1 << column & ~self._queue.open):
            self._send(column, entry, now_s)

    def settle(self, now_s: float) -> tuple[ItemUid, ...]:
        """Close items that all present interested nodes are believed to hold; return their names."""
        beliefs, is_open = self._beliefs, self._queue.open
        settled = members(is_open & ~beliefs.lacked(is_open)) if is_open else []
        for column in settled:
            self._queue.drop(column)
            self._addressed.discard(column)
        for column in [*self._addressed]:
            if beliefs.ease(column):
                self._addressed.discard(column)
                entry = beliefs.entry(column)
                self._queue.revalue(column, entry.priority, self.of(entry.about).terms, now_s)
        return tuple(sorted([beliefs.uids[column] for column in settled])) if settled else ()

    def renew(self, now_s: float) -> Renewal:
        """Evaluate all items again after a change of needs."""
        self._wanted.clear()
        before = self._queue.open
        settled: list[ItemUid] = []
        unneeded: list[Expiry] = []
        for column in members(self._sendable):
            entry, was_open = self._beliefs.entry(column), bool(before >> column & 1)
            spared, is_needed = entry.spared, self._judge(column, entry)
            if is_needed and self._beliefs.lacked(1 << column):
                if not was_open:
                    entry.is_eased = False
                    self._send(column, entry, now_s, bool(spared & ~entry.spared))
                    continue
                if entry.is_eased:
                    entry.priority = max(1, entry.priority // ADDRESSED_SHARE)
                self._queue.revalue(column, entry.priority, self.of(entry.about).terms, now_s)
            elif was_open:
                self._queue.drop(column)
                self._addressed.discard(column)
                if is_needed:
                    settled.append(self._beliefs.uids[column])
                else:
                    unneeded.append(Expiry(entry.fragment.uid, Expired.NOT_NEEDED, now_s - entry.fragment.time_s))
        taken = [kept for kept in self._aside if self.of(kept[0].facts).peers >> self._me & 1]
        self._aside = [kept for kept in self._aside if kept not in taken]
        blocks, items = tuple([block for block, _ in taken]), tuple([uid for _, uid in taken])
        return Renewal(blocks, items, tuple(settled), tuple(unneeded))

    def reopen(self, now_s: float) -> None:
        """Reopen delivered items that a peer lacks now, because it lost them or returned."""
        for column in members(self._beliefs.lacked(self._sendable & ~self._queue.open)):
            self._send(column, self._beliefs.entry(column), now_s)

    def postponed(self) -> Iterator[tuple[int, ItemUid]]:
        """Yield absent peers and the items that each will receive on its return."""
        beliefs = self._beliefs
        for node in members(beliefs.peers.away):
            for column in members(self._sendable & ~(beliefs.held[node] | beliefs.spared[node])):
                yield node, beliefs.uids[column]

    def _send(self, column: int, entry: Sendable, now_s: float, is_new_need: bool = False) -> None:
        fragment = entry.fragment
        if entry.candidate is None:
            size_bits = self._size_bits(fragment)
            entry.candidate = item_candidate(column, fragment, size_bits, entry.priority, now_s)
        entry.candidate.priority = entry.priority
        if entry.addressed:
            self._addressed.add(column)
        self._queue.take(entry.candidate, self.of(entry.about).terms, now_s, is_new_need)

    def _judge(self, column: int, entry: Sendable) -> bool:
        """Update priority and needs of an item; return True if another node is to receive it."""
        nodes, entry.priority, _ = self.of(entry.about)
        # A part goes to all nodes that need its block, with the priority of its own facts.
        if entry.fragment.facts is not entry.about:
            entry.priority = self.of(entry.fragment.facts).priority or entry.priority
        mine = nodes >> self._me & 1 or entry.fragment.origin == self._me
        is_needed = entry.priority > 0 and (mine or not self._selective)
        nodes = (nodes | entry.addressed) & self._others if is_needed else 0
        if not nodes and any(self._class_of(fact, entry.about) == 0 for fact in entry.about):
            self.undecided[column] = None
        if entry.spared != self._others & ~nodes:
            self._beliefs.spare(column, entry, self._others & ~nodes)
        return bool(nodes)

    # Filtering -----------------------------------------------------------------------------------

    def keeps(self, block: Block, completed_by: ItemUid) -> bool:
        """Return True if this node needs a received block; else filter it out."""
        if not self._selective or self.of(block.facts).peers >> self._me & 1:
            return True
        self._aside.append((block, completed_by))
        return False
