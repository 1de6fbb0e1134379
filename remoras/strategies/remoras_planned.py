"""REMORAS with missions planned before the dive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from remoras.strategies.factors import CommonPlan
from remoras.strategies.remoras import Remoras


@dataclass(frozen=True, slots=True)
class RemorasPlanned(Remoras):
    """REMORAS with prior plan; see the module docstring."""

    common_plan: CommonPlan = "jobs"

    name: ClassVar[str] = "remoras-planned"


STRATEGY = RemorasPlanned()
