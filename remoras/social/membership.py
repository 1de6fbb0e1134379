"""Membership as a lease: who is there, as one vehicle sees it, by a rule that all vehicles apply alike.

A peer of which there was no word for a lease is absent: it was not heard, and nobody told that it was. Absence is a
view of one vehicle and no fact: nothing is taken away from the organisation, and a peer of which there is word again is
present again. The start counts as word, and so does the time at which a vehicle that was away itself comes back. A
vehicle that has heard nobody at all for a lease is cut off: then it is the vehicle itself that has left, whatever it
believes of the others. Before that, one that has heard nobody for a part of the lease does not know who has left, and
takes nobody else for absent: else a deaf head would order others about while their leases end one by one.

A silence that losses cannot explain need not last a lease. What counts for that are TDMA frames in which there was word
of somebody, since in others the vehicle itself may have been deaf. In what share of them there was no word of a peer
while it was present, by its own packets or by what others told, says how soon its silence means something: a peer is
absent after so many frames that losses alone make such a silence with a stated probability: accrual, after Hayashibara
et al., The phi accrual failure detector, SRDS 2004. So of one that many hear, nobody waits longer for being far off.

Patience: what a vehicle that is cut off leaves to the others, and until when.

It cannot know whether the others are lost or out of its reach. So it does its own jobs and goes to the meeting of its
groups. Until the others should have done what they have to do, and have come, their jobs are theirs; by then whoever
can come has come, and it meets with them, seen or not. Only when that has brought no contact either, it takes the
others to be lost and does what they have not told to be done.

A job is its holder's. Whose it is if nobody is known to have it all who are cut off have to see alike, whatever each
heard last: so it is whose the strategy's messages have made it, which all have heard again and again, and where they do
not say, what follows from what all have known since before the mission (`owners`). That counts from when a vehicle has
heard nobody for a part of a lease: what it took between then and the end of the lease nobody would know of.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from typing import NamedTuple

from exchange.arithmetic import distance
from exchange.peering.peers import Link, LossEstimate
from remoras.organisation import Organisation
from remoras.work import Outlook, Point, Work

AWAY_FRAMES = 1.5
"""A vehicle that has not looked around for more TDMA frames than this was away itself."""


SHORTEST_FRAMES, FADING_S = 10, 200.0
"""Silence for which nobody is taken to have left, in TDMA frames and in seconds: a link may become worse or fade for
minutes, which its mean loss does not tell."""


class Lease(NamedTuple):
    """How long a vehicle of which there is no word counts as present.

    Attributes:
        longest_s: in any case; infinite where nobody speaks.
        frame_s: length of a TDMA frame, in which each speaks once.
        false_absence: probability of a silence by losses alone for which a peer is taken to have left; 0 if all have
            the longest lease.
    """

    longest_s: float
    frame_s: float
    false_absence: float = 0.0

    def frames_of(self, word: Link) -> int:
        """TDMA frames with word of somebody that a peer may be silent in of which so much word is lost.

        >>> [Lease(880.0, 22.0, 1e-6).frames_of(Link(p, 64, p)) for p in (0.02, 0.4, 0.6, 0.8)]
        [10, 16, 28, 62]
        """
        shortest = max(SHORTEST_FRAMES, math.ceil(FADING_S / self.frame_s))
        return max(shortest, word.longest_silence(self.false_absence))


class Changes(NamedTuple):
    """Peers that have become absent and present, in the order of their names."""

    absent: tuple[str, ...] = ()
    present: tuple[str, ...] = ()


NO_CHANGES = Changes()
DOUBT = 0.25
"""Share of a lease in which a vehicle that hears nobody may still judge others."""


def absent_peers(
    peers: Iterable[str], heard_s: Mapping[str, float], since_s: float, now_s: float, lease_s: float
) -> frozenset[str]:
    """Peers whose lease is over.

    Args:
        peers: names.
        heard_s: when a packet of each was last heard.
        since_s: when the vehicle began to listen; leases begin then at the earliest.
        now_s: time at which it looks around.
        lease_s: how long a lease lasts.

    >>> sorted(absent_peers(["AUV01", "AUV02"], {"AUV01": 50.0}, since_s=0.0, now_s=60.0, lease_s=60.0))
    ['AUV02']
    >>> sorted(absent_peers(["AUV01", "AUV02"], {"AUV01": 20.0}, since_s=0.0, now_s=60.0, lease_s=60.0))
    []
    >>> sorted(absent_peers(["AUV01", "AUV02"], {"AUV01": 20.0}, since_s=0.0, now_s=80.0, lease_s=60.0))
    ['AUV01', 'AUV02']
    """
    last_s = {name: max(since_s, heard_s.get(name, since_s)) for name in peers}
    if not last_s:
        return frozenset()
    newest_s = max(last_s.values())
    if now_s - newest_s < lease_s:
        now_s = min(now_s, newest_s + DOUBT * lease_s)
    return frozenset(name for name, heard in last_s.items() if now_s - heard >= lease_s)


def acted_on(
    organisation: Organisation, me: str, absent: frozenset[str], is_cut_off: bool, leads_alone: bool
) -> Organisation:
    """The organisation as a vehicle acts on it: without the absent, and where it is cut off, led by itself.

    Args:
        organisation: as agreed.
        me: name of the vehicle.
        absent: names of its absent peers.
        is_cut_off: True if these are all.
        leads_alone: True if the vehicle is able to lead.
    """
    seen = organisation.without(absent)
    if is_cut_off and leads_alone:
        for role in seen.roles_of(me):
            head_role = seen.groups[role.group].head_role
            if head_role is not None:
                seen, _ = seen.assign(me, role.group, head_role)
    return seen


class Membership:
    """Who is there, as one vehicle sees it.

    Args:
        me: name of the vehicle.
        names: of all vehicles.
        lease: how long a silent peer counts as present; after each TDMA frame the vehicle looks around.
    """

    def __init__(self, me: str, names: Iterable[str], lease: Lease) -> None:
        self._me = me
        self._peers = tuple(name for name in names if name != me)
        self._lease = lease
        self._away_s = AWAY_FRAMES * lease.frame_s
        self._word_s, self._n_frames = 0.0, 0  # when there was word of anybody last, and in how many frames there was
        self._spoke: dict[str, tuple[float, int]] = {}  # the same by peer
        self._word = {name: LossEstimate() for name in self._peers}  # of frames with word of somebody, those without
        self._looked_s = 0.0
        self._since_s = 0.0
        self.absent: frozenset[str] = frozenset()
        """Names of the peers that are absent now."""
        self.cut_off = False
        """True while the vehicle has heard nobody at all for a lease."""

    def look_around(
        self,
        now_s: float,
        heard_s: Mapping[str, float],
        word_s: float = 0.0,
    ) -> Changes:
        """End of a TDMA frame: see who is absent and present now.

        Args:
            now_s: time of the end of the frame.
            heard_s: when there was word of each peer last, or its silence meant nothing.
            word_s: when there was word of anybody last.
        """
        if now_s - self._looked_s > self._away_s:
            self._since_s = now_s
            self._spoke.clear()
        self._looked_s = now_s
        absent = absent_peers(self._peers, heard_s, self._since_s, now_s, self._lease.longest_s)
        if self._lease.false_absence and word_s > self._word_s:
            self._word_s, self._n_frames = word_s, self._n_frames + 1
        if self._lease.false_absence:
            absent |= self._silent_beyond_loss(heard_s)
        before, self.absent = self.absent, absent
        if before == self.absent:
            return NO_CHANGES
        self.cut_off = len(self.absent) == len(self._peers)
        return Changes(tuple(sorted(self.absent - before)), tuple(sorted(before - self.absent)))

    def _silent_beyond_loss(self, heard_s: Mapping[str, float]) -> set[str]:
        """Peers whose silence, in frames with word of somebody, is longer than losses explain."""
        spoke, n_frames, silent = self._spoke, self._n_frames, set[str]()
        for name in self._peers:
            known, spoke_s = spoke.get(name), heard_s.get(name, 0.0)
            if known is None or spoke_s > known[0]:
                if known is not None:
                    n_lost = 0 if name in self.absent else n_frames - known[1] - 1
                    self._word[name].note_heard(n_lost)
                spoke[name] = spoke_s, n_frames
            elif (n := n_frames - known[1]) >= SHORTEST_FRAMES and n >= self._lease.frames_of(self._word[name].link):
                silent.add(name)
        return silent


# Patience ------------------------------------------------------------------------------------------


LATE = 1.2
"""A vehicle may take longer for what it has left, by this factor, than its data say."""


class Patience(NamedTuple):
    """What a vehicle that is cut off leaves to others.

    Attributes:
        theirs_until_s: until when the jobs of the others are theirs.
        ends_s: until when they are nobody's.
        barred: (vehicle, role) of jobs that are another's.
    """

    theirs_until_s: float = -math.inf
    ends_s: float = -math.inf
    barred: frozenset[tuple[str, str]] = frozenset()


def with_work(present: Organisation, organisation: Organisation, absent: Collection[str]) -> Organisation:
    """The organisation as a vehicle that is cut off acts on it, with the roles of the absent but those of heads."""
    for role in sorted(organisation.assignments):
        if role.vehicle in absent and role.role != organisation.groups[role.group].head_role:
            present, _ = present.assign(role.vehicle, role.group, role.role)
    return present


def owners(whole: Work) -> dict[str, str]:
    """Who is to do the job of each role that has no holder: the longest first, each goes to who would be done first.

    Args:
        whole: work of a group before the mission has begun.
    """
    owner_of: dict[str, str] = {}
    at = {data.name: Outlook(0.0, data.start_m) for data in whole.workers}

    def ends(role: str) -> list[tuple[float, str, Outlook]]:
        of = next(of for of in whole.roles if of.name == role)
        after = ((name, whole.after(here, whole.database[name], of)) for name, here in at.items())
        return [(then.free_s, name, then) for name, then in after if then is not None]

    takes_s = {role.name: min((end_s for end_s, *_ in ends(role.name)), default=0.0) for role in whole.roles}
    for role in sorted(takes_s, key=lambda name: (-takes_s[name], name)):
        if could := ends(role):
            _, owner_of[role], at[owner_of[role]] = min(could)
    return owner_of


def patience_with(
    all_work: Iterable[tuple[Work, Work, Mapping[str, str]]],
    me: str,
    known_s: Mapping[str, float],
    rallies_m: Mapping[str, Point],
    now_s: float,
    lease_s: float,
) -> Patience:
    """What a vehicle has that is cut off: by what it knew last of where the others were, and what they had to do.

    As all who are cut off at once notice it within a lease, they wait so much longer for each other, and for the ways
    from one meeting to the next.

    Args:
        all_work: of the groups, with those who are absent: before the mission has begun, and now; and who is to do
            the jobs of roles, by the strategy's messages.
        me: name of the vehicle.
        known_s: when each vehicle was heard of last.
        rallies_m: rally points by name.
        now_s: from when it leaves that to others.
        lease_s: how long a peer counts as present of which there is no word.
    """
    until_s, way_s, barred = now_s, 0.0, set[tuple[str, str]]()
    for whole, work, division in all_work:
        rally_m = rallies_m.get(work.group.rally_point or "")
        of_nobody = {**owners(whole), **division}
        of = {role.name: work.holders(role) or (of_nobody.get(role.name, ""),) for role in work.unfinished}
        for data in work.workers:
            barred |= {(data.name, role) for role, names in of.items() if data.name not in names}
            if data.name == me:
                continue
            since_s = known_s.get(data.name, 0.0)
            own = [role for role in work.unfinished if data.name in of[role.name]]
            end = work.after_all(Outlook(since_s, work.position_m(data.name)), data, own)
            way_m = 0.0 if rally_m is None else distance(end.position_m, rally_m)
            until_s = max(until_s, since_s + LATE * (end.free_s + way_m / data.transit_speed_mps - since_s))
        if rally_m is not None and me in work.members:
            way_m = max(distance(rally_m, other_m) for other_m in rallies_m.values())
            way_s = max(way_s, way_m / work.database[me].transit_speed_mps)
    return Patience(until_s, until_s + LATE * way_s + lease_s, frozenset(barred))


class Footing(NamedTuple):
    """What the vehicle acts on.

    Attributes:
        present: the organisation without the absent.
        takes_no_jobs: vehicles that take none.
        is_cut_off: it hears nobody.
        barred: (vehicle, role) of jobs that it leaves to others, see ``Patience``.
    """

    present: Organisation
    takes_no_jobs: frozenset[str]
    is_cut_off: bool
    barred: frozenset[tuple[str, str]] = frozenset()
