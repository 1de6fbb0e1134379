"""FMC_ATA: vehicles buy shares of jobs in a Fisher market, from asynchronous bids.

Every vehicle spends the same budget. The price of a job is the sum of its bids; a bidder is allotted its bid over the
price. A share x yields the utility (r x)^elasticity, r being the worth of the whole job to the vehicle. New bids are
proportional to utilities (proportional response), which converges to the envy-free equilibrium of the market; then
capacity applies (``allotted``). A vehicle orders its jobs by gain over time, r x / (travel + x work). It bids after a
message or the end of a job; new work or a new vehicle restarts its bidding.

Ours, for TDMA broadcasts and work that takes time: each vehicle computes all prices and shares from its own and
received bids; it finishes a begun job, and values others from its end.

Source: Rachmut, Nelke, Zivan 2023, IJCAI, 262-270 (by its abstract and its first author's program,
Simulation_For_Research, ``solver_fmc_distributed_asy``); Nelke, Okamoto, Zivan 2020, ACM TIST 11 (1) (FMC_TA, by its
abstract); Zhang 2011, Proportional response dynamics in the Fisher market, Theoretical Computer Science 412 (24).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from exchange.arithmetic import distance, exp, log
from remoras.organisation import Group, RoleSpecification
from remoras.strategies.negotiator import Helped, Member, frames, taking
from remoras.strategy import Declaration, Heard, Move, Situation, Statement
from remoras.work import Outlook, Work

MONEY = 255
"""Budget of each vehicle; bids are sent in whole parts of it."""
BIDS_PER_BLOCK = 13


def responses(worth: Mapping[str, float], shares: Mapping[str, float], elasticity: float) -> dict[str, float]:
    """Return one buyer's next bids as shares of its budget, by proportional response."""
    bought = {good: worth[good] * shares[good] for good in worth}
    gains = {good: exp(elasticity * log(gain)) if gain > 0.0 else 0.0 for good, gain in bought.items()}
    total = math.fsum(gains.values())
    return {good: gain / total for good, gain in gains.items()}


def in_whole_parts(bids: Mapping[str, float], money: int, most: int) -> dict[str, int]:
    """Round the ``most`` greatest bids to whole parts that sum to ``money``; omit zero parts."""
    left = dict(sorted(bids.items(), key=lambda bid: (-bid[1], bid[0]))[:most])
    total = math.fsum(left.values())
    exact = {good: money * bid / total for good, bid in left.items()}
    parts = {good: int(bid) for good, bid in exact.items()}
    # Largest remainders first, so that the parts sum to the budget.
    behind = sorted(exact, key=lambda good: (parts[good] - exact[good], good))
    for good in behind[: money - sum(parts.values())]:
        parts[good] += 1
    return {good: part for good, part in sorted(parts.items()) if part}


def allotted(bids: Mapping[str, float], room: int | None, least_share: float) -> dict[str, float]:
    """Return the shares of one good by buyer: bid over price, for at most ``room`` buyers.

    Shares below ``least_share`` are dropped, except for the greatest; of equal bids the first wins.
    """
    greatest = sorted(bids, key=lambda buyer: -bids[buyer])[:room]
    price = math.fsum(bids[buyer] for buyer in greatest)
    stay = [buyer for n, buyer in enumerate(greatest) if n == 0 or bids[buyer] >= least_share * price]
    paid = math.fsum(bids[buyer] for buyer in stay)
    return {buyer: bids[buyer] / paid for buyer in stay}


