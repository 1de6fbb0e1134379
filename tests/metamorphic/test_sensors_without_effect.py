"""Sensors for something else than the work neither pass for it nor hide that the sensor for it has failed."""

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


@pytest.mark.slow
def test_a_working_classifier_does_not_hide_that_the_mapping_sensor_has_failed() -> None:
    """The more works, the earlier the mission ends: what the classifier sees is no mapping."""
    times_s = []
    for dead in (', sensor = "mapping"', ""):
        finished = flown(
            "mapping-objects", f'fault=[{{vehicle = "AUV01", kind = "sensor", at_s = 300.0{dead}}}]', seed=3
        )
        assert finished.completed
        times_s.append(finished.end_s)
    assert times_s[0] <= times_s[1]
