"""Facts: those given, those made true on the way, and a note of what the search asked.

A fact is a key and a value; one whose value is None is not known, one whose value is None or False does not hold.
"""

from __future__ import annotations

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
"""As the value of an effect: whatever value."""
MISSING: Final = _Mark.MISSING
_WORD = (1 << 64) - 1


class FactsLike(Protocol):
    """Anything that answers ``get(key, default)``."""

    def get(self, key: Any, default: Any = None, /) -> Any:
        """The value of a fact, or ``default`` if it is not known."""
        ...


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
        read: keys of what was looked up of the facts given.
        compared: keys of facts that were made true on the way, where states were compared with what was given.
        trail: every change: key, value before, value after.
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
        """The value of a fact; a key that is not made true on the way is noted as read."""
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
        """Take back all changes in the trail behind ``length``, the last first."""
        values, trail = self._values, self.trail
        while len(trail) > length:
            key, before, _ = trail.pop()
            if before is MISSING:
                del values[key]
            else:
                values[key] = before
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


def is_met(facts: FactsLike, wanted: Iterable[tuple[Key, Any]]) -> bool:
    """True if every fact has the value that is wanted; False is wanted of what does not hold, ANY of what is known."""
    for key, value in wanted:
        found = facts.get(key)
        if (found is None) if value is ANY else found if value is False else found != value:
            return False
    return True
