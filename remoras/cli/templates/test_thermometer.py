"""Conformance test of the sensor: mounted on AUV01, it samples a shipped scenario's world."""

from thermometer import ThermometerSettings

from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.testing import check_sensor


def test_thermometer():
    setup = resolved(load("mapping-rendezvous"))
    n_observations = check_sensor(ThermometerSettings(), setup.database["AUV01"], setup.mission.world(seed=1))
    assert n_observations > 0
