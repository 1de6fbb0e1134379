"""Agent/Group/Role (AGR) organisation as an immutable value: groups, members and roles.

The axioms (Ferber, Gutknecht, Michel 2003; section III of the REMORAS paper):

* a role exists only inside a group; the same name in two groups denotes two roles;
* a vehicle may play several roles and belong to several groups; a role may have several holders;
* being a member of a group and playing at least one role in it are the same thing;
* two vehicles interact only if they share a group.

Changes of roles return ``(organisation, outcome)``; if refused, the unchanged organisation. Demands on holders
(``RoleSpecification``), such as number and capabilities, extend AGR.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Set
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property

from pydantic import Field

from remoras.errors import OrganisationError
from remoras.table import Section

__all__: list[str] = []


class Outcome(Enum):
    """Outcome of an operation on the organisation, or of its check by ``remoras.authority``."""

    SUCCESS = "success"
    NOT_GROUP = "not group"
    NOT_ROLE = "not role"
    NOT_IN_GROUP = "not in group"
    ALREADY_GROUP = "already group"
    ROLE_ALREADY_HANDLED = "role already handled"
    ROLE_NOT_HANDLED = "role not handled"
    OUTSIDE = "issuer outside the group"
    NO_SOCIAL_LAYER = "issuer without social layer"
    NO_AUTHORITY = "issuer without authority"
    NOT_OF_GROUP = "assignee outside the group"
    UNABLE = "assignee not able"
    INCOMPATIBLE = "assignee lacks the role to play it with"
    UNAVAILABLE = "assignee takes no jobs"
    EXCLUDED = "assignee plays a role that excludes it"
    NO_ROOM = "no room"
    HEAD_PRESENT = "head is there"
    TERM_LEAPS = "term leaps"


RoleKey = tuple[str, str]
"""Group and role; role names are unique only within a group."""


@dataclass(frozen=True, slots=True)
class RoleSpecification:
    """Demands of a role: ``minimum``..``maximum`` (None: any number) holders able to play it.

    The holder of a ``head`` role leads the group: it plans its mission and allocates its roles. ``founding`` roles are
    held from the start, others are allocated during the mission. ``job`` names that of the holder. ``played_by`` is a
    (group, role) whose holder must play it; no holder may play ``incompatible`` ones, in both directions. Of the same
    group, ``influences`` are roles that its influence signals address, ``authority`` those that its holders may assign,
    release and give objectives.
    """

    name: str
    minimum: int = 0
    maximum: int | None = None
    head: bool = False
    founding: bool = False
    job: str | None = None
    played_by: RoleKey | None = None
    influences: tuple[str, ...] = ()
    incompatible: frozenset[RoleKey] = frozenset()
    authority: tuple[str, ...] = ()


class Subgroups(Section):
    """Number of subgroups of a template that a group has, one ``[[group.subgroup]]``."""

    template: str = Field(description="template of the subgroups")
    minimum: int = Field(0, ge=0, description="minimum subgroups of it")
    maximum: int | None = Field(None, ge=1, description="maximum subgroups of it; any number if absent")

    def contradictions(self) -> Iterator[tuple[str, str]]:
        if self.maximum is not None and self.minimum > self.maximum:
            yield "minimum", f"allowed: 0 to maximum = {self.maximum}"


@dataclass(frozen=True, slots=True)
class Group:
    """Specification of a group.

    Holders of the roles ``succession`` succeed a lost leader, in order. Leaders of the group ``within`` supervise it.
    ``templates`` are those of this instance, the nearest first; ``subgroups`` the demanded ones, any if empty. The
    leader of ``formed_by`` forms this group at run time; None for founding groups.

    >>> Group("Divers", (RoleSpecification("Leader", head=True),)).head_role
    'Leader'
    """

    name: str
    roles: tuple[RoleSpecification, ...] = ()
    rally_point: str | None = None
    mission: str | None = None
    succession: tuple[str, ...] = ()
    within: str | None = None
    templates: tuple[str, ...] = ()
    subgroups: tuple[Subgroups, ...] = ()
    formed_by: str | None = None

    def role(self, name: str) -> RoleSpecification | None:
        """Return the specification of a role; None if unknown."""
        return next((role for role in self.roles if role.name == name), None)

    def path(self, role: str) -> str:
        """Return the name of a role of this group in the ontology."""
        return f"{self.name}.{role}"

    @property
    def head_role(self) -> str | None:
        """Name of the leader's role, or None."""
        return next((role.name for role in self.roles if role.head), None)


@dataclass(frozen=True, slots=True, order=True)
class RoleAssignment:
    """``vehicle`` plays ``role`` in ``group``."""

    group: str
    role: str
    vehicle: str

    def __post_init__(self) -> None:
        if not (self.group and self.role and self.vehicle):
            raise OrganisationError(f"a role assignment needs a group, a role and a vehicle, not {self}")


