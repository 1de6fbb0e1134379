"""Leadership history: who led a group when, as one vehicle knows it.

An order counts by who led when it was given, whatever is heard first: the order, or that its issuer leads. So this is a
function of what was heard and of no order. Before all claims lead those that founded the group. Of the claims made by a
time the greatest leads. A head that has left its role leads no longer.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from remoras.organisation import Organisation
from remoras.social.succession import Claim

Age = tuple[float, int, int, int, int]
"""Place in the world model's order of facts: time, origin, epoch and order of the block, then position in it."""
AGREED_BEFORE: Age = (-math.inf, 0, 0, 0, 0)


class _Claimed(NamedTuple):
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
        self._claimed: dict[str, list[_Claimed]] = {}
        self._began = {
            (group, name): [AGREED_BEFORE] for group in organisation.groups for name in organisation.heads(group)
        }
        self._ended: dict[tuple[str, str], list[Age]] = {}

    def claim(self, group: str, vehicle: str, claim: Claim, age: Age) -> None:
        """A vehicle has claimed to lead a group since ``age``."""
        self.n_changes += 1
        self._claimed.setdefault(group, []).append(_Claimed(claim, age, vehicle))

    def is_claim(self, age: Age) -> bool:
        """True if what was said at ``age`` is a claim to lead a group."""
        return any(age == claim.since for of in self._claimed.values() for claim in of)

    def change(self, group: str, vehicle: str, leads: bool, age: Age) -> None:
        """A vehicle was given the role of the head at ``age``, or has left it."""
        self.n_changes += 1
        (self._began if leads else self._ended).setdefault((group, vehicle), []).append(age)

    def begin(self, group: str, vehicle: str | None, age: Age) -> None:
        """A group is formed anew, led by ``vehicle`` since ``age``; it is dissolved if None."""
        self.n_changes += 1
        self._claimed.pop(group, None)
        for ages in (self._began, self._ended):
            for key in [key for key in ages if key[0] == group]:
                del ages[key]
        if vehicle is not None:
            self._began[group, vehicle] = [age]

    def led(self, vehicle: str, group: str, at: Age) -> bool:
        """True if the vehicle led the group at ``at``."""
        return self.since(vehicle, group, at) is not None

    def has_led(self, vehicle: str, group: str, at: Age) -> bool:
        """True if the vehicle has led the group at any time before ``at``."""
        began = list(self._began.get((group, vehicle), ()))
        began += [claim.since for claim in self._claimed.get(group, ()) if claim.vehicle == vehicle]
        return any(age < at for age in began)

    def since(self, vehicle: str, group: str, at: Age) -> Age | None:
        """Since when the vehicle led the group at ``at``; None if it did not."""
        began, ended = (list(ages.get((group, vehicle), ())) for ages in (self._began, self._ended))
        greatest: Claim | None = None
        for claim, since, name in sorted(self._claimed.get(group, ()), key=lambda claim: claim.since):
            if greatest is None or claim > greatest:
                greatest = claim
                (began if name == vehicle else ended).append(since)
        latest = max((age for age in began if age <= at), default=None)
        return None if latest is None or any(latest < age <= at for age in ended) else latest