class Buyer(Member["FmcAta"]):
    """One vehicle in the market."""

    def __init__(self, me: str, group: Group, strategy: FmcAta) -> None:
        super().__init__(me, group, strategy)
        self._bids: dict[str, float] = {}  # own, parts of the money, by role
        self._told: tuple[str | None, dict[str, int]] = (None, {})  # own job and bids, as last sent
        self._heard: dict[str, dict[str, int]] = {}  # last bids of others
        self._news: dict[str, int] = {}  # of which round they are
        self._at: dict[str, str] = {}  # at which role another one is
        self._shares: dict[str, dict[str, float]] = {}  # by role and buyer
        self._traded: set[str] = set()  # roles and vehicles that have been in the market
        self._since = 0  # the round of the last one that came into it

    def negotiate(self, situation: Situation) -> Move:
        """Process bids, update own bids, begin the first job once the market has settled, report."""
        work, now = situation.work, situation.round
        is_heard = [self._hear(message) for message in situation.heard]
        self._keep_what_is_left(work)
        current, crowded = self._kept(work, self._at)
        worth = self._worth(current, crowded, situation)
        if came := {role.name for role in work.open}.union(data.name for data in work.workers) - self._traded:
            self._traded |= came
            self._since = now
        if came or not worth.keys() <= self._bids.keys():
            self._bids = responses(worth, dict.fromkeys(worth, 1.0), self._with.elasticity)
        elif any(is_heard) or len(worth) < len(self._bids):
            self._bids = responses(worth, self._bought(), self._with.elasticity)
        bids = in_whole_parts(self._bids, MONEY, BIDS_PER_BLOCK)
        self._shares = self._allotted(work)
        statements = [self._leaves(role.name) for role in crowded]
        place = None if current is None else current.name
        is_settled = now - self._since >= self._with.settle_rounds
        if current is None and is_settled and (first := self._first(worth, situation)) is not None:
            statements.append(self._takes(first))
            place = first
        if work.unfinished and ((place, bids) != self._told or now % self._with.repeat_rounds == 0):
            self._told = place, bids
            statements.append(self._message(now))
        return Move(tuple(statements), holding=bool(work.unfinished))

    def division(self) -> Mapping[str, str]:
        """Return the vehicle at each job, else the one with the greatest share."""
        greatest = {role: next(iter(shares)) for role, shares in self._shares.items() if shares}
        begun = {role: vehicle for vehicle, role in self._at.items()}
        return {**greatest, **begun} if self._told[0] is None else {**greatest, **begun, self._told[0]: self._me}

    # Messages

    def _hear(self, message: Heard) -> bool:
        values = {(subject, attribute): value for subject, attribute, value in message.facts}
        made = values.get((message.issuer, "claimsOf"))
        if made is None or int(made) <= self._news.get(message.issuer, -1):
            return False
        group, _, role = str(values.get((message.issuer, "worksOn"), "")).partition(".")
        bids = {subject.partition("."): int(bid) for (subject, name), bid in values.items() if name == "claim"}
        if {group, *(path[0] for path in bids)} - {"", self._group.name}:
            return False
        self._news[message.issuer] = int(made)
        self._heard[message.issuer] = {path[2]: bid for path, bid in bids.items()}
        self._at.pop(message.issuer, None)
        if role:
            self._at[message.issuer] = role
        return True

    def _message(self, now: int) -> Statement:
        current, bids = self._told
        place = () if current is None else ((self._me, "worksOn", self._group.path(current)),)
        offers = tuple((self._group.path(role), "claim", bid) for role, bid in bids.items())
        return Statement(((self._me, "claimsOf", now), *place, *offers))

    def _keep_what_is_left(self, work: Work) -> None:
        present, left = {data.name for data in work.workers}, {role.name for role in work.unfinished}
        self._heard = {
            vehicle: {role: bid for role, bid in bids.items() if role in left}
            for vehicle, bids in self._heard.items()
            if vehicle in present
        }
        self._at = {vehicle: role for vehicle, role in self._at.items() if vehicle in present and role in left}

    # Market

    def _worth(
        self, current: RoleSpecification | None, crowded: list[RoleSpecification], situation: Situation
    ) -> dict[str, float]:
        work, now_s = situation.work, situation.now_s
        data, here = work.database[self._me], Outlook(now_s, work.position_m(self._me))
        held = () if current is None else (current,)
        free = self._engagement(self._me, held, situation).end(data, work)
        worth = {}
        for role in work.open:
            full = role.maximum is not None and sum(role.name == place for place in self._at.values()) >= role.maximum
            outlook = here if role == current else free
            after = None if role in crowded or (full and role != current) else work.after(outlook, data, role)
            if after is None or not (role == current or work.affords(outlook, data, role)):
                continue
            way_s = distance(outlook.position_m, work.job(role).place_m) / data.transit_speed_mps
            arrival_s = 0.0 if role == current else outlook.free_s + way_s - now_s
            work_s = max(1.0, after.free_s - outlook.free_s - way_s)
            # The minimum keeps distant jobs in the market.
            worth[role.name] = work_s * max(1e-6, exp(-arrival_s / self._with.discount_s))
        return worth

    def _bought(self) -> dict[str, float]:
        shares = {}
        for role, bid in self._bids.items():
            others = math.fsum(bids.get(role, 0) for bids in self._heard.values()) / MONEY
            shares[role] = bid / (bid + others) if bid > 0.0 else 0.0
        return shares

    def _allotted(self, work: Work) -> dict[str, dict[str, float]]:
        bids = {**self._heard, self._me: self._told[1]}
        nodes = sorted(bids, key=lambda vehicle: work.database[vehicle].node)
        return {
            role.name: allotted(
                {vehicle: bids[vehicle][role.name] for vehicle in nodes if role.name in bids[vehicle]},
                role.maximum,
                self._with.least_share,
            )
            for role in work.open
        }

    # Schedule

    def _first(self, worth: Mapping[str, float], situation: Situation) -> str | None:
        work, me = situation.work, self._me
        data, here = work.database[me], Outlook(situation.now_s, work.position_m(me))
        best, most = None, 0.0
        for role in work.open:
            share = self._shares[role.name].get(me, 0.0)
            after = work.after(here, data, role) if share and role.name in worth else None
            if after is None:
                continue
            way_s = distance(here.position_m, work.job(role).place_m) / data.transit_speed_mps
            # Sharers of a job do not wait for each other; in the program another job may come first.
            takes_s = way_s + share * max(0.0, after.free_s - here.free_s - way_s)
            rate = worth[role.name] * share / max(1.0, takes_s)
            if rate > most:
                best, most = role.name, rate
        return best


@dataclass(frozen=True, slots=True)
class FmcAta(Helped):
    """Fisher market for jobs; see the module docstring."""

    discount_s: Annotated[
        float, Field(gt=0.0, le=1e6, description="delay of arrival that reduces the worth of a job to 1/e")
    ] = 300.0
    elasticity: Annotated[float, Field(gt=0.0, le=1.0, description="exponent of the gain over the share of a job")] = (
        0.9
    )
    # Far above the 0.001 of the program, since travel has a cost.
    least_share: Annotated[
        float, Field(ge=0.0, le=1.0, description="minimum share of a job worth travelling for, if others do the rest")
    ] = 0.25
    settle_rounds: Annotated[int, frames("for the market to settle before a job starts", 0)] = 2
    repeat_rounds: Annotated[int, frames("after which bids are repeated")] = 4

    name: ClassVar[str] = "fmc-ata"
    member = Buyer
    planned: ClassVar[Declaration] = taking(
        "Rachmut, Nelke, Zivan 2023 (FMC_ATA)",
        {
            "claimsOf": "of which round the bids that follow are; not acknowledged",
            "worksOn": "the job that the sender is at",
            "claim": "how much of its money the sender bids for a job, in parts of 255",
        },
    )


FMC_ATA = FmcAta()
