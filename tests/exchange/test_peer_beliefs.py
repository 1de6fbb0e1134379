"""The property of beliefs: no vehicle believes that a peer holds an item which it lacks, and all come to know all.

A schedule has new items, losses, old packets that come again, and restarts. Managers on a scripted sea and managers
behind drivers play the same schedules; each keeps a record of all holders. Behind a schedule comes a time without loss.
The rules alone, and the slot loop of the study, are held against the paper and against managers elsewhere.
"""

import random
from collections.abc import Callable, Mapping
from typing import NamedTuple

import pytest
from exchange_lives import Sea
from hypothesis import example, given, settings
from hypothesis import strategies as st

from benchmarks.manager_fleet import MAPPED_CELL, POSITION, bay, role
from exchange.drivers.memory import Ether
from exchange.packets import InfluenceSignal
from exchange.policies import POLICIES, AckPolicy

CALM_FRAMES = 60
"""Without loss behind a schedule, at most: an item is told, acknowledged and passed on in far less."""


class Schedule(NamedTuple):
    """Events of a fleet, slot by slot.

    Attributes:
        n_slots: while packets are lost.
        per: chance that a copy is lost; cut: links that carry nothing.
        again: chance that an old packet is heard once more.
        restarts: by slot, nodes that begin anew, and whether they keep their memory.
    """

    n_nodes: int
    seed: int
    n_slots: int
    per: float
    carrier_evidence: bool = True
    payload_bytes: int = 64
    cut: frozenset[tuple[int, int]] = frozenset()
    again: float = 0.0
    restarts: Mapping[int, list[tuple[int, bool]]] = {}


class Managers(Sea):
    """Exchange managers with world models, over a scripted link."""

    def __init__(self, policy: AckPolicy, schedule: Schedule) -> None:
        super().__init__(schedule.n_nodes, policy.name, schedule.payload_bytes, schedule.carrier_evidence)

    def tells(self, node: int, number: int) -> None:
        cells = range(number, number + (9 if number % 5 == 0 else 1))
        self.observe(node, (node, POSITION, (1.0, 2.0)))
        self.managers[node].offer_signals([InfluenceSignal(role(self.n_nodes), -7)])
        self.observe(node, *((bay(self.n_nodes), MAPPED_CELL, cell % 4096) for cell in cells))

    def hear_again(self, draws: random.Random) -> None:
        old = draws.choice(self.said).data
        self.deliver(draws.randrange(self.n_nodes), old, self.now_s - draws.random())

    def n_waiting(self) -> int:
        return self.n_open + len(set(self.digests())) - 1


class Radios(Managers):
    """The same managers, each behind a driver: they hear what it gives them when they next look."""

    def __init__(self, policy: AckPolicy, schedule: Schedule) -> None:
        super().__init__(policy, schedule)
        ether = Ether(lambda size_bits: 1.0)
        self.drivers = [ether.driver() for _ in range(self.n_nodes)]

    def pass_slot(self, lost: Callable[[int, int], bool] = lambda sender, receiver: False) -> None:
        sender = self.schedule.owner(self.slot)
        sent = self.managers[sender].packet_to_send(self.now_s)
        self.said.append(sent)
        self.drivers[sender].send(sent.data, self.now_s)
        for receiver, driver in enumerate(self.drivers):
            for packet in driver.receive(self.now_s + 1.0):
                if not lost(sender, receiver):
                    self.deliver(receiver, packet.data, packet.time_s)
        self.slot += 1


def play(driven: Managers, schedule: Schedule) -> None:
    draws = random.Random(schedule.seed)
    for slot in range(schedule.n_slots):
        for node, keeps in schedule.restarts.get(slot, ()):
            driven.restart(node, keeps)
        node = draws.randrange(schedule.n_nodes)
        if draws.random() < 0.3 and slot < 0.7 * schedule.n_slots:
            driven.tells(node, draws.randrange(4000))
        driven.pass_slot(lambda *link: link in schedule.cut or draws.random() < schedule.per)
        if draws.random() < schedule.again:
            driven.hear_again(draws)
        assert not driven.wrong(), f"slot {slot}"
    for frame in range(CALM_FRAMES):
        for _ in range(schedule.n_nodes):
            driven.pass_slot(lambda *link: False)
        assert not driven.wrong(), f"calm frame {frame}"
        if frame > 4 and not driven.n_waiting():
            break
    assert driven.n_waiting() == 0


@st.composite
def schedules(draw: st.DrawFn) -> Schedule:
    n_nodes = draw(st.integers(2, 5))
    n_slots = draw(st.integers(10, 100))
    nodes = st.integers(0, n_nodes - 1)
    restart = st.lists(st.tuples(nodes, st.booleans()), min_size=1, max_size=2)
    links = st.tuples(nodes, nodes)
    return Schedule(
        n_nodes,
        draw(st.integers(0, 2**32)),
        n_slots,
        draw(st.floats(0.0, 0.9)),
        draw(st.booleans()),
        draw(st.sampled_from([32, 64])),
        draw(st.frozensets(links, max_size=4)),
        draw(st.sampled_from([0.0, 0.3])),
        draw(st.dictionaries(st.integers(0, n_slots), restart, max_size=4)),
    )


MANY = {20 * n + 7: [(1 if n % 3 else 2, bool(n % 2))] for n in range(1, 31)}
UNHEARD = {200: [(3, bool(n % 2)) for n in range(4)], 420: [(3, bool(n % 3)) for n in range(8)]}
"""Four and eight lives of which nobody hears: the epoch modulo four is the same behind them."""
FOUND = [
    Schedule(4, 0, 240, 0.4, restarts={60: [(1, keeps)], 62: [(3, keeps)], 100: [(1, keeps)], 141: [(2, keeps)]})
    for keeps in (False, True)
]
"""Restarts under which matrices of an earlier life made false beliefs."""


AT_ONCE = Schedule(
    2, 1558836, 85, 0.0, False, 32, restarts={0: [(0, False)], 59: [(0, False), (1, False)], 60: [(0, True)]}
)
"""What was told in a life of which nobody had heard is settled once that life is heard of, and not before."""


@pytest.mark.parametrize("policy", POLICIES.values(), ids=POLICIES)
@pytest.mark.parametrize("drive", [Managers, Radios])
@settings(max_examples=8)
@given(schedule=schedules())
@example(FOUND[0])
@example(FOUND[1])
@example(AT_ONCE)
@example(Schedule(5, 3, 80, 0.5))
def test_no_belief_is_false_and_all_come_to_know_all(drive, policy, schedule):
    play(drive(policy, schedule), schedule)


@pytest.mark.parametrize("policy", [POLICIES[name] for name in ("ack", "mps-ack-repeat", "adaptive")])
def test_no_belief_is_false_after_thirty_restarts(policy: AckPolicy) -> None:
    managers = Managers(policy, Schedule(4, 5, 0, 0.0))
    play(managers, Schedule(4, 5, 760, 0.5, restarts=MANY | UNHEARD))
    assert [model.epoch for model in managers.models] == [0, 20, 10, 12]
