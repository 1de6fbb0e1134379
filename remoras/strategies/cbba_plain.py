"""CBBA as published: each vehicle bids for its own gain, job by job, without a plan for all."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from remoras.strategies.cbba import Cbba, PlansForAll


@dataclass(frozen=True, slots=True)
class CbbaPlain(Cbba):
    """CBBA with greedy bundles; see the module docstring."""

    plans_for_all: PlansForAll = False

    name: ClassVar[str] = "cbba-plain"


STRATEGY = CbbaPlain()
