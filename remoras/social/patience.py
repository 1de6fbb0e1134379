"""Patience: what a vehicle that is cut off leaves to the others, and until when.

It cannot know whether the others are lost or out of its reach. So it does its own jobs and goes to the meeting of its
groups. Until the others should have done what they have to do, and have come, their jobs are theirs; by then whoever
can come has come, and it meets with them, seen or not. Only when that has brought no contact either, it takes the
others to be lost and does what they have not told to be done.

A job is its holder's. Whose it is if nobody is known to have it all who are cut off have to see alike, whatever each
heard last: so it is whose the strategy's messages have made it, which all have heard again and again, and where they do
not say, what follows from what all have known since before the mission (`owners`). That counts from when a vehicle has
heard nobody for a part of a lease: what it took between then and the end of the lease nobody would know of.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from typing import NamedTuple

from exchange.arithmetic import distance
from remoras.organisation import Organisation
from remoras.work import Outlook, Point, Work

LATE = 1.2
"""A vehicle may take longer for what it has left, by this factor, than its data say."""


class Patience(NamedTuple):
    """What a vehicle that is cut off leaves to others.

    Attributes:
        theirs_until_s: until when the jobs of the others are theirs.
        ends_s: until when they are nobody's.
        barred: (vehicle, role) of jobs that are another's.
    """

    theirs_until_s: float = -math.inf
    ends_s: float = -math.inf
    barred: frozenset[tuple[str, str]] = frozenset()


def with_work(present: Organisation, organisation: Organisation, absent: Collection[str]) -> Organisation:
    """The organisation as a vehicle that is cut off acts on it, with the roles of the absent but those of heads."""
    for role in sorted(organisation.assignments):
        if role.vehicle in absent and role.role != organisation.groups[role.group].head_role:
            present, _ = present.assign(role.vehicle, role.group, role.role)
    return present


def owners(whole: Work) -> dict[str, str]:
    """Who is to do the job of each role that has no holder: the longest first, each goes to who would be done first.

    Args:
        whole: work of a group before the mission has begun.
    """
    owner_of: dict[str, str] = {}
    at = {data.name: Outlook(0.0, data.start_m) for data in whole.workers}

    def ends(role: str) -> list[tuple[float, str, Outlook]]:
        of = next(of for of in whole.roles if of.name == role)
        after = ((name, whole.after(here, whole.database[name], of)) for name, here in at.items())
        return [(then.free_s, name, then) for name, then in after if then is not None]

    takes_s = {role.name: min((end_s for end_s, *_ in ends(role.name)), default=0.0) for role in whole.roles}
    for role in sorted(takes_s, key=lambda name: (-takes_s[name], name)):
        if could := ends(role):
            _, owner_of[role], at[owner_of[role]] = min(could)
    return owner_of


def patience_with(
    all_work: Iterable[tuple[Work, Work, Mapping[str, str]]],
    me: str,
    known_s: Mapping[str, float],
    rallies_m: Mapping[str, Point],
    now_s: float,
    lease_s: float,
) -> Patience:
    """What a vehicle has that is cut off: by what it knew last of where the others were, and what they had to do.

    As all who are cut off at once notice it within a lease, they wait so much longer for each other, and for the ways
    from one meeting to the next.

    Args:
        all_work: of the groups, with those who are absent: before the mission has begun, and now; and who is to do
            the jobs of roles, by the strategy's messages.
        me: name of the vehicle.
        known_s: when each vehicle was heard of last.
        rallies_m: rally points by name.
        now_s: from when it leaves that to others.
        lease_s: how long a peer counts as present of which there is no word.
    """
    until_s, way_s, barred = now_s, 0.0, set[tuple[str, str]]()
    for whole, work, division in all_work:
        rally_m = rallies_m.get(work.group.rally_point or "")
        of_nobody = {**owners(whole), **division}
        of = {role.name: work.holders(role) or (of_nobody.get(role.name, ""),) for role in work.unfinished}
        for data in work.workers:
            barred |= {(data.name, role) for role, names in of.items() if data.name not in names}
            if data.name == me:
                continue
            since_s = known_s.get(data.name, 0.0)
            own = [role for role in work.unfinished if data.name in of[role.name]]
            end = work.after_all(Outlook(since_s, work.position_m(data.name)), data, own)
            way_m = 0.0 if rally_m is None else distance(end.position_m, rally_m)
            until_s = max(until_s, since_s + LATE * (end.free_s + way_m / data.transit_speed_mps - since_s))
        if rally_m is not None and me in work.members:
            way_m = max(distance(rally_m, other_m) for other_m in rallies_m.values())
            way_s = max(way_s, way_m / work.database[me].transit_speed_mps)
    return Patience(until_s, until_s + LATE * way_s + lease_s, frozenset(barred))
