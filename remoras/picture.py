"""State of a vehicle as seen by its behaviours; each part has one owner, its only writer."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from exchange.arithmetic import length
from exchange.manager.peers import PeerLinks
from remoras.beliefs import NOTHING_KNOWN, Known
from remoras.work import Computed, Point, Work


@dataclass(slots=True)
class Body:
    """State of the vehicle itself; owned by its functional layer.

    ``now_s`` is the last motion tick, ``decided_s`` the decision before this one. ``battery`` is the share of energy
    left, ``reserve`` that for the way home, margin included. ``outside_m``: distance outside the area of operations.
    ``yields_s``: time of the last facts by own sensor. ``contacts_m``: sonar contacts, without identity. ``settled_s``:
    start of the stay near one place. ``sensors_on``: names of sensors switched on, working or not; ``answering``: of
    those that report to work, on or off. ``uncertainty_m`` bounds the position error; ``n_fixes`` counts fixes.
    """

    now_s: float = 0.0
    decided_s: float = 0.0
    battery: float = 1.0
    reserve: float = 0.0
    outside_m: float = 0.0
    yields_s: dict[str, float] = field(default_factory=dict)
    contacts_m: tuple[Point, ...] = ()
    settled_s: float = 0.0
    sensors_on: tuple[str, ...] = ()
    answering: tuple[str, ...] = ()
    uncertainty_m: float = 0.0
    n_fixes: int = 0

    @property
    def last_yield_s(self) -> float:
        """Time (s) of the last facts of any own sensor, minus infinity before the first."""
        return max(self.yields_s.values(), default=-math.inf)


@dataclass(slots=True)
class Peers:
    """Other vehicles, as received; owned by the radio.

    ``positions_m`` are the last known positions, ``n_positions`` counts those received, so that behaviours recognise a
    new one. ``before_m`` is the previous distinct position, missing without observed motion; ``headings`` are unit
    vectors from it to the last one. ``heard_s`` and ``heard_slots``: time and slot of the last packet received, missing
    if never. ``told_s``: earliest possible time of the last transmission that was missed, reported by others;
    ``reported_s``: newest relayed report. ``last_news_s``: last received contribution to the mission. ``links``:
    estimated losses from and to each peer. ``unheard``: roles assigned by this vehicle and not acknowledged, by peer.
    """

    positions_m: dict[str, Point] = field(default_factory=dict)
    n_positions: dict[str, int] = field(default_factory=dict)
    before_m: dict[str, Point] = field(default_factory=dict)
    headings: Mapping[str, Point] = field(init=False, compare=False)
    heard_s: dict[str, float] = field(default_factory=dict)
    heard_slots: dict[str, int] = field(default_factory=dict)
    told_s: dict[str, float] = field(default_factory=dict)
    reported_s: dict[str, float] = field(default_factory=dict)
    last_news_s: float = -math.inf
    links: Mapping[str, PeerLinks] = field(default_factory=dict)
    unheard: Mapping[str, Collection[str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.headings = Computed(self.before_m, self._heading, anew=True)

    def _heading(self, name: str) -> Point:
        before_m, position_m = self.before_m[name], self.positions_m[name]
        east_m, north_m = position_m[0] - before_m[0], position_m[1] - before_m[1]
        way_m = length(east_m, north_m)
        return east_m / way_m, north_m / way_m

    def note_word(self, name: str, spoke_s: float) -> None:
        """Record the earliest time of a missed transmission, reported by others."""
        self.told_s[name] = max(spoke_s, self.told_s.get(name, -math.inf))

    def note_report(self, name: str, time_s: float) -> None:
        """Record the time of a relayed report."""
        self.reported_s[name] = max(time_s, self.reported_s.get(name, -math.inf))

    @property
    def known_s(self) -> Mapping[str, float]:
        """Time of the latest information on each: last packet, or newest relayed report."""
        heard_s = self.heard_s
        newer_s = {name: time_s for name, time_s in self.reported_s.items() if time_s > heard_s.get(name, -math.inf)}
        return heard_s | newer_s if newer_s else heard_s

    @property
    def word_s(self) -> Mapping[str, float]:
        """Earliest time of each peer's last transmission, received or reported."""
        return self.heard_s | {
            name: max(told_s, self.heard_s.get(name, told_s)) for name, told_s in self.told_s.items()
        }


@dataclass(slots=True)
class Groups:
    """Groups of the vehicle; owned by its social layer.

    ``gathered``: those believed at their rally point. ``awaited``: share of a group's wait for its rendezvous due to
    this vehicle, 0..1: 0 if another one is expected to work as long, 1 if all others are free. ``idle_since_s``: start
    of the time without work for present members, by group led. ``works``: jobs of each group as known at the end of the
    last frame, empty without help. ``returned_s``: last return of an absent peer. ``meets_unheard`` is True while an
    isolated vehicle meets with those present, received or not.
    """

    gathered: frozenset[str] = frozenset()
    planning_due: bool = False
    awaited: Mapping[str, float] = field(default_factory=dict)
    works: Mapping[str, Work] = field(default_factory=dict)
    idle_since_s: dict[str, float] = field(default_factory=dict)
    returned_s: dict[str, float] = field(default_factory=dict)
    meets_unheard: bool = False

    def note_work(self, group: str, is_left: bool, now_s: float) -> None:
        """Record whether a group has work left for present members."""
        if is_left:
            self.idle_since_s.pop(group, None)
        else:
            self.idle_since_s.setdefault(group, now_s)


@dataclass(slots=True)
class Picture:
    """Input of behaviours and decision; ``frame_s`` (TDMA) is infinite without communication.

    >>> picture = Picture()
    >>> picture.body.now_s, picture.peers.positions_m, picture.facts.get(("position", "AUV01"))
    (0.0, {}, None)
    """

    body: Body = field(default_factory=Body)
    peers: Peers = field(default_factory=Peers)
    groups: Groups = field(default_factory=Groups)
    frame_s: float = math.inf
    facts: Known = NOTHING_KNOWN
