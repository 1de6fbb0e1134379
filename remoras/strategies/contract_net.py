"""Contract net: announce, bid, award, with initiative of any robot, time-outs and re-auction.

The head announces open jobs that nobody holds whenever something has changed and a member has room for one. Every
member bids for each the time at which it expects to have done it. When the auction ends, the announcer plans with the
bids, by the allocator that all strategies share, and awards each bidder with room the first jobs of its part, so that
it holds ``queue`` at most. With ``looks_ahead`` off it awards the lowest bids instead, one to each bidder: what is left
for later then counts for nothing. The winner accepts by stating the role itself; an award not accepted within
``accept_rounds`` is cancelled and auctioned anew.

Any robot takes the initiative. One that has known of an open job for ``initiative_rounds`` which nobody holds or
announces does so itself, the one of the lowest node first. One that has not begun a job, and expects another to do it
earlier by ``margin`` of the time left, announces it anew and hands it over to the lowest bid. If two hold the same job,
the one that came later gives it up on hearing of the other. A job is announced once all that it needs is done.

Announcements and bids are said anew in every frame of an auction, all bids together, and not acknowledged. Awards,
acceptances and results are facts, acknowledged and repeated until they are.

Source: Smith 1980 (contract net); Sariel, Balch, Erdogan 2008 (DEMiR-CF: initiative of any robot, precedence, local
models, time-outs, re-auction). Awarding by a plan is ours; Smith leaves the choice among bids to the announcer.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.authority import Authority
from remoras.organisation import Group, RoleSpecification
from remoras.strategies.allocation import Engagement, Expectations, planned
from remoras.strategies.dispatch import MARGIN, QUEUE
from remoras.strategies.factors import AtSea, Factors
from remoras.strategies.negotiator import Claims, KnownFromStart, Member, RoleClaim, frames, in_blocks
from remoras.strategy import JOB_DONE, Declaration, Heard, Move, Situation, Statable, Statement
from remoras.work import Outlook

EARLIEST = 1_000_000
"""Strength of a claim made at time 0; it falls by one in a second, so the earlier claim is the stronger."""
HIGHEST_BID_S = 65535
FACTS_PER_BLOCK = 10
"""Bids that go into one block: they share its head."""


@dataclass(slots=True)
class Sayings:
    """When a vehicle was said to hold a role, and when not to, in whatever order that was heard."""

    held_s: set[float] = field(default_factory=set)
    left_s: set[float] = field(default_factory=set)

    def claim(self) -> RoleClaim:
        """Held since the first that was said after the last withdrawal; what rests on more sayings is newer."""
        withdrawn_s = max(self.left_s, default=-1.0)
        since_s = min((s for s in self.held_s if s > withdrawn_s), default=None)
        return RoleClaim(len(self.held_s) + len(self.left_s), 0 if since_s is None else EARLIEST - round(since_s))


@dataclass(slots=True)
class Auction:
    """An auction that this vehicle holds: when it ends, the bids so far, whether a job of its own is handed over."""

    ends: int
    ends_s: int
    bids_s: dict[str, int] = field(default_factory=dict)
    is_handed_over: bool = False


class Contractor(Member["ContractNet"]):
    """Announcer and bidder of one vehicle."""

    def __init__(self, me: str, group: Group, strategy: ContractNet) -> None:
        super().__init__(me, group, strategy)
        self._claims: Claims | None = None
        self._sayings: dict[tuple[str, str], Sayings] = {}  # by (role, vehicle)
        self._auctions: dict[str, Auction] = {}  # own ones, by role
        self._offered: dict[str, tuple[float, str]] = {}  # roles announced by others: until when, by whom
        self._unaccepted: dict[tuple[str, str], int] = {}  # own awards (role, vehicle), and the round they were made in
        self._accepted: set[str] = set()
        self._unclaimed_since: dict[str, int] = {}  # open roles that nobody holds or announces
        self._announced_on: object = None
        self._expectations = Expectations()

    def negotiate(self, situation: Situation) -> Move:
        """Hear, accept or leave what is held, award, announce where that is this vehicle's part, and bid."""
        work = situation.work
        claims = self._claims = self._claims or Claims(work.database, work.group.name)
        claims.members = work.members
        self._offered = {name: offer for name, offer in self._offered.items() if offer[0] > situation.now_s}
        for heard in situation.heard:
            for fact in heard.facts:
                self._hear(heard, fact, situation, claims)
        roles = {role.name: role for role in work.unfinished}
        self._auctions = {name: auction for name, auction in self._auctions.items() if name in roles}
        said = self._accept(situation, claims)
        said += self._cancel(situation, claims)
        said += self._award(self._engaged(roles, situation, claims), situation, claims)
        engaged = self._engaged(roles, situation, claims)
        self._announce(engaged, situation, claims)
        facts = [(self._group.path(name), "auctionEnds", auction.ends_s) for name, auction in self._auctions.items()]
        bids = self._bids(roles, engaged, situation)
        statements = [Statement((fact,)) for fact in said]
        statements += [*in_blocks(facts, FACTS_PER_BLOCK), *in_blocks(bids, FACTS_PER_BLOCK)]
        return Move(tuple(statements), holding=bool(roles))

    def _engaged(
        self, roles: Mapping[str, RoleSpecification], situation: Situation, claims: Claims
    ) -> dict[str, Engagement]:
        """What each worker holds, by the claims that are known, and when it will have done it."""
        return {
            data.name: self._expectations.of(
                data,
                [role for name, role in roles.items() if claims.winner(name) == data.name],
                situation.work,
                situation.now_s,
                situation.now_s if data.name == self._me else situation.heard_s.get(data.name, 0.0),
            )
            for data in situation.work.workers
        }

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

    def _hear(self, heard: Heard, fact: Statable, situation: Situation, claims: Claims) -> None:
        subject, attribute, value = fact
        group, _, role = (str(value) if attribute in ("playsRole", "leftRole") else subject).partition(".")
        if group != self._group.name:
            return
        match attribute:
            case "auctionEnds":
                nodes = situation.work.database[heard.issuer].node, situation.work.database[self._me].node
                if role in self._auctions and nodes[0] < nodes[1]:
                    del self._auctions[role]
                self._offered[role] = float(value), heard.issuer
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

    # Announcer

    def _cancel(self, situation: Situation, claims: Claims) -> list[Statable]:
        """Own awards that were not accepted in time."""
        late = [key for key, made in self._unaccepted.items() if situation.round - made >= self._with.accept_rounds]
        return [self._leave(role, vehicle, situation, claims) for role, vehicle in late]

    def _award(self, engaged: Mapping[str, Engagement], situation: Situation, claims: Claims) -> list[Statable]:
        """Jobs whose auction is over go to who bids best and has room."""
        over = {role: auction for role, auction in self._auctions.items() if auction.ends <= situation.round}
        if not over:
            return []
        self._auctions = {role: auction for role, auction in self._auctions.items() if role not in over}
        said: list[Statable] = []
        n_held = {name: len(engagement.begun) + len(engagement.queued) for name, engagement in engaged.items()}
        for role, vehicle in self._chosen(over, engaged, n_held, situation):
            winner = claims.winner(role)
            if winner is not None and not (over[role].is_handed_over and winner == self._me):
                continue
            if winner == self._me:
                said.append(self._leave(role, self._me, situation, claims))
            n_held[vehicle] += 1
            self._note_held(role, vehicle, situation.now_s, claims)
            if vehicle == self._me:
                self._accepted.add(role)
            else:
                self._unaccepted[role, vehicle] = situation.round
            said.append((vehicle, "playsRole", self._group.path(role)))
        return said

    def _chosen(
        self,
        over: Mapping[str, Auction],
        engaged: Mapping[str, Engagement],
        n_held: Mapping[str, int],
        situation: Situation,
    ) -> list[tuple[str, str]]:
        """(role, vehicle) of the bids that win."""
        work, database = situation.work, situation.work.database
        room = {name: self._with.queue - n for name, n in n_held.items()}
        bids = sorted(
            (s, database[v].node, role, v)
            for role, auction in over.items()
            for v, s in auction.bids_s.items()
            if v in engaged and database[v].can_play(work.group.name, role)
        )
        found: list[tuple[str, str]] = []
        served: set[str] = set()
        for s, _, role, vehicle in bids:
            is_free = role not in (done for done, _ in found) and vehicle not in served and room[vehicle] > 0
            if is_free and over[role].is_handed_over and self._is_better(role, vehicle, s, engaged, situation):
                found.append((role, vehicle))
                served.add(vehicle)
        vacant = [role for role in work.open if role.name in over and not over[role.name].is_handed_over]
        if self._with.looks_ahead:
            bidders = [database[v] for v in dict.fromkeys(v for _, _, _, v in bids) if v not in served]
            outlooks = {data.name: _by_bids(data.name, over, engaged[data.name], situation) for data in bidders}
            plan = planned(work, vacant, bidders, outlooks)
            return found + [
                (role.name, name) for name, roles in plan.roles.items() for role in roles[: max(0, room[name])]
            ]
        names = {role.name for role in vacant}
        for _, _, role, vehicle in bids:
            if role in names and vehicle not in served and room[vehicle] > 0:
                found.append((role, vehicle))
                served.add(vehicle)
                names.discard(role)
        return found

    def _announce(self, engaged: Mapping[str, Engagement], situation: Situation, claims: Claims) -> None:
        """Auction what nobody holds, if that is this vehicle's part, or a queued job that another would do earlier."""
        work, me = situation.work, self._me
        vacant = [
            role.name for role in work.open if claims.winner(role.name) is None and role.name not in self._offered
        ]
        since = self._unclaimed_since
        self._unclaimed_since = {name: since.get(name, situation.round) for name in vacant}
        if self._auctions:
            return
        with_room = [
            v for v, engagement in engaged.items() if len(engagement.begun) + len(engagement.queued) < self._with.queue
        ]
        if me not in work.heads:
            patience = self._with.initiative_rounds * (1 + work.database[me].node)
            vacant = [n for n in vacant if situation.round - self._unclaimed_since[n] >= patience]
        held = {v: (engagement.begun, engagement.queued) for v, engagement in engaged.items()}
        announced_on = tuple(vacant), work.done, held
        is_due = announced_on != self._announced_on or not any(engagement.begun for engagement in engaged.values())
        if vacant and with_room and is_due:
            self._announced_on = announced_on
            self._auctions = {name: self._auction(situation) for name in vacant}
        elif not vacant and me in engaged and not self._offered:
            for role in engaged[me].queued:
                others = [v for v in with_room if v != me and work.able(work.database[v], role)]
                then_s = {v: self._then_s(v, role, engaged, situation) for v in others}
                if any(self._is_better(role.name, v, s, engaged, situation) for v, s in then_s.items()):
                    self._auctions = {role.name: self._auction(situation, is_handed_over=True)}
                    return

    def _auction(self, situation: Situation, is_handed_over: bool = False) -> Auction:
        ends_s = situation.now_s * (1.0 + self._with.bidding_rounds / situation.round)
        return Auction(situation.round + self._with.bidding_rounds, round(ends_s), is_handed_over=is_handed_over)

    def _then_s(
        self, vehicle: str, role: RoleSpecification, engaged: Mapping[str, Engagement], situation: Situation
    ) -> float:
        work, data = situation.work, situation.work.database[vehicle]
        then = work.after(engaged[vehicle].end(data, work), data, role)
        return float(HIGHEST_BID_S) if then is None else then.free_s

    def _is_better(
        self, role: str, vehicle: str, bid_s: float, engaged: Mapping[str, Engagement], situation: Situation
    ) -> bool:
        """True if another would have done a job of this vehicle earlier than this one all that it holds."""
        work, data = situation.work, situation.work.database[self._me]
        if vehicle == self._me or self._me not in engaged or role not in (r.name for r in engaged[self._me].queued):
            return False
        left_s = engaged[self._me].end(data, work).free_s - situation.now_s
        return bid_s - situation.now_s < (1.0 - self._with.margin) * left_s

    # Bidder

    def _bids(
        self, roles: Mapping[str, RoleSpecification], engaged: Mapping[str, Engagement], situation: Situation
    ) -> list[Statable]:
        """Bids for all announced jobs, as long as their auction runs; those in its own auctions it tells nobody."""
        if self._me not in engaged:
            return []
        said: list[Statable] = []
        for name in dict.fromkeys([*self._auctions, *self._offered]):
            role = roles.get(name)
            data = situation.work.database[self._me]
            if role is None or not situation.work.able(data, role):
                continue
            if not situation.work.affords(engaged[self._me].end(data, situation.work), data, role):
                continue
            bid_s = min(HIGHEST_BID_S, round(self._then_s(self._me, role, engaged, situation)))
            if name in self._auctions:
                self._auctions[name].bids_s[self._me] = bid_s
            if name in self._offered:
                said.append((self._group.path(name), "bid", bid_s))
        return said


