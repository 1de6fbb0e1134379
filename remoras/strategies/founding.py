"""Who founds the groups: the same for every shipped strategy, so that they differ in nothing but allocation.

Every founding role goes to the vehicles able to play it, as many as it allows: first those that name it before their
other founding roles among the roles they can play, then those with the most energy. Who has a role in a group takes
another one of it only where too few others are able to. A head needs the social layer; a role may have to be played by
the holder of another (a Coordinator is the Tactician of the group above). Source: Carlesi, Michel, Jouvencel, Ferber
2011, sections IV and VII.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from remoras.database import AUVDatabase, VehicleData
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.work import Work


def founded(database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
    """Groups and their founding roles: ``form`` of every shipped strategy."""
    organisation = Organisation.of(groups)
    founding = [(group.name, role) for group in groups for role in group.roles if role.founding]
    names = {role.name for _, role in founding}
    done: set[tuple[str, str]] = set()
    while ready := [
        (group, role)
        for group, role in founding
        if (group, role.name) not in done and (role.played_by is None or role.played_by in done)
    ]:
        led = {group for group, role in founding if role.head and (group, role.name) in done}
        heads_first = [(group, role) for group, role in ready if role.head or group in led]
        for group, role in heads_first or ready:
            done.add((group, role.name))
            for data in _founders(database, organisation, group, role, names):
                organisation, _ = organisation.assign(data.name, group, role.name)
    return organisation


def _founders(
    database: AUVDatabase, organisation: Organisation, group: str, role: RoleSpecification, founding: Collection[str]
) -> list[VehicleData]:
    """Who is to play a founding role of a group; ``founding`` are the names of all such roles."""
    able = [data for data in database.able_to_play(group, role.name) if data.social_layer or not role.head]
    if role.played_by is not None:
        holders = organisation.members(*role.played_by)
        able = [data for data in able if data.name in holders]

    def order(data: VehicleData) -> tuple[bool, int, float, int]:
        before = [name for name in data.playable_roles if name in founding].index(role.name)
        return organisation.is_member(data.name, group), before, -data.energy_j, data.node

    able.sort(key=order)
    n_others = sum(not organisation.is_member(data.name, group) for data in able)
    n_founders = max(n_others, role.minimum)
    return able[: n_founders if role.maximum is None else min(n_founders, role.maximum)]


def common_roles(work: Work, working: Collection[str] | None = None) -> tuple[RoleAssignment, ...]:
    """Roles without a job that members able to play them do not play yet, as many as a role allows.

    This is ``adapt`` of the strategies whose vehicles divide the jobs during the mission.

    Args:
        work: of the group.
        working: vehicles for which the roles are, others take them only where a role demands more; all if None.
    """
    group, organisation, database = work.group, work.organisation, work.database
    members = [name for name in database.names if organisation.is_member(name, group.name)]
    allocated: list[RoleAssignment] = []
    for role in group.roles:
        if role.founding or role.job is not None:
            continue
        held = organisation.members(group.name, role.name)
        able = [
            name
            for name in members
            if database[name].can_play(group.name, role.name)
            and name not in held
            and not organisation.is_excluded(name, role)
        ]
        free = len(able) if role.maximum is None else max(0, role.maximum - len(held))
        if working is not None:
            able.sort(key=lambda name: name not in working)
            n_demanded = role.minimum - len(held)
            free = min(free, max(sum(name in working for name in able), n_demanded))
        allocated += [work.assignment(role, name) for name in able[:free]]
    return tuple(allocated)
