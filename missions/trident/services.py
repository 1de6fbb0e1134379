"""Services: what modules offer, and which of them is able to do what an activity asks for.

=========  ========================================================================================================
response   services for an activity, in the order in which they are tried
=========  ========================================================================================================
fixed      the one that the plan names
repair     that one, then those that the plan lists behind it, each once the step before has failed
matching   all that the world model takes to be of the class asked for and available, of vehicles that are there, by
           cost; another vehicle's costs ``HANDING_OVER_S`` more. Own services of which nothing was said yet count too
=========  ========================================================================================================

Without inference, matching compares the class that an activity asks for with the one that a service is advertised as.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from missions.trident.modules import ModuleSettings
from missions.trident.scenario import ActivityTable, Response, TridentScenario
from remoras.beliefs import Key
from remoras.database import VehicleData
from remoras.htn import FactsLike
from remoras.organisation import Group

SURVEY, CHOOSE, FIX, FIND, HOLD, HANDLE = "survey", "choose", "fix", "find", "hold", "handle"
ON_BOARD = (FIND, HOLD, HANDLE)
"""Activities that no other vehicle is able to do for one that does the recovery."""
AVAILABLE, FAILED = "available", "failed"
AVAILABLE_SERVICE = "AvailableService"
"""Class of services that say of themselves that they work."""
HANDING_OVER_S = 300.0
"""What it costs to wait for another vehicle, beside the cost of its service."""


@dataclass(frozen=True, slots=True)
class Service:
    """What a module of a vehicle offers.

    Attributes:
        name: vehicle and module; vehicle: that has it.
        settings: of the module.
    """

    name: str
    vehicle: str
    settings: ModuleSettings


def services_of(vehicles: Iterable[VehicleData]) -> dict[str, Service]:
    """The services of all vehicles by name."""
    return {
        (name := f"{data.name} {sensor.name}"): Service(name, data.name, sensor)
        for data in vehicles
        for sensor in data.sensors
        if isinstance(sensor, ModuleSettings)
    }


def parties(group: Group, facts: FactsLike) -> frozenset[str]:
    """Vehicles of a group that are there."""
    founding = (group.path(role.name) for role in group.roles if role.founding)
    return frozenset(name for path in founding for name in facts.get(("members", path)) or ())


@dataclass(frozen=True)
class Matching:
    """Says which services are able to do what.

    Attributes:
        services: of the fleet, by name.
        activities: what each asks for, and what the plan has for it.
        blocks: of these, the survey of each block, by its name.
        response: what follows when a service fails.
        inference: whether classes are concluded.
    """

    services: Mapping[str, Service]
    activities: Mapping[str, ActivityTable]
    blocks: Mapping[str, ActivityTable]
    response: Response
    inference: bool

    @classmethod
    def of(cls, scenario: TridentScenario, vehicles: Iterable[VehicleData]) -> Matching:
        """That of a scenario."""
        activities = {name: getattr(scenario.activity, name) for name in type(scenario.activity).model_fields}
        blocks = {
            block.name: ActivityTable(requires=activities[SURVEY].requires, service=block.service, spare=block.spare)
            for block in scenario.block
        }
        settings = scenario.mission
        return cls(services_of(vehicles), activities, blocks, settings.response, settings.inference)

    def for_block(self, me: str, block: str, facts: FactsLike, there: Collection[str]) -> tuple[str, ...]:
        """Services by which ``me`` may see a block surveyed, the first one first; arguments as of ``ways``."""
        return self._ways(self.blocks[block], me, facts, there)

    def ways(self, activity: str, me: str, facts: FactsLike, there: Collection[str]) -> tuple[str, ...]:
        """Services by which ``me`` may do an activity, the first one first.

        Args:
            activity: name of the activity.
            me: vehicle that does it, or sees it done.
            facts: what it knows.
            there: vehicles that are there.
        """
        found = self._ways(self.activities[activity], me, facts, there)
        if activity not in ON_BOARD:
            return found
        return tuple(name for name in found if self.services[name].vehicle == me)

    def rests_on(self) -> frozenset[Key]:
        """Facts that a match rests on."""
        return frozenset(("serviceStatus", name) for name in self.services)

    def _ways(self, of: ActivityTable, me: str, facts: FactsLike, there: Collection[str]) -> tuple[str, ...]:
        if self.response != "matching":
            listed = (of.service, *(of.spare if self.response == "repair" else ()))
            return tuple(name for name in listed if name in self.services)
        fitting = self._fitting(of.requires, me, facts)
        able = [service for name, service in self.services.items() if name in fitting and service.vehicle in there]
        able.sort(
            key=lambda service: (service.settings.cost_s + HANDING_OVER_S * (service.vehicle != me), service.name)
        )
        return tuple(service.name for service in able)

    def _fitting(self, requires: str, me: str, facts: FactsLike) -> Collection[str]:
        """Names of the services that are of the class and work; each status is looked up, since plans rest on it."""
        statuses = {name: facts.get(("serviceStatus", name)) for name in self.services}
        unsaid = {name for name, service in self.services.items() if service.vehicle == me and statuses[name] is None}
        if not self.inference:
            told = {name for name, service in self.services.items() if service.settings.capability == requires}
            return told & (unsaid | {name for name, status in statuses.items() if status == AVAILABLE})
        working = {*(facts.get(("instances", AVAILABLE_SERVICE)) or ()), *unsaid}
        return working.intersection(facts.get(("instances", requires)) or ())
