"""Encoding of received sets in packets, and handling of invalid ones."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.manager_fleet import N_BLOCKS, codec_of
from exchange.packets import Account, HolderSet, OriginStatement
from exchange.policy.planning import MOST_STATED, MOST_SYMBOL_BYTES, MOST_SYMBOLS, holder_set_bits, statement_bits
from exchange.wire.accounts import AccountCodec
from worldmodel.facts import MOST_ITEMS


def accounts_of(n_nodes: int) -> AccountCodec:
    return codec_of(n_nodes, "adaptive").accounts


@st.composite
def statements(draw: st.DrawFn, n_nodes: int, sender: int) -> OriginStatement:
    origin, length = draw(st.integers(0, n_nodes - 1)), draw(st.integers(0, MOST_STATED))
    mask = (1 << length) - 1 if origin == sender else draw(st.integers(0, (1 << length) - 1))
    first = draw(st.one_of(st.integers(0, 40), st.integers(0, MOST_ITEMS - MOST_STATED)))
    return OriginStatement(origin, draw(st.integers(0, 9)), first, length, mask, draw(st.booleans()))


@st.composite
def made_accounts(draw: st.DrawFn) -> tuple[int, int, Account]:
    n_nodes = draw(st.integers(2, 9))
    sender = draw(st.integers(0, n_nodes - 1))
    holder_sets = st.builds(
        lambda origin, epoch, sequence, holders: HolderSet(origin, epoch, sequence, holders | 1 << sender),
        st.integers(0, n_nodes - 1), st.integers(0, 9), st.integers(0, MOST_ITEMS - 1),
        st.integers(0, (1 << n_nodes) - 1),
    )  # fmt: skip
    size = draw(st.integers(1, MOST_SYMBOL_BYTES))
    symbols = st.lists(st.binary(min_size=size, max_size=size), max_size=MOST_SYMBOLS)
    of = st.lists(statements(n_nodes, sender), max_size=4), st.lists(holder_sets, max_size=4), symbols
    return n_nodes, sender, Account(*(tuple(draw(parts)) for parts in of))


@given(made_accounts())
def test_a_received_set_survives_encoding(made: tuple[int, int, Account]) -> None:
    n_nodes, sender, account = made
    codec = codec_of(n_nodes, "adaptive")
    data = codec.encode(sender, 0, account=account)
    assert codec.decode(data).packet.account == account
    overhead = len(codec.encode(sender, 0))
    assert len(data) - overhead <= -(-codec.accounts.encode(account, sender)[1] // 8)


@pytest.mark.parametrize("n_nodes", [2, 3, 5, 8, 16])
def test_encoded_sizes_equal_those_of_the_study(n_nodes: int) -> None:
    accounts, bits = accounts_of(n_nodes), (N_BLOCKS - 1).bit_length()
    assert accounts.statement(OriginStatement(1, 0, 7, 5, 0b1011, True), 0)[1] == statement_bits(n_nodes, bits, 5)
    assert accounts.statement(OriginStatement(0, 0, 7, 5, 0b11111, True), 0)[1] == statement_bits(n_nodes, bits, 0)
    assert accounts.holder_set(HolderSet(1, 0, 7, 3), 0)[1] == holder_set_bits(n_nodes, bits)
