"""Well-formedness of an organisation, as values: what of its specification does not hold at a moment.

A group is well formed while its founding roles have as many holders as they demand, no role more than it allows, and
what couples roles holds: who has to play which role besides, and which roles exclude each other (after Moise: Hübner,
Sichman, Boissier 2002). Roles that are allocated during the mission may be without a holder: before their work is
given out, and after it is done.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from remoras.organisation import Group, Organisation, RoleSpecification


class Defect(Enum):
    """What does not hold."""

    TOO_FEW = "minimum"
    TOO_MANY = "maximum"
    PLAYED_BY = "played_by"
    INCOMPATIBLE = "incompatible"
    SUBGROUPS = "subgroup"


@dataclass(frozen=True, slots=True)
class Malformed:
    """One thing that does not hold.

    Attributes:
        defect: kind of it; its value is the key of the specification.
        group, role: where; the role is empty for what holds of a group.
        given: holders, or subgroups, in words.
        allowed: what the specification says, in words.
    """

    defect: Defect
    group: str
    role: str
    given: str
    allowed: str

    @property
    def key(self) -> str:
        """Key of a scenario that says what does not hold, for example ``group.Team.role.Hand.minimum``."""
        of_role = f".role.{self.role}" if self.role else ""
        return f"group.{self.group}{of_role}.{self.defect.value}"


def specification_faults(organisation: Organisation) -> tuple[Malformed, ...]:
    """All that does not hold of an organisation's specification, in the order of its groups and roles."""
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
            yield _malformed(Defect.INCOMPATIBLE, group, role, both, f"who plays none of {paths}")


def _malformed(
    defect: Defect, group: Group, role: RoleSpecification, vehicles: tuple[str, ...], allowed: str
) -> Malformed:
    return Malformed(defect, group.name, role.name, ", ".join(vehicles) or "nobody", allowed)
