"""The jobs: blocks to be surveyed, and the recovery of what is chosen."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from exchange.arithmetic import distance
from missions.trident.modules import EffectorSettings, SurveyorSettings
from missions.trident.site import SeabedBlock
from remoras.beliefs import Key
from remoras.database import VehicleData
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


@dataclass(frozen=True)
class BlockSurvey:
    """The survey of a block: a ``remoras.work.Job``.

    Attributes:
        block: of the seabed.
        vehicles: that are able to see it done.
        needs: jobs that must be done before.
    """

    block: SeabedBlock
    vehicles: frozenset[str]
    needs: tuple[str, ...] = ()

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
class RecoveryJob:
    """The recovery of the object that is chosen once all blocks are surveyed: a ``remoras.work.Job``.

    Attributes:
        name: of its instance.
        place_m: middle of the site, until more is known.
        needs: names of the blocks.
    """

    name: str
    place_m: Point
    needs: tuple[str, ...]

    @property
    def done(self) -> Key:
        """Somebody has recovered it, as far as known."""
        return "recoveredBy", self.name

    def is_able(self, data: VehicleData) -> bool:
        """True for a vehicle that has modules to hold on and to handle."""
        does: Collection[str] = {sensor.does for sensor in data.sensors if isinstance(sensor, EffectorSettings)}
        return len(does) == 2

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """Its way, and what a recovery usually takes."""
        if not self.is_able(data):
            return None
        way_s = distance(outlook.position_m, self.place_m) / data.transit_speed_mps
        return Outlook(outlook.free_s + way_s + RECOVERY_S, self.place_m)
