"""One-to-one matching of jobs and vehicles."""

from itertools import permutations

from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from remoras.strategies.allocation import assignment, least

costs = st.integers(0, 12) | st.none()


@st.composite
def cost_matrices(draw: st.DrawFn) -> list[list[int | None]]:
    n_columns = draw(st.integers(1, 4))
    return draw(st.lists(st.lists(costs, min_size=n_columns, max_size=n_columns), min_size=1, max_size=4))


def quality(matrix: list[list[int | None]], pairs: dict[int, int]) -> tuple[int, int, int]:
    """Less is better: rows left without, the dearest pair, the sum."""
    paid = [matrix[r][c] for r, c in pairs.items()]
    assert None not in paid
    return len(matrix) - len(pairs), max(paid, default=0), sum(paid)  # type: ignore[type-var, arg-type]


def all_assignments(matrix: list[list[int | None]]) -> list[dict[int, int]]:
    n_rows, n_columns = len(matrix), len(matrix[0])
    columns = [*range(n_columns), *[None] * n_rows]  # None: the row gets nothing
    return [
        {r: c for r, c in enumerate(chosen) if c is not None}
        for chosen in set(permutations(columns, n_rows))
        if all(c is None or matrix[r][c] is not None for r, c in enumerate(chosen))
    ]


@given(cost_matrices())
def test_matching_minimises_unmatched_then_maximum_then_sum(matrix: list[list[int | None]]) -> None:
    pairs = assignment(matrix)
    assert len(set(pairs.values())) == len(pairs)
    assert list(pairs) == sorted(pairs)
    assert quality(matrix, pairs) == min(quality(matrix, other) for other in all_assignments(matrix))


@given(st.data(), st.integers(1, 7), st.integers(1, 7))
def test_matching_equals_scipy_including_ties(data: st.DataObject, n_rows: int, n_columns: int) -> None:
    row = st.lists(st.integers(0, data.draw(st.sampled_from((1, 3, 1000)))), min_size=n_columns, max_size=n_columns)
    costs = data.draw(st.lists(row, min_size=n_rows, max_size=n_rows))
    rows, columns = linear_sum_assignment(costs)
    assert list(least(costs).items()) == list(zip(rows.tolist(), columns.tolist(), strict=True))
