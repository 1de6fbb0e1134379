"""The sensors of vehicles, made of their settings, and the tables that they and a mission write."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from remoras.database import VehicleData
from remoras.errors import PluginError
from remoras.mission import Mission
from remoras.plugins import faults_of
from remoras.recorder import Recorder, Table
from remoras.run_log import DELIVERIES, UNSAID
from remoras.sensor import Sensor


def sensors_of(data: VehicleData) -> dict[str, Sensor]:
    """The sensors of a vehicle by name, made anew.

    Raises:
        PluginError: one cannot be made, or lacks a part of the seam.
    """
    made: dict[str, Sensor] = {}
    for settings in data.sensors:
        where = f"sensor {settings.name} of {data.name}"
        try:
            sensor = settings.make(data)
        except Exception as error:  # it may be somebody else's class
            raise PluginError(f"{where}: make(data) raised {type(error).__name__}: {error}") from error
        faults = list(faults_of(sensor, Sensor, ("table", "sense")))
        if not faults and not isinstance(sensor.table, Table | None):
            faults = [f"table is {type(sensor.table).__name__}; expected a remoras.Table, or None if it writes none"]
        if faults:
            raise PluginError(f"{where}: {'; '.join(faults)}")
        made[settings.name] = sensor
    return made


def recorder_of_mission(mission: Mission, sensors: Sequence[Mapping[str, Sensor]]) -> Recorder:
    """A recorder with the tables of the mission and of the sensors of each vehicle, which may have two packets on their
    way."""
    tables = [sensor.table for of_one in sensors for sensor in of_one.values() if sensor.table is not None]
    return Recorder([*mission.tables, *tables, DELIVERIES, UNSAID], 2 * len(sensors))
