"""Reports: what vehicles tell of their energy and their sensors, on which it depends what work they are able to do.

Energy is the share of the battery that a vehicle tells in its slots. That its sensors yield nothing where they should
it tells when it notices, and for good: nobody switches them on to see. The optimiser gives nobody work that it cannot
finish on its energy or needs sensors for that are dead; see ``Work.affordable``.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace

from remoras.authority import Request, Rules
from remoras.beliefs import Beliefs
from remoras.database import AUVDatabase, VehicleData
from remoras.organisation import Group

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
