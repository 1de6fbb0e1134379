"""Who claims which role, as far as one vehicle knows: a table that heals itself.

Of each vehicle's claim to a role the latest is kept; of the claims to a role the strongest wins, of equals that of
the lower node. Hearing is a join: the order, repetitions and relays of messages make no difference, only what has not
been heard yet does. So vehicles that have heard the same agree, and nobody has to ask whether others did.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from remoras.database import AUVDatabase


@dataclass(frozen=True, slots=True, order=True)
class RoleClaim:
    """How strongly a vehicle claims a role; strength 0 withdraws the claim.

    ``at`` orders the claims of one vehicle to one role, the greater is the newer: the round it was made in, say.
    """

    at: int
    strength: int


class Claims:
    """Latest claims by role and vehicle.

    Args:
        database: static data of all vehicles.
        group: whose roles are claimed.
    """

    def __init__(self, database: AUVDatabase, group: str) -> None:
        self._database = database
        self._group = group
        self._of: dict[str, dict[str, RoleClaim]] = {}
        self._members: Collection[str] = database.names
        self._winners: dict[str, str | None] = {}  # as far as asked for since the last change

    @property
    def members(self) -> Collection[str]:
        """Only their claims count."""
        return self._members

    @members.setter
    def members(self, names: Collection[str]) -> None:
        if names != self._members:
            self._members = names
            self._winners.clear()

    def take(self, role: str, vehicle: str, claim: RoleClaim) -> bool:
        """Note a claim; True if it is news."""
        known = self._of.setdefault(role, {})
        if vehicle in known and known[vehicle] >= claim:
            return False
        known[vehicle] = claim
        self._winners.pop(role, None)
        return True

    def of(self, role: str, vehicle: str) -> RoleClaim | None:
        """The latest claim of a vehicle."""
        return self._of.get(role, {}).get(vehicle)

    def standing(self, role: str) -> dict[str, RoleClaim]:
        """Claims, not withdrawn, of members that are able to play the role."""
        claims = self._of.get(role, {}).items()
        return {
            v: claim
            for v, claim in claims
            if claim.strength > 0 and v in self._members and self._database[v].can_play(self._group, role)
        }

    def has(self, role: str, strength: int) -> bool:
        """True if a claim of that strength stands."""
        return any(claim.strength == strength for claim in self.standing(role).values())

    def made_before(self, at: int, vehicle: str, strength: int) -> set[str]:
        """Roles that a vehicle has claimed with that strength since before ``at``."""
        latest = ((role, claims.get(vehicle)) for role, claims in self._of.items())
        return {role for role, claim in latest if claim is not None and claim.strength == strength and claim.at < at}

    def winner(self, role: str) -> str | None:
        """Who has the strongest claim."""
        if role not in self._winners:
            claims = self.standing(role)
            self._winners[role] = min(claims, key=lambda v: (-claims[v].strength, self._database[v].node), default=None)
        return self._winners[role]

    def beats(self, role: str, vehicle: str, strength: int) -> bool:
        """True if a claim of that strength would win."""
        winner = self.winner(role)
        if winner is None or winner == vehicle:
            return True
        nodes = self._database[vehicle].node, self._database[winner].node
        return (strength, -nodes[0]) > (self.standing(role)[winner].strength, -nodes[1])
