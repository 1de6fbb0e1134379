"""The values that a world model is made of: facts, blocks, instances, changes and faults."""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple, cast

from worldmodel.ontology.fields import Value

Guid = tuple[int, int, int]
"""(origin, epoch, sequence): the name of an item or of a private block, unique in the whole fleet."""

BlockKey = tuple[float, int, int, int]
"""(time_s, origin, epoch, order): from old to new. It is total but for statuses, and does not depend on arrival."""

STATUS = -1
"""The sequence of every status."""
EPOCHS = 256
"""A vehicle can restart this often, less one: epochs are 0 to 255."""
MOST_ITEMS = 1 << 20
"""The number of items that one origin may record in one epoch; it bounds what a bad sequence can cost."""
_PRIVATE_ORDER = -(1 << 40)


class PropertyValue(NamedTuple):
    """One value of one attribute of one instance; its block says when and by whom it was observed.

    ``uncertainty`` is the standard deviation of a number or point, the probability of any other value, or None.
    It never decides which of two values counts.
    """

    subject: int
    attribute: int
    value: Value
    uncertainty: float | None = None

    @property
    def target(self) -> int:
        """The uid that the value is: of a class for a type, of an instance for a link."""
        return cast(int, self.value)


class Block(NamedTuple):
    """Facts recorded together: kept, sent and acknowledged as a whole or not at all.

    ``time_s`` is the time of observation on the origin's clock, in seconds since the mission began. ``epoch`` grows
    when the origin restarts without its memory. ``sequence`` tells three kinds of blocks apart:

    - 0 and more: an *item*. The items of one origin and epoch are numbered without gaps.
    - ``STATUS``: a *status*, whose facts are all of attributes with rm:latestOnly. It replaces, fact by fact, what
      its origin said before.
    - -2 and less: a *private* block, counted down, which its origin keeps to itself.
    """

    origin: int
    sequence: int
    time_s: float
    facts: tuple[PropertyValue, ...]
    epoch: int = 0

    @property
    def guid(self) -> Guid:
        """(origin, epoch, sequence); statuses have no name of their own."""
        return (self.origin, self.epoch, self.sequence)

    @property
    def key(self) -> BlockKey:
        """(time_s, origin, epoch, order); order is the sequence, but private blocks come first, as recorded."""
        sequence = self.sequence
        order = sequence if sequence >= STATUS else _PRIVATE_ORDER - sequence
        return (self.time_s, self.origin, self.epoch, order)

    @property
    def is_status(self) -> bool:
        """True if it is a status."""
        return self.sequence == STATUS

    @property
    def is_item(self) -> bool:
        """True if it is an item."""
        return self.sequence >= 0


@dataclass(frozen=True, slots=True)
class Instance:
    """An individual of the ABox; ``class_uid`` is the class it was created with."""

    uid: int
    class_uid: int
    name: str


class Observation(NamedTuple):
    """A fact in the block it came in."""

    block: Block
    position: int

    @property
    def fact(self) -> PropertyValue:
        """The fact itself."""
        return self.block.facts[self.position]

    @property
    def value(self) -> Value:
        """The value observed."""
        return self.block.facts[self.position].value

    @property
    def time_s(self) -> float:
        """Time of observation on the origin's clock (s)."""
        return self.block.time_s

    @property
    def origin(self) -> int:
        """The vehicle that observed it."""
        return self.block.origin


class Change(NamedTuple):
    """A block that has gone in; ``new_latest`` are those of its facts that are now the latest of their slot."""

    block: Block
    new_latest: tuple[PropertyValue, ...]


class FaultCode(StrEnum):
    """The kinds of faults that a check finds in a block."""

    UNKNOWN_ORIGIN = "unknown origin"
    BAD_SEQUENCE = "bad sequence"
    BAD_EPOCH = "bad epoch"
    BAD_TIME = "bad time"
    FUTURE = "time in the future"
    NO_FACTS = "no facts"
    UNKNOWN_ATTRIBUTE = "unknown attribute"
    UNKNOWN_INSTANCE = "unknown instance"
    UNKNOWN_CLASS = "unknown class"
    VALUE_KIND = "value of another kind"
    VALUE_RANGE = "value out of range"
    VALUE_GRID = "value off its grid"
    DOMAIN = "domain violated"
    LINK_CLASS = "link to another class"
    TYPE_CLASH = "type clash"
    GUID_CONFLICT = "two contents under one GUID"
    TIMED_OUT = "waited too long"
    CROWDED_OUT = "too many blocks wait"


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault of the block (origin, epoch, sequence)."""

    code: FaultCode
    origin: int
    detail: str
    sequence: int
    epoch: int = 0

    @property
    def guid(self) -> Guid:
        """The name of the block."""
        return (self.origin, self.epoch, self.sequence)


class Lacking(NamedTuple):
    """An instance that blocks wait for.

    Attributes:
        uid: of the instance: nobody has announced it, or not as of the class that the blocks ask for.
        origin: the vehicle that can announce it, by number; None for an instance that all knew from the beginning.
        age_s: for how long the block that came first has waited (s).
        guids: the blocks that wait for it.
    """

    uid: int
    origin: int | None
    age_s: float
    guids: tuple[Guid, ...]


class Merged(NamedTuple):
    """What a merge did: ``changes`` in the order in which blocks went in, ``faults`` of the blocks refused."""

    changes: tuple[Change, ...]
    faults: tuple[Fault, ...]
