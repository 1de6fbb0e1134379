"""Help: jobs that need more vehicles than their holder, and the motivation of helpers.

The holder of such a job waits. Its satisfaction falls, and its role calls the initially assigned roles of the group.
These hold the objective ``Helping``: one activity for each job of another vehicle that needs help. Only this activity
ends the wait, so only it answers the call. Idle vehicles help uncalled.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, cast

from pydantic import Field

from exchange.arithmetic import distance
from missions.errors import ConfigurationFault
from missions.meeting.job_mission import DONE_BY, JobMission, JobScenario, JobSettings
from missions.meeting.meeting import NEWS_FRAMES, Pursuit
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective, Wait
from remoras.behaviours import BEYOND_IT, STANDING, Behaviour, Perception
from remoras.database import VehicleData
from remoras.htn import FactsLike
from remoras.motion.separation import SAME_DEPTH_M
from remoras.picture import Picture
from remoras.sensor import Observation
from remoras.table import Positive
from remoras.work import IS_IMPOSSIBLE, UNABLE_TO, Job, Point, Work

HELPING = "Helping"
HELPING_IMPORTANCE = 0.5  # default importance of helping: above the rendezvous, below own work
URGENCY = 50
JUDGED = {UNABLE_TO: URGENCY, IS_IMPOSSIBLE: URGENCY}
"""Urgencies of reports: a vehicle cannot do a job; a leader declares it impossible."""
LATER_SHARE = 0.5  # factor on the effect for surplus helpers, while others would end more of the wait
MUCH_NEARER_M = 20.0  # margin at which a helper under way yields to a nearer one (received positions are old)


class HelpAwaited:
    """Wait for ``n_peers`` helpers (``what``): dissatisfied, and given up after ``wait_s``."""

    def __init__(self, what: str, wait_s: float, n_peers: int = 1) -> None:
        self._what, self._wait_s, self._n_peers = what, wait_s, n_peers
        self._since_s: float | None = None
        self.is_given_up = False

    def is_over(self) -> None:
        """Reset the wait after progress."""
        self._since_s = None

    def perceived(self, now_s: float) -> Perception:
        """Return the perception during the wait."""
        self._since_s = now_s if self._since_s is None else self._since_s
        wait = Wait(self._what, self._since_s + self._wait_s, self._since_s, self._n_peers)
        self.is_given_up = now_s > wait.until_s
        return BEYOND_IT if self.is_given_up else STANDING._replace(waits=wait)


def n_helpers(job: Job) -> int:
    """Number of helpers that a job needs besides its holder."""
    return getattr(job, "n_helpers", 0)


@dataclass(eq=False)
class Help:
    """Usefulness of one vehicle at a job of others, and its effect on their wait.

    It is of no use once enough nearer vehicles have reported the same, or while others have priority. ``n_helpers``
    excludes the holder, ``attribute`` reports the helped job, ``is_on`` means helped since the last decision.
    """

    turn_frames: ClassVar[float] = 0.0
    """TDMA frames of priority for each nearer free vehicle, to report that it goes."""

    job: str
    group: str
    holders: Collection[str]
    me: str
    n_helpers: int
    attribute: str
    helped: Collection[str]
    is_on: bool = False
    _began: bool = False
    _since_s: float = math.inf
    _place_m: Point | None = None
    _picture: Picture | None = None

    def is_of_use(self, place_m: Point | None, to_go_m: float, picture: Picture, performed: bool) -> bool:
        """Return True unless enough nearer vehicles help; ``place_m`` is None without a need."""
        self._picture, self._place_m = picture, place_m
        self._began, self.is_on = performed and not self.is_on, performed
        self._since_s = math.inf if place_m is None else min(self._since_s, picture.body.now_s)
        return place_m is not None and self._n_nearer(place_m, to_go_m, picture) < self.n_helpers

    def said(self) -> tuple[Observation, ...]:
        """Observation of the chosen job, once the vehicle has set out."""
        return (Observation(((self.me, self.attribute, self.job),)),) if self._began else ()

    def _n_nearer(self, place_m: Point, to_go_m: float, picture: Picture) -> int:
        peers, now_s, frame_s = picture.peers, picture.body.now_s, picture.frame_s
        n_nearer = n_free = 0
        for name, at_m in peers.positions_m.items():
            is_stale = now_s - peers.heard_s.get(name, -math.inf) > NEWS_FRAMES * frame_s
            if is_stale or name == self.me or name in self.holders:
                continue
            to = picture.facts.get((self.attribute, name))
            if to == self.job:
                n_nearer += self.goes_before(name, distance(at_m, place_m), to_go_m)
            # Under way, only reported helpers count: free vehicles have had their turn.
            elif self.turn_frames and not self.is_on and self._is_free(name, to, picture):
                n_free += (distance(at_m, place_m), name) < (to_go_m, self.me)
        # Each nearer free vehicle has some frames in which to report that it goes.
        return n_nearer + n_free if now_s < self._since_s + n_free * self.turn_frames * frame_s else n_nearer

    def _is_free(self, name: str, helped: object, picture: Picture) -> bool:
        """True if a vehicle has no job, and the job that it reported to help is done."""
        if helped is not None and picture.facts.get((DONE_BY, str(helped))) is None:
            return False
        work = picture.groups.works.get(self.group)
        return work is None or not (work.held_by(name) or name in self.stay_away(work, picture))

    def goes_before(self, name: str, its_m: float, to_go_m: float) -> bool:
        """True if another helper is nearer, by a margin if this vehicle is under way."""
        margin_m = MUCH_NEARER_M if self.is_on else 0.0
        return (its_m + margin_m, name) < (to_go_m, self.me)

    def ends(self, caller: str, role: str) -> float:
        """Share of the holder's wait that this vehicle ends; halved if enough others end more."""
        picture, place_m = self._picture, self._place_m
        work = None if picture is None else picture.groups.works.get(self.group)
        declared = None if work is None else work.group.role(role)
        if picture is None or work is None or declared is None or declared.job != self.job or place_m is None:
            return 0.0
        away, now_s, n_helpers = self.stay_away(work, picture), picture.body.now_s, self.n_helpers
        ended = work.ended(self.me, caller, place_m, away, now_s, n_helpers)
        others = [name for name in work.members if name not in (self.me, caller, *away)]
        n_before = sum(work.ended(name, caller, place_m, away, now_s, n_helpers) > ended for name in others)
        if self.is_on or n_before < n_helpers:
            return ended
        is_their_turn = now_s < self._since_s + n_before * self.turn_frames * picture.frame_s
        return 0.0 if is_their_turn else ended * LATER_SHARE

    def stay_away(self, work: Work, picture: Picture) -> Collection[str]:
        """Members that will not come: holders of jobs that need help wait themselves."""
        return [name for role in work.unfinished if role.job in self.helped for name in work.holders(role)]


