"""Jobs of the mission: surveys of blocks, and the recovery of the chosen object."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self, cast

from exchange.arithmetic import distance
from missions.trident.services import FAILED, EffectorSettings, FinderSettings, SurveyorSettings
from missions.trident.site import SeabedBlock
from remoras.beliefs import Key, Known
from remoras.database import VehicleData
from remoras.htn import FactsLike
from remoras.work import Outlook, Point

SHARE_USED = 0.8
"""Lane spacing as share of the sensor width; the overlap covers position errors."""
RECOVERY_S = 400.0
"""Expected duration of a recovery on site, fitted to runs without faults."""


def surveyor(data: VehicleData) -> SurveyorSettings | None:
    """First surveying module of a vehicle."""
    return data.sensor(SurveyorSettings)


def survey_speed_mps(data: VehicleData, settings: SurveyorSettings) -> float:
    """Survey speed, limited by the module."""
    return min(data.survey_speed_mps, data.speed_factor * settings.speed_limit_mps)


def is_to_be_surveyed(facts: FactsLike, block: str, recovery: str) -> bool:
    """Return True unless the block is known to be surveyed as often as requested."""
    if facts.get(("surveyedBy", block)) is None:
        return True
    return int(facts.get(("surveyedAgain", block), 0)) < int(facts.get(("surveysAgain", recovery), 0))


class OnServices:
    """Base of jobs on reporting ``services``, some ``failed``; see ``remoras.work.HinderedJob``."""

    services: tuple[str, ...]
    failed: frozenset[str]

    def is_able(self, data: VehicleData) -> bool:
        """Return True for a vehicle with working services for the job."""
        raise NotImplementedError

    def is_ever_able(self, data: VehicleData) -> bool:
        """Return True for a vehicle that is able while its services work."""
        return self._with(frozenset()).is_able(data)

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
        return self if failed == self.failed else self._with(failed)

    def _with(self, failed: frozenset[str]) -> Self:
        return cast(Self, replace(cast(Any, self), failed=failed))  # a dataclass, as both jobs are


@dataclass(frozen=True)
class BlockSurvey(OnServices):
    """Survey of a block: a ``remoras.work.Job``; ``vehicles`` may do it or request it."""

    block: SeabedBlock
    vehicles: frozenset[str]
    needs: tuple[str, ...] = ()
    services: tuple[str, ...] = ()
    failed: frozenset[str] = frozenset()

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
        """Return True for a vehicle with a service for it, or one that may request it."""
        if self.failed and self.failed.issuperset(self.services):
            return False
        return data.name in self.vehicles and surveyor(data) is not None

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """Return the outlook after travel and all lanes of the first surveying module."""
        settings = surveyor(data) if self.is_able(data) else None
        if settings is None:
            return None
        way_s = distance(outlook.position_m, self.place_m) / data.transit_speed_mps
        block = self.block
        size_m2 = (block.east_m - block.west_m) * (block.north_m - block.south_m)
        lanes_s = size_m2 / (2.0 * SHARE_USED * settings.reach_m * survey_speed_mps(data, settings))
        return Outlook(outlook.free_s + way_s + lanes_s, self.place_m)


@dataclass(frozen=True)
class RecoveryJob(OnServices):
    """Recovery of the chosen object, if not ``exhausted``: a ``remoras.work.Job``."""

    name: str
    place_m: Point
    needs: tuple[str, ...]
    services: tuple[str, ...] = ()
    failed: frozenset[str] = frozenset()
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
        found, exhausted = super().left(facts), bool(facts.get(("isExhausted", self.name)))
        return found if exhausted == self.exhausted else replace(found, exhausted=exhausted)

    def is_ever_able(self, data: VehicleData) -> bool:
        """Return True for a vehicle that is able while services work and a candidate remains."""
        return replace(self, failed=frozenset(), exhausted=False).is_able(data)

    def is_able(self, data: VehicleData) -> bool:
        """Return True for a vehicle with working finder and both effectors."""
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
