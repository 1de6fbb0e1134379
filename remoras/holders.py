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
        self._last: Sequence[tuple[str, Organisation]] = ()
        self._last_counts = 0, 0

    def compare(self, believed: Sequence[tuple[str, Organisation]]) -> None:
        """Compare the vehicles at one moment; a job is held by those who believe so of themselves.

        Args:
            believed: name of every living vehicle, and the organisation as it sees it.
        """
        if believed != self._last:  # mostly they are the same from frame to frame
            self._last, self._last_counts = believed, self._counts(believed)
        n_believed, n_wrong = self._last_counts
        self.n_believed += n_believed
        self.n_wrong += n_wrong

    def _counts(self, believed: Sequence[tuple[str, Organisation]]) -> tuple[int, int]:
        """How many pairs there are, and how many of them are wrong."""
        if not believed:
            return 0, 0
        jobs = [(g.name, role.name) for g in believed[0][1].groups.values() for role in g.roles if role.job is not None]
        counts = [self._counts_of_role(believed, group, role) for group, role in jobs]
        return sum(n for n, _ in counts), sum(n for _, n in counts)

    @staticmethod
    def _counts_of_role(believed: Sequence[tuple[str, Organisation]], group: str, role: str) -> tuple[int, int]:
        named = {name: organisation.members(group, role) for name, organisation in believed}
        holders = {name for name, own in named.items() if name in own}
        of_others = [own for name, own in named.items() if own and own != (name,)]
        return len(of_others), sum(not holders.issuperset(own) for own in of_others)

    @property
    def wrong_fraction(self) -> float | None:
        """Share of the pairs that were wrong; None if there were none."""
        return round(self.n_wrong / self.n_believed, 6) if self.n_believed else None
