"""Conformance test of the mission in its own scenario."""

from pathlib import Path

import buoys

from missions.scenarios import load
from remoras.testing import check_mission


def test_buoys():
    check_mission(buoys.BuoyMission, load(str(Path(buoys.__file__).with_name("buoys.toml"))))
