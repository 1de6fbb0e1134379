"""Matching jobs and vehicles one to one."""

import os
import subprocess
import sys
from itertools import permutations

from hypothesis import given
from hypothesis import strategies as st

from remoras.strategies.matching import assignment

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
