"""Help: jobs that take more vehicles than the one that holds them, and what moves the others to come.

Whoever holds such a job waits. Its satisfaction falls, and its role calls on the founding roles of the group. These
have the objective ``Helping``: one activity for each job of another one that takes help. Only that activity ends the
wait for the job, so it alone is an answer to the call, and how much it settles follows from the way and from when
somebody would come anyway, see ``Help.ends``. What moves a vehicle to it, and away from work of its own, is the
decision of ``remoras.executive`` alone. Whoever has nothing else to do helps uncalled.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Collection, Sequence
from functools import cached_property
from typing import Any, ClassVar

from pydantic import Field

from exchange.arithmetic import distance
from missions.meeting.job_mission import JobMission, JobSettings
from missions.meeting.meeting import Pursuit
from missions.meeting.staying import DONE_BY
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective, Wait
from remoras.behaviours import BEYOND_IT, STANDING, Behaviour, Perception
from remoras.database import VehicleData
from remoras.htn import FactsLike
from remoras.picture import Picture
from remoras.sensor import Observation
from remoras.table import Positive
from remoras.work import IS_IMPOSSIBLE, UNABLE_TO, Job, Point, Work

HELPING = "Helping"
HELPING_IMPORTANCE = 0.5
"""Of helping, unless the scenario says otherwise: more than to meet, less than work of one's own."""
URGENCY = 50
"""How urgently vehicles need to hear who helps, unless the scenario says otherwise."""
NEWS_FRAMES = 20.0
"""A helper that was heard more TDMA frames ago is not counted on."""
JUDGED = {UNABLE_TO: URGENCY, IS_IMPOSSIBLE: URGENCY}
"""Words by which vehicles say what is beyond them, and heads what is impossible."""
LATER_SHARE = 0.5
"""By this share those are moved of whom a job takes no more while others would end more of the wait."""
MUCH_NEARER_M = 20.0
"""Who is on its way leaves a job to another one that is nearer by this: a position heard is some seconds old."""


class HelpAwaited:
    """The wait of whoever holds a job that takes help and does not get on: it is dissatisfied, and gives up in the end.

    Args:
        what: it waits for; wait_s: for so long.

    Attributes:
        is_given_up: for good: it leaves the job at the end of the round, and does not turn to it anew until then.
    """

    def __init__(self, what: str, wait_s: float) -> None:
        self._what, self._wait_s = what, wait_s
        self._since_s: float | None = None
        self.is_given_up = False

    def is_over(self) -> None:
        """It gets on."""
        self._since_s = None

    def perceived(self, now_s: float) -> Perception:
        """What is perceived of the job meanwhile."""
        self._since_s = now_s if self._since_s is None else self._since_s
        until_s = self._since_s + self._wait_s
        self.is_given_up = now_s > until_s
        return BEYOND_IT if self.is_given_up else STANDING._replace(waits=Wait(self._what, until_s))


def n_helpers(job: Job) -> int:
    """How many vehicles a job takes beside whoever has it."""
    return getattr(job, "n_helpers", 0)


