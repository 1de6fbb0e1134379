"""Membership as a lease: who is there, as one vehicle sees it, by a rule that all vehicles apply alike.

A peer of which no packet was heard for a lease is absent. Absence is a view of one vehicle and no fact: nothing is
taken away from the organisation, and a peer that is heard again is present again. The start counts as heard, and so
does the time at which a vehicle that was away itself comes back. A vehicle that has heard nobody at all for a lease is
cut off: then it is the vehicle itself that has left, whatever it believes of the others. Before that, one that has
heard nobody for a part of the lease does not know who has left, and takes nobody else for absent: else a deaf head
would order others about while their leases end one by one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from remoras.organisation import Organisation

AWAY_FRAMES = 1.5
"""A vehicle that has not looked around for more TDMA frames than this was away itself."""


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
        lease_s: how long a lease lasts; infinite where nobody speaks.
        frame_s: length of a TDMA frame, after each of which the vehicle looks around.
    """

    def __init__(self, me: str, names: Iterable[str], lease_s: float, frame_s: float) -> None:
        self._me = me
        self._peers = tuple(name for name in names if name != me)
        self._lease_s = lease_s
        self._away_s = AWAY_FRAMES * frame_s
        self._looked_s = 0.0
        self._since_s = 0.0
        self.absent: frozenset[str] = frozenset()
        """Names of the peers that are absent now."""
        self.cut_off = False
        """True while the vehicle has heard nobody at all for a lease."""

    def look_around(self, now_s: float, heard_s: Mapping[str, float]) -> Changes:
        """End of a TDMA frame: see who is absent and present now.

        Args:
            now_s: time of the end of the frame.
            heard_s: when a packet of each peer was last heard.
        """
        if now_s - self._looked_s > self._away_s:
            self._since_s = now_s
        self._looked_s = now_s
        before, self.absent = self.absent, absent_peers(self._peers, heard_s, self._since_s, now_s, self._lease_s)
        if before == self.absent:
            return NO_CHANGES
        self.cut_off = len(self.absent) == len(self._peers)
        return Changes(tuple(sorted(self.absent - before)), tuple(sorted(before - self.absent)))
