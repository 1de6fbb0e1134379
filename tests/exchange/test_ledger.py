"""Columns of the ledger: an item set is an integer, and a bit keeps its meaning for good."""

from hypothesis import given
from hypothesis import strategies as st

from benchmarks.manager_fleet import cells
from exchange.ledger import Ledger, LedgerEntry, columns_of
from exchange.packets import Fragment, ItemUid, Named, name_of_item


def item(origin: int, sequence: int, part: int = 0, count: int = 1) -> Named:
    return name_of_item(Fragment(origin, sequence, 0.0, cells(4, 1), part, count))


def test_a_block_is_whole_by_its_parts_in_whatever_order_they_came():
    ledger = Ledger(4)
    for part in (2, 0):
        ledger.add(item(1, 3, part, 3))
    assert ledger.parts((1, 0, 3)) == (0, 1)
    assert not ledger.is_whole((1, 0, 3))
    ledger.add(item(1, 3, 1, 3))
    ledger.add(item(1, 5))
    assert ledger.is_whole((1, 0, 3))
    assert ledger.is_whole((1, 0, 5))
    assert not ledger.is_whole((1, 0, 4))
    assert ledger.known((1, 0), 0, 9) == {3: (0, 1, 2), 5: (3,)}


def test_what_a_node_does_not_send_is_judged_by_what_it_says_itself_and_its_own_by_the_whole_block():
    ledger = Ledger(4)
    heard, own = item(1, 3), item(0, 0, 0, 2)
    whole = (*own.fragment.facts, *heard.fragment.facts)
    columns = ledger.add(heard), ledger.add(own, LedgerEntry(own.fragment, whole))
    assert [ledger.about(column) for column in columns] == [heard.fragment.facts, whole]
    assert not ledger.entries.keys() & {columns[0]}
    assert ledger.entry(columns[0]).about == heard.fragment.facts


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 200)), unique=True, max_size=150), st.integers(0))
def test_a_set_of_items_is_read_back_by_its_bits(guids: list[tuple[int, int]], some: int):
    """More than 64 items too: a set is one integer of any width."""
    ledger = Ledger(4)
    for origin, sequence in guids:
        ledger.add(item(origin, sequence))
    chosen = some & ((1 << len(guids)) - 1)
    assert [ledger.uids[column] for column in columns_of(chosen)] == [
        ItemUid(*guid, 0) for bit, guid in enumerate(guids) if chosen >> bit & 1
    ]
    assert sum(ledger.origins) == (1 << len(guids)) - 1  # every item has exactly one origin
    for node in range(4):
        assert all(uid.origin == node for uid in map(ledger.uids.__getitem__, columns_of(ledger.origins[node])))
