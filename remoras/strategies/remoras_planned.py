"""REMORAS with missions planned before the dive.

As ``remoras`` in all else: so the difference between the two is what planning at sea, and telling each other of it,
costs. Source: as of ``remoras``; planning before is ours.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from remoras.strategies.remoras import STRATEGY as AT_SEA
from remoras.strategies.remoras import Remoras
from remoras.strategy import Declaration


@dataclass(frozen=True, slots=True)
class RemorasPlanned(Remoras):
    """The same organisation, agreed before; see the module's text."""

    name: ClassVar[str] = "remoras-planned"
    declaration: ClassVar[Declaration] = replace(AT_SEA.declaration, planned_before=True)


STRATEGY = RemorasPlanned()
