"""The observations of one slot from one time to another, read where they stand."""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from typing import overload

from worldmodel.facts import Observation
from worldmodel.index import Entry, observation_of, observed_at_s


class History(Sequence[Observation]):
    """Observations of one slot, oldest first; equal to any sequence of the same observations.

    Args:
        entries: the facts of the slot, oldest first; nothing of them is copied.
        since_s: observed at this time or later (s); None from the first.
        until_s: observed at this time or before (s); None to the last.
    """

    __slots__ = ("_entries", "_positions")

    def __init__(self, entries: Sequence[Entry], since_s: float | None = None, until_s: float | None = None) -> None:
        first = 0 if since_s is None else bisect_left(entries, since_s, key=observed_at_s)
        end = len(entries) if until_s is None else bisect_right(entries, until_s, key=observed_at_s)
        self._entries = entries
        self._positions = range(first, max(first, end))

    def __len__(self) -> int:
        return len(self._positions)

    @overload
    def __getitem__(self, position: int) -> Observation: ...
    @overload
    def __getitem__(self, position: slice) -> tuple[Observation, ...]: ...
    def __getitem__(self, position: int | slice) -> Observation | tuple[Observation, ...]:
        if isinstance(position, slice):
            return tuple(observation_of(self._entries[index]) for index in self._positions[position])
        return observation_of(self._entries[self._positions[position]])

    def __iter__(self) -> Iterator[Observation]:
        return (observation_of(self._entries[index]) for index in self._positions)

    def __reversed__(self) -> Iterator[Observation]:
        return (observation_of(self._entries[index]) for index in reversed(self._positions))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and len(self) == len(other) and all(map(_same, self, other))

    def __hash__(self) -> int:
        return hash(tuple(self))

    def __repr__(self) -> str:
        return f"<History of {len(self)} observations>"


def _same(value: object, other: object) -> bool:
    return value == other
