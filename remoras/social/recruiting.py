"""Recruiting: who of a group is to come into one that its head forms at sea."""

from __future__ import annotations

import math

from remoras.organisation import RoleAssignment
from remoras.work import Outlook, Work


def nearness(work: Work, vehicle: str) -> tuple[float, int]:
    """How soon a vehicle would have done the first of the open jobs, to be compared: the lesser is nearer.

    Args:
        work: of the group that has the jobs.
        vehicle: member or not.
    """
    data, here = work.database[vehicle], Outlook(work.now_s, work.position_m(vehicle))
    thens = [work.after(here, data, role) for role in work.open if work.affords(here, data, role)]
    return min((then.free_s for then in thens if then is not None), default=math.inf), data.node


def recruits(work: Work) -> list[RoleAssignment]:
    """Members of the forming group that are to come into a group formed at sea, where it lacks holders of roles.

    These are its founding roles without a job, but for that of the head, up to the fewest holders that each demands:
    the nearest vehicles that are able to.

    Args:
        work: of the group.
    """
    group, organisation = work.group, work.organisation
    if group.formed_by is None:
        return []
    assignments: list[RoleAssignment] = []
    taken = set(work.members)
    for role in group.roles:
        if not role.founding or role.head or role.job is not None:
            continue
        free = set(organisation.members(group.formed_by)).difference(taken, work.unavailable)
        able = [name for name in free if work.database[name].can_play(group.name, role.name)]
        chosen = sorted(able, key=lambda name: nearness(work, name))[: max(0, role.minimum - len(work.holders(role)))]
        assignments += [work.assignment(role, name) for name in chosen]
        taken.update(chosen)
    return assignments
