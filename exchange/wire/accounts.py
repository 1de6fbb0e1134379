"""Codec of the holdings section of a packet, and of blocks as input to coded repairs.

Layout in `exchange.policy.planning`. The encoding of a fragment depends on its packet; a symbol therefore covers blocks
in a packet-independent form: time, facts, a 1 bit, zeros to a byte.
"""

from __future__ import annotations

from exchange.errors import PeerFault
from exchange.packets import Account, HolderSet, OriginStatement
from exchange.policy.planning import COUNT_BITS, LENGTH_BITS, SIZE_BITS
from exchange.wire.factcodec import Bits, Reader, joined, natural, padded, read_natural
from exchange.wire.fragmentcodec import EPOCH_BITS, FragmentCodec
from worldmodel import Block
from worldmodel.facts import MOST_ITEMS, Guid


class AccountCodec:
    """Codec of holdings sections, with symbols if ``codes_repairs``."""

    def __init__(self, fragments: FragmentCodec, n_nodes: int, codes_repairs: bool) -> None:
        self._fragments = fragments
        self._n_nodes = n_nodes
        self._codes_repairs = codes_repairs

    # To bits -------------------------------------------------------------------------------------

    def statement(self, content: OriginStatement, sender: int) -> Bits:
        """Encode a statement with its leading presence bit."""
        is_usual = content.epoch == 0 and content.is_known_to_all
        parts = [(1, 1), (content.origin, self._fragments.origin_bits), (int(is_usual), 1)]
        if not is_usual:
            parts += [natural(content.epoch, EPOCH_BITS), (int(content.is_known_to_all), 1)]
        parts += [natural(content.first, self._fragments.sequence_bits), (content.length, LENGTH_BITS)]
        if content.origin != sender:
            parts.append((content.mask, content.length))
        return joined(*parts)

    def holder_set(self, content: HolderSet, sender: int) -> Bits:
        """Encode a holder set with its leading presence bit."""
        parts = [(1, 1), (content.origin, self._fragments.origin_bits), (int(content.epoch == 0), 1)]
        if content.epoch:
            parts.append(natural(content.epoch, EPOCH_BITS))
        # The bit of the sender, itself a holder, is left out.
        others = content.holders >> sender + 1 << sender | content.holders & (1 << sender) - 1
        number = natural(content.sequence, self._fragments.sequence_bits)
        return joined(*parts, number, (others, self._n_nodes - 1))

    def encode(self, account: Account, sender: int) -> Bits:
        """Encode a holdings section."""
        parts = [self.statement(entry, sender) for entry in account.statements] + [(0, 1)]
        parts += [self.holder_set(entry, sender) for entry in account.holder_sets] + [(0, 1)]
        if self._codes_repairs:
            symbols = account.symbols
            parts.append((len(symbols), COUNT_BITS))
            if symbols:
                parts.append((len(symbols[0]), SIZE_BITS))
            parts += [(int.from_bytes(symbol, "big"), 8 * len(symbol)) for symbol in symbols]
        return joined(*parts)

    # From bits -----------------------------------------------------------------------------------

    def _read_statement(self, reader: Reader, sender: int) -> OriginStatement:
        origin, epoch, is_known = self._fragments.read_origin(reader), 0, True
        if not reader.take(1):
            epoch, is_known = self._fragments.read_epoch(reader), bool(reader.take(1))
            if epoch == 0 and is_known:
                raise PeerFault("received set not in its shortest form")
        first = read_natural(reader.take, self._fragments.sequence_bits)
        length = reader.take(LENGTH_BITS)
        if first + length > MOST_ITEMS:
            raise PeerFault(f"received set of {first + length} items: allowed are up to {MOST_ITEMS}")
        mask = (1 << length) - 1 if origin == sender else reader.take(length)
        return OriginStatement(origin, epoch, first, length, mask, is_known)

    def _read_holder_set(self, reader: Reader, sender: int) -> HolderSet:
        origin, is_usual = self._fragments.read_origin(reader), reader.take(1)
        epoch = 0 if is_usual else self._fragments.read_epoch(reader)
        if epoch == 0 and not is_usual:
            raise PeerFault("holder set not in its shortest form")
        sequence = read_natural(reader.take, self._fragments.sequence_bits)
        if sequence >= MOST_ITEMS:
            raise PeerFault(f"holders of item {sequence}: allowed are 0 to {MOST_ITEMS - 1}")
        others = reader.take(self._n_nodes - 1)
        holders = others >> sender << sender + 1 | 1 << sender | others & (1 << sender) - 1
        return HolderSet(origin, epoch, sequence, holders)

    def read(self, reader: Reader, sender: int) -> Account:
        """Decode the next holdings section; raise PeerFault if it is not in canonical form."""
        statements: list[OriginStatement] = []
        while reader.take(1):
            statements.append(self._read_statement(reader, sender))
        holder_sets: list[HolderSet] = []
        while reader.take(1):
            holder_sets.append(self._read_holder_set(reader, sender))
        symbols: tuple[bytes, ...] = ()
        if self._codes_repairs and (n_symbols := reader.take(COUNT_BITS)):
            size = reader.take(SIZE_BITS)
            if size == 0:
                raise PeerFault("symbols of no bytes")
            symbols = tuple([reader.take(8 * size).to_bytes(size, "big") for _ in range(n_symbols)])
        return Account(tuple(statements), tuple(holder_sets), symbols)

    # Blocks as code input ------------------------------------------------------------------------

    def block_bytes(self, block: Block) -> bytes:
        """Encode a block independently of any packet."""
        # The closing 1 bit separates the block from the zeros that pad it in symbols of longer blocks.
        bits, size_bits, _ = self._fragments.facts.of_all(block.facts)
        return padded(joined(self._fragments.encode_time(block.time_s), (bits, size_bits), (1, 1)))

    def block_of(self, data: bytes, guid: Guid) -> Block:
        """Decode a recovered block; raise PeerFault unless its encoding matches ``data``."""
        reader = Reader(data)
        time_s, facts = self._fragments.read_time(reader), self._fragments.facts.read_all(reader)
        origin, epoch, sequence = guid
        block = Block(origin, sequence, time_s, facts, epoch)
        written = self.block_bytes(block)
        # Symbols have no checksum of their own; a wrong solution shows as bytes that no block is encoded by.
        if data[: len(written)] != written or any(data[len(written) :]):
            raise PeerFault(f"the bytes decoded as block {sequence} of node {origin} are not a valid block")
        return block