class HelpSettings(JobSettings):
    """Table ``[mission]`` of a mission with waits for help."""

    wait_s: Positive = Field(2400.0, description="time after which a vehicle that waits for help gives up its job")


def unseen_by_sonar(scenario: JobScenario) -> Iterator[ConfigurationFault]:
    """Yield faults: vehicles in depths where the sonar of the first one, which waits for help, does not show them."""
    first, *others = scenario.vehicle
    for vehicle in others:
        if abs(vehicle.depth_m - first.depth_m) > SAME_DEPTH_M:
            allowed = (
                f"allowed: within {SAME_DEPTH_M:g} m of {first.name}, {first.depth_m:g} m, as helpers find each other "
                "by sonar; copies: fleet.layers = false"
            )
            yield ConfigurationFault(f"vehicle.{vehicle.name}.depth_m", f"{vehicle.depth_m:g}", allowed)


class HelpMission(JobMission):
    """Mission of jobs some of which need help, see the module."""

    other_objectives = collective = (HELPING,)
    help_activity: ClassVar[str] = HELPING
    help_by: ClassVar[tuple[type[Help], str]]
    """Class of ``Help``, and the attribute of the reported job."""

    @cached_property  # 0.5 % of a mission
    def helped(self) -> Mapping[str, Any]:
        """Jobs that need help, by name."""
        return {name: job for name, job in self.jobs.items() if n_helpers(job)}

    def founding_objectives(self) -> Sequence[Objective]:
        """Supervision by leaders; helping by all initially assigned roles."""
        return [*super().founding_objectives(), *self.meeting.objectives(HELPING)]

    def activity_sets(self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point) -> Pursuit:
        if objective.name != HELPING:
            return super().activity_sets(objective, data, facts, position_m)
        rests_on = {("gatheredAt", objective.group)}
        sets = []
        importance = self.importance_of(objective, HELPING_IMPORTANCE)
        for role in self.groups[objective.group].roles:
            if role.job is None or role.job not in self.helped:
                continue
            key = "members", f"{objective.group}.{role.name}"
            ends = self.ends_of(role.job)
            rests_on |= {key, *ends}
            holders = facts.get(key) or ()
            if all(facts.get(end) in (None, False) for end in ends) and data.name not in holders:
                parameters = (HELPING, role.job, objective.group, tuple(holders))
                activity = Activity(self.help_activity, ActivityType.GUIDANCE, parameters)
                sets.append(ActivitySet(objective, ActivityKind.COLLECTIVE, (activity,), importance))
        is_over = facts.get(("gatheredAt", objective.group)) is not None
        return () if is_over else tuple(sets), frozenset(rests_on)

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        if activity.parameters[:1] == (HELPING,):
            _, job, group, holders = activity.parameters
            kind, attribute = self.help_by
            work: Any = self.jobs[job]
            help = kind(job, group, holders, data.name, n_helpers(work), attribute, self.helped)
            return cast(Behaviour, work.helper(help, data, self.scenario))
        return super().behaviour_for(activity, data)
