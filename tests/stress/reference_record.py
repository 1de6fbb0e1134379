"""Reference record: an independent account of recorded and received content, and of false beliefs that follow.

It is made of what went into ``record`` and of which packets were taken, not of what managers say of each other.

The law. Vehicle v believes that peer p holds item u. This is false if p, in its present life, does not hold the
content that v holds under the name u. It is excused while v has not taken any packet of p's present life, provided it
is not p's first: v cannot know of a restart before it hears of it. Nothing else is excused, with one exception. While
two vehicles use one number, their items have the same names: those are excused that have not noticed, and all others
as to items of that number. When one of the two is gone, those that never noticed are excused as to whoever uses that
number, and so is whoever uses it. What a vehicle gave up (parts of a block that never came whole, a block that waited
too long) it does not hold; peers know it at the latest when a calm is over.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import chain

from exchange.manager.manager import ExchangeManager
from exchange.packets import Fragment, ItemUid
from worldmodel import Block, PropertyValue, WorldModel
from worldmodel.facts import Guid


@dataclass(eq=False)
class Incarnation:
    """One incarnation of a vehicle, from start to stop, with its true state.

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
    parts: dict[Guid, dict[int, Fragment]] = field(default_factory=dict)
    told: dict[Guid, Block] = field(default_factory=dict)
    heard: dict[int, Incarnation] = field(default_factory=dict)
    had: set[Guid] = field(default_factory=set)
    gave_up: set[Guid] = field(default_factory=set)

    @property
    def name(self) -> str:
        """Its node, and which life of it."""
        return f"{self.node}" + (f" (life {self.number})" if self.number else "") + (" (twin)" if self.is_twin else "")

    def take(self, fragments: Iterable[Fragment]) -> None:
        """Record its own or received content; the first content of a name stays."""
        for fragment in fragments:
            self.parts.setdefault(fragment.guid, {}).setdefault(fragment.index, fragment)

    def inherit(self, before: Incarnation) -> None:
        """Take over the complete blocks of the previous incarnation.

        Of one name that two vehicles gave, it may hold the content that it was not given first, and all of that though
        of the first it was given a part.
        """
        for guid, parts in before.parts.items():
            if before.is_whole(guid) and self.model.has_arrived(guid):
                self.take([part for part in parts.values() if before.holds(part)] or parts.values())
            elif (block := self.model.arrived(guid)) is not None:
                self.take([Fragment(block.origin, block.sequence, block.time_s, block.facts, 0, 1, block.epoch)])

    def is_whole(self, guid: Guid) -> bool:
        """True if it received all fragments of a block; duplicate node ids make several of one name."""
        parts = self.parts.get(guid, {})
        if len(parts) == 1:
            return next(iter(parts.values())).count == 1
        counts = Counter((part.count, part.time_s) for part in parts.values())
        return any(n_parts == count for (count, _), n_parts in counts.items())

    def part(self, fragment: Fragment) -> Fragment | None:
        """Content received under the name of a fragment."""
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
class SentPacket:
    """A packet in transit, with the content its sender put in."""

    sender: Incarnation
    slot: int
    data: bytes
    fragments: tuple[Fragment, ...]


