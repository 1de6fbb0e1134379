"""Consensus-based bundle algorithm, asynchronous: everybody bids, nobody leads.

Every vehicle keeps a bundle of jobs that it means to do, and the path through them. It adds the job that raises the
score of its path most, among those for which it can outbid all that it has heard of. The score of a path is the sum of
exp(-t / discount_s) over the times t until its jobs will be finished. They count from the round of the bid: counted
from the start of the mission, late bids would round to nothing. When it hears a stronger bid for a job of its bundle,
it drops the job and all that it added later, whose bids rested on it, and bids anew. A job is begun when its claim has
stood for ``settle_rounds``; from then on its claim is the strongest there is, and if two have begun the same job, the
one of the higher node gives it up on hearing of it. Claims of a vehicle that is absent do not count.

A bundle is greedy: its bids leave out of account what the jobs that are left mean for all. So CBBA proper, with
``plans_for_all`` off, divides work as sequential greedy does. With ``plans_for_all``, as shipped, this is the hybrid of
information and plan consensus: a vehicle bids for its part of a plan for all members, made of its own picture by the
allocator that all strategies share; consensus settles where pictures differ. A job that nobody has claimed for long
each may expect of another: whoever is able bids for it too, and keeps the bid until it is lost.

All claims of a vehicle are one message: whose they are and of which round, then each job with the strength of the
claim; what is not named is claimed no longer. It is broadcast when it changes and every ``repeat_rounds``, those of
others too; nothing is acknowledged. The round is the time of last news of that vehicle: of two messages about one
vehicle the later counts, whoever relayed it, and who relays an older one is told the newer.

Source: Choi, Brunet, How 2009 (bundles, scores, vectors of bids and of times of last news); Johnson, Ponda, Choi, How
2010 (asynchronous messages); Johnson, Choi, How 2012 (hybrid of information and plan consensus). Their tables of
decisions are replaced by ``claims``: the latest claims of each vehicle are kept, the strongest wins.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from exchange.arithmetic import exp
from remoras.organisation import Group, RoleSpecification
from remoras.strategies.allocation import Engagement, Expectations, planned
from remoras.strategies.factors import AtSea, Factors
from remoras.strategies.negotiator import Claims, KnownFromStart, Member, RoleClaim, frames, taking
from remoras.strategy import Heard, Move, Situation, Statement
from remoras.work import Outlook, Work

BEGUN = 16383
"""Strength of the claim to a job that has been begun; bids stay below. A strength takes 14 bits."""
JOBS_PER_BLOCK = 13
"""Claims that go into one block; more do not fit the packet of a small modem."""


class Bidder(Member["Cbba"]):
    """Bundle, path and claims of one vehicle."""

    def __init__(self, me: str, group: Group, strategy: Cbba) -> None:
        super().__init__(me, group, strategy)
        self._roles = {role.name: role for role in group.roles}
        self._claims: Claims | None = None
        self._news: dict[str, int] = {}  # time of last news: the round of the claims of each vehicle
        self._since: dict[str, int] = {}  # the round since which each own claim has stood
        self._bundle: list[str] = []  # in the order in which they were added
        self._path: list[str] = []  # in the order in which they are to be done
        self._expectations = Expectations()
        self._unsaid: set[str] = set()  # vehicles of whose claims there is news to tell
        self._known: object = None
        self._lost: set[str] = set()  # jobs that the last plan left to stronger claims
        self._bid_anew = True
        self._unclaimed: dict[str, int] = {}  # since when nobody claims an open role
        self._orphans: list[str] = []  # those that nobody has claimed for long
        self._adopted: set[str] = set()  # jobs of the bundle that were such

    def negotiate(self, situation: Situation) -> Move:
        """Hear, give way, bid anew if something has changed, begin what has stood, tell what is new."""
        work, now = situation.work, situation.round
        claims = self._claims = self._claims or Claims(work.database, work.group.name)
        self._listen(situation, claims)
        unfinished = [role.name for role in work.unfinished]
        self._drop({name for name in self._bundle if name not in unfinished})
        self._give_way(now, claims)
        said, held = self._left(situation, claims)
        if self._bid_anew:
            self._bid_anew = False
            self._build(held, situation, claims)
        if not held and (name := self._next(now)) is not None:
            said.append(self._takes(name))
            self._drop({name})
            self._claim(name, BEGUN, now, claims)
            self._bid_anew = True
        said += self._sayings(now, unfinished, claims)
        return Move(tuple(said), holding=bool(unfinished))

    def division(self) -> Mapping[str, str]:
        """Who claims which job most strongly."""
        claims = self._claims
        winners = {name: claims.winner(name) for name in self._roles} if claims is not None else {}
        return {name: winner for name, winner in winners.items() if winner is not None}

    # Consensus

    def _listen(self, situation: Situation, claims: Claims) -> None:
        """Take in claims, who is absent and what is done; each may be a reason to bid anew."""
        work = situation.work
        others = set(work.members).difference(work.unavailable, {self._me})
        claims.members = tuple(name for name in work.database.names if name in others or name == self._me)
        for heard in situation.heard:
            self._hear(heard, claims)
        open_roles = self._open(work, claims)
        self._orphans = self._found_orphans(open_roles, situation.round, claims)
        known = work.done, claims.members, open_roles, self._orphans
        if known != self._known:
            self._known, self._bid_anew = known, True

    def _hear(self, heard: Heard, claims: Claims) -> None:
        """All claims of one vehicle, be it the issuer or one of which it relays news."""
        whose, attribute, at = heard.facts[0]
        if attribute != "claimsOf":
            return
        if int(at) < self._news.get(whose, -1):
            self._unsaid.add(whose)  # the issuer has not heard the latest
        if whose == self._me or int(at) < self._news.get(whose, -1):
            return
        strengths = {
            role: int(strength)
            for subject, attribute, strength in heard.facts[1:]
            if attribute == "claim"
            for group, _, role in [subject.partition(".")]
            if group == self._group.name
        }
        if len(strengths) + 1 < len(heard.facts):
            return  # of another group
        withdrawn = {role for role in self._roles if whose in claims.standing(role)}.difference(strengths)
        news = [
            role
            for role, strength in [*strengths.items(), *((role, 0) for role in sorted(withdrawn))]
            if claims.take(role, whose, RoleClaim(int(at), strength))
        ]
        self._news[whose] = int(at)
        if news:
            self._unsaid.add(whose)
            # A plan for all rests on bids of others only where they were stronger; what they have begun is seen anyway.
            if not self._with.plans_for_all or not self._lost.isdisjoint(news):
                self._bid_anew = True

    def _left(self, situation: Situation, claims: Claims) -> tuple[list[Statement], list[RoleSpecification]]:
        """Roles that another vehicle has begun too are left; the statements, and the roles that stay."""
        said: list[Statement] = []
        held = situation.work.held_by(self._me)
        begun = claims.made_before(situation.round, self._me, BEGUN)  # some, while it was cut off, only for itself
        gone = [role.name for role in situation.work.unfinished if role.name in begun and role not in held]
        self._release(gone, situation.round, claims)
        for role in held:
            if claims.winner(role.name) != self._me:
                said.append(self._leaves(role.name))
                self._claim(role.name, 0, situation.round, claims)
        return said, [role for role in held if claims.winner(role.name) == self._me]

    def _give_way(self, now: int, claims: Claims) -> None:
        """Drop the first job of the bundle that is lost, and all that were added after it."""
        lost = next((n for n, name in enumerate(self._bundle) if claims.winner(name) != self._me), None)
        if lost is not None:
            self._release(self._bundle[lost:], now, claims)

    def _release(self, names: Sequence[str], now: int, claims: Claims) -> None:
        for name in names:
            self._claim(name, 0, now, claims)
        self._drop(set(names))

    def _drop(self, names: set[str]) -> None:
        self._bundle = [name for name in self._bundle if name not in names]
        self._path = [name for name in self._path if name not in names]
        self._bid_anew |= bool(names)

    def _claim(self, role: str, strength: int, now: int, claims: Claims) -> None:
        if claims.take(role, self._me, RoleClaim(now, strength)):
            self._since[role] = now
            self._news[self._me] = now
            self._unsaid.add(self._me)

    # Bundle

    def _score(self, path: Sequence[str], outlook: Outlook, work: Work, now_s: float) -> float:
        data, total = work.database[self._me], 0.0
        for name in path:
            then = work.after(outlook, data, self._roles[name])
            if then is None or not work.affords(outlook, data, self._roles[name]):
                return 0.0
            outlook = then
            total += exp(-(outlook.free_s - now_s) / self._with.discount_s)
        return total

    def _build(self, held: Sequence[RoleSpecification], situation: Situation, claims: Claims) -> None:
        """Add open jobs to the bundle while one can be won, expecting to do first what is ``held``."""
        work, data = situation.work, situation.work.database[self._me]
        if data not in work.workers:
            return
        outlook = self._expectations.of(data, held, work, situation.now_s).end(data, work)
        if self._with.plans_for_all:
            self._build_by_plan(held, outlook, situation, claims)
            return
        while len(self._bundle) < self._with.bundle:
            base = self._score(self._path, outlook, work, situation.now_s)
            best: tuple[int, str, list[str]] | None = None
            for name in self._open(work, claims):
                if name in self._bundle or not work.able(data, self._roles[name]):
                    continue
                paths = [[*self._path[:n], name, *self._path[n:]] for n in range(len(self._path) + 1)]
                score, path = max(
                    ((self._score(p, outlook, work, situation.now_s), p) for p in paths), key=lambda found: found[0]
                )
                bid = _strength(score - base)
                if claims.beats(name, self._me, bid) and (best is None or bid > best[0]):
                    best = bid, name, path
            if best is None:
                return
            bid, name, self._path = best
            self._bundle.append(name)
            self._claim(name, bid, situation.round, claims)

    def _open(self, work: Work, claims: Claims) -> list[str]:
        """Open roles that nobody has begun."""
        return [role.name for role in work.open if not claims.has(role.name, BEGUN)]

    def _found_orphans(self, open_roles: Sequence[str], now: int, claims: Claims) -> list[str]:
        """Open roles that nobody has claimed for so long that whoever they are planned for does not know of it.

        Vehicles that hear little of each other may each expect another one to do a job.
        """
        unclaimed = [name for name in open_roles if claims.winner(name) is None]
        self._unclaimed = {name: self._unclaimed.get(name, now) for name in unclaimed}
        return [name for name, since in self._unclaimed.items() if now - since >= 2 * self._with.repeat_rounds]

    def _build_by_plan(
        self, held: Sequence[RoleSpecification], outlook: Outlook, situation: Situation, claims: Claims
    ) -> None:
        """Bid for the own part of a plan for all; what others claim more strongly counts as theirs."""
        work = situation.work
        open_roles = self._open(work, claims)
        adopted = self._adopted.intersection(self._bundle).union(self._orphans)
        orphans = [n for n in open_roles if n in adopted and work.able(work.database[self._me], self._roles[n])]
        engaged = {data.name: self._engaged(data.name, held, situation, claims) for data in work.workers}
        outlooks = {data.name: engaged[data.name].end(data, work) for data in work.workers}
        theirs: dict[str, list[RoleSpecification]] = {data.name: [] for data in work.workers}
        for _ in range(len(open_roles) + 1):
            lost = {role.name for roles in theirs.values() for role in roles}
            after = {data.name: work.after_all(outlooks[data.name], data, theirs[data.name]) for data in work.workers}
            plan = planned(work, [self._roles[n] for n in open_roles if n not in lost], work.workers, after)
            planned_for_me = [role.name for role in plan.roles[self._me]]
            mine = [*planned_for_me, *(name for name in orphans if name not in planned_for_me)][: self._with.bundle]
            base, bids = 0.0, {}
            for n, name in enumerate(mine):
                score = self._score(mine[: n + 1], outlook, work, situation.now_s)
                bids[name], base = _strength(score - base), score
            beaten = [
                name for name in mine if name not in self._bundle and not claims.beats(name, self._me, bids[name])
            ]
            if not beaten:
                break
            for name in beaten:
                winner = claims.winner(name) or self._me  # who may be able to do nothing any more, and still claim it
                theirs.setdefault(winner, []).append(self._roles[name])
        self._lost = {role.name for roles in theirs.values() for role in roles}
        self._adopted = set(mine).difference(planned_for_me)
        self._release([name for name in self._bundle if name not in mine], situation.round, claims)
        for name in mine:
            if name not in self._bundle:
                self._claim(name, bids[name], situation.round, claims)
        self._bundle, self._path, self._bid_anew = list(mine), list(mine), False

    def _engaged(
        self, name: str, held: Sequence[RoleSpecification], situation: Situation, claims: Claims
    ) -> Engagement:
        """What a vehicle is known to be at: what this one holds, and what another one claims to have begun."""
        work = situation.work
        if name != self._me:
            held = [
                role
                for role in work.unfinished
                if (claim := claims.of(role.name, name)) is not None and claim.strength == BEGUN
            ]
        seen_s = situation.now_s if name == self._me else situation.heard_s.get(name, 0.0)
        return self._expectations.of(work.database[name], held, work, situation.now_s, seen_s)

    def _next(self, now: int) -> str | None:
        """The job to begin now: the first of the path, once its claim has stood."""
        stood = (name for name in self._path[:1] if now - self._since.get(name, now) >= self._with.settle_rounds)
        return next(stood, None)

    # Saying

    def _sayings(self, now: int, unfinished: Sequence[str], claims: Claims) -> list[Statement]:
        """Own claims and those of others, where there is something new; from time to time all."""
        all_due = now % self._with.repeat_rounds == 0
        new, self._unsaid = self._unsaid, set()
        said = []
        for vehicle in claims.members:
            if vehicle not in self._news or not (all_due or vehicle in new):
                continue
            strengths = [
                (self._group.path(name), "claim", claim.strength)
                for name in unfinished
                if (claim := claims.of(name, vehicle)) is not None and claim.strength > 0
            ]
            strongest = sorted(strengths, key=lambda fact: (-int(fact[2]), fact[0]))[:JOBS_PER_BLOCK]
            if strongest or vehicle in new:
                said.append(Statement(((vehicle, "claimsOf", self._news[vehicle]), *strongest)))
        return said


def _strength(gain: float) -> int:
    """The strength of a bid, by how much the job adds to the score of a path."""
    return max(1, min(BEGUN - 1, round(BEGUN * gain)))


PlansForAll = Annotated[
    bool,
    Field(description="bid for the own part of a plan for all (hybrid of information and plan consensus); false: CBBA"),
]


@dataclass(frozen=True, slots=True)
class Cbba(KnownFromStart):
    """Bids and bundles; see the module's text."""

    bundle: Annotated[int, Field(ge=1, le=12, description="most jobs that a vehicle plans ahead")] = 6
    settle_rounds: Annotated[int, frames("that a claim must have stood before its job is begun", 0)] = 1
    repeat_rounds: Annotated[int, frames("after which all claims are said again")] = 4
    discount_s: Annotated[
        float, Field(gt=0.0, le=1e6, description="a job finished this much later is worth 1/e of the other")
    ] = 2500.0
    plans_for_all: PlansForAll = True
    common_plan: AtSea = "missions"

    name: ClassVar[str] = "cbba"
    planned = taking(
        "Choi, Brunet, How 2009; Johnson, Ponda, Choi, How 2010; Johnson, Choi, How 2012",
        {
            "claimsOf": "whose claims follow, and of which round: its time of last news; not acknowledged",
            "claim": "how strongly that vehicle claims a job",
        },
        blocks_per_round=2,
    )

    @property
    def factors(self) -> Factors:
        """Its levels."""
        plan = "all" if self.plans_for_all else "own"
        return Factors(self.common_plan, "each", plan, "claims", "no", "changes")

    def negotiator(self, me: str, group: Group) -> Bidder:
        """A bidder for each member."""
        return Bidder(me, group, self)


STRATEGY = Cbba()
