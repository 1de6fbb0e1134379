"""Leadership: who led a group when, as one vehicle knows it, and which claims to lead it count. An immutable value.

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
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
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


@dataclass(frozen=True, slots=True)
class Lead:
    """What is known of the lead of one group.

    Attributes:
        claims: to lead it, each with the heads that do not stand against it.
        by_leading: of claims by who is a member by the lead of another group alone: that group.
        began: vehicles that were given the role of the head, and when.
        ended: vehicles that left it, and when; with the vehicle to whose claim they assented, if it was by that.
    """

    claims: Mapping[Claimed, frozenset[str]] = field(default_factory=dict)
    by_leading: Mapping[Claimed, str] = field(default_factory=dict)
    began: frozenset[tuple[str, Age]] = frozenset()
    ended: Mapping[tuple[str, Age], str | None] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Leadership:
    """When which vehicles led. What becomes known gives another value; the same one where it was known.

    Attributes:
        groups: the lead of each, by name.
    """

    groups: Mapping[str, Lead]
    _counting: dict[str, list[Claimed]] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def founded(cls, organisation: Organisation, at_sea: Iterable[str] = ()) -> Leadership:
        """By what was agreed before the mission; nobody leads yet what is formed at sea."""
        heads = {group: organisation.heads(group) for group in organisation.groups} | dict.fromkeys(at_sea, ())
        return cls({group: Lead(began=frozenset((name, AGREED_BEFORE) for name in of)) for group, of in heads.items()})

    # What becomes known --------------------------------------------------------------------------

    def claim(
        self, group: str, claimed: Claimed, excused: Collection[str] = NOBODY, by_leading: str | None = None
    ) -> Leadership:
        """A vehicle has claimed to lead a group.

        Args:
            group: its name; claimed: the claim.
            excused: vehicles that do not stand against it, as far as is known here; what was excused once stays so.
            by_leading: a group by whose lead alone the vehicle is a member: the claim counts if it led that by then.
        """
        lead = self.groups[group]
        before = lead.claims.get(claimed)
        if before is not None and before.issuperset(excused):
            return self
        claims = {**lead.claims, claimed: (before or NOBODY).union(excused)}
        by = lead.by_leading if by_leading is None else {**lead.by_leading, claimed: by_leading}
        # Groups stand in the order in which they were claimed first: so they are crowned, and assented to.
        others = {name: of for name, of in self.groups.items() if name != group or lead.claims}
        return Leadership({**others, group: replace(lead, claims=claims, by_leading=by)})

    def miss(self, absent: Collection[str]) -> Leadership:
        """These do not stand any more against claims that do not count yet."""
        after = self
        for group, lead in self.groups.items():
            excused = {
                claimed: heads.union(absent)
                for claimed, heads in lead.claims.items()
                if not heads.issuperset(absent) and not after.counts(group, claimed)
            }
            if excused:
                after = after._with(group, replace(lead, claims={**lead.claims, **excused}))
        return after

    def change(self, group: str, vehicle: str, leads: bool, age: Age, to: str | None = None) -> Leadership:
        """A vehicle was given the role of the head at ``age``, or has left it, or assents ``to`` another's claim."""
        lead, at = self.groups[group], (vehicle, age)
        if at in (lead.began if leads else lead.ended):
            return self
        if leads:
            return self._with(group, replace(lead, began=lead.began | {at}))
        return self._with(group, replace(lead, ended={**lead.ended, at: to}))

    def begin(self, group: str, vehicle: str | None, age: Age) -> Leadership:
        """A group is formed anew, led by ``vehicle`` since ``age``; it is dissolved if None."""
        groups = {
            name: replace(lead, by_leading={claimed: by for claimed, by in lead.by_leading.items() if by != group})
            for name, lead in self.groups.items()
        }
        began = frozenset() if vehicle is None else frozenset({(vehicle, age)})
        return Leadership({**groups, group: Lead(began=began)})

    def _with(self, group: str, lead: Lead) -> Leadership:
        return Leadership({**self.groups, group: lead})

    # Which claims count --------------------------------------------------------------------------

    def counting(self, group: str) -> list[Claimed]:
        """The claims to lead a group that count, the lesser ones first."""
        if group in self._counting:
            return self._counting[group]
        counting: list[Claimed] = []
        self._counting[group] = counting  # whoever stands against a claim leads by the lesser ones
        for claimed, excused in sorted(self.groups[group].claims.items()):
            if not self.is_member(group, claimed):
                continue
            began = self._has_led_since(group, claimed)
            if began is not None:
                void = [other for other in counting if began <= other.since < claimed.since]
                counting[:] = [other for other in counting if other.vehicle == claimed.vehicle or other not in void]
            elif not self._heads_against(group, claimed) <= excused:
                continue
            counting.append(claimed)
        return counting

    def counts(self, group: str, claimed: Claimed) -> bool:
        """True if a claim to lead a group counts."""
        return claimed in self.counting(group)

    def is_member(self, group: str, claimed: Claimed) -> bool:
        """False if who claimed a group was a member of it by the lead of another alone, which it had not."""
        of = self.groups[group].by_leading.get(claimed)
        return of is None or self.led(claimed.vehicle, of, claimed.since)

    def _has_led_since(self, group: str, claimed: Claimed) -> Age | None:
        """Since when who claims has led and has not left itself, whoever has claimed meanwhile; None if it has not."""
        left = [age for age in self._ends(group, claimed.vehicle) if age <= claimed.since]
        began = (age for age in self._begins(group, claimed.vehicle) if age < claimed.since)
        return min((age for age in began if not any(age < end for end in left)), default=None)

    def _heads_against(self, group: str, claimed: Claimed) -> set[str]:
        """Others that led a group when it was claimed, and lead it still, by the lesser claims."""
        names = {name for name, _ in self.groups[group].began} | {other.vehicle for other in self.counting(group)}
        return {
            name
            for name in names - {claimed.vehicle}
            if self.led(name, group, claimed.since) and self.led(name, group, _NOW)
        }

    def _reigns(self, group: str) -> list[Claimed]:
        """The claims by which a group was led one after another: each is greater, or the head before had left."""
        reigns: list[Claimed] = []
        for claimed in sorted(self.counting(group), key=lambda claimed: claimed.since):
            if not reigns or claimed.claim > reigns[-1].claim or self._has_left(group, reigns[-1], claimed.since):
                reigns.append(claimed)
        return reigns

    def _begins(self, group: str, vehicle: str) -> list[Age]:
        """When a vehicle came to lead a group, whoever led it besides."""
        began = [age for name, age in self.groups[group].began if name == vehicle]
        return began + [claimed.since for claimed in self.counting(group) if claimed.vehicle == vehicle]

    def _ends(self, group: str, vehicle: str) -> list[Age]:
        """When a vehicle left the lead of a group, or assented to a claim that it had not answered, nor its author."""
        ended = self.groups[group].ended
        return [age for (name, age), to in ended.items() if name == vehicle and not self._is_void(group, name, age, to)]

    def _is_void(self, group: str, vehicle: str, age: Age, to: str | None) -> bool:
        """True of an assent ``to`` whom assented to the vehicle since it claimed, or to whom this has claimed again."""
        if to is None:
            return False
        lead = self.groups[group]
        claims = [claimed for claimed in lead.claims if claimed.since < age]
        since = max([claimed.since for claimed in claims if claimed.vehicle == to], default=AGREED_BEFORE)
        ends = [end for (name, end), other in lead.ended.items() if (name, other) == (to, vehicle)]
        answers = [claimed.since for claimed in claims if claimed.vehicle == vehicle]
        return any(since < at < age for at in (*ends, *answers))

    def _has_left(self, group: str, reign: Claimed, by: Age) -> bool:
        """True if who leads a group by a claim had left by then."""
        return any(reign.since < age <= by for age in self._ends(group, reign.vehicle))

    # Who led when --------------------------------------------------------------------------------

    @property
    def claimed(self) -> list[str]:
        """Groups that somebody has claimed to lead."""
        return [group for group, lead in self.groups.items() if lead.claims]

    @property
    def leading(self) -> dict[str, Claimed]:
        """The claim by which each group is led that is led by one."""
        reigns = {group: self._reigns(group)[-1:] for group in self.claimed}
        return {group: last[0] for group, last in reigns.items() if last and not self._has_left(group, last[0], _NOW)}

    def without_claims(self, group: str) -> tuple[str, Age] | None:
        """Who leads a group without a claim, and since when; None if nobody does."""
        names = [name for _, name in sorted((age, name) for name, age in self.groups[group].began)]
        since = {name: self.since(name, group, _NOW) for name in names}
        return next(((name, age) for name, age in since.items() if age is not None), None)

    def is_claim(self, age: Age) -> bool:
        """True if what was said at ``age`` is a claim to lead a group."""
        return any(age == claimed.since for lead in self.groups.values() for claimed in lead.claims)

    def has_claimed(self, vehicle: str, group: str) -> bool:
        """True if the vehicle has led the group, or has claimed to."""
        lead = self.groups[group]
        return any(name == vehicle for name, _ in lead.began) or any(
            claimed.vehicle == vehicle for claimed in lead.claims
        )

    def has_led(self, vehicle: str, group: str, at: Age) -> bool:
        """True if the vehicle has led the group at any time before ``at``."""
        return any(age < at for age in self._begins(group, vehicle))

    def led(self, vehicle: str, group: str, at: Age) -> bool:
        """True if the vehicle led the group at ``at``."""
        return self.since(vehicle, group, at) is not None

    def since(self, vehicle: str, group: str, at: Age) -> Age | None:
        """Since when the vehicle led the group at ``at``; None if it did not."""
        if group not in self.groups:
            return None
        began = [age for name, age in self.groups[group].began if name == vehicle]
        ended = self._ends(group, vehicle)
        for reign in self._reigns(group):
            (began if reign.vehicle == vehicle else ended).append(reign.since)
        latest = max((age for age in began if age <= at), default=None)
        return None if latest is None or any(latest < age <= at for age in ended) else latest
