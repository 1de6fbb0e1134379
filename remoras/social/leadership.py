"""Leadership history: who led a group when, as one vehicle knows it, and which claims to lead it count.

An order counts by who led when it was given, whatever is heard first: the order, or that its issuer leads. So this is a
function of what was heard, and of whom this vehicle has missed, and of no order. Before all claims lead those that
founded the group. Of the claims that count, and were made by a time, the greatest leads. A head that has left its role
leads no longer.

Nobody takes the lead from a head that is there. So a claim counts only against heads that are excused: the hearer has
not heard them for a lease since it heard the claim. Who led when the claim was made, and leads still, is asked; of two
who claim in one vacancy the one that did not know of the other is refused by nobody. A head that has never left may
claim again, and what others have claimed meanwhile is void, with all that they have ordered: those who went over to
another come back. So the head itself decides whether its silence was an absence, and all follow it: it claims again, or
it assents, which ends its lead for all who have heard it all the while. Who has lost its memory may assent to a claim
whose vehicle has assented to it, or after which it has claimed again: such an assent says nothing. A claim by who is a
member of the group only since it leads another counts as long as that lead does. (The vote before the claim in section
9.6 of D. Ongaro, Consensus: Bridging Theory and Practice, Stanford 2014, keeps a server that is cut off from disturbing
the others; here each hearer has that vote for itself.)
"""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import NamedTuple

from remoras.authority import NOBODY
from remoras.organisation import Organisation
from remoras.social.succession import Claim

Age = tuple[float, int, int, int, int]
"""Place in the world model's order of facts: time, origin, epoch and order of the block, then position in it."""
AGREED_BEFORE: Age = (-math.inf, 0, 0, 0, 0)
_NOW: Age = (math.inf, 0, 0, 0, 0)


class Claimed(NamedTuple):
    """A claim to lead a group, since when it was made, and the vehicle that made it."""

    claim: Claim
    since: Age
    vehicle: str


