"""CBBA as published: each vehicle bids for its own gain, job by job, and plans for nobody else.

As ``cbba`` in all else: so the difference between the two is what a plan for all is worth to bidders.

Source: Choi, Brunet, How 2009; see ``cbba``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from remoras.strategies.cbba import Cbba, PlansForAll


@dataclass(frozen=True, slots=True)
class CbbaPlain(Cbba):
    """Greedy bundles; see the module's text."""

    plans_for_all: PlansForAll = False

    name: ClassVar[str] = "cbba-plain"


STRATEGY = CbbaPlain()
