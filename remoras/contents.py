"""Contents of packets: what the bits that a fleet sends are spent on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from enum import Enum

from exchange.packets import Transmission
from worldmodel import Attribute, TBox

ASSIGNING = frozenset({"playsRole", "leftRole", "hasMission"})
"""Attributes of the core ontology that say who is what in the organisation; objectives go with them."""
DONE = "jobDone"
"""Attribute that says what came of the work, not who does it."""
OBJECTIVES = "objective"
"""How the names of attributes begin by which a role is given an objective."""


class Content(Enum):
    """What a bit of a packet is for; every bit is for one of these."""

    HEADERS = "headers"
    ASSIGNMENTS = "assignments"
    CLAIMS = "claims"
    STATUS = "status"
    SIGNALS = "signals"
    OBSERVATIONS = "observations"


def content_of(attribute: Attribute, messages: Collection[str]) -> Content:
    """What a fact of an attribute is.

    Assignments give and leave roles, objectives and missions. Claims are all else that the strategy declares to state:
    bids, announcements, the state of its work. Status is what else counts with its newest value alone, as positions do.
    The rest are observations: the mission's own facts, such as a map or a job that is done.

    Args:
        attribute: of the fact.
        messages: names of the attributes by which vehicles organise themselves, see ``Declaration.messages``.
    """
    if attribute.name in ASSIGNING or attribute.name.startswith(OBJECTIVES):
        return Content.ASSIGNMENTS
    if attribute.name in messages and attribute.name != DONE:
        return Content.CLAIMS
    return Content.STATUS if attribute.latest_only else Content.OBSERVATIONS


class BitCount:
    """Counts the bits that a vehicle sends by their contents.

    A fragment counts as what its first fact is, with the bits that delimit and name it. Headers are the rest: those of
    packets, with the acknowledgements, and what fills the last byte.

    Args:
        tbox: attributes of the facts.
        messages: see ``content_of``.
        counts: bits by content so far, added to.
    """

    def __init__(self, tbox: TBox, messages: Collection[str], counts: Counter[Content]) -> None:
        self._contents = tuple(content_of(attribute, messages) for attribute in tbox.attributes)
        self._counts = counts

    def add(self, sent: Transmission) -> None:
        """Count a packet."""
        counts = self._counts
        rest = sent.size_bits - sent.signals_bits
        counts[Content.SIGNALS] += sent.signals_bits
        for attribute, size_bits in sent.fragments:
            counts[self._contents[attribute]] += size_bits
            rest -= size_bits
        counts[Content.HEADERS] += rest
