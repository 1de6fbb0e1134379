"""The vehicle: processing of observations, independent of the mission."""

import math
from collections.abc import Iterator, Sequence

import pytest

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.errors import PluginError
from remoras.fleet.fleet import Fleet
from remoras.fleet.vehicle import Vehicle
from remoras.functional.layer import Sensed
from remoras.motion.avoidance import Neighbour
from remoras.recorder import TIME, VEHICLE, Column, Table
from remoras.sensor import SELF, Observation

SONAR = Table("contacts", (TIME, VEHICLE, Column("range_m", "float", "m")))
WRECK = Observation(((SELF, "location", (10.0, 20.0)),), (12.5,), "ObjectOfInterest")


@pytest.fixture
def fleet(monkeypatch: pytest.MonkeyPatch) -> Iterator[Fleet]:
    """The shipped mission, in which a vehicle may find one object and has a table for it."""
    setup = resolved(load("mapping-rendezvous"))
    monkeypatch.setattr(type(setup.mission), "instances_found_per_vehicle", 1)
    monkeypatch.setattr(type(setup.mission), "tables", (SONAR,))
    assembled = assemble(resolved(setup.scenario), seed=1)
    yield assembled
    assembled.close()


def sees(vehicle: Vehicle, *observations: Observation) -> None:
    """Let the vehicle live through a tick in which its sensors see this."""

    def sense(now_s: float, neighbours: Sequence[Neighbour]) -> list[Sensed]:
        return [Sensed("sonar", SONAR, one) for one in observations]

    vehicle.functional.sense = sense  # type: ignore[method-assign]
    vehicle.step(0.0, 0.0, ())


def items(fleet: Fleet, name: str) -> list[str]:
    return [row[2] for row in fleet.recorder.knowledge if (row[1], row[4]) == (name, "observed")]


def test_an_observation_is_recorded_stored_and_sent(fleet: Fleet) -> None:
    """One with facts becomes one item, whatever their number; one with a row only becomes a row only."""
    vehicle = fleet.vehicles[1]
    before = items(fleet, vehicle.name)
    facts = (("left", "mappedCell", 3), ("left", "mappedCell", 4))
    sees(vehicle, Observation(facts), Observation(row=(3.0,)), Observation())
    assert len(items(fleet, vehicle.name)) == len(before) + 1
    assert fleet.recorder.rows("contacts") == [(0.0, vehicle.name, 3.0)]
    assert vehicle.beliefs.get(("mappedCell", "left")) == 4


@pytest.mark.parametrize(
    ("observations", "says"),
    [
        ([WRECK, WRECK], "created its 1 instances; .*instances_found_per_vehicle"),
        ([Observation(((SELF, "location", (0.0, math.nan)),), found="ObjectOfInterest")], "location of [^;]*$"),
        ([Observation((("lefft", "mappedCell", 1),))], "no .*instance is named 'lefft'"),
        ([Observation((("left", "mappedCel", 1),))], "no attribute is named 'mappedCel'"),
        ([Observation((("left", "mappedCell", "one"),))], "mappedCell"),
        ([Observation(((SELF, "location", (0.0, 0.0)),))], "SELF .* found"),
    ],
)
def test_an_observation_that_cannot_be_recorded_is_one_clear_message(fleet, observations, says) -> None:
    vehicle = fleet.vehicles[1]
    with pytest.raises(
        PluginError, match=f"sensor sonar of {vehicle.name}: its observation cannot be recorded: .*{says}"
    ):
        sees(vehicle, *observations)
