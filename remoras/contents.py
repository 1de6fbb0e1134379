"""Purpose of the bits that a fleet transmits."""

from __future__ import annotations

from collections.abc import Collection
from enum import Enum

from worldmodel import Attribute

ASSIGNING = frozenset({"playsRole", "leftRole", "hasMission"})
"""Core attributes about roles and missions; objectives count with them."""
DONE = "jobDone"
"""Attribute that reports a completed job."""
OBJECTIVES = "objective"
"""Prefix of attributes that give a role an objective."""


class Content(Enum):
    """Purpose of a bit; every transmitted bit has exactly one."""

    HEADERS = "headers"
    ASSIGNMENTS = "assignments"
    CLAIMS = "claims"
    STATUS = "status"
    SIGNALS = "signals"
    OBSERVATIONS = "observations"

    __hash__ = object.__hash__  # much faster than that of enumerations; called in each slot


def content_of(attribute: Attribute, messages: Collection[str]) -> Content:
    """Return the purpose of facts of an attribute.

    Assignments are roles, objectives and missions. Claims are all other attributes in ``messages``, the declared
    messages of the strategy. Status is any other attribute with only its newest value valid. The rest are observations.
    """
    if attribute.name in ASSIGNING or attribute.name.startswith(OBJECTIVES):
        return Content.ASSIGNMENTS
    if attribute.name in messages and attribute.name != DONE:
        return Content.CLAIMS
    return Content.STATUS if attribute.latest_only else Content.OBSERVATIONS
