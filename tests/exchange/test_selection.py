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
