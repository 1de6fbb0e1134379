"""Tenures: who holds a role with room for few, by all that was said of it, whatever was heard first.

An assignment finds room or waits. When a holder leaves, the newest of those that wait is let in, for want of newer
word: what is said later takes the room from it, and it waits again. So this is a function of what was said and of no
order.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from remoras.authority import Act, Request
from remoras.organisation import Group, Organisation
from remoras.social.newest import Newest
from remoras.social.reigns import AGREED_BEFORE, Age


class Word(NamedTuple):
    """When a role was given to a vehicle or taken from it; what was said at one time takes it before it gives it."""

    age: Age
    gives: bool
    vehicle: str


def holders_after(words: Iterable[Word], room: float) -> tuple[set[str], list[str]]:
    """Who of at most ``room`` hold a role after all that was said of it, and who waits for room, the newest first."""
    holders: dict[str, bool] = {}  # with whether it was let in
    waiting: dict[str, Age] = {}
    given: dict[str, Age] = {}
    for age, gives, name in sorted(words):
        waiting.pop(name, None)
        if gives:
            given[name] = age
            let_in = [one for one, was_let_in in holders.items() if was_let_in and one != name]
            if name in holders or len(holders) < room:
                holders[name] = False
            elif let_in:
                del holders[let_in[0]]
                waiting[let_in[0]] = given[let_in[0]]
                holders[name] = False
            else:
                waiting[name] = age
        elif holders.pop(name, None) is not None and waiting:
            newest = max(waiting, key=lambda one: waiting[one])
            del waiting[newest]
            holders[newest] = True
    return set(holders), sorted(waiting, key=lambda one: waiting[one], reverse=True)


class Tenures:
    """What was said of the holders of roles with room for few, as one vehicle knows it.

    Args:
        groups: specifications by name.
        organisation: as agreed before the mission.
        newest: when the newest word of a role of a vehicle was said; it is read only.
    """

    def __init__(self, groups: Mapping[str, Group], organisation: Organisation, newest: Newest) -> None:
        self._groups = groups
        self._newest = newest
        self._said: dict[tuple[str, str], dict[Word, Request]] = {}
        self._held: dict[tuple[str, str], set[str]] = {}
        self._crowded: set[tuple[str, str]] = set()  # where somebody waits
        for one in organisation.assignments:
            place = one.group, one.role
            asked = Request("", Act.ASSIGN, *place, one.vehicle)
            self._said.setdefault(place, {})[Word(AGREED_BEFORE, True, one.vehicle)] = asked
            self._held.setdefault(place, set()).add(one.vehicle)

    def forget(self, group: str) -> None:
        """The group is formed or dissolved."""
        for place in [place for place in self._said if place[0] == group]:
            del self._said[place], self._held[place]
            self._crowded.discard(place)

    def is_about(self, asked: Request) -> bool:
        """True if something is asked on which it depends who holds a role with room for few."""
        return asked.act in (Act.ASSIGN, Act.RELEASE) and self._room(asked.group, asked.role) < math.inf

    def settle(
        self, asked: Request, age: Age, organisation: Organisation, yielding: frozenset[str]
    ) -> tuple[list[Request], bool]:
        """What follows if what is ``asked`` at ``age`` counts among all that was said of the role.

        Args:
            asked: an assignment or a release.
            age: when.
            organisation: as agreed so far.
            yielding: holders that make room, if they all do.

        Returns:
            Releases and assignments that follow, in this order, and whether the vehicle in question waits for room.
        """
        place, gives = (asked.group, asked.role), asked.act is Act.ASSIGN
        said = self._reconciled(place, organisation)
        held, room = self._held[place], self._room(*place)
        if gives and len(held) >= room and asked.assignee not in held and held <= yielding:
            said |= {Word(age, False, name): _release(asked, name) for name in held}
        said[Word(age, gives, asked.assignee)] = asked
        holders, waiting = holders_after(said, room)
        self._held[place] = holders
        (self._crowded.add if waiting else self._crowded.discard)(place)
        follows = [_release(asked, name) for name in sorted(held - holders)]
        follows += [_last_given(said, name) for name in sorted(holders - held)]
        return follows, asked.assignee in waiting

    def waiting(self, organisation: Organisation) -> list[Request]:
        """Assignments that wait for room, the newest of each role first: holders may have left by other ways."""
        found = []
        for place in sorted(self._crowded):
            said = self._reconciled(place, organisation)
            found += [_last_given(said, name) for name in holders_after(said, self._room(*place))[1]]
        return found

    def _room(self, group: str, role: str) -> float:
        of = self._groups[group].role(role)
        return math.inf if of is None or of.maximum is None else of.maximum

    def _reconciled(self, place: tuple[str, str], organisation: Organisation) -> dict[Word, Request]:
        """What was said of a role, with what has become of it by other ways, such as a claim to lead the group."""
        said = self._said.setdefault(place, {})
        held, now = self._held.get(place, set()), set(organisation.members(*place))
        for name in held ^ now:
            age = self._newest.at(*place, name)
            asked = Request(name, Act.ASSIGN if name in now else Act.RELEASE, *place, name)
            if name in held and said.pop(Word(age, True, name), None) is None:
                said[Word(age, False, name)] = asked
            elif name in now:
                said[Word(age, True, name)] = asked
        self._held[place] = now
        return said


def _release(asked: Request, name: str) -> Request:
    return Request(asked.issuer, Act.RELEASE, asked.group, asked.role, name)


def _last_given(said: Mapping[Word, Request], name: str) -> Request:
    return said[max(word for word in said if word.gives and word.vehicle == name)]
