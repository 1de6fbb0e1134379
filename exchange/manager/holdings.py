"""Holdings reports of one vehicle: its own, those of peers, and coded repairs.

The rules are in `exchange.policy.planning`; `exchange.study.stating` applies them to all nodes at once. Here items have
names, and reports cover whole blocks by their origin's numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from operator import itemgetter, mul
from typing import TYPE_CHECKING

from exchange.errors import PeerFault
from exchange.manager.beliefs import Beliefs
from exchange.packets import (
    Account,
    DecodedPacket,
    Fragment,
    HolderSet,
    ItemUid,
    Life,
    Named,
    OriginStatement,
    Packet,
    name_of_item,
)
from exchange.policy.acknowledgement import members
from exchange.policy.coding import Decoder, added, coefficient, scaled, symbol, symbol_key
from exchange.policy.planning import (
    IMPOSSIBLE,
    LEAST_LACK,
    MOST_PASSED,
    MOST_STATED,
    MOST_SYMBOL_BYTES,
    SIZE_BITS,
    PacketPlan,
    holder_set_rank,
    kept_of_lack,
    lack_after,
    plan_packet,
    reception_of,
    share_of_symbols,
)
from worldmodel.facts import Guid

if TYPE_CHECKING:
    from exchange.wire.accounts import AccountCodec
    from exchange.wire.factcodec import Bits


class HoldingsReports:
    """Statements, holder sets and symbols (if ``codes_repairs``) of one vehicle.

    ``fragment_bits`` is an upper bound of a fragment's size, ``priority_here`` the own priority of a held item by
    column; 0 if only others need it.
    """

    def __init__(
        self,
        beliefs: Beliefs,
        accounts: AccountCodec,
        fragment_bits: Callable[[Fragment], int],
        priority_here: Callable[[int], int],
        codes_repairs: bool,
    ) -> None:
        self._me, self._n_nodes = beliefs.me, beliefs.n_nodes
        self._beliefs, self._peers = beliefs, beliefs.peers
        self._accounts, self._fragment_bits, self._codes_repairs = accounts, fragment_bits, codes_repairs
        self._priority_here = priority_here
        self._confirmed = self._told = 0  # item sets
        self._reception = [reception_of(0.0, 0.0)] * self._n_nodes  # by peer, as its last answer leaves it
        self._lacks: dict[int, list[float]] = {}  # by column and peer
        self._news: dict[int, tuple[int, ItemUid, int]] = {}  # by column: rank of its holder set, name, reports since
        self._first: dict[Life, int] = {}  # number of the first block that is not settled here
        # By sender: blocks covered by the symbols of its last packet, expected share delivered by peer.
        self._coded_last: dict[int, tuple[Sequence[Guid], Sequence[float]]] = {}
        self._decoder = Decoder()
        self._bytes: dict[Guid, bytes] = {}
        self._statements: list[OriginStatement] = []  # of the packet under construction, as the next two
        self._n_symbols = self._symbols_bits = 0
        self.n_refused = 0
        """Invalid recovered blocks; each clears all undecoded symbols."""

    # Transmission --------------------------------------------------------------------------------

    def plan(self, open_items: int, room_bits: int, large_first: bool) -> tuple[int, int]:
        """Plan the packet of the own slot; return its item set and size of the holdings section.

        ``room_bits`` is the capacity for both; ``large_first``: see ``plan_packet``.
        """
        n_nodes = self._n_nodes
        statements = [self._statement(origin) for origin in range(n_nodes)]
        # Items of different origins are disjoint, so the sum is their union.
        window = sum([self._beliefs.items(statement.life, statement.listed) for statement in statements])
        candidates = open_items | (window if self._codes_repairs else 0)
        me, uids = self._me, self._beliefs.uids  # own first: with equal values, nodes choose different items
        columns = sorted(members(candidates), key=lambda column: ((uids[column].origin - me) % n_nodes, uids[column]))
        plan = self._gathered(columns, window, statements)
        self._n_symbols = plan_packet(plan, n_nodes, len(columns), room_bits, self._codes_repairs, large_first)
        chosen = sum([1 << column for number, column in enumerate(columns) if plan.takes[number]])
        self._statements = [statement for statement in statements if plan.states[statement.origin]]
        size_bits = sum([plan.statement_bits[statement.origin] for statement in self._statements])
        self._symbols_bits = 0
        if self._n_symbols:
            longest = max(map(len, self._coded(chosen).values()))
            self._symbols_bits = 8 * longest * self._n_symbols
            size_bits += SIZE_BITS + self._symbols_bits
        return chosen, size_bits

    def _statement(self, origin: int) -> OriginStatement:
        """Return the largest statement about the present incarnation of an origin."""
        life = origin, self._peers.epochs[origin]
        held = self._beliefs.blocks.get(life, 0)
        # A discarded block may lie below the cached number.
        first = 0 if self._beliefs.discarded.get(life) else self._first.get(life, 0)
        lacked = self._beliefs.lacked(self._beliefs.origins[origin])
        while held >> first & 1 and not self._beliefs.parts.get((*life, first), 0) & lacked:
            first += 1
        self._first[life] = first
        rest = held >> first
        # A statement of own items has no mask, so it ends at the first gap.
        length = rest.bit_length() if origin != self._me else (~rest & rest + 1).bit_length() - 1
        length = min(length, MOST_STATED) if life not in self._beliefs.shared else 0
        lacked = 0
        for of_node in self._beliefs.held:
            lacked |= self._beliefs.origins[origin] & ~of_node
        is_known_to_all = all(self._beliefs.uids[column].sequence >= first for column in members(lacked))
        return OriginStatement(*life, first, length, rest & (1 << length) - 1, is_known_to_all)

    def _gathered(self, columns: Sequence[int], window: int, statements: Sequence[OriginStatement]) -> PacketPlan:
        """Return the planning input for candidates; ``window`` has the items that statements report."""
        beliefs, n_nodes, me, n = self._beliefs, self._n_nodes, self._me, len(columns)
        entries, new = beliefs.sendable, beliefs.origins[me]
        most = max((entries[column].priority for column in columns), default=0) or 1
        lacks: list[float] = []
        known = [-1 if peer == me else self._spared(peer) for peer in range(n_nodes)]
        for column in columns:
            reckoned = self._lacks.get(column)
            for peer in range(n_nodes):
                if known[peer] >> column & 1:
                    lacks.append(0.0)
                    continue
                is_held = beliefs.held[peer] >> column & 1
                lacks.append(0.0 if is_held else 1.0 if reckoned is None else max(LEAST_LACK, reckoned[peer]))
                if is_held or (reckoned is not None and reckoned[peer] < 1.0):
                    new &= ~(1 << column)
        owed = [sum(map(self._priority_here, self._owed(statement))) / most for statement in statements]
        symbol_bits = [self._symbol_bits(column) if self._codes_repairs else IMPOSSIBLE for column in columns]
        away = self._peers.away | 1 << me
        return PacketPlan(
            reception=[0.0 if away >> peer & 1 else rate for peer, rate in enumerate(self._reception)],
            origin=[min(beliefs.uids[column].origin, n_nodes - 1) for column in columns],
            size_bits=[self._fragment_bits(entries[column].fragment) for column in columns],
            symbol_bits=symbol_bits,
            is_new=[new >> column & 1 for column in columns],
            is_stated=[window >> column & 1 for column in columns],
            weight=[max(1, entries[column].priority) / most for column in columns],
            lacks=lacks,
            owed=owed,
            statement_bits=[
                self._accounts.statement(statement, me)[1] if statement.length or owed[statement.origin] else IMPOSSIBLE
                for statement in statements
            ],
            gain=[0.0] * n,
            takes=[0] * n,
            states=[0] * n_nodes,
            rests=[0] * n,
            with_code=[0] * n_nodes,
            lacked=[0.0] * n_nodes,
            worth_lacked=[0.0] * n_nodes,
            begin=[0] * n_nodes,
            end=[0] * n_nodes,
        )

    def _spared(self, peer: int) -> int:
        """Return the items (set) that do not wait for a peer, which is absent or does not need them."""
        return -1 if self._peers.away >> peer & 1 else self._beliefs.spared[peer]

    def _owed(self, claim: OriginStatement) -> list[int]:
        """Return the items (columns) whose unreported acknowledgements a statement brings its origin."""
        origin = claim.origin
        if origin == self._me or self._peers.away >> origin & 1:
            return []
        # Less what the acknowledgement vector reports anyway. Items beyond the statement wait for a later one.
        unknown = self._beliefs.origins[origin] & ~self._confirmed & ~self._beliefs.log.last(origin)
        uids, held = self._beliefs.uids, claim.held
        return [column for column in members(unknown) if held >> uids[column].sequence & 1]

    def _symbol_bits(self, column: int) -> int:
        """Return the symbol size for an item's block; ``IMPOSSIBLE`` unless it is whole here."""
        guid = self._beliefs.fragments[column].guid
        if not self._beliefs.is_whole(guid):
            return IMPOSSIBLE
        size = len(self._bytes_of(guid))
        return 8 * size if size <= MOST_SYMBOL_BYTES else IMPOSSIBLE

    def _bytes_of(self, guid: Guid) -> bytes:
        data = self._bytes.get(guid)
        if data is None:
            data = self._bytes[guid] = self._accounts.block_bytes(self._beliefs.block(guid))
        return data

    def _coded(self, content: int) -> dict[tuple[int, int], bytes]:
        """Return the blocks by origin and number that the symbols of a packet cover."""
        coded: dict[tuple[int, int], bytes] = {}
        for statement in self._statements:
            for number in members(statement.listed):
                if not self._beliefs.items(statement.life, 1 << number) & content:
                    coded[statement.origin, number] = self._bytes_of((*statement.life, number))
        return coded

    def section(self, content: int, slot: int, left_bits: int) -> Bits:
        """Encode the holdings section of a packet; ``left_bits`` is its remaining capacity."""
        symbols: tuple[bytes, ...] = ()
        coded = self._coded(content) if self._n_symbols else {}
        if coded:
            size = max(map(len, coded.values()))  # larger than planned if an item did not fit and is coded now
            n_symbols = min(self._n_symbols, self._symbols_bits // (8 * size))
            symbols = tuple([symbol(coded, symbol_key(slot, place), size) for place in range(n_symbols)])
        holder_sets = tuple(self._holder_sets(slot, left_bits))
        self._note_sent(content, coded if symbols else {}, len(symbols), holder_sets)
        return self._accounts.encode(Account(tuple(self._statements), holder_sets, symbols), self._me)

    def _holder_sets(self, slot: int, left_bits: int) -> Iterator[HolderSet]:
        """Yield holder sets within the remaining capacity, in order of ``holder_set_rank``."""
        beliefs, news = self._beliefs, self._news
        for column, (_, uid, n_passed) in sorted(news.items(), key=itemgetter(1)):
            origin, sequence, _, epoch = uid
            guid = origin, epoch, sequence
            if column not in news or guid[:2] in beliefs.shared or not beliefs.is_whole(guid):
                continue
            items = beliefs.parts[guid]  # all are needed; the one with the latest news comes first
            holders = sum([1 << node for node, held in enumerate(beliefs.held) if not items & ~held])
            if holders & ~(1 << self._me):
                holder_set = HolderSet(*guid, holders)
                left_bits -= self._accounts.holder_set(holder_set, self._me)[1]
                if left_bits < 0:
                    return
                for part in members(items):
                    news.pop(part, None)
                if n_passed + 1 < MOST_PASSED:
                    news[column] = holder_set_rank(slot, slot), uid, n_passed + 1
                yield holder_set

    def _note_sent(
        self, content: int, coded: dict[tuple[int, int], bytes], n_symbols: int, holder_sets: Sequence[HolderSet]
    ) -> None:
        """Record the reported own holdings, and the expected lack of peers after the packet."""
        beliefs, reported = self._beliefs, content
        for origin in members(beliefs.log.heard):
            reported |= beliefs.log.last(origin) & beliefs.origins[origin]
        for claim in self._statements:
            reported |= self._beliefs.items(claim.life, claim.held)
        for shown in holder_sets:
            reported |= self._beliefs.items((shown.origin, shown.epoch), 1 << shown.sequence)
        self._told = reported
        over = [(origin, self._peers.epochs[origin], number) for origin, number in coded]
        self._note_brought(self._me, members(content), over, n_symbols)

    def _note_brought(self, sender: int, plain: Iterable[int], over: Sequence[Guid], n_symbols: int) -> None:
        """Update the estimated lack of peers by a packet with symbols over blocks ``over``."""
        others = [peer for peer in range(self._n_nodes) if peer not in (self._me, sender)]
        others = [peer for peer in others if not self._peers.away >> peer & 1]
        kept, shares = [1.0] * self._n_nodes, [0.0] * self._n_nodes
        for peer in others:
            kept[peer] = kept_of_lack(self._reception[peer], 1.0)
        for column in plain:
            lacks = self._lacks_of(column)
            lacks[:] = map(mul, lacks, kept)
        for peer in others if over else ():
            shares[peer] = share_of_symbols(n_symbols, self._lacked_of_code(over, peer))
            kept[peer] = kept_of_lack(self._reception[peer], shares[peer])
        for column in self._columns_held(over):
            lacks = self._lacks_of(column)
            lacks[:] = map(mul, lacks, kept)
        self._coded_last[sender] = over, shares

    def _lacks_of(self, column: int) -> list[float]:
        """Return the mutable lack probabilities of an item, by peer."""
        return self._lacks.setdefault(column, [1.0] * self._n_nodes)

    def _columns_held(self, guids: Iterable[Guid]) -> list[int]:
        held = [guid for guid in guids if self._beliefs.is_whole(guid)]
        return [column for guid in held for column in members(self._beliefs.parts[guid])]

    def _lacked_of_code(self, over: Sequence[Guid], peer: int) -> float:
        """Return the expected number of covered blocks that a peer lacks."""
        beliefs, known, lacked = self._beliefs, self._beliefs.held[peer] | self._spared(peer), 0.0
        for guid in over:
            parts = members(beliefs.parts[guid]) if beliefs.is_whole(guid) else ()
            lacked += max([0.0 if known >> part & 1 else self._lacks_of(part)[peer] for part in parts], default=1.0)
        return lacked

    # Reception -------------------------------------------------------------------------------------

    def forget(self, *peers: int) -> None:
        """Assume that these peers (default: all) lack everything, after a restart or a duplicate node id."""
        self.miss(*(peers or range(self._n_nodes)))
        self._decoder = Decoder()

    def miss(self, *peers: int) -> None:
        """Assume that these returning peers lack all that they are not known to hold."""
        self._first.clear()  # returning peers may lack blocks that all present nodes hold
        for lacks in self._lacks.values():
            for peer in peers:
                lacks[peer] = 1.0

    def hear(
        self, decoded: DecodedPacket, slot: int, is_answer: bool, answers: bool, vouched: int, now_s: float
    ) -> tuple[tuple[Named, ...], int]:
        """Apply a packet; return the decoded items, and the items (set) that its sender lacks.

        ``is_answer``: it acknowledges the own last packet, or its loss; ``answers``: the last packets of all nodes.
        ``vouched``: nodes (bit mask) for which third-party acknowledgements of the sender count.
        """
        packet, lacked, vouched = decoded.packet, 0, vouched & ~(1 << self._me)
        sender, account = packet.sender, packet.account
        if is_answer:
            self._note_fate(sender, decoded.own >> self._me & 1)
        if answers:
            for other in members(self._beliefs.log.heard & ~(1 << sender)):
                self._reckon_fate(sender, other, bool(decoded.own >> other & 1))
        for statement in account.statements:
            life = statement.life
            if life in self._beliefs.shared or statement.epoch != self._peers.epochs[statement.origin]:
                continue
            unheld = -1 << statement.first & ~statement.held
            # A mask of full length does not say whether items behind it are held.
            if statement.length == MOST_STATED:
                unheld &= (1 << statement.first + statement.length) - 1
            for column in members(self._beliefs.items(life, unheld)):
                self._lacks_of(column)[sender] = 1.0
            lacked |= self._beliefs.deny(sender, life, unheld)
            self._beliefs.report((sender,), life, statement.held)
            if statement.is_known_to_all:
                self._beliefs.report(members(vouched), life, (1 << statement.first) - 1)
        for shown in account.holder_sets:
            if (life := (shown.origin, shown.epoch)) not in self._beliefs.shared:
                self._beliefs.report(members(shown.holders & (vouched | 1 << sender)), life, 1 << shown.sequence)
        return self._decoded(packet, slot, now_s), lacked

    def note_news(self, packet: Packet, slot: int) -> None:
        """Record new holders learned from a packet."""
        beliefs = self._beliefs
        over = self._over(packet) if packet.account.symbols else []
        plain = [beliefs.column_of[fragment.uid] for fragment in packet.fragments if fragment.uid in beliefs.column_of]
        # Last, since known holders lack nothing.
        self._note_brought(packet.sender, plain, over, len(packet.account.symbols))
        for items in beliefs.news.values():
            self._news |= {column: (holder_set_rank(slot, -1), beliefs.uids[column], 0) for column in members(items)}

    def _note_fate(self, peer: int, received: int) -> None:
        """Update link and lack estimates by a peer's acknowledgement of the own last packet."""
        if received:
            self._confirmed |= self._told & self._beliefs.origins[peer]
        self._reckon_fate(peer, self._me, bool(received))
        # After the correction, which needs the delivery rate that the lack was estimated with.
        self._reception[peer] = self._peers.outgoing[peer].reception

    def _reckon_fate(self, peer: int, sender: int, is_received: bool) -> None:
        """Correct the lack estimates of a peer by its acknowledgement of a sender's last packet."""
        over, shares = self._coded_last.get(sender, ((), ()))
        of_plain = [(column, 1.0) for column in (() if is_received else members(self._beliefs.log.last(sender)))]
        for column, share in (*of_plain, *[(column, shares[peer]) for column in self._columns_held(over)]):
            lacks = self._lacks_of(column)
            lacks[peer] = lack_after(lacks[peer], self._reception[peer], share, is_received)

    def _decoded(self, packet: Packet, slot: int, now_s: float) -> tuple[Named, ...]:
        """Return the items recovered from the symbols of this and earlier packets."""
        beliefs = self._beliefs
        decoded: dict[Guid, bytes] = {}
        # A block that arrived uncoded since may determine the others of its symbols.
        for guid in self._decoder.unknown:
            if beliefs.is_whole(guid):
                decoded |= self._decoder.learn(guid, self._bytes_of(guid))
        over = self._over(packet) if packet.account.symbols else []
        for place, data in enumerate(packet.account.symbols):
            key, unknown, rest = symbol_key(slot, place), dict[Guid, int](), data
            for guid in over:
                factor = coefficient(key, guid[0], guid[2])
                if beliefs.is_whole(guid) or guid in decoded:
                    rest = added(rest, scaled(decoded.get(guid) or self._bytes_of(guid), factor))
                else:
                    unknown[guid] = factor
            decoded |= self._decoder.add(unknown, rest)
        items: list[Named] = []
        try:
            for guid in sorted(guid for guid in decoded if not beliefs.is_whole(guid)):
                origin, epoch, sequence = guid
                block = self._accounts.block_of(decoded[guid], guid)
                if origin == self._me or block.time_s > now_s:
                    raise PeerFault(f"decoded block {sequence} of node {origin} is an own block or later than now")
                items.append(name_of_item(Fragment(origin, sequence, block.time_s, block.facts, 0, 1, epoch)))
        except PeerFault:
            self.n_refused += 1
            self._decoder = Decoder()
            return ()
        return tuple(items)

    def _over(self, packet: Packet) -> list[Guid]:
        """Return the blocks that symbols cover; none if an incarnation is unknown or ambiguous."""
        over: list[Guid] = []
        plain = {fragment.guid for fragment in packet.fragments}
        for statement in packet.account.statements:
            life = statement.life
            # The term of an omitted block would remain in the symbols and corrupt all that is decoded from them.
            if statement.epoch != self._peers.epochs[statement.origin] or life in self._beliefs.shared:
                return []
            over += [(*life, number) for number in members(statement.listed) if (*life, number) not in plain]
        return over
