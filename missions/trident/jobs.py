"""Jobs of the mission, surveys of blocks and the recovery of the chosen object, and their tasks.

HTN tasks of one vehicle are composed of basic services::

    PursueWorking(block)      survey it      -> Surveying(block, service)
    PursueWorking(recovery)   await a choice -> StandingBy(recovery)
                              recover        -> Fix -> FindAgain -> HoldOn -> HandleIt
    Fix                       seen again     ->                         position known relative to the candidate
                              on the way     ->                         fixes come from another vehicle
                              there          -> Ranging(vehicle, candidate, service)
                              without        ->
    FindAgain, HoldOn, HandleIt  by a service -> Reacquiring, Holding, Handling(recovery, candidate, service)
    FindAgain                 it is not there -> Missing(recovery, candidate)

A step is bound to a service at planning time, with one alternative per able service. After a failed step the next
alternative follows; a changed match causes a new plan. A vehicle without alternatives releases the job.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

from exchange.arithmetic import distance
from missions.trident.services import (
    AVAILABLE,
    FAILED,
    FIND,
    FIX,
    HANDLE,
    HOLD,
    EffectorSettings,
    FinderSettings,
    Matching,
    SeabedBlock,
    SurveyorSettings,
    parties,
)
from remoras.activities import Objective
from remoras.beliefs import Key, Known
from remoras.database import VehicleData
from remoras.htn import ANY, Domain, FactsLike, Method, Operator, Task
from remoras.mission import PURSUE
from remoras.organisation import Group
from remoras.work import Outlook, Point

SHARE_USED = 0.8  # lane spacing as share of the sensor width; the overlap covers position errors
RECOVERY_S = 400.0  # expected duration of a recovery on site, fitted to runs without faults


def survey_speed_mps(data: VehicleData, settings: SurveyorSettings) -> float:
    """Survey speed, limited by the module."""
    return min(data.survey_speed_mps, data.speed_factor * settings.speed_limit_mps)


def is_to_be_surveyed(facts: FactsLike, block: str, recovery: str) -> bool:
    """Return True unless the block is known to be surveyed as often as requested."""
    if facts.get(("surveyedBy", block)) is None:
        return True
    return int(facts.get(("surveyedAgain", block), 0)) < int(facts.get(("surveysAgain", recovery), 0))


def is_open(facts: FactsLike, candidate: str) -> bool:
    """Return True unless a candidate is known as a decoy or absent."""
    return facts.get(("verdict", candidate)) not in ("decoy", "absent")


@dataclass(frozen=True, kw_only=True)
class OnServices:
    """Base of jobs that depend on ``services``, some reported as ``failed``; see ``remoras.work.HinderedJob``."""

    needs: tuple[str, ...] = ()
    services: tuple[str, ...]
    failed: frozenset[str] = frozenset()

    def is_able(self, data: VehicleData) -> bool:
        """Return True for a vehicle with working services for the job."""
        raise NotImplementedError

    def is_ever_able(self, data: VehicleData) -> bool:
        """Return True for a vehicle that is able while its services work."""
        return replace(self, failed=frozenset()).is_able(data)

    @property
    def rests_on(self) -> tuple[Key, ...]:
        """Status facts of the services."""
        return tuple(("serviceStatus", name) for name in self.services)

    @property
    def hindrances(self) -> tuple[str, ...]:
        """Failed services."""
        return tuple(f"{name} has failed" for name in sorted(self.failed))

    def left(self, facts: Known) -> Self:
        """Return the job with the failed services."""
        failed = frozenset(name for name in self.services if facts.get(("serviceStatus", name)) == FAILED)
        return self if failed == self.failed else replace(self, failed=failed)


@dataclass(frozen=True)
class BlockSurvey(OnServices):
    """Survey of a block: a ``remoras.work.Job``; ``vehicles`` may do it or request it."""

    block: SeabedBlock
    vehicles: frozenset[str]

    @property
    def name(self) -> str:
        """Name of the block."""
        return self.block.name

    @property
    def place_m(self) -> Point:
        """Centre of the block."""
        return self.block.centre_m

    @property
    def done(self) -> Key:
        """Fact that the block is surveyed."""
        return "surveyedBy", self.name

    def is_able(self, data: VehicleData) -> bool:
        # Without reporting services none can fail, and the empty set would contain all of them.
        if self.failed and self.failed.issuperset(self.services):
            return False
        return data.name in self.vehicles and data.sensor(SurveyorSettings) is not None

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """Return the outlook after travel and all lanes of the first surveying module."""
        settings = data.sensor(SurveyorSettings) if self.is_able(data) else None
        if settings is None:
            return None
        way_s = distance(outlook.position_m, self.place_m) / data.transit_speed_mps
        size_m2 = math.prod(self.block.sides_m)
        lanes_s = size_m2 / (2.0 * SHARE_USED * settings.reach_m * survey_speed_mps(data, settings))
        return Outlook(outlook.free_s + way_s + lanes_s, self.place_m)


@dataclass(frozen=True)
class RecoveryJob(OnServices):
    """Recovery of the chosen object, if not ``exhausted``: a ``remoras.work.Job``."""

    name: str
    place_m: Point
    exhausted: bool = False

    @property
    def done(self) -> Key:
        """Fact that the object is recovered."""
        return "recoveredBy", self.name

    @property
    def rests_on(self) -> tuple[Key, ...]:
        """Status facts of the services, and whether candidates remain."""
        return (*super().rests_on, ("isExhausted", self.name))

    @property
    def hindrances(self) -> tuple[str, ...]:
        """Failed services, and the lack of a choice."""
        return (
            *super().hindrances,
            *(("no candidate is left that may be the target, or nobody to choose it",) if self.exhausted else ()),
        )

    def left(self, facts: Known) -> Self:
        """Return the job with failed services, and exhausted or not."""
        job, exhausted = super().left(facts), bool(facts.get(("isExhausted", self.name)))
        return job if exhausted == self.exhausted else replace(job, exhausted=exhausted)

    def is_ever_able(self, data: VehicleData) -> bool:
        """Return True for a vehicle that is able while services work and a candidate remains."""
        return replace(self, failed=frozenset(), exhausted=False).is_able(data)

    def is_able(self, data: VehicleData) -> bool:
        if self.exhausted:
            return False
        working = [sensor for sensor in data.sensors if f"{data.name} {sensor.name}" not in self.failed]
        does = {sensor.does for sensor in working if isinstance(sensor, EffectorSettings)}
        return len(does) == 2 and any(isinstance(sensor, FinderSettings) for sensor in working)

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """Return the outlook after travel and an average recovery."""
        if not self.is_able(data):
            return None
        return outlook.stayed(self.place_m, RECOVERY_S, data)


WORKING, SERVING = "Working", "Serving"  # objectives: of a role with a job, and of all initially assigned roles
STANDING_BY, SURVEYING, RANGING, REACQUIRING = "StandingBy", "Surveying", "Ranging", "Reacquiring"
MISSING, HOLDING, HANDLING = "Missing", "Holding", "Handling"
COMPOSED = {"FindAgain": (FIND, REACQUIRING), "HoldOn": (HOLD, HOLDING), "HandleIt": (HANDLE, HANDLING)}
"""Composite tasks: activity that requests a service, and step that uses it."""


def activity_domain(matching: Matching, groups: Mapping[str, Group], recovery: str) -> Domain:
    """Return the decomposition of objectives into steps bound to services."""

    def present(facts: FactsLike, objective: Objective) -> frozenset[str]:
        return parties(groups[objective.group], facts)

    def is_block(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        return objective.argument in matching.blocks

    def surveys(facts: FactsLike, objective: Objective, data: VehicleData) -> Iterator[list[Task]]:
        block, name = objective.argument, data.name
        for service in matching.for_block(name, block, facts, present(facts, objective)):
            yield [Task(SURVEYING, (block, service))]

    def is_awaited(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        return not is_block(facts, objective, data) and not is_chosen(facts, objective, data)

    def is_chosen(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        chosen = None if is_block(facts, objective, data) else facts.get(("chosen", recovery))
        return chosen is not None and is_open(facts, chosen)

    def recovers(facts: FactsLike, objective: Objective, data: VehicleData) -> list[Task]:
        parameters = objective, data, facts.get(("chosen", recovery))
        return [Task("Fix", parameters), *(Task(name, parameters) for name in COMPOSED)]

    def is_fixed(facts: FactsLike, objective: Objective, data: VehicleData, candidate: str) -> bool:
        ways = matching.ways(FIX, data.name, facts, present(facts, objective))
        return bool(ways) and matching.services[ways[0]].vehicle != data.name

    def ranges(facts: FactsLike, objective: Objective, data: VehicleData, candidate: str) -> Iterator[list[Task]]:
        for service in matching.ways(FIX, data.name, facts, present(facts, objective)):
            if matching.services[service].vehicle == data.name:
                yield [Task(RANGING, (data.name, candidate, service))]

    def is_seen(facts: FactsLike, objective: Objective, data: VehicleData, candidate: str) -> bool:
        return bool(facts.get(("reacquiredBy", candidate)) == data.name)

    fix = [
        Method.fixed("seen again", applicable=is_seen),
        Method.fixed("on the way", applicable=is_fixed),
        Method("there", ranges, uses=(RANGING,)),
        Method.fixed("without"),
    ]
    pursue = [
        Method("survey it", surveys, is_block, (SURVEYING,)),
        Method("await a choice", lambda facts, *args: [Task(STANDING_BY, (recovery,))], is_awaited, (STANDING_BY,)),
        Method("recover", recovers, is_chosen, ("Fix", *COMPOSED)),
    ]
    composed = {
        name: [Method("by a service", _bound(matching, present, *pair), uses=pair[1:])]
        for name, pair in COMPOSED.items()
    }
    composed["FindAgain"].append(_missing(matching, present))
    return Domain.of(_operators(matching), {PURSUE + WORKING: pursue, "Fix": fix, **composed})


def _bound(matching: Matching, present: Callable[..., frozenset[str]], activity: str, step: str) -> Callable[..., Any]:
    """Return the alternatives of a composite task, one step per able service."""

    def ways(facts: FactsLike, objective: Objective, data: VehicleData, candidate: str) -> Iterator[list[Task]]:
        after = data.name if step == REACQUIRING and facts.get(("fixedOn", data.name)) else ""
        for service in matching.ways(activity, data.name, facts, present(facts, objective)):
            yield [Task(step, (objective.argument, candidate, service, after))]

    return ways


def _missing(matching: Matching, present: Callable[..., frozenset[str]]) -> Method:
    def is_searched_for(facts: FactsLike, objective: Objective, data: VehicleData, candidate: str) -> bool:
        for name in matching.ways(FIND, data.name, facts, present(facts, objective)):
            # A finder without a self-test may have failed silently, so its silence does not prove absence.
            if matching.services[name].settings.tells_state and facts.get(("serviceStatus", name)) == AVAILABLE:
                return True
        return False

    def missing(facts: FactsLike, objective: Objective, data: VehicleData, candidate: str) -> list[Task]:
        return [Task(MISSING, (objective.argument, candidate))]

    return Method("it is not there", missing, is_searched_for, (MISSING,))


def _operators(matching: Matching) -> list[Operator]:
    def provider(service: str) -> str:
        return matching.services[service].vehicle

    def is_localised(facts: FactsLike, job: str, candidate: str, service: str, after: str) -> bool:
        return not after or bool(facts.get(("fixedOn", after)))  # ``after``: vehicle that must take a fix first

    def identified(facts: FactsLike, job: str, candidate: str, service: str, after: str) -> Mapping[Hashable, Any]:
        return {("verdict", candidate): "target", ("reacquiredBy", candidate): provider(service)}

    def is_found(facts: FactsLike, job: str, candidate: str, service: str, after: str) -> bool:
        by = facts.get(("reacquiredBy", candidate))
        return bool(facts.get(("verdict", candidate)) == "target" and by == provider(service))

    def held(facts: FactsLike, job: str, candidate: str, service: str, after: str) -> Mapping[Hashable, Any]:
        return {("heldBy", candidate): provider(service)}

    def is_held(facts: FactsLike, job: str, candidate: str, service: str, after: str) -> bool:
        return bool(facts.get(("heldBy", candidate)) == provider(service))

    def handled(facts: FactsLike, job: str, candidate: str, *of: str) -> Mapping[Hashable, Any]:
        return {("handledBy", candidate): ANY, ("recoveredBy", job): ANY}

    return [
        Operator(STANDING_BY, lasts=True, expected=None),
        Operator(SURVEYING, effects=lambda facts, block, *of: {("surveyedBy", block): ANY}, expected=None),
        Operator(RANGING, effects=lambda facts, vehicle, *of: {("fixedOn", vehicle): True}, expected=None),
        Operator(REACQUIRING, is_localised, identified, expected=None),
        Operator(MISSING, effects=lambda facts, job, candidate: {("verdict", candidate): "absent"}, expected=None),
        Operator(HOLDING, is_found, held, expected=None),
        Operator(HANDLING, is_held, handled, expected=None),
    ]
