"""Who founds the groups: the same for every shipped strategy, so that they differ in nothing but allocation.

Founding is one assignment over all founding roles of all groups. Every such role needs as many holders as its minimum
says, a head one; whenever all can be had at once, all are. Of those able, first come those that name the role before
their other founding roles among the roles they can play, then those with the most energy. Who has a role in a group
takes another one of it, or one of a group on another branch of the same nesting, only where it cannot be done
otherwise. Then those who are left take what has room; groups within others get them in turns. Who is able to play
nothing that has room is a reserve. A head needs the social layer; a role may have to be played by the holder of another
(a Coordinator is the Tactician of the group above). Source: Carlesi, Michel, Jouvencel, Ferber 2011, sections IV, VII.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from itertools import combinations

from remoras.database import AUVDatabase, VehicleData
from remoras.nesting import apart
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.strategies.seats import Seats
from remoras.work import Work

Founding = tuple[Group, RoleSpecification]


def founded(database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
    """Groups and their founding roles: ``form`` of every shipped strategy."""
    founders = _Founders(database, groups)
    return founders.all_others(founders.needed())


class _Founders:
    """Who is to play the founding roles.

    Args:
        database: static data of all vehicles.
        groups: with the demands of their roles.
    """

    def __init__(self, database: AUVDatabase, groups: Sequence[Group]) -> None:
        self._database, self._groups, self._apart = database, groups, apart(groups)
        self._founding = list(_in_order([(group, role) for group in groups for role in group.roles if role.founding]))
        names = {name for group, role in self._founding for name in (role.name, group.path(role.name))}
        self._ranks = {data.name: _ranks(data, names) for data in database.values()}
        self._keys = [(group.name, role.name) for group, role in self._founding]
        self._eligible = {(group.name, role.name): self._suited(group, role) for group, role in self._founding}

    def needed(self) -> Organisation:
        """Groups and the founding roles that somebody has to hold, each held by as few as it demands.

        One after the other is given to who comes first. If that leaves one without a holder, or a vehicle with more
        than it need have, each is given to the first with whom the rest can still be had.
        """
        found = Organisation.of(self._groups)
        for group, role in self._founding:
            for data in self._able(found, group, role)[: _n_needed(role)]:
                found, _ = found.assign(data.name, group.name, role.name)
        if all(self._is_filled(found, *place) for place in self._founding) and not self._n_doubled(found):
            return found
        able = [[data.name for data in self._eligible[role]] for role in self._keys]
        best = Seats(self._founding, [_n_needed(role) for _, role in self._founding], able, self._apart).filled()
        if best is None:
            return found
        exact = Organisation.of(self._groups, best)
        is_as_good = all(self._is_filled(found, *place) for place in self._founding)
        return found if is_as_good and self._n_doubled(found) <= self._n_doubled(exact) else exact

    def all_others(self, organisation: Organisation) -> Organisation:
        """The organisation in which those who are left have founding roles with room."""
        while True:
            room = [
                (0 if group.within is None else len(organisation.members(group.name)), number, group, role, able[0])
                for number, (group, role) in enumerate(self._founding)
                if (able := self._left(organisation, group, role))
            ]
            if not room:
                return organisation
            _, _, group, role, data = min(room, key=lambda seat: seat[:2])
            organisation, _ = organisation.assign(data.name, group.name, role.name)

    def _left(self, organisation: Organisation, group: Group, role: RoleSpecification) -> list[VehicleData]:
        """Who may take a role that has room, without having another one in the group or beside it."""
        if role.maximum is not None and len(organisation.members(group.name, role.name)) >= role.maximum:
            return []
        able = self._able(organisation, group, role)
        return [data for data in able if not self._is_taken(organisation, data.name, group)]

    def _suited(self, group: Group, role: RoleSpecification) -> list[VehicleData]:
        """Vehicles able to play a role, those first whom it suits best."""
        able = self._database.able_to_play(group.name, role.name)
        able = tuple(data for data in able if data.social_layer or not role.head)
        return sorted(able, key=lambda data: (self._rank(data, group, role), -data.energy_j, data.node))

    def _able(self, organisation: Organisation, group: Group, role: RoleSpecification) -> list[VehicleData]:
        """Those who may take the role beside what they hold, those first who hold nothing there."""
        able = [
            data
            for data in self._eligible[group.name, role.name]
            if (role.played_by is None or organisation.plays(data.name, *role.played_by))
            and not organisation.is_excluded(data.name, role)
            and not organisation.plays(data.name, group.name, role.name)
        ]
        return sorted(able, key=lambda data: self._is_taken(organisation, data.name, group))

    def _rank(self, data: VehicleData, group: Group, role: RoleSpecification) -> int:
        ranks = self._ranks[data.name]
        return min(ranks.get(role.name, len(ranks)), ranks.get(group.path(role.name), len(ranks)))

    def _is_taken(self, organisation: Organisation, vehicle: str, group: Group) -> bool:
        """True if it plays a role in the group, or in one that is apart from it."""
        return any(organisation.is_member(vehicle, name) for name in (group.name, *self._apart[group.name]))

    def _is_filled(self, organisation: Organisation, group: Group, role: RoleSpecification) -> bool:
        return len(organisation.members(group.name, role.name)) >= _n_needed(role)

    def _n_doubled(self, organisation: Organisation) -> int:
        """How many pairs of roles vehicles hold of one group, or of groups that are apart."""
        pairs = (pair for name in self._database for pair in combinations(organisation.roles_of(name), 2))
        return sum(one.group == other.group or other.group in self._apart[one.group] for one, other in pairs)


def _n_needed(role: RoleSpecification) -> int:
    return max(1, role.minimum) if role.head else role.minimum


def _ranks(data: VehicleData, founding: Collection[str]) -> dict[str, int]:
    """How early a vehicle names each founding role among those that it can play."""
    return {name: n for n, name in enumerate(name for name in data.playable_roles if name in founding)}


def _in_order(founding: list[Founding]) -> Iterator[Founding]:
    """Founding roles in the order in which they are given: heads, then the roles of groups that have one."""
    done: set[tuple[str, str]] = set()
    while ready := [
        (group, role)
        for group, role in founding
        if (group.name, role.name) not in done and (role.played_by is None or role.played_by in done)
    ]:
        led = {group.name for group, role in founding if role.head and (group.name, role.name) in done}
        heads_first = [(group, role) for group, role in ready if role.head or group.name in led]
        for group, role in heads_first or ready:
            done.add((group.name, role.name))
            yield group, role


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
