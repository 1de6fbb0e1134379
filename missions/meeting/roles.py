"""Roles for jobs that a scenario lists in tables of its own, so that its file need not list a role for each."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

from missions.errors import ConfigurationFault
from missions.scenarios.tables import PointM, Raw, entries, list_of, names_of, outside_faults, point_of, table_of


def founding_of(raw: Raw) -> list[str]:
    """Names of the founding roles of the first group."""
    groups = entries(raw, "group")
    roles = entries(groups[0], "role") if groups else []
    return [str(role["name"]) for role in roles if role.get("founding") is True and "name" in role]


def with_job_roles(
    raw: Raw, roles: Sequence[Mapping[str, Any]], needs: Mapping[str, int], addressed: Sequence[str] = ()
) -> Raw:
    """The tables with more roles in the first group, and with needs that the scenario does not state itself.

    Vehicles that list the roles they are able to play are able to play these too. Whoever lists a role for a job keeps
    that one. Malformed tables are left alone.

    Args:
        raw: the tables as TOML has them.
        roles: tables of the roles, each with a job.
        needs: urgency of attributes, by name.
        addressed: roles that signals of the founding roles address too.
    """
    groups = entries(raw, "group")
    if not groups or not isinstance(groups[0].get("role"), list):
        return raw
    listed = {role.get("job") for role in entries(groups[0], "role")}
    new = [dict(role) for role in roles if role["job"] not in listed]
    if not new:
        return raw
    founding, names = founding_of(raw), [role["name"] for role in new]
    old = [
        {**role, "influences": [*list_of(role, "influences"), *addressed]}
        if addressed and isinstance(role, dict) and role.get("name") in founding
        else role
        for role in groups[0]["role"]
    ]
    found: dict[str, Any] = {**raw, "group": list(raw["group"])}
    found["group"][found["group"].index(groups[0])] = {**groups[0], "role": [*old, *new]}
    if isinstance(raw.get("vehicle"), list):
        found["vehicle"] = [_able(vehicle, names) for vehicle in raw["vehicle"]]
    communication = table_of(raw, "communication")
    if isinstance(stated := communication.get("needs"), dict) and needs:
        found["communication"] = {**communication, "needs": {**needs, **stated}}
    return found


def _able(vehicle: Any, roles: Sequence[str]) -> Any:
    played = list_of(vehicle, "playable_roles") if isinstance(vehicle, dict) else []
    if not played:
        return vehicle
    return {**vehicle, "playable_roles": [*played, *(role for role in roles if role not in played)]}


def placed_in(raw: Raw, kind: str, *keys: str) -> list[tuple[str, PointM]]:
    """Places that the tables ``[[kind]]`` state by ``keys``, by their keys in messages."""
    return [(f"{kind}.{one.get('name')}.{key}", at_m) for one in entries(raw, kind) for key in keys
            for at_m in point_of(one, key)]  # fmt: skip


def listed_faults(raw: Raw, kind: str, *keys: str, taken: Collection[str] = ()) -> Iterator[ConfigurationFault]:
    """Jobs in tables ``[[kind]]`` that lie outside of the world, or have names that are taken.

    Args:
        raw: the tables as TOML has them; kind: their name.
        keys: of places.
        taken: names beside those of vehicles, groups, rally points and other such jobs.
    """
    yield from outside_faults(raw, placed_in(raw, kind, *keys))
    others = {*taken, *(name for of in ("vehicle", "group", "rally_point") for name in names_of(raw, of))}
    names = names_of(raw, kind)
    for name in dict.fromkeys(names):
        if name in others or names.count(name) > 1:
            yield ConfigurationFault(
                f"{kind}.{name}.name", f'"{name}"', f"is taken; each {kind} needs a name of its own"
            )
