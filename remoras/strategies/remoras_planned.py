"""REMORAS with missions planned before the dive.

As ``remoras`` in all else: so the difference between the two is what planning at sea, and telling each other of it,
costs. Source: as of ``remoras``; planning before is ours.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from remoras.strategies.factors import CommonPlan
from remoras.strategies.remoras import Remoras


@dataclass(frozen=True, slots=True)
class RemorasPlanned(Remoras):
    """The same organisation, agreed before; see the module's text."""

    common_plan: CommonPlan = "jobs"

    name: ClassVar[str] = "remoras-planned"


STRATEGY = RemorasPlanned()
