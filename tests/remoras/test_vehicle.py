"""The vehicle: what it makes of observations, and what it does without its mission asking for it."""

from collections.abc import Iterator, Sequence
from typing import Any

import pytest

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.avoidance import Neighbour
from remoras.errors import PluginError
from remoras.fleet import Fleet
from remoras.functional.sensing import Sensed
from remoras.functional.vital import VITAL_SETS
from remoras.recorder import TIME, VEHICLE, Column, Table
from remoras.sensor import SELF, Observation
from remoras.vehicle import Vehicle

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


def test_an_observation_is_recorded_written_and_told(fleet: Fleet) -> None:
    """One with facts becomes one item, whatever their number; one with a row only becomes a row only."""
    vehicle = fleet.vehicles[1]
    before = items(fleet, vehicle.name)
    facts = (("left", "mappedCell", 3), ("left", "mappedCell", 4))
    sees(vehicle, Observation(facts), Observation(row=(3.0,)), Observation())
    assert len(items(fleet, vehicle.name)) == len(before) + 1
    assert fleet.recorder.rows("contacts") == [(0.0, vehicle.name, 3.0)]
    assert vehicle.beliefs.get(("mappedCell", "left")) == 4


def test_what_a_sensor_finds_becomes_an_instance(fleet: Fleet) -> None:
    vehicle = fleet.vehicles[1]
    sees(vehicle, WRECK)
    model = vehicle.beliefs.model
    uid = len(model.common_instances) + vehicle.data.node  # one for each vehicle
    assert vehicle.beliefs.get(("location", f"ObjectOfInterest-{uid}")) == (10.0, 20.0)
    assert fleet.recorder.rows("contacts") == [(0.0, vehicle.name, 12.5)]


@pytest.mark.parametrize(
    ("observations", "says"),
    [
        ([WRECK, WRECK], "created its 1 instances"),
        ([Observation((("lefft", "mappedCell", 1),))], "no .*instance is named 'lefft'"),
        ([Observation((("left", "mappedCel", 1),))], "no attribute is named 'mappedCel'"),
        ([Observation((("left", "mappedCell", "one"),))], "mappedCell"),
        ([Observation(((SELF, "location", (0.0, 0.0)),))], "named ''"),
    ],
)
def test_an_observation_that_cannot_be_recorded_is_one_clear_message(
    fleet: Fleet, observations: list[Observation], says: str
) -> None:
    vehicle = fleet.vehicles[1]
    with pytest.raises(
        PluginError, match=f"sensor sonar of {vehicle.name}: its observation cannot be recorded: .*{says}"
    ):
        sees(vehicle, *observations)


def test_what_is_vital_stands_before_what_a_mission_asks_for(fleet: Fleet) -> None:
    for vehicle in fleet.vehicles:
        assert vehicle.executive.sets[: len(VITAL_SETS)] == VITAL_SETS
        assert all(one.objective is not None for one in vehicle.executive.sets[len(VITAL_SETS) :])


def test_a_vehicle_without_energy_hears_and_says_nothing(fleet: Fleet) -> None:
    vehicle = fleet.vehicles[1]
    vehicle.functional.transmitted(10**18)
    assert not vehicle.is_alive
    assert vehicle.speak(0.0) is None
    assert vehicle.hear(b"", 0.0) is None
    assert not vehicle.consult(0.0)


# What a truth sees --------------------------------------------------------------------------------


def test_a_view_shows_the_vehicle_and_lets_nothing_be_changed(fleet: Fleet) -> None:
    view, vehicle = fleet.view.vehicles[1], fleet.vehicles[1]
    assert (view.name, view.position_m, view.is_alive) == (vehicle.name, (0.0, 0.0), True)
    assert view.organisation is vehicle.social.organisation
    assert view.leads("Operational")
    assert not view.has_planned("Operational")
    for part in ("name", "position_m", "organisation", "performed", "finished", "issued"):
        with pytest.raises(AttributeError):
            setattr(view, part, None)


def test_what_is_performed_is_the_same_object_until_the_vehicle_decides_anew(fleet: Fleet) -> None:
    view: Any = fleet.view.vehicles[0]
    fleet.step()
    first = view.performed
    assert "SendingInfluenceSignals" in first
    assert view.performed is first
    while view.performed is first:
        fleet.step()
    assert fleet.now_s > 0.0


def test_every_vehicle_consults_at_the_end_of_every_frame(fleet: Fleet) -> None:
    schedule, consulted = resolved(load("mapping-rendezvous")).schedule, []
    fleet.consulted.append(lambda vehicle: consulted.append((fleet.now_s, vehicle.name)))
    ends_s = [schedule.frame_start_s(frame) for frame in (1, 2, 3)]
    while fleet.now_s <= ends_s[-1]:
        fleet.step()
    assert consulted == [(at_s, vehicle.name) for at_s in ends_s for vehicle in fleet.vehicles]
