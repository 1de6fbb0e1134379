import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.study.selection import select

ITEMS = st.lists(
    st.tuples(st.integers(0, 20), st.integers(0, 9), st.integers(1, 90), st.booleans()), min_size=1, max_size=30
)


def chosen_of(
    weights: list[int], priorities: list[int], sizes: list[int], eligible: list[int], capacity: int
) -> list[int]:
    chosen = [-1] * len(weights)
    return chosen[: select(weights, priorities, sizes, eligible, capacity, chosen)]


def test_the_heaviest_that_fit_are_chosen_in_order() -> None:
    weights = [5, 1, 9, 7]
    assert chosen_of(weights, [0, 0, 0, 0], [60, 60, 60, 60], [1, 1, 1, 1], 179) == [2, 3]


def test_weight_grows_by_priority_before_the_choice_and_restarts_for_the_chosen() -> None:
    weights = [4, 0]
    assert chosen_of(weights, [1, 6], [60, 60], [1, 1], 60) == [1]
    assert weights == [5, 0]


def test_one_too_large_is_passed_over_and_smaller_ones_still_fit() -> None:
    assert chosen_of([9, 8, 7], [0, 0, 0], [100, 300, 50], [1, 1, 1], 160) == [0, 2]


def test_of_equal_weights_the_lower_position_comes_first() -> None:
    assert chosen_of([3, 3, 3], [1, 1, 1], [60, 60, 60], [1, 1, 1], 120) == [0, 1]


def test_what_is_not_eligible_neither_grows_nor_goes() -> None:
    weights = [0, 0]
    assert chosen_of(weights, [5, 1], [60, 60], [0, 1], 600) == [1]
    assert weights == [0, 0]


def test_every_item_gets_its_turn() -> None:
    """A queue of equal items with room for one: the longest waiting goes next, round and round."""
    weights = [0] * 5
    turns = [chosen_of(weights, [1] * 5, [60] * 5, [1] * 5, 60)[0] for _ in range(10)]
    assert turns == [0, 1, 2, 3, 4] * 2


@given(ITEMS, st.integers(0, 400))
def test_the_choice_is_the_greedy_one(items: list[tuple[int, int, int, bool]], capacity: int) -> None:
    """Sorted by decreasing weight, then position; taken while they fit; larger ones passed over."""
    weights, priorities, sizes = ([item[part] for item in items] for part in range(3))
    eligible = [int(item[3]) for item in items]
    expected, left = [], capacity
    for position in sorted(range(len(items)), key=lambda p: (-(weights[p] + priorities[p]), p)):
        if eligible[position] and sizes[position] <= left:
            expected.append(position)
            left -= sizes[position]
    grown = [w + p if e else w for w, p, e in zip(weights, priorities, eligible, strict=True)]
    after = list(weights)
    assert chosen_of(after, priorities, sizes, list(eligible), capacity) == expected
    assert after == [0 if position in expected else weight for position, weight in enumerate(grown)]


@pytest.mark.parametrize("kind", [np.int64, np.float64])
def test_arrays_serve_as_well_as_lists(kind: type) -> None:
    weights = np.array([1, 5, 3], kind)
    chosen = np.zeros(3, np.int64)
    n_chosen = select(weights, np.ones(3, kind), np.full(3, 60), np.ones(3, np.int64), 130, chosen)
    assert chosen[:n_chosen].tolist() == [1, 2]
    assert weights.tolist() == [2, 0, 0]
