"""What there is left to do, as one vehicle knows it: the work of its groups, worked out anew where that has changed."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace

from remoras.authority import Rules
from remoras.beliefs import Beliefs, Fact, Key
from remoras.mission import SocialPart
from remoras.picture import Picture
from remoras.plugins import answer
from remoras.social.reports import Reports
from remoras.social.standing import Footing
from remoras.work import Job, Point, Work, WorksSeen, jobs_left, works
from worldmodel import Change


class Workload:
    """Jobs and work as one vehicle sees them.

    What is left of a job follows from facts about its own instance, so only these make it worked out anew.

    Args:
        me: own name.
        rules: who may do jobs, with the static data of all vehicles.
        mission: its jobs, and when enough of them is done.
        beliefs: of the vehicle.
        reports: what it knows of the energy and the sensors of all.
    """

    def __init__(self, me: str, rules: Rules, mission: SocialPart, beliefs: Beliefs, reports: Reports) -> None:
        self._me = me
        self._reports = reports
        self._apart = rules.apart
        self._mission = mission
        self._jobs = jobs = mission.jobs
        self._beliefs = beliefs
        self._about: dict[int, set[str]] = {}  # names of the jobs that facts about an instance are about
        for name, job in jobs.items():
            for instance in (name, job.done[1]):
                self._about.setdefault(beliefs.uid(instance), set()).add(name)
        self._stale = set(jobs)
        self._left: dict[str, Job] = {}
        self._done: frozenset[str] = frozenset()
        self._given_anew: frozenset[str] = frozenset()
        self._n_given_anew = 0  # when what is left was worked out last
        self._is_enough = False
        self._asked: tuple[object, ...] | None = None
        self._kept: dict[str, Work] = {}

    def note(self, changes: Iterable[Change]) -> bool:
        """Facts were recorded or merged: jobs that some of them are about, if any, have to be worked out anew."""
        about, is_about_jobs = self._about, False
        for change in changes:
            for fact in change.block.facts:
                if fact.subject in about:
                    self._stale |= about[fact.subject]
                    is_about_jobs = True
        return is_about_jobs

    def give_anew(self, ends: Collection[Key]) -> None:
        """The facts by which jobs end count no longer as they were told: these jobs were given anew."""
        again = {name for name, job in self._jobs.items() if job.done in ends}
        self._stale |= again
        self._given_anew |= again

    def told_by(self, vehicles: Collection[str]) -> list[Fact]:
        """That jobs are done, where these vehicles were the last to say so.

        They have fallen silent and cannot repeat it; who has heard it passes it on, or a head that has not would wait
        for whoever it believes to be at the job.
        """
        keys = (job.done for job in self._jobs.values())
        return [
            self._beliefs.fact(key[1], key[0], self._beliefs.get(key))
            for key in keys
            if self._beliefs.origin(key) in vehicles
        ]

    def of_groups(
        self, at: Footing, picture: Picture, positions_m: Mapping[str, Point] | None, from_s: float
    ) -> Mapping[str, Work]:
        """The work of every group, by its name.

        Args:
            at: the organisation that the vehicle acts on, and who takes no jobs.
            picture: for the time, and for positions where somebody is short of energy.
            positions_m: last positions known, by vehicle; None where it does not matter who is where: the work is then
                kept until it changes.
            from_s: time from which outlooks count.
        """
        asked = *at, self._reports.blind
        if self._stale:
            self._work_out()
        energy_j = self._reports.scarce_energy_j(picture.body.now_s) if self._reports.frugal else None
        if energy_j:
            return self._works(at, picture.peers.positions_m if positions_m is None else positions_m, energy_j, from_s)
        if self._asked != asked:
            self._kept = self._works(at, {}, {}, 0.0)
            self._asked = asked
        if positions_m is None:
            return self._kept
        return WorksSeen(self._kept, positions_m, from_s)

    def whole(self, at: Footing) -> dict[str, Work]:
        """The work of every group before anything is done and anybody has moved, by its name."""
        return works(at.present, self._reports.database, self._jobs, frozenset(), {}, self._apart)

    def _works(
        self, at: Footing, positions_m: Mapping[str, Point], energy_j: Mapping[str, float], from_s: float
    ) -> dict[str, Work]:
        no_jobs, database = at.takes_no_jobs | self._apart, self._reports.database
        by_group = works(
            at.present, database, self._left, self._done, positions_m, no_jobs, self._is_enough, energy_j, from_s,
            self._given_anew,
        )  # fmt: skip
        if at.barred:
            by_group = {name: replace(work, barred=at.barred) for name, work in by_group.items()}
        if at.is_cut_off and any(work.held_by(self._me) for work in by_group.values()):  # its own jobs come first
            return {name: replace(work, unavailable=work.unavailable | {self._me}) for name, work in by_group.items()}
        return by_group

    def _work_out(self) -> None:
        """Work out anew what is left of the jobs that facts were told about."""
        left, done = jobs_left({name: job for name, job in self._jobs.items() if name in self._stale}, self._beliefs)
        known = self._left | left
        before = self._left.keys(), self._done, self._is_enough, self._n_given_anew
        self._left = {name: known[name] for name in self._jobs if name in known}
        self._done = self._done.difference(self._stale) | done
        self._n_given_anew = len(self._given_anew)
        self._is_enough = answer(
            f"mission {type(self._mission).__name__}", "is_enough", "true or false",
            lambda is_enough: isinstance(is_enough, bool), lambda: self._mission.is_enough(self._beliefs),
        )  # fmt: skip
        self._stale = set()
        if before == (self._left.keys(), self._done, self._is_enough, self._n_given_anew):
            self._kept = {name: work.with_less(self._left) for name, work in self._kept.items()}
        else:
            self._asked = None  # what is kept rests on what was known before
