"""Hierarchy of groups: supervision, meeting order, and conditions on its form.

A subgroup is supervised by its enclosing group; a group outside of any by every group with an initial mission, as in a
flat organisation. A group meets after all that it supervises, directly or not: meetings proceed bottom-up. A group is
well formed if its founding roles have enough holders, no role has too many, and couplings and exclusions of roles hold
(after Moise: Hübner, Sichman, Boissier 2002). Roles allocated during the mission may lack holders.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum

from remoras.organisation import Group, Organisation, RoleSpecification


def supervisors_of(groups: Iterable[Group]) -> dict[str, tuple[str, ...]]:
    """Return for each group the groups whose leaders may give it its mission."""
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
    """Return for each group the groups it may give a mission: subgroups, or all without one."""
    listed = tuple(groups)

    def is_above(group: Group, sub: Group) -> bool:
        return sub.within == group.name or (group.mission is not None and sub.within is None and sub.mission is None)

    return {
        group.name: tuple(sub.name for sub in listed if sub is not group and is_above(group, sub)) for group in listed
    }


def meets_after(groups: Iterable[Group]) -> dict[str, tuple[str, ...]]:
    """Return for each group all groups that meet before it, in listed order."""
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
    """Return for each group those on other branches of its nesting, which share no members."""
    listed = {group.name: group for group in groups}

    def line(name: str) -> list[str]:
        chain = [name]
        while (outer := listed[chain[-1]].within) in listed and outer not in chain:
            chain.append(str(outer))
        return chain

    lines = {name: line(name) for name in listed}
    return {
        name: frozenset(
            other for other, path in lines.items() if path[-1] == own[-1] and other not in own and name not in path
        )
        for name, own in lines.items()
    }


def height(group: str, before: Mapping[str, tuple[str, ...]]) -> int:
    """Return the number of levels of groups that meet before a group (from ``meets_after``)."""
    return max((1 + height(other, before) for other in before.get(group, ())), default=0)


class Defect(Enum):
    """Violated condition; the value is the key of the specification."""

    TOO_FEW = "minimum"
    TOO_MANY = "maximum"
    PLAYED_BY = "played_by"
    INCOMPATIBLE = "incompatible"
    SUBGROUPS = "subgroup"


@dataclass(frozen=True, slots=True)
class Malformed:
    """One violated condition, with text of the given and the allowed; empty role for groups."""

    defect: Defect
    group: str
    role: str
    given: str
    allowed: str

    @property
    def key(self) -> str:
        """Scenario key of the violated condition, for example ``group.Team.role.Hand.minimum``."""
        of_role = f".role.{self.role}" if self.role else ""
        return f"group.{self.group}{of_role}.{self.defect.value}"


def specification_faults(organisation: Organisation) -> tuple[Malformed, ...]:
    """Return all violated conditions of an organisation, in the order of groups and roles."""
    return tuple(problem for group in organisation.groups.values() for problem in _of_group(organisation, group))


def _of_group(organisation: Organisation, group: Group) -> Iterator[Malformed]:
    for role in group.roles:
        yield from _of_role(organisation, group, role)
    within = [other for other in organisation.groups.values() if other.within == group.name] if group.subgroups else ()
    for subgroup in group.subgroups:
        names = [other.name for other in within if subgroup.template in other.templates]
        if len(names) < subgroup.minimum or (subgroup.maximum is not None and len(names) > subgroup.maximum):
            most = "any number" if subgroup.maximum is None else subgroup.maximum
            allowed = f"{subgroup.minimum} to {most} of {subgroup.template}"
            yield Malformed(Defect.SUBGROUPS, group.name, "", ", ".join(names) or "none", allowed)


def _of_role(organisation: Organisation, group: Group, role: RoleSpecification) -> Iterator[Malformed]:
    holders = organisation.members(group.name, role.name)
    least = max(role.minimum, int(role.head)) if role.founding else 0
    if len(holders) < least:
        yield _malformed(Defect.TOO_FEW, group, role, holders, f"{least} or more")
    if role.maximum is not None and len(holders) > role.maximum:
        yield _malformed(Defect.TOO_MANY, group, role, holders, f"{role.maximum} at the most")
    if role.played_by is not None:
        others = tuple(name for name in holders if not organisation.plays(name, *role.played_by))
        if others:
            yield _malformed(Defect.PLAYED_BY, group, role, others, f"holders of {'.'.join(role.played_by)}")
    if role.incompatible:
        both = tuple(name for name in holders if organisation.is_excluded(name, role))
        if both:
            paths = ", ".join(sorted(".".join(other) for other in role.incompatible))
            yield _malformed(Defect.INCOMPATIBLE, group, role, both, f"holder of none of {paths}")


def _malformed(
    defect: Defect, group: Group, role: RoleSpecification, vehicles: tuple[str, ...], allowed: str
) -> Malformed:
    return Malformed(defect, group.name, role.name, ", ".join(vehicles) or "nobody", allowed)
