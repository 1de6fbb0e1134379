"""Why something that waits is not in a packet, and why something waits no longer."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from exchange.packets import ItemUid, StatusUid


class Unsaid(Enum):
    """Why something that waits is not in a packet."""

    NOTHING_OPEN = "nothing open"
    BLACKOUT = "blackout"
    TOO_LARGE = "too large for the room left"
    WAITING = "waiting for acknowledgement"
    LOWER_VALUE = "lower value"
    COVERT = "covert"
    OVERFLOW = "overflow"
    RELAYED = "left to a relay"

    __hash__ = object.__hash__  # that of enumerations takes several times as long, and all slots count reasons


class Expired(Enum):
    """Why something is said no more, though not all who need it are known to hold it."""

    TIME_TO_LIVE = "time to live"
    OVERFLOW = "overflow"
    SUPERSEDED = "superseded"
    NOT_NEEDED = "not needed"
    SAID_ONCE = "said once"


class Expiry(NamedTuple):
    """Something is said no more.

    Attributes:
        uid: of the item or status.
        reason: why.
        latency_s: since its observation.
        comes_back: True if it waits outside of the queue until there is room.
    """

    uid: ItemUid | StatusUid
    reason: Expired
    latency_s: float
    comes_back: bool = False
