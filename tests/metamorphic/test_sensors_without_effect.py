"""Sensors that only fill a table of their own change no byte of any other table."""

from __future__ import annotations

from typing import Any

import pytest
from recorded import flown

from remoras import TIME, VEHICLE, Column, Observation, Quiet, SensorSettings, Table
from remoras.database import VehicleData
from remoras.sensor import Pose

FAULT = 'fault=[{vehicle = "AUV01", kind = "sensor", sensor = "mapping", at_s = 300.0}]'
OWN = "swath_m = 25.0, speed_limit_mps = 1.3"


class DepthGaugeSettings(SensorSettings):
    def make(self, data: VehicleData) -> DepthGauge:
        return DepthGauge()


class DepthGauge:
    table = Table("depths", (TIME, VEHICLE, Column("depth_m", "float", "m")))

    def __init__(self) -> None:
        self._next_s = 0.0

    def sense(self, pose: Pose, world: Any, now_s: float) -> list[Observation] | Quiet:
        if now_s < self._next_s:
            return Quiet(until_s=self._next_s)
        self._next_s = now_s + 10.0
        return [Observation(row=(pose.depth_m,))]


def tables(*sensors: str) -> dict[str, list[Any]]:
    mounted = ", ".join(f"{{{sensor}}}" for sensor in sensors)
    recorder = flown("mapping-rendezvous", "channel.per=0.5", FAULT, f"vehicle.AUV01.sensor=[{mounted}]").recorder
    return {name: list(recorder.rows(name)) for name in recorder.tables}


@pytest.mark.slow
def test_a_sensor_that_only_fills_its_table_changes_no_other() -> None:
    """Its readings neither count as mapping nor hide that the mapping sensor has failed."""
    measured = tables(OWN, f'type = "{__name__}:DepthGaugeSettings"')
    assert measured.pop("depths")
    assert measured == tables(OWN)
