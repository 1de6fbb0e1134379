"""Consensus-based bundle algorithm, asynchronous: everybody bids, nobody leads.

Every vehicle keeps a bundle of jobs that it means to do, and the path through them. It adds the job that raises the
score of its path most, among those for which it can outbid all that it has heard of. The score of a path is the sum of
exp(-t / discount_s) over the times t at which its jobs will be finished. When it hears a stronger bid for a job of
its bundle, it drops the job and all that it added later, whose bids rested on it, and bids anew. Bids are broadcast
when they change and repeated every ``repeat_rounds``, those of others too, and a withdrawal when somebody still relays
what was withdrawn; nothing is acknowledged. A job is begun when its claim has stood for ``settle_rounds``; from then
on its claim is the strongest there is, and if two have begun the same job, the one of the higher node gives it up on
hearing of it. Claims of a vehicle that has not been heard for ``silence_rounds`` do not count until it is heard again.

Source: Choi, Brunet, How 2009 (bundles, scores, consensus); Johnson, Ponda, Choi, How 2010 (asynchronous messages).
Their tables of decisions are replaced by ``claims``: the latest bid of each vehicle is kept, the strongest wins.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.organisation import Group, RoleSpecification
from remoras.strategies.allocation import Expectations
from remoras.strategies.claims import Claim, Claims
from remoras.strategies.founding import common_roles, founded
from remoras.strategies.silence import SILENCE, Silence
from remoras.strategy import JOB_DONE, Declaration, Move, Situation, Statement
from remoras.work import Outlook, Work

BEGUN = 65535
"""Strength of the claim to a job that has been begun; bids stay below."""


class Bidder:
    """Bundle, path and claims of one vehicle."""

    def __init__(self, me: str, group: Group, strategy: Cbba) -> None:
        self._me = me
        self._group = group
        self._with = strategy
        self._roles = {role.name: role for role in group.roles}
        self._claims: Claims | None = None
        self._bundle: list[str] = []  # in the order in which they were added
        self._path: list[str] = []  # in the order in which they are to be done
        self._expectations = Expectations()
        self._silence = Silence(me, strategy.silence_rounds)
        self._unsaid: set[str] = set()
        self._known_done: frozenset[str] = frozenset()
        self._bid_anew = True

    def negotiate(self, situation: Situation) -> Move:
        """Hear, give way, bid anew if something has changed, begin what has stood, tell what is new."""
        work, now = situation.work, situation.round
        claims = self._claims = self._claims or Claims(work.database)
        self._listen(situation, claims)
        unfinished = [role.name for role in work.unfinished]
        self._drop({name for name in self._bundle if name not in unfinished})
        self._give_way(now, claims)
        said, held = self._left(situation, claims)
        if self._bid_anew:
            self._bid_anew = False
            self._build(held, situation, claims)
        if not held and (name := self._next(now, claims)) is not None:
            said.append(Statement(((self._me, "playsRole", self._group.path(name)),), told=False))
            self._drop({name})
            self._claim(name, Claim(now, BEGUN), claims)
            self._bid_anew = True
        said += self._sayings(now, unfinished, claims)
        return Move(tuple(said), holding=bool(unfinished))

    # Consensus

    def _listen(self, situation: Situation, claims: Claims) -> None:
        """Take in claims, who is silent and what is done; each may be a reason to bid anew."""
        members = situation.work.members
        silent = self._silence.out_of_reach(members, situation)
        heeded = [name for name in members if name not in silent]
        if heeded != claims.members:
            claims.members, self._bid_anew = heeded, True
        for heard in situation.heard:
            self._hear(heard.issuer, {attribute: (subject, value) for subject, attribute, value in heard.facts}, claims)
        if situation.work.done != self._known_done:
            self._known_done, self._bid_anew = situation.work.done, True

    def _left(self, situation: Situation, claims: Claims) -> tuple[list[Statement], list[RoleSpecification]]:
        """Roles that another vehicle has begun too are left; the statements, and the roles that stay."""
        said: list[Statement] = []
        held = situation.work.held_by(self._me)
        for role in held:
            if claims.winner(role.name) != self._me:
                said.append(Statement(((self._me, "leftRole", self._group.path(role.name)),), told=False))
                self._claim(role.name, Claim(situation.round, 0), claims)
        return said, [role for role in held if claims.winner(role.name) == self._me]

    def _hear(self, issuer: str, facts: dict[str, tuple[str, str | float | bool]], claims: Claims) -> None:
        """A claim of the issuer, or one that it relays."""
        if "bid" not in facts or "bidRound" not in facts:
            return
        group, _, role = facts["bid"][0].partition(".")
        vehicle = str(facts["winner"][1]) if "winner" in facts else issuer
        if group != self._group.name:
            return
        if vehicle == self._me:
            own = claims.of(role, vehicle)
            if own is not None and int(facts["bidRound"][1]) < own.at:
                self._unsaid.add(role)  # others have not heard that this is no longer so
            return
        if claims.take(role, vehicle, Claim(int(facts["bidRound"][1]), int(facts["bid"][1]))):
            self._unsaid.add(role)
            self._bid_anew = True

    def _give_way(self, now: int, claims: Claims) -> None:
        """Drop the first job of the bundle that is lost, and all that were added after it."""
        lost = next((n for n, name in enumerate(self._bundle) if claims.winner(name) != self._me), None)
        if lost is not None:
            for name in self._bundle[lost:]:
                self._claim(name, Claim(now, 0), claims)
            self._drop(set(self._bundle[lost:]))

    def _drop(self, names: set[str]) -> None:
        if names:
            self._bundle = [name for name in self._bundle if name not in names]
            self._path = [name for name in self._path if name not in names]
            self._bid_anew = True

    def _claim(self, role: str, claim: Claim, claims: Claims) -> None:
        if claims.take(role, self._me, claim):
            self._unsaid.add(role)

    # Bundle

    def _score(self, path: Sequence[str], outlook: Outlook, work: Work) -> float:
        data, total = work.database[self._me], 0.0
        for name in path:
            then = work.after(outlook, data, self._roles[name])
            if then is None:
                return 0.0
            outlook = then
            total += math.exp(-outlook.free_s / self._with.discount_s)
        return total

    def _build(self, held: Sequence[RoleSpecification], situation: Situation, claims: Claims) -> None:
        """Add open jobs to the bundle while one can be won, expecting to do first what is ``held``."""
        work, data = situation.work, situation.work.database[self._me]
        outlook = self._expectations.of(data, held, situation.now_s, work)
        if data not in work.workers:
            return
        while len(self._bundle) < self._with.bundle:
            base = self._score(self._path, outlook, work)
            best: tuple[int, str, list[str]] | None = None
            for name in [role.name for role in work.open if data.can_play(role.name)]:
                if name in self._bundle or BEGUN in (c.strength for c in claims.standing(name).values()):
                    continue
                paths = [[*self._path[:n], name, *self._path[n:]] for n in range(len(self._path) + 1)]
                score, path = max(((self._score(p, outlook, work), p) for p in paths), key=lambda found: found[0])
                bid = max(1, min(BEGUN - 1, round(BEGUN * (score - base))))
                if claims.beats(name, self._me, bid) and (best is None or bid > best[0]):
                    best = bid, name, path
            if best is None:
                return
            bid, name, self._path = best
            self._bundle.append(name)
            self._claim(name, Claim(situation.round, bid), claims)

    def _next(self, now: int, claims: Claims) -> str | None:
        """The job to begin now: the first of the path, once its claim has stood."""
        for name in self._path[:1]:
            claim = claims.of(name, self._me)
            if claim is not None and now - claim.at >= self._with.settle_rounds:
                return name
        return None

    # Saying

    def _sayings(self, now: int, unfinished: Sequence[str], claims: Claims) -> list[Statement]:
        """Own claims and known winners, where there is something new; from time to time all that stand."""
        all_due = now % self._with.repeat_rounds == 0
        new, self._unsaid = self._unsaid, set()
        said = []
        for name in unfinished:
            if not (all_due or name in new):
                continue
            subject = self._group.path(name)
            own, winner = claims.of(name, self._me), claims.winner(name)
            if own is not None and (own.strength > 0 or name in new):
                said.append(Statement(((subject, "bid", own.strength), (subject, "bidRound", own.at))))
            if winner is not None and winner != self._me:
                claim = claims.standing(name)[winner]
                facts = (subject, "winner", winner), (subject, "bid", claim.strength), (subject, "bidRound", claim.at)
                said.append(Statement(facts))
        return said


@dataclass(frozen=True, slots=True)
class Cbba:
    """Bids and bundles; see the module's text."""

    bundle: Annotated[int, Field(ge=1, le=64, description="most jobs that a vehicle plans ahead")] = 3
    settle_rounds: Annotated[
        int, Field(ge=0, le=1000, description="TDMA frames that a claim must have stood before its job is begun")
    ] = 2
    repeat_rounds: Annotated[
        int, Field(ge=1, le=1000, description="TDMA frames after which all claims are said again")
    ] = 5
    silence_rounds: Annotated[int, SILENCE] = 300
    discount_s: Annotated[
        float, Field(gt=0.0, le=1e6, description="a job finished this much later is worth 1/e of the other")
    ] = 3600.0

    name: ClassVar[str] = "cbba"
    declaration: ClassVar[Declaration] = Declaration(
        source="Choi, Brunet, How 2009; Johnson, Ponda, Choi, How 2010",
        messages={
            "bid": "how strongly the sender, or the winner it names, claims a job; not acknowledged",
            "bidRound": "when that was claimed",
            "winner": "whose claim the sender relays",
            JOB_DONE: "the sender has done a job",
        },
        blocks_per_round=2,
    )
    form = staticmethod(founded)
    adapt = staticmethod(common_roles)

    def negotiator(self, me: str, group: Group) -> Bidder:
        """A bidder for each member."""
        return Bidder(me, group, self)


STRATEGY = Cbba()
