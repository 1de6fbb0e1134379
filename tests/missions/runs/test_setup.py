"""The setup of a run: resolved once, frozen, and shared by any number of runs without a trace."""

from pathlib import Path
from typing import Any

import pytest
from small_mission import SMALL

from missions.errors import ConfigurationError
from missions.runs.assembly import actual, assemble
from missions.runs.setup import Setup, resolved, sensors_of
from missions.scenarios import Scenario, load
from remoras.errors import PluginError
from remoras.fleet import Fleet

SECONDS_S = 200.0


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    file = tmp_path_factory.mktemp("setup") / "pond.toml"
    file.write_text(SMALL, encoding="utf-8")
    return load(str(file), [("--set", f"scenario.duration_s={SECONDS_S}"), ("--set", "uncertainty.speed_spread=0.1")])


@pytest.fixture(scope="module")
def pond(scenario: Scenario) -> Setup:
    return resolved(scenario)


def rows_of(fleet: Fleet) -> dict[str, list[Any]]:
    fleet.run()
    rows = {name: list(fleet.recorder.rows(name)) for name in fleet.recorder.tables}
    fleet.close()
    return rows


# Resolved once ------------------------------------------------------------------------------------


def test_runs_of_one_setup_are_alike_and_leave_no_trace_in_it(pond: Setup, scenario: Scenario) -> None:
    """Two runs one after the other, two at the same time, and one of a setup of its own."""
    first, second = rows_of(assemble(pond, 3)), rows_of(assemble(pond, 3))
    fleets = assemble(pond, 3), assemble(pond, 3)
    while any(fleet.now_s < SECONDS_S for fleet in fleets):
        for fleet in fleets:
            fleet.step()
    at_once = [{name: list(fleet.recorder.rows(name)) for name in fleet.recorder.tables} for fleet in fleets]
    for fleet in fleets:
        fleet.close()
    assert first == second == rows_of(assemble(resolved(scenario), 3))
    assert at_once[0] == at_once[1]
    assert at_once[0]["packets"] == first["packets"]
    assert first["packets"]
    assert first["coverage"]
    assert rows_of(assemble(pond, 4))["packets"] != first["packets"]  # the seed is of the run


# What follows from a scenario ---------------------------------------------------------------------


def test_a_vehicle_is_as_fast_as_it_really_is_and_believed_to_be_as_its_data_say(pond: Setup) -> None:
    fleet = assemble(pond, 2)
    for vehicle in fleet.vehicles:
        known = pond.database[vehicle.name]
        assert vehicle.data == known
        assert vehicle.functional.data == actual(pond, known, 2) != known
    fleet.close()


def test_a_sensor_that_cannot_be_made_is_named_with_its_vehicle(pond: Setup, monkeypatch: pytest.MonkeyPatch) -> None:
    data = pond.database["Diver"]
    monkeypatch.setattr(type(data.sensors[0]), "make", lambda self, data: object())
    with pytest.raises(PluginError, match=r"sensor mapping of Diver: lacks table, sense of remoras\.sensor\.Sensor"):
        sensors_of(data)


def test_a_group_that_nobody_comes_to_lead_is_a_fault(tmp_path: Path) -> None:
    """The Skipper must also be Scout, a role that is not played before the mission; that is one fault, told once."""
    file = tmp_path / "pond.toml"
    text = SMALL.replace("head = true", 'head = true\n  played_by = "Team.Scout"')
    file.write_text(text.replace('["Skipper"]', '["Skipper", "Scout"]'), encoding="utf-8")
    scenario = load(str(file))
    with pytest.raises(
        ConfigurationError, match=r"group\.Team\.role\.Skipper: nobody came to play it before"
    ) as caught:
        resolved(scenario)
    assert len(caught.value.faults) == 1


def test_a_job_that_vehicles_without_the_social_layer_alone_are_able_to_do_needs_a_head_to_give_it_out(
    tmp_path: Path,
) -> None:
    """The Diver alone can do the jobs."""
    file = tmp_path / "pond.toml"
    file.write_text(SMALL.replace('name = "Diver"', 'name = "Diver"\nsocial_layer = false'), encoding="utf-8")
    resolved(load(str(file), [("--set", "strategy.name='central'")]))
    auctioned = load(str(file), [("--set", "strategy.name='contract-net'")])
    with pytest.raises(ConfigurationError, match=r"role\..*\.job.*contract-net .* Diver has none: set social_layer"):
        resolved(auctioned)
