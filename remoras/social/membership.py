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
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from exchange.peering.peers import Link, LossEstimate
from remoras.organisation import Organisation

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
