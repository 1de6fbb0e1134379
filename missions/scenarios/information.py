"""Who holds what a group knows: what has to hold between the tables."""

from __future__ import annotations

from collections.abc import Iterator

from missions.errors import ConfigurationFault
from missions.scenarios.scenario import BY_GROUPS, HELD
from missions.scenarios.tables import Raw, entries, table_of


def information_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """A head can hold what its group knows only where needs follow from groups; else all vehicles need everything."""
    if table_of(raw, "communication").get("needs_follow") == BY_GROUPS:
        return
    for group in entries(raw, "group"):
        if group.get("information") == HELD:
            remedy = f'every vehicle needs everything: set communication.needs_follow = "{BY_GROUPS}", or leave it out'
            yield ConfigurationFault(f"group.{group.get('name')}.information", f'"{HELD}"', remedy)
