"""Contents of packets: what the bits that a fleet sends are spent on."""

from __future__ import annotations

from collections.abc import Collection
from enum import Enum

from worldmodel import Attribute

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

    __hash__ = object.__hash__  # that of enumerations takes several times as long, and bits are counted in each slot


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
