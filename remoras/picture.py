"""What a vehicle knows at this moment that its behaviours look at; each part has one owner that alone writes it."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field

from exchange.arithmetic import length
from exchange.peering.peers import PeerLinks
from remoras.beliefs import NOTHING_KNOWN, Known
from remoras.work import Point, Work


@dataclass(slots=True)
class Body:
    """The vehicle itself; owned by its functional layer.

    Attributes:
        now_s: time of the last motion tick.
        battery: share of the energy left; reserve: share that the way home takes, with margin.
        outside_m: how far the vehicle is outside the area of operations.
        last_yield_s: when its own sensors last found something.
        contacts_m: where the obstacle sonar sees vehicles; it does not tell which.
        settled_s: since when the vehicle has stayed near one place.
        sensors_on: names of the sensors that are switched on, whether they work or not.
        answering: names of the sensors that tell their state, on or off, and tell that they work.
        uncertainty_m: greatest distance between where the vehicle takes itself to be and where it is, as it knows.
        n_fixes: how often it has interrupted its work to learn where it is.
    """

    now_s: float = 0.0
    battery: float = 1.0
    reserve: float = 0.0
    outside_m: float = 0.0
    last_yield_s: float = -math.inf
    contacts_m: tuple[Point, ...] = ()
    settled_s: float = 0.0
    sensors_on: tuple[str, ...] = ()
    answering: tuple[str, ...] = ()
    uncertainty_m: float = 0.0
    n_fixes: int = 0


class Headings(Mapping[str, Point]):
    """Unit vectors along which vehicles have moved last, by name: (x east, y north).

    Args:
        positions_m, before_m: as ``Peers`` has them.
    """

    def __init__(self, positions_m: Mapping[str, Point], before_m: Mapping[str, Point]) -> None:
        self._positions_m = positions_m
        self._before_m = before_m

    def __getitem__(self, name: str) -> Point:
        before_m, position_m = self._before_m[name], self._positions_m[name]
        east_m, north_m = position_m[0] - before_m[0], position_m[1] - before_m[1]
        way_m = length(east_m, north_m)
        return east_m / way_m, north_m / way_m

    def __iter__(self) -> Iterator[str]:
        return iter(self._before_m)

    def __len__(self) -> int:
        return len(self._before_m)


@dataclass(slots=True)
class Peers:
    """The other vehicles, as far as heard; owned by the radio.

    Attributes:
        positions_m: last position known of each vehicle, by name.
        n_positions: how many positions of each have been heard: so a behaviour knows that one is new.
        before_m: another one where it was before that; who was never seen to move is missing.
        headings: unit vectors, from the one to the other.
        heard_s: when a packet of each was last heard; who was never heard is missing.
        told_s: when, at the earliest, each last spoke whose packet was missed, as others have told.
        reported_s: of when the newest report of each is that others have passed on.
        last_news_s: when a contribution to the mission was last heard of.
        links: what the links from and to each peer lose, as far as it can be told.
        unheard: peers that are not known to have heard of roles which this vehicle gave out, and these roles.
    """

    positions_m: dict[str, Point] = field(default_factory=dict)
    n_positions: dict[str, int] = field(default_factory=dict)
    before_m: dict[str, Point] = field(default_factory=dict)
    headings: Headings = field(init=False, compare=False)
    heard_s: dict[str, float] = field(default_factory=dict)
    told_s: dict[str, float] = field(default_factory=dict)
    reported_s: dict[str, float] = field(default_factory=dict)
    last_news_s: float = -math.inf
    links: Mapping[str, PeerLinks] = field(default_factory=dict)
    unheard: Mapping[str, Collection[str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.headings = Headings(self.positions_m, self.before_m)

    def note_word(self, name: str, spoke_s: float) -> None:
        """Note when, at the earliest, a vehicle spoke that was not heard, as others tell."""
        self.told_s[name] = max(spoke_s, self.told_s.get(name, -math.inf))

    def note_report(self, name: str, time_s: float) -> None:
        """Note that a report of a vehicle of that time was passed on."""
        self.reported_s[name] = max(time_s, self.reported_s.get(name, -math.inf))

    @property
    def known_s(self) -> Mapping[str, float]:
        """Of when each is known how it is: when its packet was heard last, or its newest report that was passed on."""
        heard_s = self.heard_s
        newer_s = {name: time_s for name, time_s in self.reported_s.items() if time_s > heard_s.get(name, -math.inf)}
        return heard_s | newer_s if newer_s else heard_s

    @property
    def word_s(self) -> Mapping[str, float]:
        """When, at the earliest, each last spoke, by its own packets and by what others tell."""
        return self.heard_s | {
            name: max(told_s, self.heard_s.get(name, told_s)) for name, told_s in self.told_s.items()
        }


@dataclass(slots=True)
class Groups:
    """The vehicle's groups; owned by its social layer.

    Attributes:
        gathered: groups believed to be together at their rally point.
        planning_due: True while the social layer has something to plan.
        awaited: by group, how much of the wait for its meeting is for this vehicle, 0..1: 0 if another one is
            expected to be at work as long, 1 if all others are free.
        idle_since_s: by group that this vehicle leads, since when there is nothing left that anybody present is to do.
        works: the work of each group, as this vehicle knew it at the end of the last frame; none where nobody signals.
        returned_s: when a peer that was absent was heard again last, by its name.
        meets_unheard: True while the vehicle, which is cut off, meets with whoever has come, heard or not.
    """

    gathered: set[str] = field(default_factory=set)
    planning_due: bool = False
    awaited: Mapping[str, float] = field(default_factory=dict)
    works: Mapping[str, Work] = field(default_factory=dict)
    idle_since_s: dict[str, float] = field(default_factory=dict)
    returned_s: dict[str, float] = field(default_factory=dict)
    meets_unheard: bool = False

    def note_work(self, group: str, is_left: bool, now_s: float) -> None:
        """Note whether there is something left in a group that somebody present is to do."""
        if is_left:
            self.idle_since_s.pop(group, None)
        else:
            self.idle_since_s.setdefault(group, now_s)


@dataclass(slots=True)
class Picture:
    """The parts together.

    Attributes:
        frame_s: length of a TDMA frame, in which everybody may speak once; infinite where nobody speaks.
        facts: what the vehicle knows, to be looked up.
    """

    body: Body = field(default_factory=Body)
    peers: Peers = field(default_factory=Peers)
    groups: Groups = field(default_factory=Groups)
    frame_s: float = math.inf
    facts: Known = NOTHING_KNOWN