class LeadershipHistory:
    """When which vehicles led.

    Args:
        organisation: as agreed before the mission.

    Attributes:
        n_changes: how often something has become known.
    """

    def __init__(self, organisation: Organisation) -> None:
        self.n_changes = 0
        self._excused: dict[str, dict[Claimed, frozenset[str]]] = {}  # for each claim to lead a group, of what heads
        self._by_leading: dict[tuple[str, Claimed], str] = {}
        self._counting: dict[str, list[Claimed]] = {}
        self._began = {
            (group, name): [AGREED_BEFORE] for group in organisation.groups for name in organisation.heads(group)
        }
        self._ended: dict[tuple[str, str], list[Age]] = {}
        self._assents: dict[tuple[str, str, Age], str] = {}  # of those ends, to whose claim

    def claim(
        self, group: str, claimed: Claimed, excused: Collection[str] = NOBODY, by_leading: str | None = None
    ) -> bool:
        """A vehicle has claimed to lead a group; True if that counts.

        Args:
            group: its name; claimed: the claim.
            excused: vehicles that do not stand against it, as far as is known here; what was excused once stays so.
            by_leading: a group by whose lead alone the vehicle is a member: the claim counts if it led that by then.
        """
        claims = self._excused.setdefault(group, {})
        before = claims.get(claimed)
        if before is None or not before.issuperset(excused):
            self.n_changes += 1
            claims[claimed] = (before or NOBODY).union(excused)
            if by_leading is not None:
                self._by_leading[group, claimed] = by_leading
            self._weigh(group)
        return claimed in self._counting[group]

    def miss(self, absent: Collection[str]) -> None:
        """These do not stand any more against claims that do not count yet."""
        for group, claims in self._excused.items():
            refused = [one for one in claims if one not in self._counting[group] and not claims[one].issuperset(absent)]
            if refused:
                self.n_changes += 1
                claims.update((one, claims[one].union(absent)) for one in refused)
                self._weigh(group)

    def is_member(self, group: str, claimed: Claimed) -> bool:
        """False if who claimed a group was a member of it by the lead of another alone, which it had not."""
        of = self._by_leading.get((group, claimed))
        return of is None or self.led(claimed.vehicle, of, claimed.since)

    @property
    def leading(self) -> dict[str, Claimed]:
        """The claim by which each group is led that is led by one."""
        reigns = {group: self._reigns(group)[-1:] for group in self._counting}
        return {group: last[0] for group, last in reigns.items() if last and not self._has_left(group, last[0], _NOW)}

    @property
    def claimed(self) -> list[str]:
        """Groups that somebody has claimed to lead."""
        return list(self._excused)

    def without_claims(self, group: str) -> tuple[str, Age] | None:
        """Who leads a group without a claim, and since when; None if nobody does."""
        names = [name for of, name in self._began if of == group and self.led(name, group, _NOW)]
        since = {name: self.since(name, group, _NOW) for name in names}
        return next(((name, age) for name, age in since.items() if age is not None), None)

    def _weigh(self, group: str) -> None:
        """See which claims count, the lesser ones first."""
        counting: list[Claimed] = []
        self._counting[group] = counting
        for claimed, excused in sorted(self._excused.get(group, {}).items()):
            if not self.is_member(group, claimed):
                continue
            began = self._has_led_since(group, claimed, counting)
            if began is not None:
                meanwhile = [one for one in counting if began <= one.since < claimed.since]
                counting[:] = [one for one in counting if one.vehicle == claimed.vehicle or one not in meanwhile]
            elif not self._heads_against(group, claimed, counting) <= excused:
                continue
            counting.append(claimed)
        for above in {of for (of, _), by in self._by_leading.items() if by == group and of != group}:
            self._weigh(above)

    def _has_led_since(self, group: str, claimed: Claimed, counting: list[Claimed]) -> Age | None:
        """Since when who claims has led and has not left itself, whoever has claimed meanwhile; None if it has not."""
        about = group, claimed.vehicle
        began = list(self._began.get(about, ()))
        began += [one.since for one in counting if one.vehicle == claimed.vehicle]
        left = [age for age in self._ends(*about) if age <= claimed.since]
        return min((age for age in began if age < claimed.since and not any(age < end for end in left)), default=None)

    def _reigns(self, group: str) -> list[Claimed]:
        """The claims by which a group was led one after another: each is greater, or the head before had left."""
        reigns: list[Claimed] = []
        for one in sorted(self._counting.get(group, ()), key=lambda claimed: claimed.since):
            if not reigns or one.claim > reigns[-1].claim or self._has_left(group, reigns[-1], one.since):
                reigns.append(one)
        return reigns

    def _has_left(self, group: str, reign: Claimed, by: Age) -> bool:
        """True if who leads a group by a claim had left by then."""
        return any(reign.since < age <= by for age in self._ends(group, reign.vehicle))

    def _ends(self, group: str, vehicle: str) -> list[Age]:
        """When a vehicle left the lead of a group, or assented to a claim that it had not answered, nor its author."""
        ends = self._ended.get((group, vehicle), ())
        return [age for age in ends if not self._is_void(group, vehicle, age)]

    def _is_void(self, group: str, vehicle: str, age: Age) -> bool:
        to = self._assents.get((group, vehicle, age))
        if to is None:
            return False
        claims = [one for one in self._excused.get(group, ()) if one.since < age]
        since = max([one.since for one in claims if one.vehicle == to], default=AGREED_BEFORE)
        ends = [end for end in self._ended.get((group, to), ()) if self._assents.get((group, to, end)) == vehicle]
        answers = [one.since for one in claims if one.vehicle == vehicle]  # it has claimed again
        return any(since < at < age for at in (*ends, *answers))

    def _heads_against(self, group: str, claimed: Claimed, counting: list[Claimed]) -> set[str]:
        """Others that led a group when it was claimed, and lead it still, by the lesser claims."""
        names = {name for of, name in self._began if of == group} | {one.vehicle for one in counting}
        return {
            name
            for name in names - {claimed.vehicle}
            if self.led(name, group, claimed.since) and self.led(name, group, _NOW)
        }

    def is_claim(self, age: Age) -> bool:
        """True if what was said at ``age`` is a claim to lead a group."""
        return any(age == claimed.since for of in self._excused.values() for claimed in of)

    def change(self, group: str, vehicle: str, leads: bool, age: Age, to: str | None = None) -> None:
        """A vehicle was given the role of the head at ``age``, or has left it, or assents ``to`` another's claim."""
        ages = (self._began if leads else self._ended).setdefault((group, vehicle), [])
        if age in ages:
            return
        self.n_changes += 1
        ages.append(age)
        if to is not None:
            self._assents[group, vehicle, age] = to
        if group in self._excused:
            self._weigh(group)

    def begin(self, group: str, vehicle: str | None, age: Age) -> None:
        """A group is formed anew, led by ``vehicle`` since ``age``; it is dissolved if None."""
        self.n_changes += 1
        self._excused.pop(group, None)
        self._counting.pop(group, None)
        self._by_leading = {key: by for key, by in self._by_leading.items() if group not in (key[0], by)}
        self._assents = {key: to for key, to in self._assents.items() if key[0] != group}
        for ages in (self._began, self._ended):
            for key in [key for key in ages if key[0] == group]:
                del ages[key]
        if vehicle is not None:
            self._began[group, vehicle] = [age]

    def led(self, vehicle: str, group: str, at: Age) -> bool:
        """True if the vehicle led the group at ``at``."""
        return self.since(vehicle, group, at) is not None

    def has_claimed(self, vehicle: str, group: str) -> bool:
        """True if the vehicle has led the group, or has claimed to."""
        return (group, vehicle) in self._began or any(one.vehicle == vehicle for one in self._excused.get(group, ()))

    def has_led(self, vehicle: str, group: str, at: Age) -> bool:
        """True if the vehicle has led the group at any time before ``at``."""
        began = list(self._began.get((group, vehicle), ()))
        began += [one.since for one in self._counting.get(group, ()) if one.vehicle == vehicle]
        return any(age < at for age in began)

    def since(self, vehicle: str, group: str, at: Age) -> Age | None:
        """Since when the vehicle led the group at ``at``; None if it did not."""
        began, ended = list(self._began.get((group, vehicle), ())), self._ends(group, vehicle)
        for reign in self._reigns(group):
            (began if reign.vehicle == vehicle else ended).append(reign.since)
        latest = max((age for age in began if age <= at), default=None)
        return None if latest is None or any(latest < age <= at for age in ended) else latest
