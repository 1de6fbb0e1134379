"""Contract net: announce, bid, award, with time-outs and re-auction.

The head auctions the open jobs that nobody holds while some member holds fewer than ``queue``. A member with room bids
for each the time at which it expects to have done it. When the auction ends, jobs go to the lowest bids, at most one to
each bidder; the winner accepts by stating the role itself. An award not accepted within ``accept_rounds``, and what a
vehicle holds that has not been heard for ``silence_rounds``, is cancelled and auctioned anew. A vehicle without work
that has not heard the head for so long auctions by itself. If two hold the same job, the one that came later gives it
up on hearing of the other.

Announcements and bids are said anew in every frame of an auction, and not acknowledged. Awards, acceptances and
results are facts, acknowledged and repeated until they are.

Source: Smith 1980 (contract net); Sariel, Balch, Erdogan 2008 (DEMiR-CF: local models, time-outs, re-auction).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.organisation import Group, RoleSpecification
from remoras.strategies.allocation import Expectations
from remoras.strategies.claims import Claim, Claims
from remoras.strategies.founding import common_roles, founded
from remoras.strategies.silence import QUEUE, SILENCE, Silence
from remoras.strategy import JOB_DONE, Declaration, Heard, Move, Situation, Statable, Statement

EARLIEST = 1_000_000
"""Strength of a claim made at time 0; it falls by one in a second, so the earlier claim is the stronger."""
HIGHEST_BID_S = 65535


@dataclass(slots=True)
class Sayings:
    """When a vehicle was said to hold a role, and when not to, in whatever order that was heard."""

    held_s: set[float] = field(default_factory=set)
    left_s: set[float] = field(default_factory=set)

    def claim(self) -> Claim:
        """Held since the first that was said after the last withdrawal; what rests on more sayings is newer."""
        withdrawn_s = max(self.left_s, default=-1.0)
        since_s = min((s for s in self.held_s if s > withdrawn_s), default=None)
        return Claim(len(self.held_s) + len(self.left_s), 0 if since_s is None else EARLIEST - round(since_s))


@dataclass(slots=True)
class Auction:
    """An auction that this vehicle holds: the round and the time it ends, and the bids so far by vehicle."""

    ends: int
    ends_s: int
    bids_s: dict[str, int]


class Contractor:
    """Auctioneer and bidder of one vehicle."""

    def __init__(self, me: str, group: Group, strategy: ContractNet) -> None:
        self._me = me
        self._group = group
        self._with = strategy
        self._claims: Claims | None = None
        self._sayings: dict[tuple[str, str], Sayings] = {}  # by (role, vehicle)
        self._auctions: dict[str, Auction] = {}  # own ones, by role
        self._offered: dict[str, float] = {}  # roles auctioned by others, and until when
        self._unaccepted: dict[tuple[str, str], int] = {}  # own awards (role, vehicle), and the round they were made in
        self._accepted: set[str] = set()
        self._silence = Silence(me, strategy.silence_rounds)
        self._expectations = Expectations()

    def negotiate(self, situation: Situation) -> Move:
        """Hear, accept or leave what is held, hold auctions where that is this vehicle's part, and bid."""
        work = situation.work
        claims = self._claims = self._claims or Claims(work.database)
        claims.members = work.members
        self._offered = {name: ends_s for name, ends_s in self._offered.items() if ends_s > situation.now_s}
        for heard in situation.heard:
            for fact in heard.facts:
                self._hear(heard, fact, claims)
        roles = {role.name: role for role in work.unfinished}
        self._auctions = {name: auction for name, auction in self._auctions.items() if name in roles}
        said = self._accept(situation, claims)
        held = {data.name: [name for name in roles if claims.winner(name) == data.name] for data in work.workers}
        silent = self._silence.out_of_reach([*work.heads, *held], situation)
        takes_over = not held.get(self._me) and silent.issuperset(work.heads)
        if self._me in work.heads or takes_over or self._auctions:
            said += self._cancel(held, silent, situation, claims)
            said += self._award(held, silent, situation, claims)
            said += self._announce(held, silent, situation, claims)
        said += self._bid(roles, held.get(self._me, []), situation)
        return Move(tuple(Statement((fact,)) for fact in said), holding=bool(roles))

    def _accept(self, situation: Situation, claims: Claims) -> list[Statable]:
        """What this vehicle holds it accepts once, or leaves if another had it before."""
        said: list[Statable] = []
        for role in situation.work.held_by(self._me):
            if claims.winner(role.name) != self._me:
                said.append(self._leave(role.name, self._me, situation, claims))
            elif role.name not in self._accepted:
                self._accepted.add(role.name)
                said.append((self._me, "playsRole", self._group.path(role.name)))
        return said

    def _hear(self, heard: Heard, fact: Statable, claims: Claims) -> None:
        subject, attribute, value = fact
        group, _, role = (str(value) if attribute in ("playsRole", "leftRole") else subject).partition(".")
        if group != self._group.name:
            return
        match attribute:
            case "auctionEnds":
                self._offered[role] = float(value)
            case "bid" if role in self._auctions:
                self._auctions[role].bids_s[heard.issuer] = int(value)
            case "playsRole":
                self._note_held(role, subject, heard.time_s, claims)
                if heard.issuer == subject:
                    self._unaccepted.pop((role, subject), None)
            case "leftRole":
                self._note_left(role, subject, heard.time_s, claims)

    def _note_held(self, role: str, vehicle: str, time_s: float, claims: Claims) -> None:
        sayings = self._sayings.setdefault((role, vehicle), Sayings())
        sayings.held_s.add(time_s)
        claims.take(role, vehicle, sayings.claim())

    def _note_left(self, role: str, vehicle: str, time_s: float, claims: Claims) -> None:
        sayings = self._sayings.setdefault((role, vehicle), Sayings())
        sayings.left_s.add(time_s)
        claims.take(role, vehicle, sayings.claim())
        if vehicle not in claims.standing(role):
            self._unaccepted.pop((role, vehicle), None)
            if vehicle == self._me:
                self._accepted.discard(role)

    def _leave(self, role: str, vehicle: str, situation: Situation, claims: Claims) -> Statable:
        self._note_left(role, vehicle, situation.now_s, claims)
        return vehicle, "leftRole", self._group.path(role)

    # Auctioneer

    def _cancel(
        self, held: Mapping[str, list[str]], silent: Collection[str], situation: Situation, claims: Claims
    ) -> list[Statable]:
        late = [key for key, made in self._unaccepted.items() if situation.round - made >= self._with.accept_rounds]
        lost = [(role, vehicle) for vehicle in sorted(silent) for role in held.get(vehicle, ())]
        said = []
        for role, vehicle in dict.fromkeys(late + lost):
            said.append(self._leave(role, vehicle, situation, claims))
            if role in held.get(vehicle, ()):
                held[vehicle].remove(role)
        return said

    def _award(
        self, held: Mapping[str, list[str]], silent: Collection[str], situation: Situation, claims: Claims
    ) -> list[Statable]:
        """Jobs whose auction is over go to the lowest bids."""
        over = {role: auction for role, auction in self._auctions.items() if auction.ends <= situation.round}
        database = situation.work.database
        bids = sorted(
            (s, database[v].node, role, v) for role, auction in over.items() for v, s in auction.bids_s.items()
        )
        said: list[Statable] = []
        served: set[str] = set()
        for _, _, role, vehicle in bids:
            has_room = vehicle in held and len(held[vehicle]) < self._with.queue and vehicle not in silent
            if has_room and database[vehicle].can_play(role) and vehicle not in served and claims.winner(role) is None:
                served.add(vehicle)
                held[vehicle].append(role)
                self._note_held(role, vehicle, situation.now_s, claims)
                if vehicle == self._me:
                    self._accepted.add(role)
                else:
                    self._unaccepted[role, vehicle] = situation.round
                said.append((vehicle, "playsRole", self._group.path(role)))
        for role in over:
            del self._auctions[role]
        return said

    def _announce(
        self, held: Mapping[str, list[str]], silent: Collection[str], situation: Situation, claims: Claims
    ) -> list[Statable]:
        """Auction open jobs that nobody holds while somebody has room for one."""
        if not self._auctions and any(len(held[v]) < self._with.queue and v not in silent for v in held):
            ends = situation.round + self._with.bidding_rounds
            ends_s = situation.now_s * (1.0 + self._with.bidding_rounds / situation.round)
            vacant = [role.name for role in situation.work.open if claims.winner(role.name) is None]
            self._auctions = {name: Auction(ends, round(ends_s), {}) for name in vacant}
        return [(self._group.path(name), "auctionEnds", auction.ends_s) for name, auction in self._auctions.items()]

    # Bidder

    def _bid(self, roles: Mapping[str, RoleSpecification], held: Sequence[str], situation: Situation) -> list[Statable]:
        """Bids for all announced jobs, as long as their auction runs; those in its own auctions it tells nobody."""
        work, data = situation.work, situation.work.database[self._me]
        if len(held) >= self._with.queue or not (self._auctions or self._offered):
            return []
        outlook = self._expectations.of(data, [roles[name] for name in held], situation.now_s, work)
        said: list[Statable] = []
        for name in dict.fromkeys([*self._auctions, *self._offered]):
            then = work.after(outlook, data, roles[name]) if name in roles else None
            if then is not None:
                bid_s = min(HIGHEST_BID_S, round(then.free_s))
                if name in self._auctions:
                    self._auctions[name].bids_s[self._me] = bid_s
                if name in self._offered:
                    said.append((self._group.path(name), "bid", bid_s))
        return said


