"""The values that a world model is made of: facts, blocks, instances, changes and faults."""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple, cast

from worldmodel.tbox import Value

Guid = tuple[int, int]
"""(origin, sequence): the name of a block, unique in the whole fleet."""

BlockKey = tuple[float, int, int]
"""(time_s, origin, sequence): the order from old to new. It is total and does not depend on arrival."""


class PropertyValue(NamedTuple):
    """One value of one attribute of one instance; its block says when and by whom it was observed."""

    subject: int
    attribute: int
    value: Value

    @property
    def target(self) -> int:
        """The uid that the value is: of a class for a type, of an instance for a link."""
        return cast(int, self.value)


class Block(NamedTuple):
    """Facts recorded together: kept, sent and acknowledged as a whole or not at all.

    ``time_s`` is the time of observation on the origin's clock, in seconds since the mission began.
    """

    origin: int
    sequence: int
    time_s: float
    facts: tuple[PropertyValue, ...]

    @property
    def guid(self) -> Guid:
        """(origin, sequence)."""
        return (self.origin, self.sequence)

    @property
    def key(self) -> BlockKey:
        """(time_s, origin, sequence)."""
        return (self.time_s, self.origin, self.sequence)


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
    BAD_TIME = "bad time"
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


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault of the block (origin, sequence)."""

    code: FaultCode
    origin: int
    detail: str
    sequence: int


class Merged(NamedTuple):
    """What a merge did: ``changes`` in the order in which blocks went in, ``faults`` of the blocks refused."""

    changes: tuple[Change, ...]
    faults: tuple[Fault, ...]
