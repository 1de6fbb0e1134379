"""Fragmentation: a block too large for a packet is sent in fragments and merged as a whole."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from exchange.errors import ConfigurationError
from exchange.packets import Fragment
from worldmodel import Block, PropertyValue
from worldmodel.facts import Guid

MAX_FRAGMENTS = 16
HALF_BLOCKS = 64
"""Incomplete blocks of one origin that are assembled at once."""


def fragments_of(block: Block, capacity_bits: int, size_bits: Callable[[Fragment], int]) -> tuple[Fragment, ...]:
    """Split ``block`` into the fewest fragments of at most ``capacity_bits`` each, in order.

    Raises ConfigurationError if a single fact is larger than a packet, or ``MAX_FRAGMENTS`` are too few.
    """

    def fragment(facts: tuple[PropertyValue, ...], index: int, count: int) -> Fragment:
        return Fragment(block.origin, block.sequence, block.time_s, facts, index, count, block.epoch)

    uncut = fragment(block.facts, 0, 1)
    if size_bits(uncut) <= capacity_bits:
        return (uncut,)
    parts: list[tuple[PropertyValue, ...]] = []
    part: tuple[PropertyValue, ...] = ()
    for fact in block.facts:
        if part and size_bits(fragment((*part, fact), 0, 2)) > capacity_bits:
            parts.append(part)
            part = ()
        part = (*part, fact)
        if size_bits(fragment(part, 0, 2)) > capacity_bits:
            raise ConfigurationError(
                f"one fact needs {size_bits(fragment((fact,), 0, 2))} bits, a packet has room for "
                f"{capacity_bits}: take a modem with a larger payload"
            )
    parts.append(part)
    if len(parts) > MAX_FRAGMENTS:
        raise ConfigurationError(
            f"a block of {len(block.facts)} facts needs {len(parts)} fragments, {MAX_FRAGMENTS} are allowed"
        )
    return tuple(fragment(facts, index, len(parts)) for index, facts in enumerate(parts))


class Assembly:
    """Reassembly of incomplete blocks.

    At most ``HALF_BLOCKS`` per origin are cached; ``add`` restores the parts of an evicted one from the ledger. Missing
    parts are not requested, since senders repeat each part until it is acknowledged.
    """

    def __init__(self) -> None:
        self._parts: dict[tuple[Guid, int], dict[int, Fragment]] = {}  # by block and count, in order of age

    def __len__(self) -> int:
        return len(self._parts)

    def add(self, fragment: Fragment, known: Iterable[Fragment] = ()) -> Block | None:
        """Return the block that this fragment completes, else None; ``known`` parts are reused."""
        if fragment.count == 1:
            return fragment.block
        name = fragment.block.guid, fragment.count
        if name not in self._parts:
            self._make_room(fragment.origin)
            self._parts[name] = {part.index: part for part in known if part.count == fragment.count}
        parts = self._parts[name]
        parts[fragment.index] = fragment
        if len(parts) < fragment.count:
            return None
        del self._parts[name]
        return joined_block([parts[index] for index in range(fragment.count)])

    def lacking(self) -> list[Guid]:
        """Return the incomplete blocks."""
        return [guid for guid, _ in self._parts]

    def _make_room(self, origin: int) -> None:
        of_origin = [name for name in self._parts if name[0][0] == origin]
        if len(of_origin) >= HALF_BLOCKS:
            del self._parts[of_origin[0]]


def joined_block(parts: Sequence[Fragment]) -> Block:
    """Join all parts of a block, in order."""
    return parts[0].block._replace(facts=tuple(fact for part in parts for fact in part.facts))
