"""Sensors of a vehicle: switching, faults and observations per tick."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Any, NamedTuple

from remoras.errors import PluginError
from remoras.plugins import broken_promise
from remoras.recorder import Table
from remoras.sensor import Observation, Pose, Sensor

OBSERVATIONS = "a list of Observation"


class Sensed(NamedTuple):
    """Observation with the name of its sensor and the table of its row."""

    sensor: str
    table: Table | None
    observation: Observation

    def table_of(self, vehicle: str) -> Table:
        """Return the table of the row; raise PluginError if missing or not fitting."""
        row = self.observation.row
        if self.table is None:
            raise PluginError(
                f"sensor {self.sensor} of {vehicle}: its observation has the row {row}, but its table is None; "
                "declare the table"
            )
        if len(row) + 2 != len(self.table.columns):
            names = ", ".join(self.table.column_names[2:])
            raise PluginError(
                f"sensor {self.sensor} of {vehicle}: its row {row} does not fit the columns {names} of its table "
                f"{self.table.name}"
            )
        return self.table


class Sensing:
    """Switch and read the sensors of one vehicle.

    ``looking`` names the sensors that were on and worked in the last motion tick. ``misses`` returns whether a sensor
    yields nothing at a time (s).
    """

    def __init__(self, vehicle: str, sensors: Mapping[str, Sensor], world: Any) -> None:
        self.looking: tuple[str, ...] = ()
        self._vehicle = vehicle
        self._sensors = sensors
        self._world = world
        self.misses: Callable[[str, float], bool] | None = None
        self._dead: frozenset[str] = frozenset()
        self._on: list[tuple[str, Sensor]] = []
        self._working: list[tuple[str, Sensor]] = []
        self._working_names: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all sensors of the vehicle."""
        return tuple(self._sensors)

    def impair(self, dead: frozenset[str]) -> None:
        """Set the failed sensors, which stay on but yield nothing."""
        self._dead = dead
        self._working = [(name, sensor) for name, sensor in self._on if name not in dead]
        self._working_names = tuple(name for name, _ in self._working)

    def switch_on(self, names: Collection[str]) -> tuple[str, ...]:
        """Switch on exactly these sensors; return those on, working or not."""
        self._on = [(name, sensor) for name, sensor in self._sensors.items() if name in names]
        self.impair(self._dead)
        return tuple(name for name, _ in self._on)

    def look(self, pose: Pose, now_s: float) -> list[Sensed]:
        """Return the current observations; raise PluginError on wrong sensor results."""
        working, self.looking = self._working, self._working_names
        if (misses := self.misses) is not None:
            working = [named for named in working if not misses(named[0], now_s)]
            self.looking = tuple(name for name, _ in working)
        sensed: list[Sensed] = []
        for name, sensor in working:
            try:
                returned = sensor.sense(pose, self._world, now_s)
                if not returned and returned is not None:  # nearly always empty
                    continue
                observations = tuple(returned)
            except Exception as error:
                raise broken_promise(self._where(name), "sense", OBSERVATIONS, error) from error
            if not all(isinstance(observation, Observation) for observation in observations):
                raise broken_promise(self._where(name), "sense", OBSERVATIONS, observations)
            sensed += [Sensed(name, sensor.table, observation) for observation in observations]
        return sensed

    def _where(self, name: str) -> str:
        return f"sensor {name} of {self._vehicle}"
