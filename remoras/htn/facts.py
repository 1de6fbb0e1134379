"""Facts of a search: given ones, effects on the way, and a record of the keys read."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Iterable, Mapping
from enum import Enum
from typing import Any, Final, Protocol

Key = Hashable


class _Mark(Enum):
    ANY = "ANY"
    MISSING = "MISSING"

    def __repr__(self) -> str:
        return self.value


ANY: Final = _Mark.ANY
"""Effect value that matches any known value."""
MISSING: Final = _Mark.MISSING


class FactsLike(Protocol):
    """Any object with ``get(key, default)``."""

    def get(self, key: Any, default: Any = None, /) -> Any:
        """Return the value of a fact, or ``default`` if unknown."""
        ...


class _Words(dict[Any, int]):
    """64-bit hash word per requested fact, from its sequence number."""

    def __missing__(self, fact: Any) -> int:
        digest = hashlib.blake2b(len(self).to_bytes(8), digest_size=8).digest()
        word = self[fact] = int.from_bytes(digest)
        return word


class Facts:
    """State of the search, passed to methods and operators.

    Attributes:
        read: keys read from the given facts.
        compared: keys of changed facts, compared with the given ones by state hashing.
        trail: all changes: key, value before, value after.
    """

    def __init__(self, given: FactsLike) -> None:
        self.read: set[Any] = set()
        self.compared: set[Any] = set()
        self.trail: list[tuple[Key, Any, Any]] = []
        self._given = given
        self._values: dict[Any, Any] = {}
        self._words_at = [0]
        self._words = _Words()

    def get(self, key: Key, default: Any = None) -> Any:
        """Return the value of a fact; record the key as read unless set by an effect."""
        value = self._values.get(key, MISSING)
        if value is MISSING:
            value = self._values[key] = self._given.get(key)
            self.read.add(key)
        return default if value is None else value

    def make_true(self, effects: Mapping[Key, Any]) -> None:
        """Apply ``effects``."""
        values, note = self._values, self.trail.append
        for key, value in effects.items():
            note((key, values.get(key, MISSING), value))
            values[key] = value

    def undo(self, length: int) -> None:
        """Undo all changes of the trail after ``length``, last first."""
        values, trail = self._values, self.trail
        while len(trail) > length:
            key, before, _ = trail.pop()
            if before is MISSING:
                del values[key]
            else:
                values[key] = before
        del self._words_at[length + 1 :]

    def word(self, length: int) -> int:
        """Return a 64-bit state hash after ``length`` changes: XOR over the changed facts (Zobrist).

        Equal states have equal words; different states collide with probability 2^-64.
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
        except TypeError:  # an unhashable value equals no other
            return self._words[len(self._words)]


def is_met(facts: FactsLike, wanted: Iterable[tuple[Key, Any]]) -> bool:
    """True if all facts have the wanted values; False matches None and False, ANY any known value."""
    for key, value in wanted:
        known = facts.get(key)
        if (known is None) if value is ANY else known if value is False else known != value:
            return False
    return True
