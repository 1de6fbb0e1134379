"""Holders of jobs: how far the vehicles of a fleet agree with those who hold them."""

from __future__ import annotations

from collections.abc import Sequence

from remoras.organisation import Organisation


class HolderCount:
    """Counts what vehicles believe of the others' jobs, and how much of it is wrong.

    Not to know who holds a job is not wrong. Vehicles that keep claims to themselves, as in auctions by consensus, name
    nobody.

    Attributes:
        n_believed: (vehicle, job) pairs in which the vehicle named another one as holder.
        n_wrong: such pairs in which one that it named does not hold the job.
    """

    def __init__(self) -> None:
        self.n_believed = 0
        self.n_wrong = 0

    def compare(self, believed: Sequence[tuple[str, Organisation]]) -> None:
        """Compare the vehicles at one moment; a job is held by those who believe so of themselves.

        Args:
            believed: name of every living vehicle, and the organisation as it sees it.
        """
        if not believed:
            return
        for group in believed[0][1].groups.values():
            for role in group.roles:
                if role.job is not None:
                    self._compare_role(believed, group.name, role.name)

    def _compare_role(self, believed: Sequence[tuple[str, Organisation]], group: str, role: str) -> None:
        named = {name: organisation.members(group, role) for name, organisation in believed}
        holders = {name for name, own in named.items() if name in own}
        for name, own in named.items():
            if own and own != (name,):
                self.n_believed += 1
                self.n_wrong += not holders.issuperset(own)

    @property
    def wrong_fraction(self) -> float | None:
        """Share of the pairs that were wrong; None if there were none."""
        return round(self.n_wrong / self.n_believed, 6) if self.n_believed else None
