"""Blocks larger than a packet: fragmented, carried in any order, complete again or absent."""

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.manager_fleet import BATTERY, MAPPED_CELL, POSITION, bay, cells, codec_of
from exchange.errors import ConfigurationError
from exchange.manager.beliefs import Beliefs
from exchange.packets import MAX_FRAGMENTS, Fragment, fragments_of, name_of_item
from exchange.policy.policies import ACK
from worldmodel import EPOCHS, Block, PropertyValue

N_NODES = 4
CODEC = codec_of(N_NODES)
HEAD_BITS = CODEC.fragment_bits(Fragment(0, 0, 0.0, (), 0, 2))
"""A relayed part of a larger block, without facts: at most 3 + 2 + 2 + 20 + 1 + 4 + 4 + 16 = 52 bits."""

facts = st.one_of(
    st.integers(0, 4095).map(lambda cell: PropertyValue(bay(N_NODES), MAPPED_CELL, float(cell))),
    st.integers(0, 100).map(lambda percent: PropertyValue(0, BATTERY, percent / 100)),
    st.tuples(st.integers(-99, 99), st.integers(-99, 99)).map(lambda at: PropertyValue(1, POSITION, at)),
)
blocks = st.builds(
    Block,
    st.integers(0, N_NODES - 1),
    st.integers(0, 9999),
    st.integers(0, 9999).map(float),
    st.lists(facts, min_size=1, max_size=MAX_FRAGMENTS).map(tuple),
    st.integers(0, EPOCHS - 1),
)
capacities = st.integers(HEAD_BITS + 60, 800)
"""A position, the largest fact here, has 3 + 5 + 2 * 16 + 1 = 41 bits; any block here goes in with a fact to a part."""


def block_of_cells(n: int) -> Block:
    """A block that says of so many cells that they are mapped."""
    return Block(0, 0, 1.0, cells(N_NODES, n))


@settings(max_examples=200)
@given(blocks, capacities)
def test_fragments_are_ordered_within_capacity_and_minimal_in_number(block: Block, capacity_bits: int):
    parts = fragments_of(block, capacity_bits, CODEC.fragment_bits)
    assert sum((part.facts for part in parts), ()) == block.facts
    assert [(part.index, part.count) for part in parts] == [(index, len(parts)) for index in range(len(parts))]
    assert all(CODEC.fragment_bits(part) <= capacity_bits for part in parts)
    assert len({part.uid for part in parts}) == len(parts)
    whole = Fragment(block.origin, block.sequence, block.time_s, block.facts, 0, 1, block.epoch)
    assert (len(parts) == 1) == (CODEC.fragment_bits(whole) <= capacity_bits)
    for one, following in itertools.pairwise(parts):  # not even its first fact would have gone in before
        fuller = Fragment(one.origin, one.sequence, one.time_s, (*one.facts, following.facts[0]), 0, 2, one.epoch)
        assert CODEC.fragment_bits(fuller) > capacity_bits


@settings(max_examples=200)
@given(blocks, capacities, st.data())
def test_a_block_is_complete_with_its_last_fragment_in_any_order(block: Block, capacity_bits: int, data: st.DataObject):
    parts = fragments_of(block, capacity_bits, CODEC.fragment_bits)
    beliefs = Beliefs(0, N_NODES, ACK, lambda summary: (0, 0))
    for n_known, part in enumerate(data.draw(st.permutations(parts))):
        assert not beliefs.is_whole(block.guid)
        assert beliefs.half_blocks() == [block.guid] * (n_known > 0)
        beliefs.add(name_of_item(part))
    assert beliefs.block(block.guid) == block
    assert beliefs.half_blocks() == []


def test_a_fact_larger_than_a_packet_is_refused_with_both_sizes():
    """A cell takes 3 (of 8 instances) + 6 (of 49 attributes) + 12 + 1 = 22 bits, behind a head of 52."""
    with pytest.raises(ConfigurationError, match="one fact needs 74 bits, a packet has room for 73"):
        fragments_of(block_of_cells(2), 73, CODEC.fragment_bits)


def test_a_block_of_too_many_parts_is_refused_with_their_number():
    """One cell of 22 bits to a part of 52 + 22: 16 cells just go, 17 do not."""
    capacity_bits = HEAD_BITS + 22
    assert len(fragments_of(block_of_cells(MAX_FRAGMENTS), capacity_bits, CODEC.fragment_bits)) == 16
    with pytest.raises(ConfigurationError, match="a block of 17 facts needs 17 fragments, 16 are allowed"):
        fragments_of(block_of_cells(17), capacity_bits, CODEC.fragment_bits)