@dataclass(frozen=True)
class Organisation:
    """Groups and role assignments; equality by value."""

    groups: Mapping[str, Group] = field(default_factory=dict)
    assignments: frozenset[RoleAssignment] = frozenset()

    # Sorted, since the order of a set depends on hashes, and decisions follow the order of members.
    @cached_property  # 1 to 15 % of a mission
    def _players(self) -> dict[tuple[str, str | None], tuple[str, ...]]:
        players: dict[tuple[str, str | None], set[str]] = {}
        for a in self.assignments:
            players.setdefault((a.group, a.role), set()).add(a.vehicle)
            players.setdefault((a.group, None), set()).add(a.vehicle)
        return {key: tuple(sorted(names)) for key, names in players.items()}

    @cached_property  # 3 to 16 % of a mission
    def _roles(self) -> dict[str, dict[str, tuple[RoleAssignment, ...]]]:
        roles: dict[str, dict[str, tuple[RoleAssignment, ...]]] = {}
        for a in sorted(self.assignments):
            by_group = roles.setdefault(a.vehicle, {})
            by_group[a.group] = (*by_group.get(a.group, ()), a)
        return roles

    @cached_property  # 2 to 3 % of a mission
    def _heads(self) -> dict[str, tuple[str, ...]]:
        heads = {name: group.head_role for name, group in self.groups.items()}
        return {group: self.members(group, role) for group, role in heads.items() if role is not None}

    def members(self, group: str, role: str | None = None) -> tuple[str, ...]:
        """Return the vehicles in ``group`` (playing ``role``), sorted."""
        return self._players.get((group, role), ())

    def roles_of(self, vehicle: str, group: str | None = None) -> tuple[RoleAssignment, ...]:
        """Return the roles that ``vehicle`` plays (in ``group``)."""
        held = self._roles.get(vehicle, {})
        if group is not None:
            return held.get(group, ())
        return tuple(role for name in sorted(held) for role in held[name])

    def plays(self, vehicle: str, group: str, role: str) -> bool:
        """Return whether ``vehicle`` plays ``role`` in ``group``."""
        return vehicle in self._players.get((group, role), ())

    def is_member(self, vehicle: str, group: str) -> bool:
        """Return whether ``vehicle`` plays some role in ``group``."""
        return group in self._roles.get(vehicle, {})

    def shared_groups(self, vehicle: str, other: str) -> frozenset[str]:
        """Return the groups of which both vehicles are members."""
        return frozenset(self._roles.get(vehicle, {}).keys() & self._roles.get(other, {}).keys())

    def heads(self, group: str) -> tuple[str, ...]:
        """Return the leaders of ``group``."""
        return self._heads.get(group, ())

    def assign(self, vehicle: str, group: str, role: str) -> tuple[Organisation, Outcome]:
        """Assign ``role`` in ``group``; refused at its maximum number of holders."""
        assignment = RoleAssignment(group, role, vehicle)
        if group not in self.groups:
            return self, Outcome.NOT_GROUP
        if assignment in self.assignments:
            return self, Outcome.ROLE_ALREADY_HANDLED
        specification = self.groups[group].role(role)
        if self.groups[group].roles and specification is None:
            return self, Outcome.NOT_ROLE
        maximum = specification.maximum if specification else None
        if maximum is not None and len(self.members(group, role)) >= maximum:
            return self, Outcome.NO_ROOM
        return replace(self, assignments=self.assignments | {assignment}), Outcome.SUCCESS

    def leave_role(self, vehicle: str, group: str, role: str) -> tuple[Organisation, Outcome]:
        """Release ``role`` in ``group``."""
        assignment = RoleAssignment(group, role, vehicle)
        if group not in self.groups:
            return self, Outcome.NOT_GROUP
        if assignment not in self.assignments:
            member = self.is_member(vehicle, group)
            return self, Outcome.ROLE_NOT_HANDLED if member else Outcome.NOT_IN_GROUP
        return replace(self, assignments=self.assignments - {assignment}), Outcome.SUCCESS

    def form(self, group: Group) -> Organisation:
        """Return the organisation with a further group, without members."""
        return replace(self, groups={**self.groups, group.name: group})

    def without_group(self, group: str) -> Organisation:
        """Return the organisation without a group and its roles."""
        if group not in self.groups:
            return self
        groups = {name: known for name, known in self.groups.items() if name != group}
        return replace(self, groups=groups, assignments=frozenset(a for a in self.assignments if a.group != group))

    def without(self, vehicles: Set[str]) -> Organisation:
        """Return the organisation without any role of these vehicles."""
        if vehicles.isdisjoint(a.vehicle for a in self.assignments):
            return self
        return replace(self, assignments=frozenset(a for a in self.assignments if a.vehicle not in vehicles))

    def is_excluded(self, vehicle: str, role: RoleSpecification) -> bool:
        """Return whether ``vehicle`` plays a role that is incompatible with ``role``."""
        return any(self.plays(vehicle, *other) for other in role.incompatible)

    @classmethod
    def of(cls, groups: Iterable[Group], assignments: Iterable[RoleAssignment] = ()) -> Organisation:
        """Create from groups and assignments."""
        return cls({group.name: group for group in groups}, frozenset(assignments))
