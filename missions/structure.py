"""Groups and roles as the scenario of a run declares them, and which group supervises which."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

RoleKey = tuple[str, str]
"""Group and role."""


class RoleDemand(NamedTuple):
    """What a role demands: from ``minimum`` to ``maximum`` holders, any number if that is None."""

    name: str
    minimum: int = 0
    maximum: int | None = None
    is_head: bool = False

    @property
    def cardinality(self) -> str:
        """How many may hold it, in short.

        >>> tuple(RoleDemand("a", *bounds).cardinality for bounds in ((1, 1), (0, 2), (1,), ()))
        ('(1)', '(0\u20132)', '(\u2265 1)', '')
        """
        if self.maximum is None:
            return f"(\u2265 {self.minimum})" if self.minimum else ""
        return f"({self.minimum})" if self.minimum == self.maximum else f"({self.minimum}\u2013{self.maximum})"


class GroupNode(NamedTuple):
    """A group: the one whose heads supervise it (empty if none does), and whether it is there from the start."""

    name: str
    above: str
    roles: tuple[RoleDemand, ...]
    is_founded: bool = True


def group_nodes(scenario: Mapping[str, Any], met: Iterable[RoleKey] = ()) -> list[GroupNode]:
    """Groups in the order of the scenario, then those that a table alone names.

    A group is supervised by the one that it is ``within``, or whose head forms it at sea (``formed_by``); one that has
    neither, nor a mission from the start, by the first that has a mission.

    Args:
        scenario: resolved.
        met: groups and roles that stand in the tables of the run.
    """
    declared = list(scenario.get("group", ()))
    leading = next((group["name"] for group in declared if group.get("mission")), "")
    found: dict[str, GroupNode] = {}
    for group in declared:
        flat = "" if group.get("mission") else leading
        above = group.get("formed_by") or group.get("within") or flat
        roles = tuple(_role(role) for role in group.get("role", ()))
        found[group["name"]] = GroupNode(group["name"], above, roles, not group.get("formed_by"))
    for name, role in met:
        group = found.get(name, GroupNode(name, "", ()))
        if role and all(role != other.name for other in group.roles):
            group = group._replace(roles=(*group.roles, RoleDemand(role)))
        found[name] = group
    return [group._replace(above=group.above if group.above in found else "") for group in found.values()]


def _role(role: Mapping[str, Any]) -> RoleDemand:
    return RoleDemand(role["name"], role.get("minimum", 0), role.get("maximum"), role.get("head", False))
