"""The jobs: blocks to be surveyed, and the recovery of what is chosen."""

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
"""Lanes are so much nearer to each other than a module sees: who errs about its place leaves fewer gaps."""
RECOVERY_S = 400.0
"""What a recovery is expected to take beside the way there, fitted to runs without faults."""


def surveyor(data: VehicleData) -> SurveyorSettings | None:
    """The first module of a vehicle that surveys."""
    return data.sensor(SurveyorSettings)


def survey_speed_mps(data: VehicleData, settings: SurveyorSettings) -> float:
    """How fast a vehicle surveys with a module."""
    return min(data.survey_speed_mps, data.speed_factor * settings.speed_limit_mps)


def is_to_be_surveyed(facts: FactsLike, block: str, recovery: str) -> bool:
    """True of a block that is not known to be surveyed as often as is called for.

    Args:
        facts: of a vehicle.
        block, recovery: names of jobs.
    """
    if facts.get(("surveyedBy", block)) is None:
        return True
    return int(facts.get(("surveyedAgain", block), 0)) < int(facts.get(("surveysAgain", recovery), 0))


class OnServices:
    """What both jobs share: services on board do them, and say whether they work; see ``remoras.work.HinderedJob``.

    Attributes:
        services: that say whether they work; failed: of these, that say that they do not.
    """

    services: tuple[str, ...]
    failed: frozenset[str]

    def is_able(self, data: VehicleData) -> bool:
        """True for a vehicle with services that do the job and are not said to have failed."""
        raise NotImplementedError

    def is_ever_able(self, data: VehicleData) -> bool:
        """True for a vehicle that is able while its services work."""
        return self._with(frozenset()).is_able(data)

    @property
    def rests_on(self) -> tuple[Key, ...]:
        """What the services say of themselves."""
        return tuple(("serviceStatus", name) for name in self.services)

    @property
    def hindrances(self) -> tuple[str, ...]:
        """The services that have failed."""
        return tuple(f"{name} has failed" for name in sorted(self.failed))

    def left(self, facts: Known) -> Self:
        """With the services that have failed."""
        failed = frozenset(name for name in self.services if facts.get(("serviceStatus", name)) == FAILED)
        return self if failed == self.failed else self._with(failed)

    def _with(self, failed: frozenset[str]) -> Self:
        return cast(Self, replace(cast(Any, self), failed=failed))  # a dataclass, as both jobs are


@dataclass(frozen=True)
class BlockSurvey(OnServices):
    """The survey of a block: a ``remoras.work.Job``.

    Attributes:
        block: of the seabed.
        vehicles: that are able to see it done.
        needs: jobs that must be done before.
        services: that survey, and say whether they work; failed: of these, that say that they do not.
    """

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
        """Middle of the block."""
        return self.block.centre_m

    @property
    def done(self) -> Key:
        """Somebody has surveyed it."""
        return "surveyedBy", self.name

    def is_able(self, data: VehicleData) -> bool:
        """True for a vehicle that has a service for it, or may ask another for one."""
        if self.failed and self.failed.issuperset(self.services):
            return False
        return data.name in self.vehicles and surveyor(data) is not None

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """Its way, and the length of all lanes of the first module that surveys."""
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
    """The recovery of the object that is chosen once all blocks are surveyed: a ``remoras.work.Job``.

    Attributes:
        name: of its instance.
        place_m: middle of the site, until more is known.
        needs: names of the blocks.
        services: that have to be on board, and say whether they work; failed: of these, that say that they do not.
        exhausted: no candidate is left that may be the target, or nobody to choose it.
    """

    name: str
    place_m: Point
    needs: tuple[str, ...]
    services: tuple[str, ...] = ()
    failed: frozenset[str] = frozenset()
    exhausted: bool = False

    @property
    def done(self) -> Key:
        """Somebody has recovered it, as far as known."""
        return "recoveredBy", self.name

    @property
    def rests_on(self) -> tuple[Key, ...]:
        """What the services say of themselves, and whether a candidate is left."""
        return (*super().rests_on, ("isExhausted", self.name))

    @property
    def hindrances(self) -> tuple[str, ...]:
        """The services that have failed; that no choice is left."""
        return (
            *super().hindrances,
            *(("no candidate is left that may be the target, or nobody to choose it",) if self.exhausted else ()),
        )

    def left(self, facts: Known) -> Self:
        """With the services that have failed, and without a candidate once none is left."""
        found, exhausted = super().left(facts), bool(facts.get(("isExhausted", self.name)))
        return found if exhausted == self.exhausted else replace(found, exhausted=exhausted)

    def is_ever_able(self, data: VehicleData) -> bool:
        """True for a vehicle that is able while its services work and a candidate is left."""
        return replace(self, failed=frozenset(), exhausted=False).is_able(data)

    def is_able(self, data: VehicleData) -> bool:
        """True for a vehicle with modules to find, to hold and to handle it that are not said to have failed."""
        if self.exhausted:
            return False
        working = [sensor for sensor in data.sensors if f"{data.name} {sensor.name}" not in self.failed]
        does = {sensor.does for sensor in working if isinstance(sensor, EffectorSettings)}
        return len(does) == 2 and any(isinstance(sensor, FinderSettings) for sensor in working)

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """Its way, and what a recovery usually takes."""
        if not self.is_able(data):
            return None
        return outlook.stayed(self.place_m, RECOVERY_S, data)
