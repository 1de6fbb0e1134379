"""Agreement on leaders: vehicles with differing peers, claims, forged claims and losses reach one view.

Four vehicles of the shipped mission are asked by hand, round by round, what they state; words reach each of them in a
round of their own. Whom each takes for absent is drawn, whatever it hears: nothing is assumed of how they come to that.
"""

from collections.abc import Callable
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.beliefs import Fact
from remoras.organisation import RoleAssignment
from worldmodel import Block, merge

SETUP = resolved(load("mapping-rendezvous"))
NAMES = SETUP.database.names
ROUND_S = 100.0
"""So long that a lease is three of them."""
QUIET, MOST_ROUNDS = 5, 40
"""Rounds in which nobody has anything to say, and rounds after the last disturbance by when these have to come."""


class Talk:
    """Vehicles at rest, and their statements."""

    def __init__(self) -> None:
        self._fleet = assemble(SETUP, seed=1)
        self._vehicles = {vehicle.name: vehicle for vehicle in self._fleet.vehicles}
        self._said: list[Block] = []
        self._heard: dict[str, set[int]] = {name: set() for name in NAMES}
        self._now_s = 0.0
        self.alive = list(NAMES)

    def say(self, name: str, facts: list[Fact]) -> None:
        """A vehicle states facts, later than all before."""
        self._now_s += 0.01
        change = self._vehicles[name].beliefs.model.record(facts, self._now_s)
        self._heard[name].add(len(self._said))
        self._said.append(change.block)
        self._vehicles[name].social.consider([change])

    def forge(self, name: str, group: str, term: int) -> None:
        """A vehicle claims leadership of a group without authority."""
        beliefs = self._vehicles[name].beliefs
        self.say(name, [beliefs.fact(group, "headedBy", name), beliefs.fact(group, "headTerm", term)])

    def round(self, absent: dict[str, set[str]], reaches: Callable[[], bool]) -> bool:
        """What reaches them counts, and they state what follows; True if that is anything."""
        n_said, self._now_s = len(self._said), self._now_s + ROUND_S
        left = set().union(*(self._heard[name] for name in self.alive))  # the dead repeat nothing
        for name in self.alive:
            social = self._vehicles[name].social
            for number in sorted(left - self._heard[name]):
                if reaches():
                    self._heard[name].add(number)
                    social.consider(merge(self._vehicles[name].beliefs.model, [self._said[number]]).changes)
            social._membership.absent, social._membership.looked_s = frozenset(absent[name]), self._now_s
            social.consult()
        for name in self.alive:
            for facts in self._vehicles[name].social.claims():
                self.say(name, facts)
            self._vehicles[name].social.consult()
        return len(self._said) > n_said

    def views(self) -> set[frozenset[RoleAssignment]]:
        """Views of the live vehicles."""
        return {frozenset(self._vehicles[name].social.organisation.assignments) for name in self.alive}

    def heads(self, group: str) -> set[str]:
        """Leader of a group in the views of live vehicles."""
        return {head for name in self.alive for head in self._vehicles[name].social.present.heads(group)}


TERMS = (1, 2, 3, 40, 64, 100, 255)


@pytest.mark.slow
@settings(max_examples=50, deadline=None)
@given(st.randoms(use_true_random=False), st.integers(3, 40), st.sampled_from((0.1, 0.2, 0.5, 0.9)))
def test_all_views_agree_on_one_leader_after_any_claims(draws: Random, n_rounds: int, p_reaches: float) -> None:
    """Once all hear each other, and the lost are missed: one organisation in all views, and a head for each group."""
    talk = Talk()
    absent: dict[str, set[str]] = {name: set() for name in NAMES}
    for _ in range(n_rounds):
        if draws.random() < 0.05 and len(talk.alive) > 2:
            talk.alive.remove(draws.choice(talk.alive))
        if draws.random() < 0.5:
            name = draws.choice(NAMES)
            absent[name] = set(draws.sample([peer for peer in NAMES if peer != name], draws.randrange(3)))
        if draws.random() < 0.25:
            talk.forge(draws.choice(talk.alive), draws.choice(("Operational", "Coordination")), draws.choice(TERMS))
        talk.round(absent, lambda: draws.random() < p_reaches)
    lost = {name: set(NAMES).difference(talk.alive) for name in NAMES}
    n_quiet, n_after = 0, 0
    while n_quiet < QUIET and n_after < MOST_ROUNDS:
        n_quiet, n_after = (0 if talk.round(lost, lambda: True) else n_quiet + 1), n_after + 1
    assert n_quiet == QUIET, "they go on claiming"
    assert len(talk.views()) == 1
    if any(name.startswith("AUV") for name in talk.alive):
        assert len(talk.heads("Operational")) == 1