class ReferenceRecord:
    """The record of one fleet.

    Attributes:
        recorded: blocks that were recorded, by name; statuses: origin, time and fact of each that was.
        lives: present life of each node; past: those before; twins: second vehicles of a number.
        doubled: numbers that two vehicles have used.
    """

    def __init__(self) -> None:
        self.recorded: dict[Guid, set[Block]] = {}
        self.statuses: set[tuple[int, float, PropertyValue]] = set()
        self.lives: dict[int, Incarnation] = {}
        self.past: list[Incarnation] = []
        self.twins: list[Incarnation] = []
        self.doubled: set[int] = set()

    def all_alive(self) -> list[Incarnation]:
        """The vehicles that are switched on, twins behind the others."""
        return [life for life in (*self.lives.values(), *self.twins) if life.is_alive]

    # What happens --------------------------------------------------------------------------------

    def note_recorded(self, life: Incarnation, block: Block) -> None:
        """A vehicle has recorded a block of its own."""
        if block.is_status:
            self.statuses |= {(block.origin, block.time_s, fact) for fact in block.facts}
        else:
            self.recorded.setdefault(block.guid, set()).add(block)
            if block.is_item:
                life.had.add(block.guid)

    def note_taken(self, life: Incarnation, aired: SentPacket) -> None:
        """A vehicle has taken a sound packet."""
        life.take(aired.fragments)
        own = [fragment for fragment in aired.fragments if fragment.origin == aired.sender.node and fragment.count == 1]
        life.told.update((fragment.guid, fragment.block) for fragment in own)
        known = life.heard.get(aired.sender.node)
        if known is None or known.number <= aired.sender.number:
            life.heard[aired.sender.node] = aired.sender

    def note_decoded(self, life: Incarnation, items: Iterable[ItemUid]) -> None:
        """A vehicle has come to know these items; those that no packet gave it came by symbols, as they were recorded.

        Items that nobody recorded, or two under one name, are left: so they count as held by nobody.
        """
        for uid in items:
            guid = uid.origin, uid.epoch, uid.sequence
            recorded = self.recorded.get(guid, set())
            if uid.part == 0 and guid not in life.parts and len(recorded) == 1:
                (block,) = recorded
                life.take([Fragment(uid.origin, uid.sequence, block.time_s, block.facts, 0, 1, uid.epoch)])

    # What is true --------------------------------------------------------------------------------

    def is_false(self, life: Incarnation, peer: Incarnation, fragment: Fragment) -> bool:
        """True if a vehicle must not believe that a peer holds an item as it holds it itself."""
        return (
            (fragment.origin not in self.doubled or fragment.origin == life.node)
            and fragment.guid not in peer.gave_up
            and not peer.holds(fragment)
        )

    def is_excused(self, life: Incarnation, peer: Incarnation) -> bool:
        """True while a vehicle cannot know of a peer's present life, or that others have used a number of the two."""
        if peer.node == life.node:
            return True
        if self.doubled and not (life.has_noticed or self.doubled.isdisjoint((life.node, peer.node))):
            return True
        return not (peer.number == 0 or life.heard.get(peer.node) is peer)

    def false_beliefs(self) -> list[tuple[str, str, ItemUid]]:
        """False beliefs that are not excused: believer, peer and item."""
        found = []
        for life in self.all_alive():
            if (self.twins or life.is_twin) and not life.has_noticed:
                continue
            for peer in self.lives.values():
                if self.is_excused(life, peer):
                    continue
                found += [
                    (life.name, peer.name, fragment.uid)
                    for fragment in life.fragments()
                    if life.manager.believes(peer.node, fragment.uid) and self.is_false(life, peer, fragment)
                ]
        return found

    def flaws(self) -> Iterator[str]:
        """All that is believed or known and not so, or was lost."""
        for one, other, uid in self.false_beliefs():
            yield f"{one} believes that {other} holds {uid}"
        for life in self.all_alive():
            yield from self.unfounded(life)
            yield from self.lost(life)

    def unfounded(self, life: Incarnation) -> Iterator[str]:
        """Content of a world model that no vehicle recorded."""
        model = life.model
        for block in chain(model.blocks(), model.arrivals.waiting.values(), model.arrivals.refused.values()):
            if (flaw := self.flaw_of(life, block)) is not None:
                yield flaw
            life.had.add(block.guid)
        for status in model.statuses():
            if (flaw := self.flaw_of(life, status)) is not None:
                yield flaw

    def flaw_of(self, life: Incarnation, block: Block) -> str | None:
        """Flaw of a known block or status; None if a vehicle recorded it."""
        if block.is_status:
            if all((block.origin, block.time_s, fact) in self.statuses for fact in block.facts):
                return None
            return f"{life.name} knows {block}, which nobody recorded"
        recorded = self.recorded.get(block.guid, set[Block]())
        if block in recorded:
            return None
        return f"{life.name} knows {block}; recorded was {recorded or 'nothing'}"

    def lost(self, life: Incarnation) -> Iterator[str]:
        """Blocks that a vehicle held or received completely, and lost."""
        model = life.model
        for guid in life.had:
            if guid not in life.gave_up and not model.has_arrived(guid):
                yield f"{life.name} lost {guid}"
        for guid in life.parts:
            if guid[0] in self.doubled or guid in life.gave_up:
                continue
            if life.is_whole(guid) and not model.has_arrived(guid):
                yield f"{life.name} was given all of {guid} and does not have it"

    def kept_out(self, life: Incarnation) -> Iterator[str]:
        """Content sent by the origin of a block, if other content of greater digest replaced it.

        Who has noticed that two vehicles seem to use one number settles nothing.
        """
        model = life.model
        for guid, true in life.told.items() if not life.has_noticed else ():
            known = model.arrived(guid)
            if known is None or known == true or guid in life.gave_up:
                continue
            if guid[0] not in self.doubled and model.content(known) > model.content(true):
                yield f"{life.name} knows {known}, though its origin told {true}"

    def outdated(self, life: Incarnation) -> Iterator[str]:
        """Valid values of a vehicle that holds newer ones; excluded origins are left out."""
        model = life.model
        newest: dict[tuple[int, int], Block] = {}
        for block in filter(model.is_seen, chain(model.blocks(), model.statuses())):
            for fact in block.facts:
                known = newest.get((fact.subject, fact.attribute))
                if known is None or known.time_s < block.time_s:
                    newest[fact.subject, fact.attribute] = block
        for slot, block in newest.items():
            counting = model.latest(*slot)
            if counting is None or counting.block.time_s < block.time_s:
                yield f"{life.name} goes by {counting}, though it holds {block}"

    def apart(self, alive: Iterable[Incarnation], of_all: bool = True) -> Iterator[str]:
        """Items that vehicles in contact lack of each other after a quiet time.

        Args:
            alive: who hear each other.
            of_all: also items whose origin lives no more; else those whose origin could say them.
        """
        alive = list(alive)
        origins = {(life.node, life.epoch) for life in alive}
        for life in alive:
            for other in alive:
                missing = [
                    guid
                    for guid in other.had
                    if (of_all or guid[:2] in origins)
                    and other.model.has_arrived(guid)
                    and not life.model.has_arrived(guid)
                ]
                if missing:
                    yield f"{life.name} lacks {missing[:5]} of {other.name}: {len(missing)}"

    def restless(self, alive: Iterable[Incarnation]) -> Iterator[str]:
        """Vehicles with queued items, pending or incomplete blocks after a quiet time."""
        alive = list(alive)
        lives = {(life.node, life.epoch) for life in alive}
        for life in alive:
            if life.manager.n_open:
                yield f"{life.name} has {life.manager.n_open} items open"
            half = [guid for guid in life.manager.half_blocks() if guid[:2] in lives and guid not in life.gave_up]
            if half:
                yield f"{life.name} lacks parts of {half[:5]}"
            if waiting := life.model.arrivals.waiting:
                yield f"{life.name}: {len(waiting)} blocks wait"
