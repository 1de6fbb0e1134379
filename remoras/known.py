"""What a vehicle knows, as behaviours and jobs look it up."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass
from typing import Any, Protocol

from remoras.beliefs import Key


class Known(Protocol):
    """What a vehicle knows, to be looked up by ``(attribute, instance)``; ``Beliefs`` is one."""

    def get(self, key: Key, default: Any = None, /) -> Any:
        """The latest value of a fact, or ``default`` if it is not known."""
        ...

    def values(self, key: Key) -> Set[Any]:
        """Every value of a fact that was ever told, but for what banned vehicles said."""
        ...

    def instances(self, of_class: str, /) -> tuple[str, ...]:
        """The names of all that is known to be of a class, told or concluded."""
        ...

    @property
    def n_told(self) -> int:
        """It grows whenever what ``values`` gives changes: what was worked out of these sets holds until then."""
        ...


@dataclass(frozen=True)
class _Nothing:
    def get(self, key: Key, default: Any = None, /) -> Any:
        return default

    def values(self, key: Key) -> Set[Any]:
        return frozenset()

    def instances(self, of_class: str, /) -> tuple[str, ...]:
        return ()

    @property
    def n_told(self) -> int:
        return 0


NOTHING_KNOWN: Known = _Nothing()
"""What is known before the mission."""
