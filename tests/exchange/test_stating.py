"""Policies that report received sets, in the study: against the bound, the paper's six, and with parts removed."""

from typing import Any

import numpy as np
import pytest

from benchmarks.manager_fleet import ReferenceStudy
from exchange.policy import planning
from exchange.policy.policies import PAPER_POLICIES, STATING, AckPolicy
from exchange.study.parameters import ExchangeStudy, LoadKind, StudyLoad
from exchange.study.study import StudyRow, run


def rows_of(n_nodes: int, per: float, policies: tuple[str | AckPolicy, ...], **settings: Any) -> dict[str, StudyRow]:
    asked = ExchangeStudy(
        nodes=n_nodes, per=(per,), policies=policies, carrier_evidence=True, seed=11, max_slots=60_000, **settings
    )
    return {row.policy: row for row in run(asked)}


def means(row: StudyRow) -> tuple[float, float]:
    return row.delivered_slots.mean, row.source_acked_slots.mean


CELLS = [(4, 12, 0.6), (8, 6, 0.4), (16, 3, 0.8)]


@pytest.mark.parametrize(("n_nodes", "items", "per"), CELLS)
def test_coded_repairs_beat_paper_policies_and_plain_repairs(n_nodes: int, items: int, per: float) -> None:
    batch = StudyLoad(LoadKind.BATCH, items)
    fit = [name for name in PAPER_POLICIES if n_nodes < 16 or not name.startswith("m")]
    found = rows_of(n_nodes, per, (*fit, *STATING), trials=40, capacity_bits=256, load=batch)
    delivered, known = (min(means(found[name])[at] for name in fit) for at in (0, 1))
    adaptive = means(found["adaptive"])
    assert adaptive[0] < 0.85 * delivered
    assert adaptive[1] < 0.85 * known
    assert adaptive[0] < 0.85 * means(found["holdings-repeat"])[0]


@pytest.mark.parametrize(("name", "reaches"), [("adaptive", True), ("holdings-repeat", True), ("holdings", False)])
def test_along_a_line_items_travel_beyond_the_range_of_their_origin(name: str, reaches: bool) -> None:
    """Nodes hear only who is next to them: all come to hold all where who holds may tell, not where origins do."""
    dice, items = np.random.default_rng(11), 3
    line = ReferenceStudy(STATING[name], 4, items, evidence=True, item_bits=60, room=250, of_symbol=70)
    for slot in range(600):
        beside = [node for node in (slot % 4 - 1, slot % 4 + 1) if 0 <= node < 4 and dice.random() >= 0.3]
        line.pass_slot(slot, sum(1 << node for node in beside))
    held = [line.believes(node, node, column) for node in range(4) for column in range(4 * items)]
    assert all(held) == reaches


# Parts taken out ----------------------------------------------------------------------------------


def plan_of(n_nodes: int, lacks: list[list[float]], **settings: Any) -> planning.PacketPlan:
    """A plan of node 0 for its own items, by default of 60 bits, 70 in a symbol, told before."""
    n = len(lacks)
    flat = [lack for row in lacks for lack in row]
    plan = planning.PacketPlan(
        [0.0] + [0.5] * (n_nodes - 1), [0] * n, [60] * n, [70] * n, [0] * n, [1] * n, [1.0] * n, flat, [0] * n_nodes,
        [15] + [planning.IMPOSSIBLE] * (n_nodes - 1), [0.0] * n, [0] * n, [0] * n_nodes, [0] * n, [0] * n_nodes,
        [0.0] * n_nodes, [0.0] * n_nodes, [0] * n_nodes, [0] * n_nodes,
    )  # fmt: skip
    return plan._replace(**settings)