@dataclass(frozen=True, slots=True)
class ContractNet:
    """Announce, bid, award; see the module's text."""

    queue: Annotated[int, QUEUE] = 2
    bidding_rounds: Annotated[int, Field(ge=2, le=1000, description="TDMA frames from announcement to award")] = 3
    accept_rounds: Annotated[int, Field(ge=1, le=10_000, description="TDMA frames to accept an award")] = 60
    silence_rounds: Annotated[int, SILENCE] = 60

    name: ClassVar[str] = "contract-net"
    declaration: ClassVar[Declaration] = Declaration(
        source="Smith 1980; Sariel, Balch, Erdogan 2008",
        messages={
            "auctionEnds": "a job is auctioned until then; not acknowledged",
            "bid": "when the sender expects to have done the job; not acknowledged",
            "playsRole": "award by the auctioneer, acceptance by the winner",
            "leftRole": "cancellation by the auctioneer, or withdrawal",
            JOB_DONE: "a vehicle has done a job",
        },
        blocks_per_round=2,
    )
    form = staticmethod(founded)
    adapt = staticmethod(common_roles)

    def negotiator(self, me: str, group: Group) -> Contractor:
        """An auctioneer and bidder for each member."""
        return Contractor(me, group, self)


STRATEGY = ContractNet()
