"""Values of a world model: facts, blocks, instances, changes and faults."""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple, cast

from worldmodel.ontology.fields import Value

Guid = tuple[int, int, int]  # (origin, epoch, sequence) of an item or private block, unique in the fleet

BlockKey = tuple[float, int, int, int]
"""(time_s, origin, epoch, order): total order except for statuses, independent of arrival."""

STATUS = -1  # sequence of every status
EPOCHS = 256  # number of epochs: 0 to 255, one per restart
MOST_ITEMS = 1 << 20  # maximum number of items per origin and epoch; it bounds the cost of a corrupt sequence
_PRIVATE_ORDER = -(1 << 40)


class PropertyValue(NamedTuple):
    """Value of one attribute of one instance.

    ``uncertainty``: standard deviation of a number or point, probability of any other value, or None.
    """

    subject: int
    attribute: int
    value: Value
    uncertainty: float | None = None

    @property
    def target(self) -> int:
        """Value as a uid: of a class for a type, of an instance for a link."""
        return cast(int, self.value)


class Block(NamedTuple):
    """Facts recorded together; stored, sent and acknowledged as a whole.

    ``time_s`` is the observation time on the origin's clock, in seconds since mission start. ``epoch`` grows when the
    origin restarts without its memory. ``sequence`` gives the kind:

    - 0 and more: *item*, numbered without gaps per origin and epoch.
    - ``STATUS``: *status* of attributes with rm:latestOnly; it replaces older statuses of its origin, fact by fact.
    - -2 and less: *private* block, counted down, never sent.
    """

    origin: int
    sequence: int
    time_s: float
    facts: tuple[PropertyValue, ...]
    epoch: int = 0

    @property
    def guid(self) -> Guid:
        """(origin, epoch, sequence); statuses of one origin share it."""
        return (self.origin, self.epoch, self.sequence)

    @property
    def key(self) -> BlockKey:
        """Sort key (time_s, origin, epoch, order), independent of arrival."""
        sequence = self.sequence
        # Private blocks count down: mirrored, they sort as recorded, before all others of one time and origin.
        order = sequence if sequence >= STATUS else _PRIVATE_ORDER - sequence
        return (self.time_s, self.origin, self.epoch, order)

    @property
    def is_status(self) -> bool:
        """True for a status."""
        return self.sequence == STATUS

    @property
    def is_item(self) -> bool:
        """True for an item."""
        return self.sequence >= 0


@dataclass(frozen=True, slots=True)
class Instance:
    """Individual of the ABox; ``class_uid`` is its class of creation."""

    uid: int
    class_uid: int
    name: str


class Observation(NamedTuple):
    """Fact with its block; ``position`` is the index in the block."""

    block: Block
    position: int

    @property
    def fact(self) -> PropertyValue:
        """Observed value of a property."""
        return self.block.facts[self.position]

    @property
    def value(self) -> Value:
        """Observed value."""
        return self.block.facts[self.position].value

    @property
    def time_s(self) -> float:
        """Observation time on the origin's clock (s)."""
        return self.block.time_s

    @property
    def origin(self) -> int:
        """Observing vehicle."""
        return self.block.origin


def sort_key(observation: Observation) -> tuple[BlockKey, int]:
    """Return a key that orders observations from oldest to latest."""
    return observation.block.key, observation.position


class Change(NamedTuple):
    """Accepted block; ``new_latest`` are those of its facts that are now the latest."""

    block: Block
    new_latest: tuple[PropertyValue, ...]


class FaultCode(StrEnum):
    """Reasons for refusing or discarding a block."""

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
    """Fault of the block (origin, epoch, sequence)."""

    code: FaultCode
    origin: int
    detail: str
    sequence: int
    epoch: int = 0

    @property
    def guid(self) -> Guid:
        """GUID of the block."""
        return (self.origin, self.epoch, self.sequence)


class Lacking(NamedTuple):
    """Missing instance, the origin that owns its uid range, and GUIDs of the blocks pending for it."""

    uid: int
    origin: int | None
    guids: tuple[Guid, ...]


class Merged(NamedTuple):
    """Result of a merge: ``changes`` in order of acceptance, ``faults`` of refused blocks."""

    changes: tuple[Change, ...]
    faults: tuple[Fault, ...]
