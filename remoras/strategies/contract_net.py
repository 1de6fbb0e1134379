"""Contract net: announce, bid, award, with initiative of any robot, time-outs and re-auction.

After a change, the group leader announces unassigned open jobs if a member has free capacity. Members bid their
expected completion times. The announcer plans with the bids by the shared allocator, and awards each bidder the first
jobs of its part, up to ``queue`` held ones; with ``looks_ahead`` off, the lowest bids win, one per bidder. The winner
accepts by stating the role; after ``accept_rounds`` without acceptance the job is auctioned again. Another vehicle
announces an open job after ``initiative_rounds``, or a queued one that another would end earlier by ``margin`` of the
time left. Of two holders of a job, the later one leaves.

Source: Smith 1980 (contract net); Sariel, Balch, Erdogan 2008 (DEMiR-CF: initiative, precedence, time-outs,
re-auction). Awarding by a plan is ours; Smith leaves the choice to the announcer.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.authority import Authority
from remoras.organisation import Group, RoleSpecification
from remoras.strategies.allocation import Engagement, planned
from remoras.strategies.negotiator import MARGIN, QUEUE, Claims, KnownFromStart, Member, RoleClaim, frames, in_blocks
from remoras.strategy import JOB_DONE, Declaration, Heard, Move, Situation, Statable, Statement
from remoras.work import Outlook

EARLIEST = 1_000_000
"""Strength of a claim made at 0 s; it falls by one per second, so that earlier claims win."""
HIGHEST_BID_S = 65535
FACTS_PER_BLOCK = 10
"""Bids per block; they share its header."""


@dataclass(slots=True)
class Sayings:
    """Times of statements that a vehicle holds or releases a role, received in any order."""

    held_s: set[float] = field(default_factory=set)
    left_s: set[float] = field(default_factory=set)

    def claim(self) -> RoleClaim:
        """Return the claim: held since the first statement after the last release."""
        withdrawn_s = max(self.left_s, default=-1.0)
        since_s = min((s for s in self.held_s if s > withdrawn_s), default=None)
        # A claim based on more statements is newer, in any order of reception.
        return RoleClaim(len(self.held_s) + len(self.left_s), 0 if since_s is None else EARLIEST - round(since_s))


@dataclass(slots=True)
class Auction:
    """Own auction: end (round, s), bids so far (s), and whether an own job is handed over."""

    ends: int
    ends_s: int
    bids_s: dict[str, int] = field(default_factory=dict)
    is_handed_over: bool = False


class Contractor(Member["ContractNet"]):
    """Announcer and bidder of one vehicle."""

    def __init__(self, me: str, group: Group, strategy: ContractNet) -> None:
        super().__init__(me, group, strategy)
        self._claims = Claims(group.name)
        self._sayings: dict[tuple[str, str], Sayings] = {}  # by (role, vehicle)
        self._auctions: dict[str, Auction] = {}  # own ones, by role
        self._offered: dict[str, tuple[float, str]] = {}  # by role: end (s) and announcer of others' auctions
        self._unaccepted: dict[tuple[str, str], int] = {}  # own awards (role, vehicle), and the round they were made in
        self._accepted: set[str] = set()
        self._unclaimed_since: dict[str, int] = {}  # round, by open role without holder or auction
        self._announced_on: object = None

    def negotiate(self, situation: Situation) -> Move:
        """Process statements, accept or release held roles, award, announce where responsible, bid."""
        work = situation.work
        self._claims.meet(work.members, work.database)
        self._offered = {name: offer for name, offer in self._offered.items() if offer[0] > situation.now_s}
        for message in situation.heard:
            for fact in message.facts:
                self._hear(message, fact, situation)
        roles = {role.name: role for role in work.unfinished}
        self._auctions = {name: auction for name, auction in self._auctions.items() if name in roles}
        decisions = self._accept(situation)
        decisions += self._cancel(situation)
        decisions += self._award(self._engaged(roles, situation), situation)
        # Computed again: own awards change what this vehicle announces and bids.
        engaged = self._engaged(roles, situation)
        self._announce(engaged, situation)
        facts = [(self._group.path(name), "auctionEnds", auction.ends_s) for name, auction in self._auctions.items()]
        bids = self._bids(roles, engaged, situation)
        statements = [Statement((fact,)) for fact in decisions]
        statements += [*in_blocks(facts, FACTS_PER_BLOCK), *in_blocks(bids, FACTS_PER_BLOCK)]
        return Move(tuple(statements), holding=bool(roles))

    def _engaged(self, roles: Mapping[str, RoleSpecification], situation: Situation) -> dict[str, Engagement]:
        held: dict[str | None, list[RoleSpecification]] = {}
        for name, role in roles.items():
            held.setdefault(self._claims.winner(name), []).append(role)
        return {
            data.name: self._engagement(data.name, held.get(data.name, ()), situation)
            for data in situation.work.workers
        }

    def _accept(self, situation: Situation) -> list[Statable]:
        facts: list[Statable] = []
        for role in situation.work.held_by(self._me):
            if self._claims.winner(role.name) != self._me:
                facts.append(self._leave(role.name, self._me, situation))
            elif role.name not in self._accepted:
                self._accepted.add(role.name)
                facts.append(self._given(self._me, role.name))
        return facts

    def _hear(self, message: Heard, fact: Statable, situation: Situation) -> None:
        subject, attribute, value = fact
        group, _, role = (str(value) if attribute in ("playsRole", "leftRole") else subject).partition(".")
        if group != self._group.name:
            return
        match attribute:
            case "auctionEnds":
                nodes = situation.work.database[message.issuer].node, situation.work.database[self._me].node
                # Of two auctions of one job, that of the lower node goes on.
                if role in self._auctions and nodes[0] < nodes[1]:
                    del self._auctions[role]
                self._offered[role] = float(value), message.issuer
            case "bid" if role in self._auctions:
                self._auctions[role].bids_s[message.issuer] = int(value)
            case "playsRole":
                self._note(role, subject, message.time_s, True)
                if message.issuer == subject:
                    self._unaccepted.pop((role, subject), None)
            case "leftRole":
                self._note(role, subject, message.time_s, False)

    def _note(self, role: str, vehicle: str, time_s: float, holds: bool) -> None:
        sayings = self._sayings.setdefault((role, vehicle), Sayings())
        (sayings.held_s if holds else sayings.left_s).add(time_s)
        self._claims.take(role, vehicle, sayings.claim())
        if not holds and vehicle not in self._claims.standing(role):
            self._unaccepted.pop((role, vehicle), None)
            if vehicle == self._me:
                self._accepted.discard(role)

    def _leave(self, role: str, vehicle: str, situation: Situation) -> Statable:
        self._note(role, vehicle, situation.now_s, False)
        return self._left(vehicle, role)

    # Announcer

    def _cancel(self, situation: Situation) -> list[Statable]:
        late = [key for key, made in self._unaccepted.items() if situation.round - made >= self._with.accept_rounds]
        return [self._leave(role, vehicle, situation) for role, vehicle in late]

    def _award(self, engaged: Mapping[str, Engagement], situation: Situation) -> list[Statable]:
        over = {role: auction for role, auction in self._auctions.items() if auction.ends <= situation.round}
        if not over:
            return []
        self._auctions = {role: auction for role, auction in self._auctions.items() if role not in over}
        facts: list[Statable] = []
        n_held = {name: len(engagement.begun) + len(engagement.queued) for name, engagement in engaged.items()}
        for role, vehicle in self._chosen(over, engaged, n_held, situation):
            winner = self._claims.winner(role)
            if winner is not None and not (over[role].is_handed_over and winner == self._me):
                continue
            if winner == self._me:
                facts.append(self._leave(role, self._me, situation))
            n_held[vehicle] += 1
            self._note(role, vehicle, situation.now_s, True)
            if vehicle == self._me:
                self._accepted.add(role)
            else:
                self._unaccepted[role, vehicle] = situation.round
            facts.append(self._given(vehicle, role))
        return facts

    def _chosen(
        self,
        over: Mapping[str, Auction],
        engaged: Mapping[str, Engagement],
        n_held: Mapping[str, int],
        situation: Situation,
    ) -> list[tuple[str, str]]:
        work, database = situation.work, situation.work.database
        room = {name: self._with.queue - n for name, n in n_held.items()}
        bids = sorted(
            (s, database[v].node, role, v)
            for role, auction in over.items()
            for v, s in auction.bids_s.items()
            if v in engaged and database[v].can_play(work.group.name, role)
        )
        chosen: list[tuple[str, str]] = []
        served: set[str] = set()
        for s, _, role, vehicle in bids:
            is_free = role not in (done for done, _ in chosen) and vehicle not in served and room[vehicle] > 0
            if is_free and over[role].is_handed_over and self._is_better(role, vehicle, s, engaged, situation):
                chosen.append((role, vehicle))
                served.add(vehicle)
        vacant = [role for role in work.open if role.name in over and not over[role.name].is_handed_over]
        if self._with.looks_ahead:
            bidders = [database[v] for v in dict.fromkeys(v for _, _, _, v in bids) if v not in served]
            outlooks = {data.name: _by_bids(data.name, over, engaged[data.name], situation) for data in bidders}
            plan = planned(work, vacant, bidders, outlooks)
            return chosen + [
                (role.name, name) for name, roles in plan.roles.items() for role in roles[: max(0, room[name])]
            ]
        names = {role.name for role in vacant}
        for _, _, role, vehicle in bids:
            if role in names and vehicle not in served and room[vehicle] > 0:
                chosen.append((role, vehicle))
                served.add(vehicle)
                names.discard(role)
        return chosen

    def _announce(self, engaged: Mapping[str, Engagement], situation: Situation) -> None:
        """Auction unassigned jobs if responsible, or a queued job that another would end earlier."""
        work, me = situation.work, self._me
        vacant = [
            role.name for role in work.open if self._claims.winner(role.name) is None and role.name not in self._offered
        ]
        since = self._unclaimed_since
        self._unclaimed_since = {name: since.get(name, situation.round) for name in vacant}
        # Bids depend on the awards of the running auction.
        if self._auctions:
            return
        with_room = [
            v for v, engagement in engaged.items() if len(engagement.begun) + len(engagement.queued) < self._with.queue
        ]
        if me not in work.heads:
            # Staggered by node: the first announcement keeps the others from theirs.
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
        after = work.after(engaged[vehicle].end(data, work), data, role)
        return float(HIGHEST_BID_S) if after is None else after.free_s

    def _is_better(
        self, role: str, vehicle: str, bid_s: float, engaged: Mapping[str, Engagement], situation: Situation
    ) -> bool:
        work, data = situation.work, situation.work.database[self._me]
        if vehicle == self._me or self._me not in engaged or role not in (r.name for r in engaged[self._me].queued):
            return False
        left_s = engaged[self._me].end(data, work).free_s - situation.now_s
        return bid_s - situation.now_s < (1.0 - self._with.margin) * left_s

    # Bidder

    def _bids(
        self, roles: Mapping[str, RoleSpecification], engaged: Mapping[str, Engagement], situation: Situation
    ) -> list[Statable]:
        if self._me not in engaged:
            return []
        bids: list[Statable] = []
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
                bids.append((self._group.path(name), "bid", bid_s))
        return bids


def _by_bids(vehicle: str, over: Mapping[str, Auction], engaged: Engagement, situation: Situation) -> Outlook:
    # Bids follow from the bidder's own knowledge: their median difference corrects the announcer's estimate.
    work, data = situation.work, situation.work.database[vehicle]
    end = engaged.end(data, work)
    shifts_s = []
    for role in work.open:
        bid_s = over[role.name].bids_s.get(vehicle) if role.name in over else None
        after = work.after(end, data, role)
        if bid_s is not None and after is not None:
            shifts_s.append(bid_s - after.free_s)
    shift_s = sorted(shifts_s)[len(shifts_s) // 2] if shifts_s else 0.0
    return Outlook(max(situation.now_s, end.free_s + shift_s), end.position_m)


@dataclass(frozen=True, slots=True)
class ContractNet(KnownFromStart):
    """Contract net; see the module docstring."""

    queue: Annotated[int, QUEUE] = 2
    bidding_rounds: Annotated[int, frames("from announcement to award", 2)] = 3
    accept_rounds: Annotated[int, frames("to accept an award", most=10_000)] = 60
    initiative_rounds: Annotated[int, frames("per node that others wait before they announce", most=10_000)] = 10
    margin: Annotated[float, MARGIN] = 0.05
    looks_ahead: Annotated[bool, Field(description="award by a plan of all jobs, else the lowest bids")] = True

    name: ClassVar[str] = "contract-net"
    member = Contractor
    announces = "bids"
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


STRATEGY = ContractNet()
