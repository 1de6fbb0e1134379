"""Conformance test of the mission in its own scenario."""

from pathlib import Path

from buoys import BuoyMission

from missions.scenarios import load
from remoras.testing import check_mission


def test_buoys():
    check_mission(BuoyMission, load(str(Path(__file__).with_name("buoys.toml"))))
