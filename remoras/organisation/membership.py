"""Membership as a lease: present members as one vehicle sees them.

A peer is absent if no evidence of it, direct or second-hand, arrived for a lease. Absence is a view of one vehicle: the
organisation stays unchanged, and new evidence makes the peer present again. A vehicle that has received no peer for a
lease is isolated. A failure detector suspects a peer earlier if losses do not explain its silence: accrual, after
Hayashibara et al., The phi accrual failure detector, SRDS 2004.

Isolation grace period (`Patience`): an isolated vehicle cannot know whether others are lost or out of reach. It does
its own jobs and goes to the rendezvous of its groups. Until the others should have finished and arrived, their jobs
stay theirs. Jobs have owners: their holders, else the vehicles named by the strategy's messages, else vehicles that
follow from data known before the mission (`owners`), so that all isolated vehicles agree.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from typing import NamedTuple

from exchange.arithmetic import distance
from exchange.manager.peers import Link, LossEstimate
from remoras.organisation import Organisation
from remoras.work import Outlook, Point, Work

AWAY_FRAMES = 1.5
"""TDMA frames without an update after which a vehicle counts as away itself."""


SHORTEST_FRAMES, FADING_S = 10, 200.0
"""Silence (TDMA frames, s) below which no peer is suspected: fading may last minutes."""


class Lease(NamedTuple):
    """Time for which a silent peer counts as present, infinite without communication.

    ``false_absence`` is the probability that losses alone make a suspected peer's silence; 0 disables suspicion.
    """

    longest_s: float
    frame_s: float
    false_absence: float = 0.0

    def frames_of(self, link: Link) -> int:
        """Return the TDMA frames (with evidence of any peer) whose silence losses do not explain.

        >>> [Lease(880.0, 22.0, 1e-6).frames_of(Link(p, 64, p)) for p in (0.02, 0.4, 0.6, 0.8)]
        [10, 16, 28, 62]
        """
        shortest = max(SHORTEST_FRAMES, math.ceil(FADING_S / self.frame_s))
        return max(shortest, link.longest_silence(self.false_absence))


class Changes(NamedTuple):
    """Peers that have become absent and present, by name."""

    absent: tuple[str, ...] = ()
    present: tuple[str, ...] = ()


NO_CHANGES = Changes()
DOUBT = 0.25
"""Share of a lease after which a vehicle without reception presumes no further peer absent."""


def absent_peers(
    peers: Iterable[str], heard_s: Mapping[str, float], since_s: float, now_s: float, lease_s: float
) -> frozenset[str]:
    """Return peers whose lease is over; ``since_s`` is the earliest start of a lease.

    >>> sorted(absent_peers(["AUV01", "AUV02"], {"AUV01": 50.0}, since_s=0.0, now_s=60.0, lease_s=60.0))
    ['AUV02']
    >>> sorted(absent_peers(["AUV01", "AUV02"], {"AUV01": 20.0}, since_s=0.0, now_s=60.0, lease_s=60.0))
    []
    """
    last_s = {name: max(since_s, heard_s.get(name, since_s)) for name in peers}
    if not last_s:
        return frozenset()
    newest_s = max(last_s.values())
    # After part of a lease without reception it presumes no further peer absent: a deaf leader would reassign jobs
    # while leases end one by one.
    if now_s - newest_s < lease_s:
        now_s = min(now_s, newest_s + DOUBT * lease_s)
    return frozenset(name for name, evidence_s in last_s.items() if now_s - evidence_s >= lease_s)


def acted_on(
    organisation: Organisation, me: str, absent: frozenset[str], is_cut_off: bool, leads_alone: bool
) -> Organisation:
    """Return the organisation without ``absent``; an isolated vehicle leads its own groups."""
    seen = organisation.without(absent)
    if is_cut_off and leads_alone:
        for role in seen.roles_of(me):
            head_role = seen.groups[role.group].head_role
            if head_role is not None:
                seen, _ = seen.assign(me, role.group, head_role)
    return seen


class Membership:
    """Present members as one vehicle sees them, updated after each TDMA frame."""

    def __init__(self, me: str, names: Iterable[str], lease: Lease) -> None:
        self._me = me
        self._peers = tuple(name for name in names if name != me)
        self._lease = lease
        self.lease_s = lease.longest_s
        self._away_s = AWAY_FRAMES * lease.frame_s
        self._word_s, self._n_frames = 0.0, 0  # last evidence of any peer; number of frames with such evidence
        self._spoke: dict[str, tuple[float, int]] = {}  # per peer
        self._word = {name: LossEstimate() for name in self._peers}  # frames with evidence of others alone
        self._since_s = self._was_away_s = 0.0
        self.looked_s = 0.0
        self.began_s = 0.0
        """End of the last time for which the vehicle was itself away for longer than a lease (s)."""
        self.missed: frozenset[str] = frozenset()
        """Vehicles not received since that time began, itself included."""
        self.absent: frozenset[str] = frozenset()
        self.cut_off = False
        """True while the vehicle is isolated: no reception for a lease."""
        self.in_doubt = False
        """True while it is possibly isolated, after part of a lease."""

    def look_around(
        self,
        now_s: float,
        heard_s: Mapping[str, float],
        word_s: float = 0.0,
    ) -> Changes:
        """Update membership at the end of a TDMA frame, by the last evidence (s) of each peer."""
        if now_s - self.looked_s > self._away_s:
            # It was away itself, so the silence of others proves nothing.
            self._since_s = now_s
            self._spoke.clear()
        if now_s - self.looked_s > max(self._away_s, self.lease_s):
            self.began_s, self._was_away_s = now_s, self.looked_s
        self.looked_s = now_s
        if self.began_s > 0.0:
            missed = (name for name in self._peers if heard_s.get(name, 0.0) <= self._was_away_s)
            self.missed = frozenset({self._me, *missed})
        absent = absent_peers(self._peers, heard_s, self._since_s, now_s, self._lease.longest_s)
        if self._lease.false_absence and word_s > self._word_s:
            # Frames without evidence of any peer do not count: the vehicle itself may have been deaf.
            self._word_s, self._n_frames = word_s, self._n_frames + 1
        if self._lease.false_absence:
            absent |= self._silent_beyond_loss(heard_s)
        before, self.absent = self.absent, absent
        if before != absent:
            self.cut_off = len(absent) == len(self._peers)
        newest_s = max(self.began_s, max(heard_s.values(), default=0.0))
        self.in_doubt = self.cut_off or now_s - newest_s >= DOUBT * self.lease_s
        if before == absent:
            return NO_CHANGES
        return Changes(tuple(sorted(self.absent - before)), tuple(sorted(before - self.absent)))

    def _silent_beyond_loss(self, heard_s: Mapping[str, float]) -> set[str]:
        spoke, n_frames, silent = self._spoke, self._n_frames, set[str]()
        for name in self._peers:
            known, spoke_s = spoke.get(name), heard_s.get(name, 0.0)
            if known is None or spoke_s > known[0]:
                if known is not None:
                    # A silence that led to absence does not count as loss: the next suspicion would come later.
                    n_lost = 0 if name in self.absent else n_frames - known[1] - 1
                    self._word[name].note_heard(n_lost)
                spoke[name] = spoke_s, n_frames
            elif (n := n_frames - known[1]) >= SHORTEST_FRAMES and n >= self._lease.frames_of(self._word[name].link):
                silent.add(name)
        return silent


# Isolation grace period ----------------------------------------------------------------------------


LATE = 1.2
"""Factor by which a vehicle may take longer for its remaining work than expected."""


class Patience(NamedTuple):
    """Isolation grace period until ``ends_s``; the others should have met by ``theirs_until_s``."""

    # ``barred`` has (vehicle, role) of jobs that another vehicle owns.
    theirs_until_s: float = -math.inf
    ends_s: float = -math.inf
    barred: frozenset[tuple[str, str]] = frozenset()


def with_work(present: Organisation, organisation: Organisation, absent: Collection[str]) -> Organisation:
    """Return ``present`` with the roles of absent vehicles, except leaders' roles."""
    for role in sorted(organisation.assignments):
        if role.vehicle in absent and role.role != organisation.groups[role.group].head_role:
            present, _ = present.assign(role.vehicle, role.group, role.role)
    return present


