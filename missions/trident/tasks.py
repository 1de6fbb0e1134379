"""HTN tasks of one vehicle: composite tasks built from basic services.

::

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
alternative follows; a changed match causes a new plan. A vehicle without alternatives releases the job. A successor
must reacquire and hold the candidate itself before it can handle it.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping
from typing import Any

from missions.trident.services import AVAILABLE, FIND, FIX, HANDLE, HOLD, Matching, parties
from remoras.activities import Objective
from remoras.database import VehicleData
from remoras.htn import ANY, Domain, FactsLike, Method, Operator, Task
from remoras.mission import PURSUE
from remoras.organisation import Group

WORKING, SERVING = "Working", "Serving"
"""Objectives: of a role with a job, and of all initially assigned roles."""
STANDING_BY, SURVEYING, RANGING, REACQUIRING, MISSING, HOLDING, HANDLING = (
    "StandingBy",
    "Surveying",
    "Ranging",
    "Reacquiring",
    "Missing",
    "Holding",
    "Handling",
)
COMPOSED = {"FindAgain": (FIND, REACQUIRING), "HoldOn": (HOLD, HOLDING), "HandleIt": (HANDLE, HANDLING)}
"""Composite tasks: activity that requests a service, and step that uses it."""


def activity_domain(matching: Matching, groups: Mapping[str, Group], recovery: str) -> Domain:
    """Return the decomposition of objectives into steps bound to services."""

    def there(facts: FactsLike, objective: Objective) -> frozenset[str]:
        return parties(groups[objective.group], facts)

    def is_block(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        return objective.argument in matching.blocks

    def surveys(facts: FactsLike, objective: Objective, data: VehicleData) -> Iterator[list[Task]]:
        block, name = objective.argument, data.name
        for service in matching.for_block(name, block, facts, there(facts, objective)):
            yield [Task(SURVEYING, (block, service))]

    def is_awaited(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        return not is_block(facts, objective, data) and not _is_open(facts, recovery)

    def is_chosen(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        return not is_block(facts, objective, data) and _is_open(facts, recovery)

    def recovers(facts: FactsLike, objective: Objective, data: VehicleData) -> list[Task]:
        of = objective, data, facts.get(("chosen", recovery))
        return [Task("Fix", of), *(Task(name, of) for name in COMPOSED)]

    def is_fixed(facts: FactsLike, objective: Objective, data: VehicleData, candidate: str) -> bool:
        ways = matching.ways(FIX, data.name, facts, there(facts, objective))
        return bool(ways) and matching.services[ways[0]].vehicle != data.name

    def ranges(facts: FactsLike, objective: Objective, data: VehicleData, candidate: str) -> Iterator[list[Task]]:
        for service in matching.ways(FIX, data.name, facts, there(facts, objective)):
            if matching.services[service].vehicle == data.name:
                yield [Task(RANGING, (data.name, candidate, service))]

    def is_seen(facts: FactsLike, objective: Objective, data: VehicleData, candidate: str) -> bool:
        return bool(facts.get(("reacquiredBy", candidate)) == data.name)

    fix = [
        Method("seen again", _nothing, is_seen, ()),
        Method("on the way", _nothing, is_fixed, ()),
        Method("there", ranges, uses=(RANGING,)),
        Method("without", _nothing, uses=()),
    ]
    pursue = [
        Method("survey it", surveys, is_block, (SURVEYING,)),
        Method("await a choice", lambda facts, *of: [Task(STANDING_BY, (recovery,))], is_awaited, (STANDING_BY,)),
        Method("recover", recovers, is_chosen, ("Fix", *COMPOSED)),
    ]
    composed = {
        name: [Method("by a service", _bound(matching, there, *of), uses=of[1:])] for name, of in COMPOSED.items()
    }
    composed["FindAgain"].append(_missing(matching, there))
    return Domain.of(_operators(matching), {PURSUE + WORKING: pursue, "Fix": fix, **composed})


def _bound(matching: Matching, there: Callable[..., frozenset[str]], activity: str, step: str) -> Callable[..., Any]:
    """Return the alternatives of a composite task, one step per able service."""

    def ways(facts: FactsLike, objective: Objective, data: VehicleData, candidate: str) -> Iterator[list[Task]]:
        after = data.name if step == REACQUIRING and facts.get(("fixedOn", data.name)) else ""
        for service in matching.ways(activity, data.name, facts, there(facts, objective)):
            yield [Task(step, (objective.argument, candidate, service, after))]

    return ways


def _missing(matching: Matching, there: Callable[..., frozenset[str]]) -> Method:
    """Return the last method of reacquisition: report absence, if a finder passed its self-test."""

    def is_searched_for(facts: FactsLike, objective: Objective, data: VehicleData, candidate: str) -> bool:
        for name in matching.ways(FIND, data.name, facts, there(facts, objective)):
            if matching.services[name].settings.tells_state and facts.get(("serviceStatus", name)) == AVAILABLE:
                return True
        return False

    def missing(facts: FactsLike, objective: Objective, data: VehicleData, candidate: str) -> list[Task]:
        return [Task(MISSING, (objective.argument, candidate))]

    return Method("it is not there", missing, is_searched_for, (MISSING,))


def _operators(matching: Matching) -> list[Operator]:
    def provider(service: str) -> str:
        return matching.services[service].vehicle

    def surveyed(facts: FactsLike, block: str, service: str) -> Mapping[Hashable, Any]:
        return {("surveyedBy", block): ANY}

    def fixed(facts: FactsLike, vehicle: str, candidate: str, service: str) -> Mapping[Hashable, Any]:
        return {("fixedOn", vehicle): True}

    def found(facts: FactsLike, job: str, candidate: str, service: str, after: str) -> Mapping[Hashable, Any]:
        return {("verdict", candidate): "target", ("reacquiredBy", candidate): provider(service)}

    def is_found(facts: FactsLike, job: str, candidate: str, service: str, after: str) -> bool:
        by = facts.get(("reacquiredBy", candidate))
        return bool(facts.get(("verdict", candidate)) == "target" and by == provider(service))

    def absent(facts: FactsLike, job: str, candidate: str) -> Mapping[Hashable, Any]:
        return {("verdict", candidate): "absent"}

    def held(facts: FactsLike, job: str, candidate: str, service: str, after: str) -> Mapping[Hashable, Any]:
        return {("heldBy", candidate): provider(service)}

    def is_held(facts: FactsLike, job: str, candidate: str, service: str, after: str) -> bool:
        return bool(facts.get(("heldBy", candidate)) == provider(service))

    def handled(facts: FactsLike, job: str, candidate: str, *of: str) -> Mapping[Hashable, Any]:
        return {("handledBy", candidate): ANY, ("recoveredBy", job): ANY}

    return [
        Operator(STANDING_BY, lasts=True, expected=_unknown),
        Operator(SURVEYING, effects=surveyed, expected=_unknown),
        Operator(RANGING, effects=fixed, expected=_unknown),
        Operator(REACQUIRING, _is_localised, found, expected=_unknown),
        Operator(MISSING, effects=absent, expected=_unknown),
        Operator(HOLDING, is_found, held, expected=_unknown),
        Operator(HANDLING, is_held, handled, expected=_unknown),
    ]


def _is_localised(facts: FactsLike, job: str, candidate: str, service: str, after: str) -> bool:
    """True if no vehicle must take a fix first (``after`` empty), or ``after`` has one."""
    return not after or bool(facts.get(("fixedOn", after)))


def _is_open(facts: FactsLike, recovery: str) -> bool:
    """True once a candidate is chosen and not rejected."""
    chosen = facts.get(("chosen", recovery))
    return chosen is not None and facts.get(("verdict", chosen)) not in ("decoy", "absent")


def _nothing(facts: FactsLike, *args: Any) -> list[Task]:
    return []


def _unknown(facts: FactsLike, *args: Any) -> None:
    """Return None: duration unknown."""
