"""Scenario of two vehicles and one area, as text, and the shipped one as tables to be varied."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from varied import Varied

from missions.document import Document, validated
from missions.errors import ConfigurationError, ConfigurationFault
from missions.runs.run import Run
from missions.runs.run import run as run_scenario
from missions.scenarios import Scenario, load
from remoras.mission import Mission

Raw = dict[str, Any]

SMALL = """\
[scenario]
name = "pond"
mission = "missions.mapping:MappingMission"
duration_s = 1200.0

[world]
x_m = [-50.0, 250.0]
y_m = [-50.0, 250.0]
cell_m = 10.0

[communication]
modem = "s2c-18-34"
range_m = 500.0
policy = "mps-ack-repeat"

[communication.needs]
playsRole = 50
hasMission = 50
objectiveExploring = 50
objectiveMapping = 50
objectivePositioning = 50
objectiveRendezVous = 50
objectiveMissionGathering = 50
gatheredAt = 20
areaDone = 10
mappedCell = 1
position = 3

[channel]
name = "bernoulli"
per = 0.2

[strategy]
name = "remoras"

[mission]
arrival_radius_m = 15.0
follow_distance_m = 20.0
formation_spacing_m = 10.0
patience_s = 60.0

[mission.importance]
Exploring = 0.6
Mapping = 0.6
MissionGathering = 0.1
RendezVous = 0.3

[[area]]
name = "north bank"
corners_m = [[50.0, 50.0], [150.0, 50.0], [150.0, 100.0], [50.0, 100.0]]

[[rally_point]]
name = "jetty"
position_m = [200.0, 200.0]

[[group]]
name = "Team"
rally_point = "jetty"
mission = "AreaMapping"

  [[group.role]]
  name = "Skipper"
  minimum = 1
  maximum = 1
  head = true
  founding = true

  [[group.role]]
  name = "Hand"
  minimum = 1
  founding = true

  [[group.role]]
  name = "Mapper"

  [[group.role]]
  name = "Scout"
  maximum = 1
  job = "north bank"

[[vehicle]]
name = "Boat"
vehicle_type = "ASV"
slot = 1
start_m = [0.0, 0.0]
transit_speed_mps = 2.0
survey_speed_mps = 1.5
energy_j = 1.0e6
hotel_w = 10.0
drag_w_per_mps3 = 5.0
playable_roles = ["Skipper"]

[[vehicle]]
name = "Diver"
vehicle_type = "AUV"
slot = 0
start_m = [10.0, 0.0]
depth_m = 5.0
depth_limit_m = 30.0
transit_speed_mps = 2.0
survey_speed_mps = 1.5
energy_j = 1.0e6
hotel_w = 10.0
drag_w_per_mps3 = 5.0
playable_roles = ["Hand", "Mapper", "Scout"]

  [vehicle.sensor]
  swath_m = 10.0
  speed_limit_mps = 2.0
"""


CHANNEL = '[channel]\nname = "bernoulli"\nper = 0.2\n'


def with_channel(channel: str) -> str:
    return SMALL.replace(CHANNEL, channel)


def line_of(text: str, wanted: str, occurrence: int = 1) -> int:
    """Number of the line that begins with ``wanted``, for the n-th time, as an editor counts."""
    numbers = [number for number, line in enumerate(text.splitlines(), 1) if line.strip().startswith(wanted)]
    return numbers[occurrence - 1]


def pond(folder: Path, text: str = SMALL, *settings: str) -> Scenario:
    """A text as the scenario of a folder, with keys set."""
    file = folder / "pond.toml"
    file.write_text(text, encoding="utf-8")
    return load(str(file), [("--set", setting) for setting in settings])


def faults_of(folder: Path, text: str, *settings: str) -> tuple[ConfigurationFault, ...]:
    """Faults of a scenario; the message has a line for each."""
    with pytest.raises(ConfigurationError) as caught:
        pond(folder, text, *settings)
    for fault, line in zip(caught.value.faults, str(caught.value).splitlines(), strict=True):
        assert all(part in line for part in (str(folder), fault.key, fault.given, fault.allowed))
    return caught.value.faults


def checked(mission: type[Mission], raw: Raw) -> list[ConfigurationFault]:
    """Faults within tables, and those found by the mission's own check."""
    scenario, malformed = validated(mission.Scenario, raw)
    found = malformed if scenario is None else mission.check(scenario)
    return [replace(fault, line=None) for fault in Document("own.toml", "", raw).located(found)]


def named(entries: list[Raw], name: str) -> Raw:
    return next(entry for entry in entries if entry["name"] == name)


def run_varied(folder: Path, vary: Callable[[Raw], object], *settings: str, seed: int = 1) -> Run:
    """Run the shipped scenario after ``vary`` has changed its tables."""
    shipped = Varied("mapping-rendezvous", "varied.toml")
    raw = shipped.raw()
    vary(raw)
    file = shipped.written(folder, raw)
    return run_scenario(load(str(file), [("--set", setting) for setting in settings]), seed)
