"""While the goal is not reached, to come to the meeting settles no call for help.

A vehicle that is called weighs what answering can change. A mission whose goal is not reached is not complete, however
early its groups meet: the head waits for who has work to do, or all meet in vain. So as long as a vehicle does not know
that enough is mapped and every find is inspected, the behaviours of the meeting answer no call. Otherwise vehicles that
wait would call others off work that nobody else does.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from functools import partial

from missions.mapping.jobs import SurveyJob
from missions.meeting.meeting import Meeting
from remoras.behaviours import IDLE, Behaviour, Perception, Reference, awaited
from remoras.beliefs import Beliefs
from remoras.htn import FactsLike
from remoras.known import Known
from remoras.mission import Finding
from remoras.motion import Motion
from remoras.organisation import Group, Organisation
from remoras.picture import Picture

EXPLORING = "objectiveExploring"
"""The fact that gives a role an area."""
MOST_ANEW = 3
"""So often an area is given anew; what is reported in spite of that is believed."""


def is_to_be_inspected(facts: FactsLike, find: str) -> bool:
    """True while a find is known and not known to be inspected."""
    return facts.get(("foundAt", find)) is not None and facts.get(("inspectedBy", find)) is None


def given_anew(
    group: Group,
    organisation: Organisation,
    surveys: Mapping[str, SurveyJob],
    meeting: Meeting,
    beliefs: Beliefs,
    picture: Picture,
) -> list[Finding]:
    """Orders for areas of a group that are held or said to be done, and of which not all cells are known to be mapped.

    Whoever is done with an area knows all its cells, and tells them when it meets the others. So half the patience
    after a meeting that shows the job unfinished the report counts no longer, whoever has heard it; who holds an area
    and does not do it may know by a report that the head has not heard that it is done. After ``MOST_ANEW`` times a
    report is believed: it may be that some cells cannot be mapped, or be heard of.

    Args:
        group: whose head asks; organisation: without the absent.
        surveys: of all areas, by name.
        meeting: of all groups.
        beliefs: of the head; picture: what else it knows.
    """
    met_s = meeting.met_s(group, beliefs, picture)
    if met_s is None or picture.body.now_s - met_s < meeting.patience_s / 2.0:
        return []
    found = []
    for role in group.roles:
        job, path = surveys.get(role.job or ""), group.path(role.name)
        given_s = beliefs.observed_s((EXPLORING, path))
        if job is None or (given_s or 0.0) > met_s:
            continue
        if not beliefs.values(job.done) and not organisation.members(group.name, role.name):
            continue
        if job.left(beliefs).bits and beliefs.n_over(job.done) < MOST_ANEW:
            found.append(Finding(path, EXPLORING, job.name))
    return found


def is_open_again(group: Group, surveys: Mapping[str, SurveyJob], beliefs: Beliefs) -> bool:
    """True while an area of a group that was given anew is not known to be done; arguments as of ``given_anew``."""
    jobs = (surveys[role.job] for role in group.roles if role.job is not None and role.job in surveys)
    again = (job for job in jobs if beliefs.n_over(job.done))
    return any(not beliefs.values(job.done) and job.left(beliefs).bits for job in again)


def is_alone_with_work(
    group: Group, organisation: Organisation, surveys: Mapping[str, SurveyJob], beliefs: Beliefs
) -> bool:
    """True while a head has nobody left in its group, and areas of it are not known to be done.

    Losses may bring a silence of a lease about: whom it takes for absent may be at work, and would stop if it met.
    """
    if set(organisation.members(group.name)).difference(organisation.heads(group.name)):
        return False
    jobs = (surveys[role.job] for role in group.roles if role.job is not None and role.job in surveys)
    return any(not beliefs.values(job.done) and job.left(beliefs).bits for job in jobs)


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
            self._n_told, self._holds = facts.n_told, self.is_work_left(facts)
        return self._holds

    def answers(self, group: str, picture: Picture) -> float:
        """How much of a call to a group's meeting is settled by coming to it: nothing before the goal is reached."""
        return 0.0 if self.holds(picture.facts) else awaited(group, picture)

    def settled(self, found: Perception, facts: Known) -> float:
        """How much of a call the behaviour of the meeting settles that has perceived this: nothing before then."""
        return 0.0 if self.holds(facts) else found.settled

    def is_work_left(self, facts: Known) -> bool:
        """The same of any vehicle's knowledge; nothing is remembered of it."""
        if any(facts.values(("foundAt", find)) and not facts.values(("inspectedBy", find)) for find in self._finds):
            return True
        n_left = 0
        for job in self._surveys:
            n_left += 0 if facts.values(job.done) else job.left(facts).bits.bit_count()
            if n_left > self._n_spared:
                break
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
        self._found = self._perceived = IDLE  # when it was due last, and what was made of that

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """As the behaviour itself, but for the calls that it answers where it is due."""
        found = self._meeting.perceive(motion, picture, performed)
        if found.stimulus <= 0.0:
            return found
        if found != self._found:
            self._found, answers = found, partial(self._unfinished.settled, found, picture.facts)
            self._perceived = Perception(*found[:4], answers, *found[5:])
        return self._perceived

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """As the behaviour itself."""
        return self._meeting.reference(motion, picture)

    def accuracy_m(self, motion: Motion, picture: Picture) -> float:
        """As the behaviour itself."""
        return self._meeting.accuracy_m(motion, picture)
