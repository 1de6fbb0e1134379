"""While the goal is not reached, to come to the meeting settles no call for help.

A vehicle that is called weighs what answering can change. A mission whose goal is not reached is not complete, however
early its groups meet: the head waits for who has work to do, or all meet in vain. So as long as a vehicle does not know
that enough is mapped and every find is inspected, the behaviours of the meeting answer no call. Otherwise vehicles that
wait would call others off work that nobody else does.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable

from missions.mapping.jobs import SurveyJob
from remoras.behaviours import Behaviour, Perception, Reference
from remoras.htn import FactsLike
from remoras.known import Known
from remoras.motion import Motion
from remoras.picture import Picture


def is_to_be_inspected(facts: FactsLike, find: str) -> bool:
    """True while a find is known and not known to be inspected."""
    return facts.get(("foundAt", find)) is not None and facts.get(("inspectedBy", find)) is None


class Unfinished:
    """Whether a vehicle knows that the goal is reached.

    Args:
        surveys: of all areas.
        goal: share of their cells.
        finds: names of what may be found.
    """

    def __init__(self, surveys: Iterable[SurveyJob], goal: float, finds: Collection[str]) -> None:
        self._surveys = list(surveys)
        n_cells = sum(job.on.work.bit_count() for job in self._surveys)
        self._n_spared = n_cells - goal * n_cells
        self._finds = tuple(finds)
        self._n_told = -1
        self._holds = True

    def holds(self, facts: Known) -> bool:
        """True while more is left than the goal spares, as far as is known."""
        if self._n_told != facts.n_told:
            self._n_told, self._holds = facts.n_told, self._is_work_left(facts)
        return self._holds

    def _is_work_left(self, facts: Known) -> bool:
        if any(facts.values(("foundAt", find)) and not facts.values(("inspectedBy", find)) for find in self._finds):
            return True
        n_left, done = 0, []
        for job in self._surveys:
            if facts.values(job.done):
                done.append(job)
                continue
            n_left += job.left(facts).bits.bit_count()
            if n_left > self._n_spared:
                break
        for job in done:
            self._surveys.remove(job)
        return n_left > self._n_spared


class AfterWork(Behaviour):
    """A behaviour of the meeting, which answers no call while the goal is not reached.

    Args:
        meeting: the behaviour itself.
        unfinished: says so.
    """

    def __init__(self, meeting: Behaviour, unfinished: Unfinished) -> None:
        self._meeting = meeting
        self._unfinished = unfinished

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """As the behaviour itself, but for the calls that it answers where it is due."""
        found = self._meeting.perceive(motion, picture, performed)
        if found.stimulus > 0.0 and found.answers > 0.0 and self._unfinished.holds(picture.facts):
            return Perception(found.stimulus, found.advance, found.done, found.failed, 0.0)
        return found

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """As the behaviour itself."""
        return self._meeting.reference(motion, picture)