def test_coded_symbols_are_used_where_peers_lack_different_items() -> None:
    """Three peers lack one of three items each: one symbol serves all; if all lack the same one, the item goes."""
    different = plan_of(4, [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    assert planning.plan_packet(different, 4, 3, 95, True, False) == 1
    assert different.states[0] == 1
    assert sum(different.takes) == 0
    same = plan_of(4, [[0.0, 1.0, 1.0, 1.0], [0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]])
    assert planning.plan_packet(same, 4, 3, 95, True, False) == 0
    assert list(same.takes) == [1, 0, 0]
    assert planning.plan_packet(different, 4, 3, 95, False, False) == 0


def test_a_due_report_precedes_items_that_no_peer_lacks() -> None:
    owed = {"owed": [0, 4, 0], "statement_bits": [15, 20, planning.IMPOSSIBLE]}
    hardly = plan_of(3, [[0.0, 0.02, 0.02]], **owed)
    planning.plan_packet(hardly, 3, 1, 70, False, False)
    assert (list(hardly.states), list(hardly.takes)) == ([0, 1, 0], [0])
    nothing_owed = plan_of(3, [[0.0, 0.02, 0.02]])
    planning.plan_packet(nothing_owed, 3, 1, 70, False, False)
    assert (list(nothing_owed.states), list(nothing_owed.takes)) == ([0, 0, 0], [1])


def test_new_items_leave_capacity_for_a_report_only_if_much_is_due() -> None:
    new = {"is_new": [1, 1], "statement_bits": [15, 20, planning.IMPOSSIBLE]}
    little, much = (plan_of(3, [[0.0, 1.0, 1.0]] * 2, owed=[0, owed, 0], **new) for owed in (1, 9))
    for plan in (little, much):
        planning.plan_packet(plan, 3, 2, 125, False, False)
    assert (sum(little.takes), little.states[1]) == (2, 0)
    assert (sum(much.takes), much.states[1]) == (1, 1)


def test_a_large_item_precedes_a_due_report_in_every_second_packet() -> None:
    owed = {"owed": [0, 9, 0], "statement_bits": [15, 30, planning.IMPOSSIBLE]}
    first, other = (plan_of(3, [[0.0, 1.0, 1.0]], size_bits=[80], **owed) for _ in range(2))
    planning.plan_packet(first, 3, 1, 100, False, True)
    assert (list(first.states), list(first.takes)) == ([0, 0, 0], [1])
    planning.plan_packet(other, 3, 1, 100, False, False)
    assert (list(other.states), list(other.takes)) == ([0, 1, 0], [0])
    small = plan_of(3, [[0.0, 1.0, 1.0]], size_bits=[50], owed=[0, 30, 0], statement_bits=[15, 60, planning.IMPOSSIBLE])
    planning.plan_packet(small, 3, 1, 100, False, True)
    assert (list(small.states), list(small.takes)) == ([0, 1, 0], [0])


def test_items_that_all_lack_are_ordered_by_weight_and_age() -> None:
    """A new item of little weight waits for one of more that all have lost, a small one for a large one before it."""
    lost = plan_of(3, [[0.0, 1.0, 1.0]] * 2, weight=[0.1, 1.0], is_new=[1, 1])
    planning.plan_packet(lost, 3, 2, 100, False, False)
    assert list(lost.takes) == [0, 1]
    small = plan_of(3, [[0.0, 1.0, 1.0]] * 2, size_bits=[90, 30], is_new=[1, 1])
    planning.plan_packet(small, 3, 2, 100, False, False)
    assert list(small.takes) == [1, 0]


def test_no_more_coded_symbols_are_sent_than_are_useful() -> None:
    """With room for 7: a peer that lacks one of 8 items, half of whose packets arrive, takes 1 / 0.25 of them."""
    slightly = plan_of(2, [[0.0, 0.125]] * 8, size_bits=[90] * 8)
    assert planning.plan_packet(slightly, 2, 8, 600, True, False) == 4
    wholly = plan_of(2, [[0.0, 1.0]] * 24, size_bits=[90] * 24)
    assert planning.plan_packet(wholly, 2, 24, 600, True, False) == 7


def test_repairs_are_planned_by_the_mean_number_of_missing_items() -> None:
    """It lacks as many of node 0 as there are symbols, but in the mean: those of node 1 count where it lacks fewer."""
    origin = [0] * 6 + [1] * 6
    plan = plan_of(3, [[0.0, 0.0, 1.0]] * 12, origin=origin, size_bits=[90] * 12, statement_bits=[15, 16, 40])
    assert planning.plan_packet(plan, 3, 12, 472, True, False) == 6
    assert list(plan.states) == [1, 1, 0]


@pytest.mark.parametrize("room_bits", [0, 10, 59, 60, 100, 300, 1000])
def test_a_plan_fits_its_packet(room_bits: int) -> None:
    dice = np.random.default_rng(room_bits)
    for _ in range(30):
        lacks = [[0.0, *dice.random(3)] for _ in range(6)]
        plan = plan_of(
            4, lacks, origin=list(dice.integers(0, 4, 6)), is_new=list(dice.integers(0, 2, 6)),
            owed=[0, *dice.integers(0, 9, 3)], statement_bits=list(dice.integers(10, 30, 4)),
        )  # fmt: skip
        n_symbols = planning.plan_packet(plan, 4, 6, room_bits, True, bool(dice.integers(0, 2)))
        used = 60 * sum(plan.takes) + 70 * n_symbols + (planning.SIZE_BITS if n_symbols else 0)
        used += sum(bits for bits, states in zip(plan.statement_bits, plan.states, strict=True) if states)
        assert used <= room_bits
