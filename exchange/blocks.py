"""Block boundaries: a block that does not fit a packet travels in fragments and goes in whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from exchange.errors import ConfigurationError
from exchange.packets import Fragment
from worldmodel import Block, PropertyValue
from worldmodel.facts import Guid

MAX_FRAGMENTS = 16


def fragments_of(block: Block, capacity_bits: int, size_bits: Callable[[Fragment], int]) -> tuple[Fragment, ...]:
    """Split ``block`` into the fewest fragments, in order, of at most ``capacity_bits`` each.

    Raises ConfigurationError if a single fact is larger than a packet, or more than
    ``MAX_FRAGMENTS`` fragments are needed.
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
    """Caches the fragments of each block until the whole block is there."""

    def __init__(self) -> None:
        self._parts: dict[tuple[Guid, int], dict[int, Fragment]] = {}  # by block and count

    def add(self, fragment: Fragment) -> Block | None:
        """The whole block if this fragment completes it, else None."""
        if fragment.count == 1:
            return fragment.block
        name = fragment.block.guid, fragment.count
        parts = self._parts.setdefault(name, {})
        parts[fragment.index] = fragment
        if len(parts) < fragment.count:
            return None
        del self._parts[name]
        return whole([parts[index] for index in range(fragment.count)])


def whole(parts: Sequence[Fragment]) -> Block:
    """The block of all its parts, in their order."""
    return parts[0].block._replace(facts=tuple(fact for part in parts for fact in part.facts))
