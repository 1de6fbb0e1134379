"""Items of one vehicle, and the nodes that it believes to hold them."""

import pytest

from benchmarks.manager_fleet import cells
from exchange.manager.beliefs import Beliefs, Sendable, item_set
from exchange.packets import Fragment, Named, name_of_item
from exchange.policy.policies import ACK


def item(origin: int, sequence: int, part: int = 0, count: int = 1, epoch: int = 0) -> Named:
    return name_of_item(Fragment(origin, sequence, 0.0, cells(4, 1), part, count, epoch))


def test_a_block_is_whole_by_its_parts_in_whatever_order_they_came():
    beliefs = Beliefs(0, 4, ACK)
    for part in (2, 0):
        beliefs.add(item(1, 3, part, 3))
    assert beliefs.parts((1, 0, 3)) == (0, 1)
    assert not beliefs.is_whole((1, 0, 3))
    beliefs.add(item(1, 3, 1, 3))
    beliefs.add(item(1, 5))
    assert beliefs.is_whole((1, 0, 3))
    assert beliefs.is_whole((1, 0, 5))
    assert not beliefs.is_whole((1, 0, 4))


def test_what_a_node_does_not_send_is_judged_by_what_it_says_itself_and_its_own_by_the_whole_block():
    beliefs = Beliefs(0, 4, ACK)
    heard, own = item(1, 3), item(0, 0, 0, 2)
    whole = (*own.fragment.facts, *heard.fragment.facts)
    columns = beliefs.add(heard), beliefs.add(own, Sendable(own.fragment, whole))
    assert [beliefs.about(column) for column in columns] == [heard.fragment.facts, whole]
    assert not beliefs.sendable.keys() & {columns[0]}


@pytest.mark.parametrize("n_nodes", [4, 256])
def test_of_a_node_in_another_life_only_what_it_told_in_that_is_believed(n_nodes: int):
    """A set of items is one integer of any width."""
    beliefs, last = Beliefs(0, n_nodes, ACK), n_nodes - 1
    old, others, new = beliefs.add(item(last, 0)), beliefs.add(item(1, 0)), beliefs.add(item(last, 0, epoch=1))
    beliefs.take(item_set((old, others, new)), last)
    assert beliefs.held[last] == item_set((old, others, new))
    beliefs.begin(last, 1)
    assert beliefs.held[last] == item_set([new])
    assert beliefs.held[0] == item_set((old, others, new))
