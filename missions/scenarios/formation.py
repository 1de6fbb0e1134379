"""Groups that are formed at sea: what has to hold of ``formed_by``."""

from __future__ import annotations

from collections.abc import Iterator

from missions.errors import ConfigurationFault
from missions.scenarios.tables import Raw, entries, names_of, one_of
from remoras.faults import HEAD_OF
from remoras.mission import Mission
from worldmodel import ontology_path

FORMATION_WORDS = ontology_path("formation")
"""Listed in the ``vocabulary`` of a mission that forms groups at sea."""


def formation_faults(raw: Raw, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Groups that nobody could form, or that would have what only founded groups have.

    Args:
        raw: the tables as TOML has them.
        mission: class of the mission.
    """
    formers = {str(entry.get("name")): entry["formed_by"] for entry in entries(raw, "group") if "formed_by" in entry}
    missions = {str(entry.get("name")): entry.get("mission") for entry in entries(raw, "group")}
    for group, former in formers.items():
        key = f"group.{group}.formed_by"
        unknown = list(one_of(key, former, [name for name in names_of(raw, "group") if name != group]))
        yield from unknown
        if not unknown and _is_circular(group, formers):
            allowed = "no group of the circle would ever be there: leave formed_by out of one of them"
            yield ConfigurationFault(key, f'"{former}"', allowed)
        if FORMATION_WORDS not in mission.vocabulary:
            allowed = f"the mission {mission.__name__} forms no groups at sea: leave it out"
            yield ConfigurationFault(key, f'"{former}"', allowed)
        if missions[group] is not None:
            allowed = "a group that is formed at sea is given its mission there: leave it out"
            yield ConfigurationFault(f"group.{group}.mission", f'"{missions[group]}"', allowed)
    for number, fault in enumerate(entries(raw, "fault"), 1):
        vehicle = str(fault.get("vehicle"))
        if vehicle.startswith(HEAD_OF) and vehicle.removeprefix(HEAD_OF) in formers:
            allowed = "nobody leads a group before it is formed at sea: name a vehicle, or the head of another group"
            yield ConfigurationFault(f"fault.{number}.vehicle", f'"{vehicle}"', allowed)


def _is_circular(group: str, formers: dict[str, object]) -> bool:
    seen: set[object] = set()
    at: object = group
    while isinstance(at, str) and at in formers and at not in seen:
        seen.add(at)
        at = formers[at]
    return at == group
