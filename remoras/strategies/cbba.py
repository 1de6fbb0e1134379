"""Consensus-based bundle algorithm, asynchronous: every vehicle bids, without a leader.

Each vehicle plans a bundle of jobs and a path through them. It adds the job with the largest gain in path score among
those for which it outbids all known claims. The score is the sum of exp(-t / discount_s) over completion times t. On a
stronger claim the vehicle drops that job and all added later. After ``settle_rounds`` it begins the job with the
maximum strength; of two vehicles that have begun it, the higher node leaves. Claims of absent vehicles are ignored.

Bids ignore the effect on remaining jobs, so plain CBBA (``plans_for_all`` off) divides work like sequential greedy
assignment. By default a vehicle bids for its part of a plan for all members by the shared allocator, and consensus
resolves differences. Every able vehicle bids for a job that stays unclaimed for long.

One unacknowledged message, sent on change and every ``repeat_rounds``, holds all claims of a vehicle, own or relayed,
and its round. Of two messages about a vehicle the later round wins.

Source: Choi, Brunet, How 2009 (bundles, scores, bid vectors); Johnson, Ponda, Choi, How 2010 (asynchronous); Johnson,
Choi, How 2012 (hybrid of information and plan consensus). ``negotiator.Claims`` replaces their decision tables.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from exchange.arithmetic import exp
from remoras.organisation import Group, RoleSpecification
from remoras.strategies.allocation import planned
from remoras.strategies.negotiator import Claims, KnownFromStart, Member, RoleClaim, frames, taking
from remoras.strategy import Heard, Move, Situation, Statement
from remoras.work import Outlook, Work

BEGUN = 16383
"""Strength of the claim to a begun job, the 14-bit maximum; bids stay below."""
JOBS_PER_BLOCK = 13
"""Claims per block; more do not fit the packet of a small modem."""


class Bidder(Member["Cbba"]):
    """Bundle, path and claims of one vehicle."""

    def __init__(self, me: str, group: Group, strategy: Cbba) -> None:
        super().__init__(me, group, strategy)
        self._roles = {role.name: role for role in group.roles}
        self._claims = Claims(group.name)
        self._news: dict[str, int] = {}  # time of last news: the round of the claims of each vehicle
        self._since: dict[str, int] = {}  # the round since which each own claim has stood
        self._bundle: list[str] = []  # in the order in which they were added
        self._path: list[str] = []  # in the order in which they are to be done
        self._unsaid: set[str] = set()  # vehicles with claims to report
        self._known: object = None
        self._lost: set[str] = set()  # jobs that the last plan left to stronger claims
        self._bid_anew = True
        self._unclaimed: dict[str, int] = {}  # round since which an open role has no claim
        self._orphans: list[str] = []  # unclaimed for long
        self._adopted: set[str] = set()  # jobs of the bundle that were orphans

    def negotiate(self, situation: Situation) -> Move:
        """Process claims, yield to stronger ones, bid after changes, begin settled jobs, report."""
        work, now = situation.work, situation.round
        self._listen(situation)
        unfinished = [role.name for role in work.unfinished]
        self._drop({name for name in self._bundle if name not in unfinished})
        self._give_way(now)
        statements, held = self._released(situation)
        if self._bid_anew:
            self._bid_anew = False
            self._build(held, situation)
        if not held and (name := self._next(now)) is not None:
            statements.append(self._takes(name))
            self._drop({name})
            self._claim(name, BEGUN, now)
            self._bid_anew = True
        statements += self._sayings(now, unfinished)
        return Move(tuple(statements), holding=bool(unfinished))

    def division(self) -> Mapping[str, str]:
        """Return the vehicle with the strongest claim, by role name."""
        winners = {name: self._claims.winner(name) for name in self._roles}
        return {name: winner for name, winner in winners.items() if winner is not None}

    # Consensus

    def _listen(self, situation: Situation) -> None:
        work = situation.work
        others = set(work.members).difference(work.unavailable, {self._me})
        names = tuple(name for name in work.database.names if name in others or name == self._me)
        self._claims.meet(names, work.database)
        for message in situation.heard:
            self._hear(message)
        open_roles = self._open(work)
        self._orphans = self._found_orphans(open_roles, situation.round)
        known = work.done, names, open_roles, self._orphans
        if known != self._known:
            self._known, self._bid_anew = known, True

    def _hear(self, message: Heard) -> None:
        issuer, attribute, made = message.facts[0]
        if attribute != "claimsOf":
            return
        if int(made) < self._news.get(issuer, -1):
            self._unsaid.add(issuer)  # the issuer lacks the latest claims
        if issuer == self._me or int(made) < self._news.get(issuer, -1):
            return
        strengths = {
            role: int(strength)
            for subject, attribute, strength in message.facts[1:]
            if attribute == "claim"
            for group, _, role in [subject.partition(".")]
            if group == self._group.name
        }
        if len(strengths) + 1 < len(message.facts):
            return  # of another group
        # A message holds all claims of its vehicle, so a missing one is withdrawn.
        withdrawn = {role for role in self._roles if self._claims.stands(role, issuer)}.difference(strengths)
        news = [
            role
            for role, strength in [*strengths.items(), *((role, 0) for role in sorted(withdrawn))]
            if self._claims.take(role, issuer, RoleClaim(int(made), strength))
        ]
        self._news[issuer] = int(made)
        if news:
            self._unsaid.add(issuer)
            # A plan for all depends on others' bids only if they were stronger; begun jobs are visible anyway.
            if not self._with.plans_for_all or not self._lost.isdisjoint(news):
                self._bid_anew = True

    def _released(self, situation: Situation) -> tuple[list[Statement], list[RoleSpecification]]:
        statements: list[Statement] = []
        held = situation.work.held_by(self._me)
        begun = self._claims.made_before(situation.round, self._me, BEGUN)  # some while isolated, unknown to others
        gone = [role.name for role in situation.work.unfinished if role.name in begun and role not in held]
        self._release(gone, situation.round)
        for role in held:
            if self._claims.winner(role.name) != self._me:
                statements.append(self._leaves(role.name))
                self._claim(role.name, 0, situation.round)
        return statements, [role for role in held if self._claims.winner(role.name) == self._me]

    def _give_way(self, now: int) -> None:
        lost = next((n for n, name in enumerate(self._bundle) if self._claims.winner(name) != self._me), None)
        if lost is not None:
            # Bids of jobs added later assumed the lost one in the path.
            self._release(self._bundle[lost:], now)

    def _release(self, names: Sequence[str], now: int) -> None:
        for name in names:
            self._claim(name, 0, now)
        self._drop(set(names))

    def _drop(self, names: set[str]) -> None:
        self._bundle = [name for name in self._bundle if name not in names]
        self._path = [name for name in self._path if name not in names]
        self._bid_anew |= bool(names)

    def _claim(self, role: str, strength: int, now: int) -> None:
        if self._claims.take(role, self._me, RoleClaim(now, strength)):
            self._since[role] = now
            self._news[self._me] = now
            self._unsaid.add(self._me)

    # Bundle

    def _score(self, path: Sequence[str], outlook: Outlook, work: Work, now_s: float) -> float:
        data, total = work.database[self._me], 0.0
        for name in path:
            after = work.after(outlook, data, self._roles[name])
            if after is None or not work.affords(outlook, data, self._roles[name]):
                return 0.0
            outlook = after
            # Counted from mission start, late bids would round to zero.
            total += exp(-(outlook.free_s - now_s) / self._with.discount_s)
        return total

    def _build(self, held: Sequence[RoleSpecification], situation: Situation) -> None:
        work, data = situation.work, situation.work.database[self._me]
        if data not in work.workers:
            return
        outlook = self._engagement(self._me, held, situation).end(data, work)
        if self._with.plans_for_all:
            self._build_by_plan(held, outlook, situation)
            return
        while len(self._bundle) < self._with.bundle:
            base = self._score(self._path, outlook, work, situation.now_s)
            best: tuple[int, str, list[str]] | None = None
            for name in self._open(work):
                if name in self._bundle or not work.able(data, self._roles[name]):
                    continue
                paths = [[*self._path[:n], name, *self._path[n:]] for n in range(len(self._path) + 1)]
                score, path = max(
                    ((self._score(p, outlook, work, situation.now_s), p) for p in paths), key=lambda pair: pair[0]
                )
                bid = _strength(score - base)
                if self._claims.beats(name, self._me, bid) and (best is None or bid > best[0]):
                    best = bid, name, path
            if best is None:
                return
            bid, name, self._path = best
            self._bundle.append(name)
            self._claim(name, bid, situation.round)

    def _open(self, work: Work) -> list[str]:
        return [role.name for role in work.open if not self._claims.has(role.name, BEGUN)]

    def _found_orphans(self, open_roles: Sequence[str], now: int) -> list[str]:
        # Unclaimed for long: the vehicle planned for the role cannot know of it.
        unclaimed = [name for name in open_roles if self._claims.winner(name) is None]
        self._unclaimed = {name: self._unclaimed.get(name, now) for name in unclaimed}
        return [name for name, since in self._unclaimed.items() if now - since >= 2 * self._with.repeat_rounds]

    def _build_by_plan(self, held: Sequence[RoleSpecification], outlook: Outlook, situation: Situation) -> None:
        work = situation.work
        open_roles = self._open(work)
        adopted = self._adopted.intersection(self._bundle).union(self._orphans)
        orphans = [n for n in open_roles if n in adopted and work.able(work.database[self._me], self._roles[n])]
        begun = {data.name: held if data.name == self._me else self._begun_by(data.name, work) for data in work.workers}
        outlooks = {d.name: self._engagement(d.name, begun[d.name], situation).end(d, work) for d in work.workers}
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
                name for name in mine if name not in self._bundle and not self._claims.beats(name, self._me, bids[name])
            ]
            if not beaten:
                break
            for name in beaten:
                winner = self._claims.winner(name) or self._me  # may be unable to work and still claim it
                theirs.setdefault(winner, []).append(self._roles[name])
        self._lost = {role.name for roles in theirs.values() for role in roles}
        self._adopted = set(mine).difference(planned_for_me)
        self._release([name for name in self._bundle if name not in mine], situation.round)
        for name in mine:
            if name not in self._bundle:
                self._claim(name, bids[name], situation.round)
        self._bundle, self._path, self._bid_anew = list(mine), list(mine), False

    def _begun_by(self, vehicle: str, work: Work) -> list[RoleSpecification]:
        latest = ((role, self._claims.of(role.name, vehicle)) for role in work.unfinished)
        return [role for role, claim in latest if claim is not None and claim.strength == BEGUN]

    def _next(self, now: int) -> str | None:
        stood = (name for name in self._path[:1] if now - self._since.get(name, now) >= self._with.settle_rounds)
        return next(stood, None)

    # Saying

    def _sayings(self, now: int, unfinished: Sequence[str]) -> list[Statement]:
        all_due = now % self._with.repeat_rounds == 0
        new, self._unsaid = self._unsaid, set()
        statements = []
        for vehicle in self._claims.members:
            if vehicle not in self._news or not (all_due or vehicle in new):
                continue
            strengths = [
                (self._group.path(name), "claim", claim.strength)
                for name in unfinished
                if (claim := self._claims.of(name, vehicle)) is not None and claim.strength > 0
            ]
            strongest = sorted(strengths, key=lambda fact: (-int(fact[2]), fact[0]))[:JOBS_PER_BLOCK]
            if strongest or vehicle in new:
                statements.append(Statement(((vehicle, "claimsOf", self._news[vehicle]), *strongest)))
        return statements


def _strength(gain: float) -> int:
    return max(1, min(BEGUN - 1, round(BEGUN * gain)))


PlansForAll = Annotated[
    bool,
    Field(description="bid for the own part of a common plan (hybrid of information and plan consensus); false: CBBA"),
]


@dataclass(frozen=True, slots=True)
class Cbba(KnownFromStart):
    """CBBA and its hybrid with ``plans_for_all``; see the module docstring."""

    bundle: Annotated[int, Field(ge=1, le=12, description="maximum number of jobs planned ahead")] = 6
    settle_rounds: Annotated[int, frames("for which a claim must stand before its job starts", 0)] = 1
    repeat_rounds: Annotated[int, frames("after which all claims are repeated")] = 4
    discount_s: Annotated[
        float, Field(gt=0.0, le=1e6, description="delay of completion that reduces the worth of a job to 1/e")
    ] = 2500.0
    plans_for_all: PlansForAll = True

    name: ClassVar[str] = "cbba"
    member = Bidder
    announces = "claims"
    planned = taking(
        "Choi, Brunet, How 2009; Johnson, Ponda, Choi, How 2010; Johnson, Choi, How 2012",
        {
            "claimsOf": "vehicle and round of the claims that follow: its time of last update; not acknowledged",
            "claim": "how strongly that vehicle claims a job",
        },
        blocks_per_round=2,
    )


STRATEGY = Cbba()
