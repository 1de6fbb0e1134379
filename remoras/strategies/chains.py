"""Chains of jobs that need each other, for a plan that nobody can change once the vehicles have dived.

A vehicle that hears nothing knows only of the jobs that it has done itself. So jobs that need each other, directly or
through others, go to one vehicle, which does them in an order that their needs allow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from remoras.beliefs import Key
from remoras.database import VehicleData
from remoras.organisation import RoleSpecification
from remoras.work import Job, Outlook, Point, Work


@dataclass(frozen=True)
class ChainOfJobs:
    """Jobs done by one vehicle, one after the other, as one job under the name of the first.

    Attributes:
        group: whose roles have the jobs.
        links: name of the role and the job of each, in the order in which they are done.
        needs: jobs outside of the chain that must be done before.
    """

    group: str
    links: tuple[tuple[str, Job], ...]
    needs: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the first job."""
        return self.links[0][1].name

    @property
    def place_m(self) -> Point:
        """Where it begins."""
        return self.links[0][1].place_m

    @property
    def done(self) -> Key:
        """The last job is done."""
        return self.links[-1][1].done

    def is_able(self, data: VehicleData) -> bool:
        """True if the vehicle is able to do every one of the jobs."""
        return all(data.can_play(self.group, role) and job.is_able(data) for role, job in self.links)

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """When and where the vehicle will have done all of them; None if it is not able to do one."""
        if not self.is_able(data):
            return None
        for _, job in self.links:
            then = job.after(outlook, data)
            if then is None:
                return None
            outlook = then
        return outlook


def chains(work: Work) -> list[tuple[RoleSpecification, ...]]:
    """Roles whose jobs need each other, together, each in an order in which they can be done; most stand alone."""
    found: list[list[RoleSpecification]] = []
    for role in work.roles:
        joined = [chain for chain in found if any(_are_linked(role, other, work) for other in chain)]
        found = [chain for chain in found if chain not in joined]
        found.append([*(other for chain in joined for other in chain), role])
    return [_in_order(chain, work) for chain in found]


def _are_linked(one: RoleSpecification, other: RoleSpecification, work: Work) -> bool:
    return one.job in work.job(other).needs or other.job in work.job(one).needs


def _in_order(roles: list[RoleSpecification], work: Work) -> tuple[RoleSpecification, ...]:
    left = sorted(roles, key=work.roles.index)
    ordered: list[RoleSpecification] = []
    while left:
        waiting = {role.job for role in left}
        role = next(role for role in left if waiting.isdisjoint(work.job(role).needs))
        left.remove(role)
        ordered.append(role)
    return tuple(ordered)


def chained(work: Work) -> Work:
    """The same work where what is left of a chain is the one job of its first role, and its other roles are not seen.

    A chain that somebody has begun is left to that vehicle: nothing of it is vacant.
    """
    longer = [chain for chain in chains(work) if len(chain) > 1]
    if not longer:
        return work
    unseen: set[str] = set()
    jobs = dict(work.jobs)
    for chain in longer:
        left = [role for role in chain if role in work.unfinished]
        if not left:
            continue
        is_begun = any(work.holders(role) for role in chain)
        unseen.update(role.name for role in left[0 if is_begun and not work.holders(left[0]) else 1 :])
        within = {role.job for role in chain}
        needs = tuple(need for role in left for need in work.job(role).needs if need not in within)
        jobs[left[0].job or ""] = ChainOfJobs(
            work.group.name, tuple((role.name, work.job(role)) for role in left), needs
        )
    roles = tuple(role for role in work.group.roles if role.name not in unseen)
    return replace(work, group=replace(work.group, roles=roles), jobs=jobs)
