"""Count of reversed decisions of vehicles, for tests of whole runs."""

from collections import defaultdict
from collections.abc import Iterable
from itertools import groupby

BACK_S = 30.0


def undone(rows: Iterable[tuple[float, str, str, str, str, float]]) -> tuple[int, int]:
    """Number of reversed guidance changes, and of all changes; the first guidance is no change."""
    guidance: dict[str, dict[float, set[tuple[str, str]]]] = defaultdict(lambda: defaultdict(set))
    for time_s, vehicle, kind, name, role, _ in rows:
        guidance[vehicle][time_s] |= {(name, role)} if kind == "guidance" else set()
    n_undone = n_changes = 0
    for of in guidance.values():
        begun = [(next(alike)[0], what) for what, alike in groupby(of.items(), lambda one: one[1])]
        n_changes += len(begun) - 1
        for (_, first), (left_s, _), (back_s, third) in zip(begun, begun[1:], begun[2:], strict=False):
            n_undone += first == third and back_s - left_s <= BACK_S
    return n_undone, n_changes
