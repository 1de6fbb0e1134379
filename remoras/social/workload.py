"""What there is left to do, as one vehicle knows it: the work of its groups, worked out anew where that has changed.

Reports: what vehicles tell of their energy and their sensors, on which it depends what work they are able to do.

Energy is the share of the battery that a vehicle tells in its slots. That its sensors yield nothing where they should
it tells when it notices, and for good: nobody switches them on to see. The optimiser gives nobody work that it cannot
finish on its energy or needs sensors for that are dead; see ``Work.affordable``.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from typing import cast

from remoras.authority import Request, Rules
from remoras.beliefs import Beliefs, Fact, Key
from remoras.database import AUVDatabase, VehicleData
from remoras.mission import SocialPart
from remoras.organisation import Group
from remoras.picture import Picture
from remoras.plugins import answer
from remoras.social.membership import Footing
from remoras.work import UNABLE_TO, HinderedJob, Job, Point, Work, WorksSeen, hindrances, jobs_left, works
from worldmodel import Change, PropertyValue

BATTERY, SENSORS_WORK = "batteryFraction", "sensorsWork"
AMPLE = 1.1
"""Who begins with so many times what it could spend in transit until the mission ends is never short of energy."""


def without_sensors(data: VehicleData) -> VehicleData:
    """What a vehicle is able to do whose sensors are dead follows from its data without them."""
    return replace(data, sensors=())


def takes_sensors(rules: Rules, group: Group, asked: Request) -> bool:
    """True if the assignee of a request needs its sensors for the job of the role that it asks for, in ``group``."""
    role = group.role(asked.role)
    job = rules.jobs.get(role.job) if role is not None and role.job is not None else None
    return job is not None and not job.is_able(without_sensors(rules.database[asked.assignee]))


def scarce_energy_j(
    vehicles: Iterable[VehicleData], told: Mapping[str, tuple[float, float]], now_s: float, until_s: float
) -> dict[str, float]:
    """What vehicles have left that could not go on in transit until the end of the mission, by name.

    Since it was told, a vehicle is taken to have worked at survey speed.

    Args:
        vehicles: data of those that may be short of it; batteries are full at the start.
        told: share of the battery and when that was told, by vehicle.
        now_s: time; until_s: end of the mission.
    """
    scarce_j = {}
    for data in vehicles:
        share, told_s = told.get(data.name, (1.0, 0.0))
        left_j = share * data.energy_j - data.power_w(data.survey_speed_mps) * max(0.0, now_s - told_s)
        if left_j < data.power_w(data.transit_speed_mps) * (until_s - now_s):
            scarce_j[data.name] = left_j
    return scarce_j


class Reports:
    """What one vehicle knows of the energy and the sensors of all.

    Args:
        beliefs: of the vehicle.
        database: static data of all vehicles.
        until_s: end of the mission.

    Attributes:
        blind: vehicles that say of themselves that their sensors yield nothing.
        database: data of all vehicles, of these without sensors.
        frugal: vehicles that may not have enough energy for the mission; of all others it need not be asked.
    """

    def __init__(self, beliefs: Beliefs, database: AUVDatabase, until_s: float) -> None:
        self._beliefs = beliefs
        self._until_s = until_s
        self.database = database
        all_w = {name: data.power_w(data.transit_speed_mps) for name, data in database.items()}
        self.frugal = tuple(name for name, w in all_w.items() if database[name].energy_j < AMPLE * w * until_s)
        self.blind: frozenset[str] = frozenset()

    def note(self, blind: Collection[str]) -> None:
        """See whose sensors are dead."""
        self.blind = frozenset(blind)
        data = self.database.values()
        self.database = AUVDatabase(tuple(without_sensors(d) if d.name in self.blind else d for d in data))

    def scarce_energy_j(self, now_s: float) -> dict[str, float]:
        """What vehicles have left, of those that may not have enough for the rest of the mission."""
        told = {}
        for name in self.frugal:
            share, told_s = self._beliefs.get((BATTERY, name)), self._beliefs.observed_s((BATTERY, name))
            if share is not None and told_s is not None:
                told[name] = share, told_s
        return scarce_energy_j([self.database[name] for name in self.frugal], told, now_s, self._until_s)


class Workload:
    """Jobs and work as one vehicle sees them.

    What is left of a job follows from facts about its own instance, and from those that it says it rests on, so only
    these make it worked out anew.

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
        tbox = beliefs.model.tbox
        words = {attribute.name: attribute.uid for attribute in tbox.attributes}
        self._unable_to = words.get(UNABLE_TO)
        self.has_words = self._unable_to is not None
        self._resting: dict[tuple[int, int], set[str]] = {}  # the same of other facts, by subject and attribute
        for name, job in jobs.items():
            for attribute, instance in getattr(job, "rests_on", ()):
                self._resting.setdefault((beliefs.uid(instance), words[attribute]), set()).add(name)
        self.unable: frozenset[tuple[str, str]] = frozenset()
        self._is_hindered = False
        self.is_anew = False
        """True once others may be able to do what than before; whoever has taken note of that sets it back."""
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
        about, is_about_jobs, unable_to, resting = self._about, False, self._unable_to, self._resting
        for change in changes:
            for fact in change.block.facts:
                if fact.subject in about:
                    self._stale |= about[fact.subject]
                    is_about_jobs = True
                if fact.attribute == unable_to and unable_to is not None:
                    self._note_unable(change, fact)
                elif resting and (fact.subject, fact.attribute) in resting:
                    self._note_resting(fact)
        return is_about_jobs

    def _note_unable(self, change: Change, fact: PropertyValue) -> None:
        """A vehicle says of itself what it is not able to do."""
        if fact.subject == change.block.origin:
            said = self._beliefs.name(fact.subject), self._beliefs.name(fact.target)
            self.is_anew = self.is_anew or said not in self.unable
            self.unable |= {said}

    def _note_resting(self, fact: PropertyValue) -> None:
        """Jobs that rest on a fact, if any, have to be worked out anew."""
        for name in self._resting[fact.subject, fact.attribute]:
            self._stale.add(name)
            job = cast(HinderedJob, self._jobs[name])
            now = hindrances(job.left(self._beliefs))
            self.is_anew = self.is_anew or now != hindrances(self._left.get(name, job))

    @property
    def is_hindered(self) -> bool:
        """True if anything is in the way of some job."""
        if self._stale:
            self._work_out()
        return self._is_hindered or bool(self.unable)

    def is_able(self, job: str) -> bool:
        """True if this vehicle is able to do a job, by what is known of it and of the job."""
        if self._stale:
            self._work_out()
        left = self._left.get(job)
        is_able = left is None or left.is_able(self._reports.database[self._me])
        return is_able and (self._me, job) not in self.unable

    def why_not(self, job: str) -> str:
        """What is in the way of a job, in words."""
        known = self._left.get(job, self._jobs[job])
        failed = [f"{vehicle} has no way left" for vehicle, of in sorted(self.unable) if of == job]
        return "; ".join([*hindrances(known), *failed])

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
        asked = *at, self._reports.blind, self.unable
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
            self._given_anew, self.unable,
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
            self._asked = None  # what is kept rests on what was known before
