"""Classification of contacts by received evidence, on the group leader's vehicle.

Mine echoes lie above a level halfway between mine and rock, rock echoes equally far below, with independent normal
errors. Each level x therefore adds 2 m (x - reference)/sigma^2 to the log likelihood ratio (Wald, Sequential Analysis,
1947). Here m is the distance of the mean from the halfway level. The analyst never knows the truth.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from exchange.arithmetic import log
from missions.minehunting.imagery import (
    FLOOR_ECHOES,
    REFERENCE,
    REVISITS,
    SHOWN,
    TARGET_ECHOES,
    ContactView,
    ImageryTable,
)
from remoras.behaviours import Behaviour, Perception, Reference
from remoras.beliefs import Known
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.sensor import Observation

CLASSIFIED = "classifiedAs"
MINE, ROCK = "mine", "rock"


@dataclass(frozen=True)
class Analysis:
    """Decision rule: ``confidence`` is the probability of a correct decision.

    ``patience_s`` is the wait for missing strips after the last view and the last update.
    """

    imagery: ImageryTable
    confidence: float
    patience_s: float

    @property
    def decisive(self) -> float:
        """Log likelihood ratio for a decision, with equal priors.

        >>> round(Analysis(ImageryTable(), 0.99, 600.0).decisive, 2)
        4.6
        """
        return log(self.confidence / (1.0 - self.confidence))


@dataclass(frozen=True)
class Evidence:
    """Evidence about a contact: log likelihood ratio mine/rock, strips across and beside it."""

    log_ratio: float
    n_target: int
    n_floor: int


def evidence_of(contact: str, facts: Known, imagery: ImageryTable) -> Evidence:
    """Evidence of all snippets with a known reference level."""
    echoes = (TARGET_ECHOES, imagery.target_db), (FLOOR_ECHOES, imagery.floor_db)
    terms: list[float] = []
    n_strips = [0, 0]
    for snippet in facts.values((SHOWN, contact)):
        high_db, low_db = facts.get((REFERENCE, snippet), (0.0, 0.0))
        for kind, (names, mean_db) in enumerate(echoes):
            pairs = [facts.values((name, snippet)) for name in names]
            n_strips[kind] += max(map(len, pairs))
            weight = 2.0 * mean_db / (imagery.sigma_db * imagery.sigma_db)
            terms += [weight * (high - high_db + low - low_db) for of_name in pairs for high, low in of_name]
    return Evidence(math.fsum(terms), *n_strips)


class Analysing(Behaviour):
    """Background classification of contacts; requests another view of undecided ones.

    The request follows once all strips across the contact have come without a decision. Without views left to request,
    all strips together decide for the likelier class. ``firsts`` has one view per contact.
    """

    def __init__(self, analysis: Analysis, firsts: Sequence[ContactView], revisits: Sequence[ContactView]) -> None:
        self._analysis = analysis
        self._firsts, self._revisits = firsts, revisits
        self._news_s: dict[str, tuple[tuple[int, ...], float]] = {}

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Return conclusions; never pending."""
        facts, now_s = picture.facts, picture.body.now_s
        free = [one for one in self._revisits if facts.get((REVISITS, one.name)) is None]
        found: list[Observation] = []
        for first in self._firsts:
            if facts.get((CLASSIFIED, first.contact)) is not None:
                continue
            verdict = self._verdict(first, facts, now_s, bool(free))
            if verdict == REVISITS:
                found.append(Observation(((free.pop(0).name, REVISITS, first.contact),)))
            elif verdict:
                found.append(Observation(((first.contact, CLASSIFIED, verdict),)))
        return Perception(0.0, concludes=tuple(found))

    def _verdict(self, first: ContactView, facts: Known, now_s: float, may_ask: bool) -> str:
        """Class of the contact; ``REVISITS`` for another view; empty to wait."""
        imagery = self._analysis.imagery
        known = evidence_of(first.contact, facts, imagery)
        likely = MINE if known.log_ratio > 0.0 else ROCK
        if abs(known.log_ratio) >= self._analysis.decisive:
            return likely
        views = [first, *(one for one in self._revisits if facts.get((REVISITS, one.name)) == first.contact)]
        n_done = sum(facts.get(one.done) is not None for one in views)
        news = known.n_target, known.n_floor, n_done
        before, since_s = self._news_s.get(first.contact, ((), now_s))
        if news != before:
            self._news_s[first.contact] = news, now_s
            since_s = now_s
        is_over = n_done == len(views) and now_s - since_s >= self._analysis.patience_s
        n_target = len(views) * imagery.target_strips
        if may_ask and (known.n_target >= n_target or is_over):
            return REVISITS
        has_all = known.n_target + known.n_floor >= len(views) * imagery.strips
        return likely if has_all or (is_over and known.n_target > 0) else ""

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Return None."""
        return None
