"""Attacks on the exchange, one by one, and their effect on beliefs and knowledge of vehicles."""

import random
from collections.abc import Iterator
from typing import Any
from unittest.mock import patch

import pytest
from exchange_stress import DOUBLED, HEARD, LOST, Fate, Fleet, chances, creates, maps

from benchmarks.manager_fleet import PLAYS_ROLE, POSITION, ManagerFleet
from exchange.packets import Account, Fragment, HolderSet, OriginStatement
from exchange.policy.acknowledgement import members
from exchange.policy.policies import POLICIES
from worldmodel import PropertyValue
from worldmodel.facts import MOST_ITEMS

EVERY_POLICY = pytest.mark.parametrize("policy", sorted(POLICIES))


def busy(fleet: Fleet, frames: int, fates: Iterator[Fate]) -> None:
    """Every vehicle that lives maps a cell in each round."""
    for _ in range(frames):
        for life in fleet.all_alive():
            maps(fleet, life, len(life.parts) + 1000 * life.is_twin)
        fleet.run_frames(1, fates)
        fleet.check()


BEFALL: dict[str, list[tuple[float, Fate]]] = {
    "lost and doubled": [(0.4, LOST), (0.2, DOUBLED)],
    "16 slots late": [(0.2, LOST), (0.3, (0.0, 16.0)), (0.1, (16.0,))],
}


@EVERY_POLICY
@pytest.mark.parametrize("name", BEFALL)
def test_channel_faults_cause_no_false_belief(policy: str, name: str):
    fleet = Fleet(4, policy, payload_bytes=32)
    busy(fleet, 12, chances(2, *BEFALL[name]))
    fleet.calm(30)
    fleet.check_agreement()
    fleet.check_rest()


# Two of one number --------------------------------------------------------------------------------


@EVERY_POLICY
def test_a_duplicate_node_id_is_detected(policy: str):
    """Each of the others hears now one of them and now the other. All report it, and then believe nothing false."""
    fleet = Fleet(4, policy)
    fleet.run_frames(2)
    fleet.add_twin(1)
    busy(fleet, 20, chances(9, (0.3, LOST)))
    assert all(life.has_noticed for life in fleet.all_alive())
    assert fleet.false_beliefs() == []


@pytest.mark.parametrize("policy", ["ack-repeat", "m-ack-repeat", "mps-ack-repeat"])
def test_acknowledgements_to_a_duplicate_id_are_dropped_once_it_is_detected(policy: str):
    """Of two that speak as 2, 1 hears the one repeat its cell, and 0 the other. 0 acknowledges; then 1 hears both."""
    fleet = Fleet(3, policy, payload_bytes=24, offsets_s=(0.2, 0.0, 0.0))
    for _ in range(4):
        creates(fleet, 2)  # it says these first
    fleet.add_twin(2)
    [cell] = maps(fleet, 1, 50)
    heard_by_twins, by_0, late_by_1, twin_by_1 = [LOST, HEARD], HEARD, (1.0,), [LOST, HEARD]
    fleet.run(3, [*heard_by_twins, by_0, late_by_1, *twin_by_1])
    assert not fleet.lives[0].manager.holds(cell)
    fleet.run(0.45)
    assert fleet.lives[1].manager.believes(0, cell)  # as it had to, until it hears what comes late
    fleet.run(0.55)
    assert fleet.lives[1].has_noticed
    assert fleet.false_beliefs() == []
    fleet.remove_twins()
    fleet.die(2)  # else it would repeat the cell itself
    fleet.run_frames(40)
    assert fleet.lives[0].manager.holds(cell)


# Lives --------------------------------------------------------------------------------------------

SOME = ("mps-ack-repeat", "adaptive")
LIVES: dict[str, tuple[int, int, dict[int, list[tuple[int, bool]]]]] = {
    # nodes, slots, and by slot the nodes that begin anew and whether they keep their memory
    "matrices of an earlier life": (
        4, 240, {at: [(node, at > 100)] for at, node in ((60, 1), (62, 3), (100, 1), (141, 2))}
    ),
    "told in a life unheard of": (2, 85, {0: [(0, False)], 59: [(0, False), (1, False)], 60: [(0, True)]}),
    "thirty lives, twelve of them unheard of": (
        4, 760, {20 * n + 7: [(1 if n % 3 else 2, bool(n % 2))] for n in range(1, 31)}
        | {200: [(3, bool(n % 2)) for n in range(4)], 420: [(3, bool(n % 3)) for n in range(8)]},
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    ("policy", "name"),
    [
        pytest.param(policy, name, marks=pytest.mark.slow if "thirty" in name else ())
        for policy in sorted(POLICIES)
        for name in LIVES
        if "thirty" not in name or policy in SOME
    ],
)
def test_no_belief_is_false_after_restarts(policy: str, name: str) -> None:
    n_nodes, n_slots, restarts = LIVES[name]
    fleet, draws = Fleet(n_nodes, policy), random.Random(5)
    for slot in range(n_slots):
        for node, keeps in restarts.get(slot, ()):
            fleet.restart(node, keeps)
        node = draws.randrange(n_nodes)
        if draws.random() < 0.3 and slot < 0.7 * n_slots:
            fleet.record(node, (node, POSITION, (1.0, 2.0)))
            maps(fleet, node, *range(5 * slot, 5 * slot + draws.choice((1, 1, 1, 9))))
        fleet.run(1, [LOST if draws.random() < 0.4 else HEARD for _ in range(n_nodes - 1)])
        fleet.check()
    fleet.calm(60)
    fleet.check_agreement(of_all=POLICIES[policy].repeat)
    fleet.check_rest()


# Numbers beyond all items -------------------------------------------------------------------------


def numbered(n: int) -> list[tuple[str, dict[str, Any]]]:
    """Packets of node 1 that name an item of this number, by policy."""
    item = Fragment(1, n, 1.0, (PropertyValue(1, PLAYS_ROLE, 6),))
    return [
        ("ack", {"fragments": [item]}),
        ("adaptive", {"account": Account((OriginStatement(2, 0, n, 0, 0, False),))}),
        ("adaptive", {"account": Account((), (HolderSet(2, 0, n, 2),))}),
    ]


@pytest.mark.parametrize("case", range(3))
@pytest.mark.parametrize("n", [MOST_ITEMS + 1, 1 << 45])
def test_an_item_number_out_of_range_is_refused_at_once(case: int, n: int):
    """A set of so many items would fill the memory; a vehicle cannot have recorded them."""
    policy, content = numbered(n)[case]
    fleet = ManagerFleet(5, policy)
    opens_s = fleet.schedule.start_s(1)
    data = fleet.codec.encode(1, 0, **{"fragments": [], "slot_start_s": opens_s, **content})
    reception = fleet.managers[0].receive(data, opens_s + 1.6)
    assert reception.fault is not None
    assert "allowed are" in str(reception.fault)


def test_a_report_of_many_unknown_items_is_processed_cheaply():
    """Beliefs are about known items alone."""
    fleet = ManagerFleet(5, "adaptive")
    opens_s = fleet.schedule.start_s(1)
    account = Account((OriginStatement(2, 0, 20_000, 0, 0, False),))
    data = fleet.codec.encode(1, 0, [], slot_start_s=opens_s, account=account)
    with patch("exchange.manager.beliefs.members", wraps=members) as numbers:
        assert fleet.managers[0].receive(data, opens_s + 1.6).fault is None
    assert sum(abs(call.args[0]).bit_count() for call in numbers.call_args_list) < 10
