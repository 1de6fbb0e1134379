"""The values a world model is made of: what is recorded, exchanged, returned and refused."""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple, cast

from worldmodel.tbox import Value

Guid = tuple[int, int]
"""(origin, sequence): names a block, once and for all, in the whole fleet."""

BlockKey = tuple[float, int, int]
"""(time_s, origin, sequence): which block is the newer. A total order, and not that of arrival."""


class PropertyValue(NamedTuple):
    """One value of one attribute of one instance; when and by whom it was observed is said by its block."""

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
        """What was observed."""
        return self.block.facts[self.position].value

    @property
    def time_s(self) -> float:
        """When."""
        return self.block.time_s

    @property
    def origin(self) -> int:
        """By whom."""
        return self.block.origin


class Change(NamedTuple):
    """A block has gone in; ``new_latest`` are those of its facts that are now the latest of their slot."""

    block: Block
    new_latest: tuple[PropertyValue, ...]


class FaultCode(StrEnum):
    """What a check found wrong with a block."""

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
    """One thing wrong with the block (origin, sequence)."""

    code: FaultCode
    origin: int
    detail: str
    sequence: int
