"""Remaining work of a vehicle's groups, as known by reports on jobs, batteries and sensors."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from typing import cast

from remoras.authority import Rules
from remoras.beliefs import Beliefs, Fact, Key
from remoras.database import AUVDatabase, VehicleData
from remoras.mission_parts import SocialPart
from remoras.organisation import RoleSpecification
from remoras.organisation.membership import Footing
from remoras.picture import Picture
from remoras.plugins import answer
from remoras.work import UNABLE_TO, Computed, HinderedJob, Job, Point, Work, hindrances, jobs_left
from worldmodel import Change, PropertyValue

BATTERY, SENSORS_WORK = "batteryFraction", "sensorsWork"
AMPLE = 1.1
"""Initial energy, as a multiple of transit until the mission's end, that counts as ample."""


def without_sensors(data: VehicleData) -> VehicleData:
    """Return the data of a vehicle whose sensors have failed."""
    return replace(data, sensors=())


def takes_sensors(rules: Rules, role: RoleSpecification | None, vehicle: str) -> bool:
    """Return whether a vehicle needs its sensors for the job of a role."""
    job = rules.jobs.get(role.job) if role is not None and role.job is not None else None
    return job is not None and not job.is_able(without_sensors(rules.database[vehicle]))


def scarce_energy_j(
    vehicles: Iterable[VehicleData], reports: Mapping[str, tuple[float, float]], now_s: float, until_s: float
) -> dict[str, float]:
    """Return the energy (J) left to vehicles that cannot afford transit until ``until_s``."""
    # ``reports`` have battery share, 0..1, and time; since then survey speed is assumed.
    scarce_j = {}
    for data in vehicles:
        share, reported_s = reports.get(data.name, (1.0, 0.0))
        left_j = share * data.energy_j - data.power_w(data.survey_speed_mps) * max(0.0, now_s - reported_s)
        if left_j < data.power_w(data.transit_speed_mps) * (until_s - now_s):
            scarce_j[data.name] = left_j
    return scarce_j


