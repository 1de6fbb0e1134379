"""Nesting: which groups supervise which, and which meet before which, to any depth.

A subgroup is supervised by the group that it is within. Where a group is within none, every group that has its mission
from the start supervises it, as in a flat organisation. A group meets after all those that it supervises, directly or
through others, so that meetings go from the bottom up.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from remoras.organisation import Group


def supervisors_of(groups: Iterable[Group]) -> dict[str, tuple[str, ...]]:
    """For each group, by name, the groups whose heads may give it its mission."""
    listed = tuple(groups)
    names = {group.name for group in listed}
    with_mission = [group.name for group in listed if group.mission is not None]
    return {
        group.name: (group.within,)
        if group.within in names
        else tuple(name for name in with_mission if name != group.name)
        for group in listed
    }


def supervised_by(groups: Iterable[Group]) -> dict[str, tuple[str, ...]]:
    """For each group, by name, those that wait for it to give them a mission: its subgroups, or all that have none."""
    listed = tuple(groups)
    found: dict[str, tuple[str, ...]] = {}
    for group in listed:
        found[group.name] = tuple(
            one.name
            for one in listed
            if one is not group
            and (one.within == group.name or (group.mission is not None and one.within is None and one.mission is None))
        )
    return found


def meets_after(groups: Iterable[Group]) -> dict[str, tuple[str, ...]]:
    """For each group, by name, all those that meet before it, in the order in which they are listed."""
    listed = tuple(groups)
    supervised = supervised_by(listed)

    def below(group: str, seen: frozenset[str]) -> set[str]:
        nearest = [name for name in supervised[group] if name not in seen]
        return {*nearest, *(name for below_it in nearest for name in below(below_it, seen | {*nearest}))}

    meeting = {group.name for group in listed if group.rally_point is not None}
    return {
        name: tuple(group.name for group in listed if group.name in below(name, frozenset({name})) & meeting)
        for name in supervised
    }


def apart(groups: Iterable[Group]) -> dict[str, frozenset[str]]:
    """For each group, by name, those on other branches of the same nesting: its members should be in none of them."""
    listed = {group.name: group for group in groups}

    def line(name: str) -> list[str]:
        found = [name]
        while (outer := listed[found[-1]].within) in listed and outer not in found:
            found.append(str(outer))
        return found

    lines = {name: line(name) for name in listed}
    return {
        name: frozenset(
            other for other, of in lines.items() if of[-1] == own[-1] and other not in own and name not in of
        )
        for name, own in lines.items()
    }


def height(group: str, before: Mapping[str, tuple[str, ...]]) -> int:
    """How many levels of groups meet before a group, by what ``meets_after`` gave."""
    return max((1 + height(other, before) for other in before.get(group, ())), default=0)
