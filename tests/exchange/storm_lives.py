"""What becomes of packets and vehicles in a `storm`: fates, and lives with what is true of them."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import chain
from typing import NamedTuple

from exchange.manager import ExchangeManager
from exchange.packets import Fragment
from worldmodel import WorldModel
from worldmodel.facts import Guid


class Copy(NamedTuple):
    """One arrival of a packet at one receiver.

    Attributes:
        late_slots: by how much it comes later than sound needs, in slots.
        flips: numbers of the bits that are damaged, counted round the packet.
    """

    late_slots: float = 0.0
    flips: tuple[int, ...] = ()


Fate = tuple[Copy, ...]
"""What becomes of a packet at one receiver: each copy that arrives."""

HEARD: Fate = (Copy(),)
LOST: Fate = ()
DOUBLED: Fate = (Copy(), Copy(0.05))


def late(slots: float) -> Fate:
    """It comes so many slots late."""
    return (Copy(slots),)


def replayed(slots: float) -> Fate:
    """It is heard, and once more so many slots later."""
    return (Copy(), Copy(slots))


def damaged(*flips: int) -> Fate:
    """It comes with these bits flipped."""
    return (Copy(0.0, flips),)


def chances(seed: int, *fates: tuple[float, Fate]) -> Iterator[Fate]:
    """Fates without end, each with its chance; what is left is heard."""
    draws = random.Random(seed)
    while True:
        number = draws.random()
        for chance, fate in fates:
            number -= chance
            if number < 0.0:
                yield fate
                break
        else:
            yield HEARD


@dataclass(eq=False)
class Life:
    """A vehicle from when it is switched on until it stops, and what is true of it.

    Attributes:
        node: number that it uses.
        number: which of the lives of that number it is, the first 0.
        epoch: how often the memory was lost before.
        model: its world model.
        manager: its exchange manager.
        offset_s: by how much its clock is ahead.
        parts: of each block, the fragments that it recorded or was given, by their index.
        heard: of each peer, the life whose packets it has taken last.
        gave_up: names of blocks that it does not hold any more, and said so.
        took_damaged: damaged packets that it did not notice.
        is_twin: True for a second vehicle of that number.
        has_noticed: True once it has reported that a number is used twice.
    """

    node: int
    number: int
    epoch: int
    model: WorldModel
    manager: ExchangeManager
    offset_s: float = 0.0
    is_alive: bool = True
    is_twin: bool = False
    has_noticed: bool = False
    took_damaged: int = 0
    parts: dict[Guid, dict[int, Fragment]] = field(default_factory=dict)
    heard: dict[int, Life] = field(default_factory=dict)
    had: set[Guid] = field(default_factory=set)
    gave_up: set[Guid] = field(default_factory=set)

    def take(self, fragments: Iterable[Fragment]) -> None:
        """Note what it recorded or was given; what came first under a name stays."""
        for fragment in fragments:
            self.parts.setdefault(fragment.block.guid, {}).setdefault(fragment.index, fragment)

    def is_whole(self, guid: Guid) -> bool:
        """True if it was given all parts of a block; two vehicles of one number make several of one name."""
        parts = self.parts.get(guid, {}).values()
        counts = Counter((part.count, part.time_s) for part in parts)
        return any(n_parts == count for (count, _), n_parts in counts.items())

    def holds(self, fragment: Fragment) -> bool:
        """True if it holds an item with this content: in its world model, or as part of a block that is not whole."""
        guid = fragment.block.guid
        if self.is_whole(guid):
            block = self.model.arrived(guid)
            return block is not None and block.time_s == fragment.time_s and set(fragment.facts) <= set(block.facts)
        return self.parts.get(guid, {}).get(fragment.index) == fragment and self.manager.holds(fragment.uid)

    def fragments(self) -> Iterator[Fragment]:
        """All that it was given."""
        return chain.from_iterable(parts.values() for parts in self.parts.values())


@dataclass(frozen=True)
class Aired:
    """A packet on its way, with what its sender put in."""

    sender: Life
    slot: int
    data: bytes
    fragments: tuple[Fragment, ...]


def flipped(data: bytes, flips: Iterable[int]) -> bytes:
    """The bytes with these bits turned; numbers count round."""
    damaged = bytearray(data)
    for bit in flips:
        byte, place = divmod(bit % (8 * len(damaged)), 8)
        damaged[byte] ^= 128 >> place
    return bytes(damaged)