def _by_bids(vehicle: str, over: Mapping[str, Auction], engaged: Engagement, situation: Situation) -> Outlook:
    """When and where a bidder is free: as expected, later or earlier by what its bids differ from expected ones."""
    work, data = situation.work, situation.work.database[vehicle]
    end = engaged.end(data, work)
    shifts_s = []
    for role in work.open:
        bid_s = over[role.name].bids_s.get(vehicle) if role.name in over else None
        then = work.after(end, data, role)
        if bid_s is not None and then is not None:
            shifts_s.append(bid_s - then.free_s)
    shift_s = sorted(shifts_s)[len(shifts_s) // 2] if shifts_s else 0.0
    return Outlook(max(situation.now_s, end.free_s + shift_s), end.position_m)


@dataclass(frozen=True, slots=True)
class ContractNet(KnownFromStart):
    """Announce, bid, award; see the module's text."""

    queue: Annotated[int, QUEUE] = 2
    bidding_rounds: Annotated[int, frames("from announcement to award", 2)] = 3
    accept_rounds: Annotated[int, frames("to accept an award", most=10_000)] = 60
    initiative_rounds: Annotated[int, frames("that others wait, for each node, before they announce", most=10_000)] = 10
    margin: Annotated[float, MARGIN] = 0.05
    looks_ahead: Annotated[bool, Field(description="award by a plan of all jobs, else the lowest bids")] = True

    common_plan: AtSea = "missions"

    name: ClassVar[str] = "contract-net"
    planned = Declaration(
        source="Smith 1980; Sariel, Balch, Erdogan 2008",
        messages={
            "auctionEnds": "a job is auctioned until then; not acknowledged",
            "bid": "when the sender expects to have done the job; not acknowledged",
            "playsRole": "award by the announcer, acceptance by the winner",
            "leftRole": "cancellation by the announcer, or withdrawal",
            JOB_DONE: "the sender has done a job",
        },
        blocks_per_round=2,
        authorities=frozenset({Authority.RECRUIT}),
    )

    @property
    def factors(self) -> Factors:
        """Its levels."""
        plan = "all" if self.looks_ahead else "own"
        return Factors(self.common_plan, "each", plan, "bids", "no", "changes")

    def negotiator(self, me: str, group: Group) -> Contractor:
        """An announcer and bidder for each member."""
        return Contractor(me, group, self)


STRATEGY = ContractNet()
