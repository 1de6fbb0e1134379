"""Matching jobs and vehicles one to one."""

import os
import subprocess
import sys
from itertools import permutations

from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from remoras.strategies.matching import MANY, assignment, least

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
def test_as_many_as_possible_then_the_dearest_then_the_sum(matrix: list[list[int | None]]) -> None:
    pairs = assignment(matrix)
    assert len(set(pairs.values())) == len(pairs)
    assert list(pairs) == sorted(pairs)
    assert quality(matrix, pairs) == min(quality(matrix, other) for other in all_assignments(matrix))


@given(st.data(), st.integers(1, 7), st.integers(1, 7))
def test_it_is_what_scipy_finds_ties_and_all(data: st.DataObject, n_rows: int, n_columns: int) -> None:
    row = st.lists(st.integers(0, data.draw(st.sampled_from((1, 3, 1000)))), min_size=n_columns, max_size=n_columns)
    costs = data.draw(st.lists(row, min_size=n_rows, max_size=n_rows))
    rows, columns = linear_sum_assignment(costs)
    assert list(least(costs).items()) == list(zip(rows.tolist(), columns.tolist(), strict=True))


def test_where_there_are_many_pairs_scipy_is_asked() -> None:
    """30 rows of 30 columns, of which each has one that is cheap."""
    costs = [[0 if column == 29 - row else 5 for column in range(30)] for row in range(30)]
    assert MANY < 30 * 30 * 30
    assert assignment(costs) == {row: 29 - row for row in range(30)}


def test_a_small_assignment_loads_neither_scipy_nor_numpy() -> None:
    program = (
        "import sys\nfrom remoras.strategies.matching import assignment\n"
        "assert assignment([[5, 9], [9, 14]]) == {0: 1, 1: 0}\nassert not {'numpy', 'scipy'} & set(sys.modules)"
    )
    subprocess.run(
        [sys.executable, "-c", program], check=True, env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    )


def test_the_last_one_finishes_as_early_as_possible() -> None:
    """The least sum would be 0 + 9 = 9; with it the last one is finished at 9, otherwise at 6."""
    assert assignment([[0, 5], [6, 9]]) == {0: 1, 1: 0}


def test_of_equal_dearest_pairs_the_least_work_in_all() -> None:
    """The third row takes 9 in any case; of the other two 1 + 1 is less than 8 + 8."""
    assert assignment([[8, 1, None], [1, 8, None], [None, None, 9]]) == {0: 1, 1: 0, 2: 2}


def test_nobody_is_able() -> None:
    assert assignment([]) == {}
    assert assignment([[None, None]]) == {}


def test_ties_fall_the_same_way_in_every_process() -> None:
    """No order of a set and no hash decides: the same answer under different hash seeds."""
    program = (
        "from remoras.strategies.matching import assignment\n"
        "print([assignment([[1] * n] * m) for n in range(1, 5) for m in range(1, 5)])"
    )
    answers = {
        subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": os.pathsep.join(sys.path)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("0", "1", "2")
    }
    assert len(answers) == 1
