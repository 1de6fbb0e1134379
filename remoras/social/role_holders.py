"""Role holders: who holds a role with a job or with room for few, by all that was said of it, whatever was heard first.

An assignment finds room or waits. When a holder leaves, the newest of those that wait is let in, for want of newer
word: what is said later takes the room from it, and it waits again. Where heads alone give out jobs, holders that have
theirs from before a head led, or began anew, make room for whom it names: it may know nothing of what was told before,
and nobody would do what it gives out again. So this is a function of what was said and of no order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

from remoras.authority import NOBODY, Act, Request, Rules
from remoras.organisation import Group, Organisation, Outcome
from remoras.social.availability import Availability
from remoras.social.leadership import AGREED_BEFORE, Age, LeadershipHistory
from remoras.social.newest import Newest


class Instruction(NamedTuple):
    """When a role was given to a vehicle or taken from it; what was said at one time takes it before it gives it."""

    age: Age
    gives: bool
    vehicle: str


def holders_after(
    instructions: Iterable[Instruction],
    room: float,
    led_since: Callable[[Instruction], Age | None] = lambda instruction: None,
) -> tuple[set[str], list[str]]:
    """Who of at most ``room`` hold a role after all that was said of it, and who waits for room, the newest first.

    Args:
        instructions: in any order.
        room: for so many.
        led_since: since when the head that gave it has led: who holds the role from before makes room; or None.
    """
    holders: dict[str, bool] = {}  # with whether it was let in
    waiting: dict[str, Age] = {}
    given: dict[str, Age] = {}
    for instruction in sorted(instructions):
        age, gives, name = instruction
        waiting.pop(name, None)
        if gives:
            since = led_since(instruction)
            given[name] = age
            let_in = [one for one, was_let_in in holders.items() if was_let_in and one != name]
            if name in holders or len(holders) < room:
                holders[name] = False
            elif let_in:
                del holders[let_in[0]]
                waiting[let_in[0]] = given[let_in[0]]
                holders[name] = False
            elif since is not None and all(
                given[holder] < since or is_of_earlier_life(given[holder], age) for holder in holders
            ):
                holders = {name: False}
            else:
                waiting[name] = age
        elif holders.pop(name, None) is not None and waiting:
            newest = max(waiting, key=lambda vehicle: waiting[vehicle])
            del waiting[newest]
            holders[newest] = True
    return set(holders), sorted(waiting, key=lambda vehicle: waiting[vehicle], reverse=True)


def is_of_earlier_life(one: Age, other: Age) -> bool:
    """True if whoever said the other said the one before it began anew, and may know nothing of it."""
    return one[1] == other[1] and one[2] < other[2]


class RoleHolders:
    """What was said of the holders of roles with room for few, as one vehicle knows it.

    Args:
        rules: of who may change what.
        groups: specifications by name.
        organisation: as agreed before the mission.
        newest: when the newest statement about a role of a vehicle was said; leadership: who led when.
        availability: who takes jobs. All three are read only.
    """

    def __init__(
        self,
        rules: Rules,
        groups: Mapping[str, Group],
        organisation: Organisation,
        newest: Newest,
        leadership: LeadershipHistory,
        availability: Availability,
    ) -> None:
        self._availability = availability
        self._rules = rules
        self._groups = groups
        self._newest = newest
        self._leadership = leadership
        self._said: dict[tuple[str, str], dict[Instruction, Request]] = {}
        self._held: dict[tuple[str, str], set[str]] = {}
        self._crowded: set[tuple[str, str]] = set()  # where somebody waits
        for assignment in organisation.assignments:
            place = assignment.group, assignment.role
            asked = Request("", Act.ASSIGN, *place, assignment.vehicle)
            self._said.setdefault(place, {})[Instruction(AGREED_BEFORE, True, assignment.vehicle)] = asked
            self._held.setdefault(place, set()).add(assignment.vehicle)

    def forget(self, group: str) -> None:
        """The group is formed or dissolved."""
        for place in [place for place in self._said if place[0] == group]:
            del self._said[place], self._held[place]
            self._crowded.discard(place)

    def is_about(self, asked: Request) -> bool:
        """True if something is asked on which it depends who holds a role with room for few.

        Nobody waits for the role of a head that is succeeded: after it has left, the first in order claims the group.
        """
        group = self._groups[asked.group]
        is_claimed = asked.role == group.head_role and bool(group.succession)
        if asked.act not in (Act.ASSIGN, Act.RELEASE) or is_claimed:
            return False
        role = group.role(asked.role)
        return role is not None and (role.maximum is not None or role.job is not None)

    def yielding(self, asked: Request, age: Age, organisation: Organisation) -> frozenset[str]:
        """Holders of a role that have it from before the issuer led, and make room for whom it names."""
        since = self._led_since(asked, age) or AGREED_BEFORE
        holders = organisation.members(asked.group, asked.role)
        return frozenset(name for name in holders if self._newest.at(asked.group, asked.role, name) < since)

    def settle(
        self, asked: Request, age: Age, organisation: Organisation, absent: frozenset[str]
    ) -> tuple[list[Request], Outcome | None]:
        """What follows if what is ``asked`` at ``age`` counts among all that was said of the role.

        Args:
            asked: an assignment or a release.
            age: when.
            organisation: as agreed so far.
            absent: holders that make room if all do; where heads alone give out jobs they say so.

        Returns:
            Releases and assignments that follow, in this order, and why the vehicle in question does not get the role
            for now, if so: it waits for room, or takes no jobs.
        """
        place = asked.group, asked.role
        said = self._reconciled(place, organisation)
        held, gives = self._held[place], asked.act is Act.ASSIGN
        refused = None if self._counts(asked, age) else Outcome.UNAVAILABLE
        if gives and refused is None and len(held) >= self._room(*place) and asked.assignee not in held:
            yielding = absent if self._rules.authorities else NOBODY
            said |= {Instruction(age, False, name): _release(asked, name) for name in held if held <= yielding}
        said[Instruction(age, gives, asked.assignee)] = asked
        follows = self._follow(place, said, asked.issuer)
        return follows, Outcome.NO_ROOM if asked.assignee in self._after(place, said)[1] else refused

    def renew(self, group: str, issuer: str, organisation: Organisation) -> list[Request]:
        """What follows for the jobs of a group now that ``issuer`` has claimed it, so that more is known of who led."""
        found, jobs = [], {role.name for role in self._groups[group].roles if role.job is not None}
        for place in [place for place in self._said if place[0] == group and place[1] in jobs]:
            found += self._follow(place, self._reconciled(place, organisation), issuer)
        return found

    def _follow(self, place: tuple[str, str], said: Mapping[Instruction, Request], issuer: str) -> list[Request]:
        """Releases and assignments by which those hold a role that are to, after all that was said of it."""
        held, (holders, waiting) = self._held[place], self._after(place, said)
        self._held[place] = holders
        (self._crowded.add if waiting else self._crowded.discard)(place)
        follows = [Request(issuer, Act.RELEASE, *place, name) for name in sorted(held - holders)]
        return follows + [_last_given(said, name) for name in sorted(holders - held)]

    def waiting(self, organisation: Organisation) -> list[Request]:
        """Assignments for which there is room now, the newest of each role first: holders may have left otherwise.

        Where vehicles divide jobs among themselves, holders that are absent may make room.
        """
        found = []
        for place in sorted(self._crowded):
            said = self._reconciled(place, organisation)
            n_free, waiting = self._room(*place) - len(self._held[place]), self._after(place, said)[1]
            n_free = math.inf if self._rules.authorities else n_free
            found += [_last_given(said, name) for number, name in enumerate(waiting) if number < n_free]
        return found

    def _after(self, place: tuple[str, str], said: Mapping[Instruction, Request]) -> tuple[set[str], list[str]]:
        """Who holds a role and who waits for room after all that counts of what was said of it."""
        counting = [instruction for instruction, asked in said.items() if self._counts(asked, instruction.age)]
        return holders_after(counting, self._room(*place), lambda given: self._led_since(said[given], given.age))

    def _counts(self, asked: Request, age: Age) -> bool:
        """True unless the issuer, as is known now, led no more by then, or the assignee took no jobs."""
        if self._is_for_heads(asked) and not self._leadership.led(asked.issuer, asked.group, age):
            return False
        return asked.act is not Act.ASSIGN or self._availability.takes(asked, self._groups[asked.group], age)

    def _led_since(self, asked: Request, age: Age) -> Age | None:
        """Since when the issuer of an assignment has led, where heads alone give out the role; else None."""
        is_order = asked.act is Act.ASSIGN and self._is_for_heads(asked)
        return self._leadership.since(asked.issuer, asked.group, age) if is_order else None

    def _is_for_heads(self, asked: Request) -> bool:
        """True if heads alone may ask it: it gives out or takes back a role with a job that is another's."""
        role = self._groups[asked.group].role(asked.role)
        is_own = asked.issuer in ("", asked.assignee) and asked.act is Act.RELEASE
        return bool(asked.issuer and role and role.job and not is_own and not self._rules.authorities)

    def _room(self, group: str, role: str) -> float:
        of = self._groups[group].role(role)
        return math.inf if of is None or of.maximum is None else of.maximum

    def _reconciled(self, place: tuple[str, str], organisation: Organisation) -> dict[Instruction, Request]:
        """What was said of a role, with what has become of it by other ways, such as a claim to lead the group."""
        said = self._said.setdefault(place, {})
        held, now = self._held.get(place, set()), set(organisation.members(*place))
        for name in held ^ now:
            age = self._newest.at(*place, name)
            if name in held and said.pop(Instruction(age, True, name), None) is None:
                said[Instruction(age, False, name)] = Request("", Act.RELEASE, *place, name)
            elif name in now:
                said.setdefault(Instruction(age, True, name), Request("", Act.ASSIGN, *place, name))
        self._held[place] = now
        return said


def _release(asked: Request, name: str) -> Request:
    return Request(asked.issuer, Act.RELEASE, asked.group, asked.role, name)


def _last_given(said: Mapping[Instruction, Request], name: str) -> Request:
    return said[max(given for given in said if given.gives and given.vehicle == name)]
