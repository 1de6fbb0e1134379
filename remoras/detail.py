"""Level of detail by bandwidth: a vehicle whose queue is long records coarser values, which take fewer bits to tell.

The value is rounded where it is recorded, and nowhere else: all vehicles hold the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from worldmodel import Attribute, TBox
from worldmodel.abox import Stated
from worldmodel.coarse import coarsened


class Detail:
    """How finely a vehicle records.

    Args:
        tbox: whose attributes may declare a coarse grid.
        n_waiting: tells how many items wait to be said.
        above: with more of them than this, values are coarse.
    """

    def __init__(self, tbox: TBox, n_waiting: Callable[[], int], above: int) -> None:
        self._coarse = {one.uid: one for one in tbox.attributes if one.coarse}
        self._n_waiting = n_waiting
        self._above = above

    def of(self, facts: Sequence[Stated]) -> Sequence[Stated]:
        """Return the facts as they are to be recorded now; what cannot be recorded stays as it is."""
        if not any(fact[1] in self._coarse for fact in facts) or self._n_waiting() <= self._above:
            return facts
        return [_rounded(self._coarse[fact[1]], fact) if fact[1] in self._coarse else fact for fact in facts]


def _rounded(attribute: Attribute, fact: Stated) -> Stated:
    subject, uid, value, *uncertain = fact
    try:
        rounded, uncertainty = coarsened(attribute, value, uncertain[0] if uncertain else None)
    except (TypeError, ValueError):
        return fact  # the world model says what is wrong
    return (subject, uid, rounded) if uncertainty is None else (subject, uid, rounded, uncertainty)
