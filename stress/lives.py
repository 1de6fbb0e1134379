"""Lives: what is true of a vehicle from when it is switched on until it stops, whatever it believes itself."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import chain

from exchange.manager import ExchangeManager
from exchange.packets import Fragment
from worldmodel import Block, WorldModel
from worldmodel.facts import Guid


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
        told: blocks of one part that their origin itself has told it, by name.
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
    told: dict[Guid, Block] = field(default_factory=dict)
    heard: dict[int, Life] = field(default_factory=dict)
    had: set[Guid] = field(default_factory=set)
    gave_up: set[Guid] = field(default_factory=set)

    @property
    def name(self) -> str:
        """Its node, and which life of it."""
        return f"{self.node}" + (f" (life {self.number})" if self.number else "") + (" (twin)" if self.is_twin else "")

    def take(self, fragments: Iterable[Fragment]) -> None:
        """Note what it recorded or was given; what came first under a name stays."""
        for fragment in fragments:
            self.parts.setdefault(fragment.guid, {}).setdefault(fragment.index, fragment)

    def inherit(self, before: Life) -> None:
        """Note what it kept of the life before: the blocks that were whole there.

        Of one name that two vehicles gave, it may hold the content that it was not given first, and all of that though
        of the first it was given a part.
        """
        for guid, parts in before.parts.items():
            if before.is_whole(guid) and self.model.has_arrived(guid):
                self.take([part for part in parts.values() if before.holds(part)] or parts.values())
            elif (block := self.model.arrived(guid)) is not None:
                self.take([Fragment(block.origin, block.sequence, block.time_s, block.facts, 0, 1, block.epoch)])

    def is_whole(self, guid: Guid) -> bool:
        """True if it was given all parts of a block; two vehicles of one number make several of one name."""
        parts = self.parts.get(guid, {})
        if len(parts) == 1:
            return next(iter(parts.values())).count == 1
        counts = Counter((part.count, part.time_s) for part in parts.values())
        return any(n_parts == count for (count, _), n_parts in counts.items())

    def part(self, fragment: Fragment) -> Fragment | None:
        """What it was given under the name of a fragment."""
        return self.parts.get(fragment.guid, {}).get(fragment.index)

    def holds(self, fragment: Fragment) -> bool:
        """True if it holds an item with this content: in its world model, or as part of a block that is not whole."""
        guid = fragment.guid
        if self.is_whole(guid):
            block = self.model.arrived(guid)
            if block is None or block.time_s != fragment.time_s:
                return False
            return fragment.facts == block.facts or set(fragment.facts) <= set(block.facts)
        return self.part(fragment) == fragment and self.manager.holds(fragment.uid)

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