class Workload:
    """Jobs and work as one vehicle sees them, cached until facts that jobs depend on change."""

    def __init__(self, me: str, rules: Rules, mission: SocialPart, beliefs: Beliefs, until_s: float) -> None:
        self._me = me
        self._until_s = until_s
        self.database = rules.database
        all_w = {name: data.power_w(data.transit_speed_mps) for name, data in rules.database.items()}
        self.frugal = tuple(name for name, w in all_w.items() if rules.database[name].energy_j < AMPLE * w * until_s)
        self.blind: frozenset[str] = frozenset()
        self._apart = rules.apart
        self._mission = mission
        self._jobs = jobs = mission.jobs
        self._beliefs = beliefs
        self._about: dict[int, set[str]] = {}  # jobs by instance
        for name, job in jobs.items():
            for instance in (name, job.done[1]):
                self._about.setdefault(beliefs.uid(instance), set()).add(name)
        tbox = beliefs.model.tbox
        words = {attribute.name: attribute.uid for attribute in tbox.attributes}
        self._unable_to = words.get(UNABLE_TO)
        self.has_words = self._unable_to is not None
        self._resting: dict[tuple[int, int], set[str]] = {}  # jobs that depend on other facts, by (subject, attribute)
        for name, job in jobs.items():
            for attribute, instance in getattr(job, "rests_on", ()):
                self._resting.setdefault((beliefs.uid(instance), words[attribute]), set()).add(name)
        self.unable: frozenset[tuple[str, str]] = frozenset()
        self._is_hindered = False
        self.is_anew = False
        """True once abilities have changed; the reader resets it."""
        self._stale = set(jobs)
        self._left: dict[str, Job] = {}
        self._done: frozenset[str] = frozenset()
        self._given_anew: frozenset[str] = frozenset()
        self._n_given_anew = 0  # as of the last update
        self._is_enough = False
        self._asked: tuple[object, ...] | None = None
        self._kept: dict[str, Work] = {}

    def note_blind(self, blind: Collection[str]) -> None:
        """Set the vehicles with failed sensors."""
        self.blind = frozenset(blind)
        data = self.database.values()
        self.database = AUVDatabase(tuple(without_sensors(d) if d.name in self.blind else d for d in data))

    def scarce_energy_j(self, now_s: float) -> dict[str, float]:
        """Return the remaining energy (J) of vehicles that may lack energy, by name."""
        reports = {}
        for name in self.frugal:
            share, reported_s = self._beliefs.get((BATTERY, name)), self._beliefs.observed_s((BATTERY, name))
            if share is not None and reported_s is not None:
                reports[name] = share, reported_s
        return scarce_energy_j([self.database[name] for name in self.frugal], reports, now_s, self._until_s)

    def note(self, changes: Iterable[Change]) -> bool:
        """Mark jobs affected by changed facts as stale; return whether any fact is about a job."""
        jobs, is_about_jobs, unable_to, resting = self._about, False, self._unable_to, self._resting
        for change in changes:
            for fact in change.block.facts:
                if fact.subject in jobs:
                    self._stale |= jobs[fact.subject]
                    is_about_jobs = True
                if fact.attribute == unable_to and unable_to is not None:
                    self._note_unable(change, fact)
                elif resting and (fact.subject, fact.attribute) in resting:
                    self._note_resting(fact)
        return is_about_jobs

    def _note_unable(self, change: Change, fact: PropertyValue) -> None:
        if fact.subject == change.block.origin:
            statement = self._beliefs.name(fact.subject), self._beliefs.name(fact.target)
            self.is_anew = self.is_anew or statement not in self.unable
            self.unable |= {statement}

    def _note_resting(self, fact: PropertyValue) -> None:
        for name in self._resting[fact.subject, fact.attribute]:
            self._stale.add(name)
            job = cast(HinderedJob, self._jobs[name])
            now = hindrances(job.left(self._beliefs))
            self.is_anew = self.is_anew or now != hindrances(self._left.get(name, job))

    @property
    def is_hindered(self) -> bool:
        """True if any job has a blocking condition."""
        if self._stale:
            self._work_out()
        return self._is_hindered or bool(self.unable)

    def is_able(self, job: str) -> bool:
        """Return whether this vehicle is able to do a job, as far as known."""
        if self._stale:
            self._work_out()
        left = self._left.get(job)
        is_able = left is None or left.is_able(self.database[self._me])
        return is_able and (self._me, job) not in self.unable

    def left(self, job: str) -> Job | None:
        """Return a job reduced by known facts to its remainder; None while it is not known to exist."""
        return jobs_left({job: self._jobs[job]}, self._beliefs)[0].get(job)

    def why_not(self, job: str) -> str:
        """Describe the blocking conditions of a job."""
        known = self._left.get(job, self._jobs[job])
        failed = [f"{vehicle} has no way left" for vehicle, job_failed in sorted(self.unable) if job_failed == job]
        return "; ".join([*hindrances(known), *failed])

    def give_anew(self, ends: Collection[Key]) -> None:
        """Mark jobs as reassigned: their completion facts are no longer valid."""
        again = {name for name, job in self._jobs.items() if job.done in ends}
        self._stale |= again
        self._given_anew |= again

    def told_by(self, vehicles: Collection[str]) -> list[Fact]:
        """Return completion facts last reported by these absent vehicles, which cannot repeat them."""
        keys = (job.done for job in self._jobs.values())
        return [
            self._beliefs.fact(key[1], key[0], self._beliefs.get(key))
            for key in keys
            if self._beliefs.origin(key) in vehicles
        ]

    def of_groups(
        self, at: Footing, picture: Picture, positions_m: Mapping[str, Point] | None, from_s: float
    ) -> Mapping[str, Work]:
        """Return the work of every group, with outlooks from ``from_s``; cached without positions."""
        asked = *at, self.blind, self.unable
        if self._stale:
            self._work_out()
        energy_j = self.scarce_energy_j(picture.body.now_s) if self.frugal else None
        if energy_j:
            # Energy falls with time, so this result is not cached.
            return self._works(at, picture.peers.positions_m if positions_m is None else positions_m, energy_j, from_s)
        if self._asked != asked:
            self._kept = self._works(at, {}, {}, 0.0)
            self._asked = asked
        if positions_m is None:
            return self._kept
        kept = self._kept
        return Computed(kept, lambda group: kept[group].seen(positions_m, from_s))

    def whole(self, at: Footing) -> dict[str, Work]:
        """Return the work of every group at its start, with all jobs and vehicles at their starts."""
        return {
            name: Work(group, at.present, self.database, self._jobs, unavailable=self._apart)
            for name, group in at.present.groups.items()
        }

    def _works(
        self, footing: Footing, positions_m: Mapping[str, Point], energy_j: Mapping[str, float], from_s: float
    ) -> dict[str, Work]:
        takes_no_jobs = footing.takes_no_jobs | self._apart
        known = footing.present, self.database, self._left, self._done, positions_m, takes_no_jobs, self._is_enough
        by_group = {
            name: Work(group, *known, energy_j, from_s, footing.barred, self._given_anew, self.unable)
            for name, group in footing.present.groups.items()
        }
        if footing.is_cut_off and any(work.held_by(self._me) for work in by_group.values()):  # its own jobs come first
            return {name: replace(work, unavailable=work.unavailable | {self._me}) for name, work in by_group.items()}
        return by_group

    def _work_out(self) -> None:
        left, done = jobs_left({name: job for name, job in self._jobs.items() if name in self._stale}, self._beliefs)
        known = self._left | left
        is_anew = any(hindrances(job) != hindrances(self._left.get(name, job)) for name, job in left.items())
        before = self._left.keys(), self._done, self._is_enough, self._n_given_anew
        self._is_hindered = any(map(hindrances, known.values())) if is_anew else self._is_hindered
        self._left = {name: known[name] for name in self._jobs if name in known}
        self._done = self._done.difference(self._stale) | done
        self._n_given_anew = len(self._given_anew)
        self._is_enough = answer(
            f"mission {type(self._mission).__name__}", "is_enough", "true or false",
            lambda is_enough: isinstance(is_enough, bool), lambda: self._mission.is_enough(self._beliefs),
        )  # fmt: skip
        self._stale = set()
        if not is_anew and before == (self._left.keys(), self._done, self._is_enough, self._n_given_anew):
            self._kept = {name: work.with_less(self._left) for name, work in self._kept.items()}
        else:
            self._asked = None  # the cache depends on earlier facts
