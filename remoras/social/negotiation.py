"""Division of jobs during the mission, for any strategy: received and stated messages."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING

from remoras.authority import Rules
from remoras.beliefs import Beliefs, Fact
from remoras.organisation import Group, Organisation
from remoras.organisation.leadership import LEFT_ROLE, ROLE_ATTRIBUTES
from remoras.picture import Peers
from remoras.strategy import (
    JOB_DONE,
    Heard,
    Move,
    Negotiator,
    Situation,
    Statement,
    Strategy,
    Waits,
    ask,
    division_of,
    negotiator_of,
)
from remoras.work import Job, Outlook, Point, Work
from worldmodel import Block, Change, TBox

if TYPE_CHECKING:
    from remoras.organisation.leadership import Age

LEG = 1.5
"""Longest expected absence of a worker, as a factor on its share of all work."""


def negotiated_attributes(strategy: Strategy, jobs: Mapping[str, Job], tbox: TBox) -> tuple[str, ...]:
    """Return the ontology attributes of a strategy's messages; jobs' own replace ``JOB_DONE``."""
    known = {attribute.name for attribute in tbox.attributes}
    job_done = [job.done[0] for job in jobs.values()]
    declared = [name for key in strategy.declaration.messages for name in (job_done if key == JOB_DONE else [key])]
    return tuple(dict.fromkeys([*ROLE_ATTRIBUTES, *(name for name in declared if name in known)]))


class Negotiation:
    """Negotiators of one vehicle, by group with jobs; ``attributes`` are uids of messages."""

    def __init__(
        self,
        me: str,
        strategy: Strategy,
        organisation: Organisation,
        beliefs: Beliefs,
        rally_points_m: Mapping[str, Point],
        rules: Rules,
    ) -> None:
        self._me = me
        self._apart = rules.apart
        self._strategy = strategy.name
        self._beliefs = beliefs
        tbox = beliefs.model.tbox
        self.attributes = frozenset(
            tbox.attribute_named(name).uid for name in negotiated_attributes(strategy, rules.jobs, tbox)
        )
        plain = (*ROLE_ATTRIBUTES, *(job.done[0] for job in rules.jobs.values()))
        self._of_all = frozenset(tbox.attribute_named(name).uid for name in plain)  # excluded vehicles may too
        self._negotiators: dict[str, Negotiator] = {}
        self._rally_m: dict[str, Point | None] = {}
        self._rallies_m, self._at_sea, self._of = rally_points_m, rules.at_sea, strategy
        self._groups = {**organisation.groups, **rules.at_sea}
        for group in organisation.groups.values():
            if organisation.is_member(me, group.name):
                self._add(group)
        self._heard: list[Block] = []
        self._added: list[Heard] = []
        self._unlawful: Collection[Age] = ()
        self._round = 0
        self.until_news: dict[str, Move] = {}
        """By group, moves that stay valid until new information arrives."""
        self.holding = frozenset(self._negotiators)
        """Groups with work left to assign, which are therefore not gathered."""
        for group in rules.at_sea.values():
            self._add(group)
        self.silent = False
        """True while a negotiator forbids transmission."""
        self.helping: list[tuple[str, str, str]] = []
        """(group, vehicle, role) of jobs to help with."""
        self._longest_away_s = 0.0
        self._expected: frozenset[str] = frozenset()  # peers whose silence is expected now
        self._expected_s: dict[str, float] = {}

    def _add(self, group: Group) -> None:
        if any(role.job is not None for role in group.roles) and self._me not in self._apart:
            negotiator = negotiator_of(self._of, self._me, group)
            if negotiator is not None:
                self._negotiators[group.name] = negotiator
                self._rally_m[group.name] = self._rallies_m.get(group.rally_point or "")

    def begin(self, group: str) -> None:
        """Restart a group without knowledge of the earlier division of jobs."""
        self.until_news.pop(group, None)
        if self._negotiators.pop(group, None) is not None or group in self._at_sea:
            self._add(self._groups[group])

    @property
    def takes_part(self) -> bool:
        """True if this vehicle has a negotiator for any of its groups."""
        return bool(self._negotiators)

    def heard_or_expected_s(
        self, heard_s: Mapping[str, float], names: Collection[str], now_s: float
    ) -> Mapping[str, float]:
        """Return the later of last reception and last expected silence of each vehicle (s)."""
        expected: Collection[str] = self._expected
        if not self._negotiators:
            # Without a negotiator it does not know the plan: it expects any silence up to the longest distant work.
            expected = [name for name in names if now_s - heard_s.get(name, 0.0) < self._longest_away_s]
        self._expected_s.update(dict.fromkeys(expected, now_s))
        return {name: max(heard_s.get(name, 0.0), self._expected_s.get(name, 0.0)) for name in names}

    def expect_away(self, all_work: Iterable[Work]) -> None:
        """Set the longest expected silence of workers, for vehicles that take no part in the work."""
        for work in all_work:
            for data in work.workers:
                alone = work.after_all(Outlook(0.0, data.start_m), data, work.unfinished)
                self._longest_away_s = max(self._longest_away_s, LEG * alone.free_s / len(work.workers))

    def hold(self, groups: Collection[str]) -> None:
        """Mark newly led groups as not gathered until their work has been examined."""
        self.holding |= self._negotiators.keys() & set(groups)

    def note(self, change: Change) -> None:
        """Queue a peer's statement until the end of the round."""
        block = change.block
        attribute = block.facts[0].attribute
        if self._negotiators and attribute in self.attributes:
            issuer = self._beliefs.name(block.origin)
            if issuer != self._me and (attribute in self._of_all or issuer not in self._apart):
                self._heard.append(block)

    def note_added(self, now_s: float, left: Iterable[Fact]) -> None:
        """Queue the roles that this vehicle declared released, as strategy input of the next round."""
        name = self._beliefs.name
        facts = tuple(
            (name(vehicle), LEFT_ROLE, name(role))
            for vehicle, attribute, role, *_ in left
            if attribute in self.attributes
        )
        if facts:
            self._added.append(Heard(self._me, self._beliefs.model.quantise_time(now_s), facts))

    def disregard(self, unlawful: Collection[Age]) -> None:
        """Exclude unauthorised facts, given by their places in the order, from this round."""
        self._unlawful = unlawful

    def _take_heard(self) -> tuple[Heard, ...]:
        blocks, self._heard = self._heard, []
        unlawful, self._unlawful = self._unlawful, ()
        statements, self._added = self._added, []
        for block in blocks:
            facts = tuple(
                self._beliefs.by_name(fact)
                for position, fact in enumerate(block.facts)
                if (*block.key, position) not in unlawful
            )
            if facts:
                statements.append(Heard(self._beliefs.name(block.origin), block.time_s, facts))
        return tuple(statements)

    def division(self, group: str) -> Mapping[str, str]:
        """Return the planned owners of roles without a holder, as far as the negotiator knows them."""
        negotiator = self._negotiators.get(group)
        return {} if negotiator is None else division_of(self._strategy, negotiator)

    def negotiate(
        self,
        now_s: float,
        work: Mapping[str, Work],
        peers: Peers,
        unheard: Mapping[str, Collection[str]],
        waits: Waits,
        missions: Collection[str],
        is_news: bool = True,
    ) -> list[Statement]:
        """Return this vehicle's statements at the end of a round; PluginError for a wrong answer.

        ``now_s`` is as quantised in messages; ``unheard`` and ``waits`` are as in ``remoras.strategy.Situation``.
        Groups without known ``missions`` have nothing to divide yet. ``is_news``: roles or missions have changed.
        """
        self._round += 1
        received, known_s = self._take_heard(), peers.known_s
        statements: list[Statement] = []
        holding = list[str]()
        self.silent, expected, self.helping = False, set[str](), []
        if is_news or received or unheard:
            self.until_news.clear()
        for group, negotiator in self._negotiators.items():
            if (move := self.until_news.get(group)) is not None:
                self._heed(group, move, holding, expected)
                continue
            if group not in work or self._me not in work[group].members:
                continue  # the group does not exist now, or the vehicle has resigned
            if group not in missions:
                holding.append(group)
                continue
            known = received, known_s, unheard, waits, peers.links
            situation = Situation(now_s, self._round, work[group], self._rally_m[group], *known)
            move = ask(self._strategy, negotiator, situation)
            statements += move.statements
            self._heed(group, move, holding, expected)
            if move.until_news:
                self.until_news[group] = move
        self.holding, self._expected = frozenset(holding), frozenset(expected)
        return statements

    def _heed(self, group: str, move: Move, holding: list[str], expected: set[str]) -> None:
        self.silent = self.silent or move.silent
        self.helping += [(group, *helped) for helped in move.helping]
        expected.update(move.expected)
        if move.holding:
            holding.append(group)
