"""Facts: those given, those made true on the way, and a note of what the search asked.

A fact is a key and a value; one whose value is None is not known, one whose value is None or False does not hold. A key
that is a tuple can be asked for by a pattern, a tuple with ``ANY`` in some places. Buckets of facts that agree in the
places which a pattern gives are made when they are first asked for, so an answer costs as much as it is long.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from enum import Enum
from functools import cache
from operator import itemgetter
from typing import Any, Final, Protocol

from remoras.errors import PlanningError

Key = Hashable
Pattern = tuple[Any, ...]


class _Mark(Enum):
    ANY = "ANY"
    MISSING = "MISSING"

    __hash__ = object.__hash__  # that of an enumeration is slow, and every pattern asks for it

    def __repr__(self) -> str:
        return self.value


ANY: Final = _Mark.ANY
"""In a pattern: whatever stands in this place."""
MISSING: Final = _Mark.MISSING
Shape = tuple[int, ...]
_WORD = (1 << 64) - 1
_Buckets = dict[Hashable, dict[tuple[Any, ...], None]]
"""Keys of facts by what stands in the places of a shape."""
_Answer = tuple[_Buckets, Hashable, tuple[tuple[Any, ...], ...]]
"""Of a pattern: the buckets, which of them, and what answers where there is none."""
_Sorted = tuple[int, Callable[[tuple[Any, ...]], Hashable], _Buckets, Shape]
"""Of a shape: the length of keys, what reads its places, and its buckets."""


class FactsLike(Protocol):
    """Anything that answers ``get(key, default)``."""

    def get(self, key: Any, default: Any = None, /) -> Any:
        """The value of a fact, or ``default`` if it is not known."""
        ...


def fits(pattern: Pattern, key: Key) -> bool:
    """True if ``key`` is a tuple that agrees with ``pattern`` wherever the pattern does not say ANY."""
    return (
        isinstance(key, tuple)
        and len(key) == len(pattern)
        and all(wanted is ANY or wanted == given for wanted, given in zip(pattern, key, strict=True))
    )


def _shape(pattern: Pattern) -> Shape:
    """The length of a pattern, and the places that it gives."""
    return (len(pattern), *[place for place, wanted in enumerate(pattern) if wanted is not ANY])


@cache
def _reader(shape: Shape) -> Callable[[tuple[Any, ...]], Hashable]:
    """The function that reads what stands in the places of ``shape``."""
    return itemgetter(*shape[1:]) if len(shape) > 1 else lambda key: None


class FactIndex(Mapping[Any, Any]):
    """Facts that can be asked for by pattern; made once, it serves any number of plans.

    >>> roads = FactIndex({("road", "A", "B"): True, ("road", "B", "C"): True, ("at", "AUV00"): "A"})
    >>> roads.match(("road", "A", ANY))
    (('road', 'A', 'B'),)
    """

    def __init__(self, given: Mapping[Any, Any]) -> None:
        self._given = dict(given)
        self._buckets: dict[Shape, dict[Hashable, tuple[tuple[Any, ...], ...]]] = {}

    def __getitem__(self, key: Any) -> Any:
        return self._given[key]

    def get(self, key: Any, default: Any = None, /) -> Any:
        """The value of a fact, or ``default`` if it was not given."""
        return self._given.get(key, default)

    def __iter__(self) -> Iterator[Any]:
        return iter(self._given)

    def __len__(self) -> int:
        return len(self._given)

    def match(self, pattern: Pattern) -> tuple[tuple[Any, ...], ...]:
        """Keys of the facts that hold and fit ``pattern``, in the order in which they were given."""
        shape = _shape(pattern)
        return self.bucket(shape, _reader(shape)(pattern))

    def bucket(self, shape: Shape, values: Hashable) -> tuple[tuple[Any, ...], ...]:
        """Keys of the facts that hold and have ``values`` in the places of ``shape``."""
        buckets = self._buckets.get(shape)
        if buckets is None:
            buckets = self._buckets[shape] = self._sorted(shape)
        return buckets.get(values, ())

    def _sorted(self, shape: Shape) -> dict[Hashable, tuple[tuple[Any, ...], ...]]:
        read = _reader(shape)
        found: dict[Hashable, list[tuple[Any, ...]]] = {}
        for key, value in self._given.items():
            if isinstance(key, tuple) and len(key) == shape[0] and value is not None and value is not False:
                found.setdefault(read(key), []).append(key)
        return {values: tuple(keys) for values, keys in found.items()}


class _Words(dict[Any, int]):
    """A word of 64 bits for every fact that is asked for, from its number (SplitMix64)."""

    def __missing__(self, fact: Any) -> int:
        mixed = (len(self) + 1) * 0x9E3779B97F4A7C15 & _WORD
        mixed = (mixed ^ (mixed >> 30)) * 0xBF58476D1CE4E5B9 & _WORD
        mixed = (mixed ^ (mixed >> 27)) * 0x94D049BB133111EB & _WORD
        word = self[fact] = mixed ^ (mixed >> 31)
        return word


class Facts:
    """Facts as the search sees them; methods and operators are handed this.

    Attributes:
        read, patterns: what was looked up of the facts given.
        compared: keys of facts that were made true on the way, where states were compared with what was given.
        trail: every change: key, value before, value after.
    """

    def __init__(self, given: FactsLike) -> None:
        self.read: set[Any] = set()
        self.patterns: set[Pattern] = set()
        self.compared: set[Any] = set()
        self.trail: list[tuple[Key, Any, Any]] = []
        self._given = given
        self._values: dict[Any, Any] = {}
        self._words_at = [0]
        self._words = _Words()
        self._index: FactIndex | None = None
        self._asked: dict[Pattern, _Answer] = {}
        self._buckets: dict[tuple[Shape, Any], _Buckets] = {}
        self._sorted: dict[Any, list[_Sorted]] = {}  # shapes of patterns, by what they begin with

    def get(self, key: Key, default: Any = None) -> Any:
        """The value of a fact; a key that is not made true on the way is noted as read."""
        value = self._values.get(key, MISSING)
        if value is MISSING:
            value = self._values[key] = self._given.get(key)
            self.read.add(key)
        return default if value is None else value

    def match(self, pattern: Pattern) -> tuple[tuple[Any, ...], ...]:
        """Keys of the facts that hold now and fit ``pattern``; the plan rests on this answer.

        Raises:
            PlanningError: the facts given can only be asked one by one.
        """
        asked = self._asked.get(pattern)
        if asked is None:
            asked = self._asked[pattern] = self._ask(pattern)
        buckets, values, given = asked
        bucket = buckets.get(values)
        return given if bucket is None else tuple(bucket)

    def _ask(self, pattern: Pattern) -> _Answer:
        """Where the facts that fit a pattern are found; where none was made true or false those given answer."""
        self.patterns.add(pattern)
        shape = _shape(pattern)
        first = pattern[0] if pattern else ANY
        values = _reader(shape)(pattern)
        given = self._indexed().bucket(shape, values)
        buckets = self._buckets.get((shape, first))
        if buckets is None:
            buckets = self._buckets[shape, first] = {}
            self._sorted.setdefault(first, []).append((shape[0], _reader(shape), buckets, shape))
            for key, value in self._values.items():
                if isinstance(key, tuple) and len(key) == shape[0] and (first is ANY or key[0] == first):
                    self._put(buckets, shape, key, value)
        return buckets, values, given

    def _indexed(self) -> FactIndex:
        if self._index is None:
            if not isinstance(self._given, Mapping):
                raise PlanningError(
                    f"facts of type {type(self._given).__name__} can be asked one by one, and not by pattern; "
                    "give a mapping, or a FactIndex that serves many plans"
                )
            self._index = self._given if isinstance(self._given, FactIndex) else FactIndex(self._given)
        return self._index

    def make_true(self, effects: Mapping[Key, Any]) -> None:
        """Apply ``effects``."""
        values, sorts, note = self._values, self._sorted, self.trail.append
        for key, value in effects.items():
            note((key, values.get(key, MISSING), value))
            values[key] = value
            if sorts and isinstance(key, tuple):
                self._sort_in(key, value)

    def undo(self, length: int) -> None:
        """Take back all changes in the trail behind ``length``, the last first."""
        values, trail = self._values, self.trail
        while len(trail) > length:
            key, before, _ = trail.pop()
            if before is MISSING:
                del values[key]
            else:
                values[key] = before
            if self._sorted and isinstance(key, tuple):
                value = self._given.get(key) if before is MISSING else before
                self._sort_in(key, value)
        del self._words_at[length + 1 :]

    def word(self, length: int) -> int:
        """A word for the state after ``length`` changes.

        It is the exclusive or of one word for each fact that differs from what was given. So equal states have equal
        words; different states have different ones but for a chance of 2^-64.
        """
        words = self._words_at
        if length >= len(words):
            word, word_of = words[-1], self._word
            for key, before, after in self.trail[len(words) - 1 : length]:
                if before is MISSING:
                    before = self._given.get(key)  # noqa: PLW2901
                    self.compared.add(key)
                if before != after:
                    word ^= word_of(key, before) ^ word_of(key, after)
                words.append(word)
        return words[length]

    def _word(self, key: Key, value: Any) -> int:
        if value is None:
            return 0
        try:
            return self._words[key, value]
        except TypeError:  # a value that cannot be compared by hash equals no other
            return self._words[len(self._words)]

    def _sort_in(self, key: tuple[Any, ...], value: Any) -> None:
        """Add a fact to its buckets, or take it out."""
        sorts = self._sorted
        for first in (key[0], ANY) if key and ANY in sorts else key[:1] or (ANY,):
            for length, read, buckets, shape in sorts.get(first, ()):
                if length == len(key):
                    bucket = buckets.get(read(key))
                    if bucket is None:
                        self._put(buckets, shape, key, value)
                    elif value is None or value is False:
                        bucket.pop(key, None)
                    else:
                        bucket[key] = None

    def _put(self, buckets: _Buckets, shape: Shape, key: tuple[Any, ...], value: Any) -> None:
        """Add a fact to its bucket, or take it out; a bucket begins with the facts given."""
        values = _reader(shape)(key)
        bucket = buckets.get(values)
        if bucket is None:
            bucket = buckets[values] = dict.fromkeys(self._indexed().bucket(shape, values))
        if value is None or value is False:
            bucket.pop(key, None)
        else:
            bucket[key] = None


def is_met(facts: FactsLike, wanted: Iterable[tuple[Key, Any]]) -> bool:
    """True if every fact has the value that is wanted; False is wanted of what does not hold, ANY of what is known."""
    for key, value in wanted:
        found = facts.get(key)
        if (found is None) if value is ANY else found if value is False else found != value:
            return False
    return True