def owners(whole: Work) -> dict[str, str]:
    """Return owners of roles without holder at the start: longest job first, to earliest end."""
    owner_of: dict[str, str] = {}
    outlooks = {data.name: Outlook(0.0, data.start_m) for data in whole.workers}

    def ends(role: str) -> list[tuple[float, str, Outlook]]:
        specification = next(specification for specification in whole.roles if specification.name == role)
        after = ((name, whole.after(here, whole.database[name], specification)) for name, here in outlooks.items())
        return [(outlook.free_s, name, outlook) for name, outlook in after if outlook is not None]

    takes_s = {role.name: min((end_s for end_s, *_ in ends(role.name)), default=0.0) for role in whole.roles}
    for role in sorted(takes_s, key=lambda name: (-takes_s[name], name)):
        if could := ends(role):
            _, owner_of[role], outlooks[owner_of[role]] = min(could)
    return owner_of


def patience_with(
    all_work: Iterable[tuple[Work, Work, Mapping[str, str]]],
    me: str,
    known_s: Mapping[str, float],
    rallies_m: Mapping[str, Point],
    now_s: float,
    lease_s: float,
) -> Patience:
    """Return the grace period; ``all_work`` has work at the start and now, and owners of jobs."""
    until_s, way_s, barred = now_s, 0.0, set[tuple[str, str]]()
    for whole, work, division in all_work:
        rally_m = rallies_m.get(work.group.rally_point or "")
        of_nobody = {**owners(whole), **division}
        owners_of = {role.name: work.holders(role) or (of_nobody.get(role.name, ""),) for role in work.unfinished}
        for data in work.workers:
            barred |= {(data.name, role) for role, names in owners_of.items() if data.name not in names}
            if data.name == me:
                continue
            since_s = known_s.get(data.name, 0.0)
            own = [role for role in work.unfinished if data.name in owners_of[role.name]]
            end_s = work.arrival_s(Outlook(since_s, work.position_m(data.name)), data, own, rally_m)
            until_s = max(until_s, since_s + LATE * (end_s - since_s))
        if rally_m is not None and me in work.members:
            way_m = max(distance(rally_m, other_m) for other_m in rallies_m.values())
            way_s = max(way_s, way_m / work.database[me].transit_speed_mps)
    # Vehicles isolated at the same time notice it within a lease of each other, hence ``lease_s``.
    return Patience(until_s, until_s + LATE * way_s + lease_s, frozenset(barred))


class Footing(NamedTuple):
    """Basis for planning: organisation without absent vehicles, ``barred`` as in ``Patience``."""

    present: Organisation
    takes_no_jobs: frozenset[str]
    is_cut_off: bool
    barred: frozenset[tuple[str, str]] = frozenset()
