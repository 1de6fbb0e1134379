"""Who founds the groups: the same for every shipped strategy, so that they differ in nothing but allocation.

Every founding role goes to the vehicles able to play it, as many as it allows, those with the most energy first; a
head needs the social layer; a role may have to be played by the holder of another (a Coordinator is the Tactician
of the group above). Source: Carlesi, Michel, Jouvencel, Ferber 2011, sections IV and VII.
"""

from __future__ import annotations

from collections.abc import Sequence

from remoras.database import AUVDatabase, VehicleData
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.work import Work


def founded(database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
    """Groups and their founding roles: ``form`` of every shipped strategy."""
    organisation = Organisation.of(groups)
    founding = [(group.name, role) for group in groups for role in group.roles if role.founding]
    done: set[tuple[str, str]] = set()
    while ready := [
        (group, role)
        for group, role in founding
        if (group, role.name) not in done and (role.played_by is None or role.played_by in done)
    ]:
        for group, role in ready:
            done.add((group, role.name))
            for data in _founders(database, organisation, role):
                organisation, _ = organisation.assign(data.name, group, role.name)
    return organisation


def _founders(database: AUVDatabase, organisation: Organisation, role: RoleSpecification) -> list[VehicleData]:
    able = [data for data in database.able_to_play(role.name) if data.social_layer or not role.head]
    if role.played_by is not None:
        holders = organisation.members(*role.played_by)
        able = [data for data in able if data.name in holders]
    able.sort(key=lambda data: (-data.energy_j, data.node))
    return able if role.maximum is None else able[: role.maximum]


def common_roles(work: Work) -> tuple[RoleAssignment, ...]:
    """Roles without a job that members able to play them do not play yet, as many as a role allows.

    This is ``adapt`` of the strategies whose vehicles divide the jobs during the mission.
    """
    group, organisation, database = work.group, work.organisation, work.database
    members = [name for name in database.names if organisation.is_member(name, group.name)]
    allocated: list[RoleAssignment] = []
    for role in group.roles:
        if role.founding or role.job is not None:
            continue
        held = organisation.members(group.name, role.name)
        able = [name for name in members if database[name].can_play(role.name) and name not in held]
        free = len(able) if role.maximum is None else max(0, role.maximum - len(held))
        allocated += [work.assignment(role, name) for name in able[:free]]
    return tuple(allocated)
