"""Auction of help: a vehicle that waits for others recruits them.

Holder of a job that makes no progress until others come, it announces that it seeks help. Members bid the share of its
wait that they would end (``Waits.ended``), less their satisfaction with their own work. After `BIDDING_ROUNDS` the best
bidders are awarded, as many as the job takes. A winner helps while the award is repeated or remembered; one that bids
no more is replaced. Vehicles that wait themselves bid only to callers of an earlier name, and not once help is on its
way to them, so two of them do not wait for each other.

Source: Sariel-Talay, Balch, Erdogan 2011 (DEMiR-CF: coalitions of robots recruited by single-item auctions, precedence,
replacement of silent members). Bids by satisfaction are ours, as in `docs/model/decision.md`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from remoras.organisation import Group
from remoras.strategy import Heard, Move, Negotiator, Situation, Statable, Statement, division_of
from remoras.work import vehicles_taken

BIDDING_ROUNDS = 3
"""TDMA frames from announcement to award, and the age up to which announcements and bids count."""
MEMORY_ROUNDS = 10
"""TDMA frames after which an award without repetition ends, and a winner without bid is replaced."""
HIGHEST_BID = 255
MESSAGES = frozenset({"seeksHelp", "helpBid", "isToHelp"})

Wait = tuple[str, str]
"""Vehicle that waits, and its role."""


class HelpAuction(Negotiator):
    """Auctioneer and bidder of one vehicle, beside its ``part`` in dividing the jobs."""

    def __init__(self, me: str, group: Group, part: Negotiator) -> None:
        self._me, self._group, self._part = me, group, part
        self._own: str | None = None  # role for whose job this vehicle seeks or has help
        self._is_waiting, self._ends = False, 0  # whether that job waits; round in which the own auction ends
        self._bids: dict[str, tuple[int, int]] = {}  # round and amount of the last bid of each vehicle
        self._winners: dict[str, int] = {}  # own awards, and the round since which the winner has not bid
        self._sought: dict[Wait, int] = {}  # round of the last announcement
        self._awards: dict[Wait, int] = {}  # round of the last award to this vehicle

    def negotiate(self, situation: Situation) -> Move:
        """Process messages, let the other part negotiate, announce, award, bid."""
        is_ours = [message.facts[0][1] in MESSAGES for message in situation.heard]
        for message, is_of_help in zip(situation.heard, is_ours, strict=True):
            for fact in message.facts if is_of_help else ():
                self._hear(message, fact, situation.round)
        theirs = tuple(message for message, is_of_help in zip(situation.heard, is_ours, strict=True) if not is_of_help)
        move = self._part.negotiate(replace(situation, heard=theirs))
        facts = [*self._sayings(situation), *self._bid(situation)]
        statements = (*move.statements, *(Statement((fact,)) for fact in facts))
        helping = tuple(self._recent(self._awards, MEMORY_ROUNDS, situation))
        return replace(move, statements=statements, helping=helping, until_news=False)

    def division(self) -> Mapping[str, str]:
        """Return the division of jobs by the other part."""
        return division_of("help auction", self._part)

    def _hear(self, message: Heard, fact: Statable, now: int) -> None:
        subject, attribute, value = fact
        group, _, role = (str(value) if attribute == "isToHelp" else subject).partition(".")
        if group != self._group.name:
            return
        wait = message.issuer, role
        if attribute == "seeksHelp":
            self._sought[wait] = now
        elif attribute == "isToHelp" and subject == self._me:
            self._awards[wait] = now
        elif attribute == "helpBid" and role == self._own:
            self._bids[message.issuer] = now, int(value)
            if message.issuer in self._winners:
                self._winners[message.issuer] = now

    def _recent(self, waits: Mapping[Wait, int], n_rounds: int, situation: Situation) -> list[Wait]:
        members = situation.work.members
        return [wait for wait, at in waits.items() if situation.round - at <= n_rounds and wait[0] in members]

    def _sayings(self, situation: Situation) -> Iterator[Statable]:
        """Announce while the own job waits, award until it is over."""
        work, now = situation.work, situation.round
        held = {role.name: role for role in work.held_by(self._me)}
        waiting = next(
            (role for group, role in situation.waits.own if group == self._group.name and role in held), None
        )
        self._is_waiting = waiting is not None
        if waiting is not None and waiting != self._own:
            self._own, self._ends, self._bids, self._winners = waiting, now + BIDDING_ROUNDS, {}, {}
        self._winners = {name: at for name, at in self._winners.items() if now - at <= MEMORY_ROUNDS}
        if self._own not in held or not (waiting or self._winners):
            self._own, self._winners = None, {}
            return
        path, n_helpers = self._group.path(self._own), max(1, vehicles_taken(work.job(held[self._own])) - 1)
        if waiting and now >= self._ends:
            nodes = {name: work.database[name].node for name in work.members}
            recent = {name: bid for name, (at, bid) in self._bids.items() if now - at <= BIDDING_ROUNDS}
            new = nodes.keys() & recent.keys() - self._winners.keys()
            ranked = sorted(new, key=lambda name: (-recent[name], nodes[name]))
            self._winners |= dict.fromkeys(ranked[: max(0, n_helpers - len(self._winners))], now)
        if waiting and len(self._winners) < n_helpers:
            yield path, "seeksHelp", True
        yield from ((name, "isToHelp", path) for name in self._winners)

    def _bid(self, situation: Situation) -> Iterator[Statable]:
        """Bid to the vehicle whose wait this one would shorten most; renew the bid while it helps."""
        waits = self._recent(self._awards, MEMORY_ROUNDS, situation)
        waits = waits or self._recent(self._sought, BIDDING_ROUNDS, situation)
        if self._winners:
            return
        if self._is_waiting:
            waits = [wait for wait in waits if wait[0] < self._me]
        bids = [(round(HIGHEST_BID * situation.waits.ended(*wait)), wait) for wait in sorted(waits)]
        bid, wait = max(bids, key=lambda option: option[0], default=(0, ("", "")))
        if bid:
            yield self._group.path(wait[1]), "helpBid", bid