class Help:
    """Whether one vehicle is of use at a job of others, and how much of their wait it ends.

    It says to which job it goes. As long as enough others have said so that are nearer, it is of no use there; nor
    while it is the turn of others.

    Args:
        job: name of the job; group: whose it is; holders: who holds it; me: the vehicle.
        n_helpers: how many the job takes beside its holder.
        attribute: of the vocabulary, by which a vehicle says to which job it goes.
        helped: all jobs that take help, by name.

    Attributes:
        is_on: it has helped since the last decision.
    """

    turn_frames: ClassVar[float] = 0.0
    """Whoever hears of a need leaves so many TDMA frames to each free one that is nearer, to say that it goes."""

    def __init__(
        self,
        job: str,
        group: str,
        holders: Collection[str],
        me: str,
        n_helpers: int,
        attribute: str,
        helped: Collection[str],
    ) -> None:
        self.holders = holders
        self._job, self._group, self.me = job, group, me
        self._n_helpers, self._attribute, self._helped = n_helpers, attribute, helped
        self._place_m: Point | None = None
        self._picture: Picture | None = None
        self._since_s = math.inf
        self.is_on = False
        self._began = False

    def is_of_use(self, place_m: Point | None, to_go_m: float, picture: Picture, performed: bool) -> bool:
        """True unless enough others help that are nearer.

        Args:
            place_m: where help is needed; None while it is not, or that is not known.
            to_go_m: the way there.
            picture: of the vehicle.
            performed: True if it has helped since the last decision.
        """
        self._picture, self._place_m = picture, place_m
        self._began, self.is_on = performed and not self.is_on, performed
        self._since_s = math.inf if place_m is None else min(self._since_s, picture.body.now_s)
        return place_m is not None and self._n_nearer(place_m, to_go_m, picture) < self._n_helpers

    def said(self) -> tuple[Observation, ...]:
        """What the vehicle says of it: to which job it goes, once it has set out."""
        return (Observation(((self.me, self._attribute, self._job),)),) if self._began else ()

    def _n_nearer(self, place_m: Point, to_go_m: float, picture: Picture) -> int:
        """How many others that were heard lately go before: they have said that they help, or it is their turn."""
        peers, now_s, frame_s = picture.peers, picture.body.now_s, picture.frame_s
        busy = peers.positions_m if self.is_on else self._busy(picture)
        n_nearer = n_free = 0
        for name, at_m in peers.positions_m.items():
            if (
                name == self.me
                or name in self.holders
                or now_s - peers.heard_s.get(name, -math.inf) > NEWS_FRAMES * frame_s
            ):
                continue
            its_m = distance(at_m, place_m)
            to = picture.facts.get((self._attribute, name))
            if to == self._job:
                n_nearer += self.goes_before(name, its_m, to_go_m)
            elif name not in busy and (to is None or picture.facts.get((DONE_BY, to)) is not None):
                n_free += (its_m, name) < (to_go_m, self.me)
        return n_nearer + n_free if now_s < self._since_s + n_free * self.turn_frames * frame_s else n_nearer

    def _busy(self, picture: Picture) -> Collection[str]:
        """Members that have work of their own or will not come, as far as is known."""
        work = picture.groups.works.get(self._group)
        if work is None:
            return ()
        return {*self.stay_away(work, picture), *(name for name in work.members if work.held_by(name))}

    def goes_before(self, name: str, its_m: float, to_go_m: float) -> bool:
        """True if another one that helps is nearer; much nearer, where this one is on its way.

        Args:
            name: of the other one.
            its_m: the way that it has to go, as far as heard; to_go_m: that of this one.
        """
        margin_m = MUCH_NEARER_M if self.is_on else 0.0
        return (its_m + margin_m, name) < (to_go_m, self.me)

    def ends(self, caller: str, role: str) -> float:
        """How much of the wait of whoever holds the job, by vehicle and role, this one ends by coming: see ``Work``.

        Where enough others end more, half of it: they hear the same call and set out first, so nobody has to turn back.
        """
        picture, place_m = self._picture, self._place_m
        work = None if picture is None else picture.groups.works.get(self._group)
        of = None if work is None else work.group.role(role)
        if picture is None or work is None or of is None or of.job != self._job or place_m is None:
            return 0.0
        away, now_s, n_helpers = self.stay_away(work, picture), picture.body.now_s, self._n_helpers
        ended = work.ended(self.me, caller, place_m, away, now_s, n_helpers)
        others = [name for name in work.members if name not in (self.me, caller, *away)]
        n_before = sum(work.ended(name, caller, place_m, away, now_s, n_helpers) > ended for name in others)
        return ended if self.is_on or n_before < n_helpers else ended * LATER_SHARE

    def stay_away(self, work: Work, picture: Picture) -> Collection[str]:
        """Members that will not come meanwhile: who holds a job that takes help waits too, so it will not be done.

        Args:
            work: of the group; picture: of the vehicle.
        """
        return [name for one in work.unfinished if one.job in self._helped for name in work.holders(one)]


class HelpSettings(JobSettings):
    """The ``[mission]`` table of a mission in which vehicles wait for help."""

    wait_s: Positive = Field(2400.0, description="a vehicle that has waited for help for so long gives up its job")


class HelpMission(JobMission):
    """A mission of jobs of which some take help; see the text of this module."""

    help_activity: ClassVar[str] = HELPING
    """Name of the activity by which a vehicle helps."""
    help_by: ClassVar[tuple[type[Help], str]]
    """Whether one is of use, and the attribute by which it says to which job it goes."""

    @cached_property
    def helped(self) -> Collection[str]:
        """Names of the jobs that take help: they have an attribute ``n_helpers``."""
        return {name: job for name, job in self.jobs.items() if n_helpers(job)}

    @abstractmethod
    def helper(self, job: Any, help: Help, data: VehicleData) -> Behaviour:
        """A new behaviour by which a vehicle helps the holders of a job."""
        ...

    def founding_objectives(self) -> Sequence[Objective]:
        """Heads supervise; whoever founds a group helps the others of it."""
        helping = [
            Objective(group.name, role.name, HELPING, group.name)
            for group in self._groups.values()
            for role in group.roles
            if role.founding
        ]
        return [*super().founding_objectives(), *helping]

    def is_individual(self, objective: Objective) -> bool:
        """True for jobs, and not for help."""
        return objective.name != HELPING and super().is_individual(objective)

    def activity_sets(self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point) -> Pursuit:
        """For help one activity for each job that takes it, is not done yet, and not the vehicle's own."""
        if objective.name != HELPING:
            return super().activity_sets(objective, data, facts, position_m)
        rests_on = {("gatheredAt", objective.group)}
        sets = []
        importance = self.meeting.importance.get(HELPING, HELPING_IMPORTANCE)
        for role in self._groups[objective.group].roles:
            if role.job is None or role.job not in self.helped:
                continue
            key = "members", f"{objective.group}.{role.name}"
            ends = self.ends_of(role.job)
            rests_on |= {key, *ends}
            holders = facts.get(key) or ()
            if all(facts.get(end) in (None, False) for end in ends) and data.name not in holders:
                about = (HELPING, role.job, objective.group, tuple(holders))
                activity = Activity(self.help_activity, ActivityType.GUIDANCE, about)
                sets.append(ActivitySet(objective, ActivityKind.COLLECTIVE, (activity,), importance))
        is_over = facts.get(("gatheredAt", objective.group)) is not None
        return () if is_over else tuple(sets), frozenset(rests_on)

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        """Help with a job, or what every mission of jobs has."""
        if activity.parameters[:1] == (HELPING,):
            _, job, group, holders = activity.parameters
            (help, attribute), of = self.help_by, self.jobs[job]
            return self.helper(of, help(job, group, holders, data.name, n_helpers(of), attribute, self.helped), data)
        return super().behaviour_for(activity, data)
