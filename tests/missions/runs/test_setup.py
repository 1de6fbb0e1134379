"""Setup of a run: resolved once, immutable, shared by any number of runs."""

from pathlib import Path
from typing import Any

import pytest
from small_mission import SMALL
from small_mission import pond as pond_of

from missions.errors import ConfigurationError
from missions.runs.assembly import actual, assemble
from missions.runs.setup import Setup, resolved
from missions.scenarios import Scenario, load
from remoras.fleet.fleet import Fleet
from remoras.stepped import RunSoFar

SECONDS_S = 200.0


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    settings = (f"scenario.duration_s={SECONDS_S}", "uncertainty.speed_spread=0.1")
    return pond_of(tmp_path_factory.mktemp("setup"), SMALL, *settings)


@pytest.fixture(scope="module")
def pond(scenario: Scenario) -> Setup:
    return resolved(scenario)


def rows_of(fleet: Fleet) -> dict[str, list[Any]]:
    fleet.run()
    rows = {name: list(fleet.recorder.rows(name)) for name in fleet.recorder.tables}
    fleet.close()
    return rows


# Resolved once ------------------------------------------------------------------------------------


def test_runs_of_one_setup_are_equal_and_do_not_change_it(pond: Setup, scenario: Scenario) -> None:
    """Two runs in sequence, two interleaved, and one with a new setup."""
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


def test_vehicle_has_its_true_speed_but_known_data_are_nominal(pond: Setup) -> None:
    fleet = assemble(pond, 2)
    for vehicle in fleet.vehicles:
        known = pond.database[vehicle.name]
        assert vehicle.data == known
        assert vehicle.functional.data == actual(pond, known, 2) != known
    fleet.close()


def test_group_without_possible_head_is_one_fault(tmp_path: Path) -> None:
    """The Skipper must also be Scout, which is not played before the mission; this is one fault, reported once."""
    text = SMALL.replace("head = true", 'head = true\n  played_by = "Team.Scout"')
    scenario = pond_of(tmp_path, text.replace('["Skipper"]', '["Skipper", "Scout"]'))
    with pytest.raises(
        ConfigurationError, match=r"group\.Team\.role\.Skipper: no vehicle is assigned to it before"
    ) as caught:
        resolved(scenario)
    assert len(caught.value.faults) == 1


def test_job_only_for_vehicles_without_social_layer_needs_a_head(
    tmp_path: Path,
) -> None:
    """The Diver alone can do the jobs."""
    text = SMALL.replace('name = "Diver"', 'name = "Diver"\nsocial_layer = false')
    resolved(pond_of(tmp_path, text, "strategy.name='central'"))
    auctioned = pond_of(tmp_path, text, "strategy.name='contract-net'")
    with pytest.raises(ConfigurationError, match=r"role\..*\.job.*contract-net .* Diver has none: set social_layer"):
        resolved(auctioned)


SHORT = [("--set", "scenario.duration_s=120"), ("--per", "channel.per=0.6")]


def started() -> RunSoFar:
    setup = resolved(load("mapping-rendezvous", SHORT))
    return RunSoFar(setup.scenario, 3, assemble(setup, 3))


def test_packet_row_appears_after_its_last_arrival() -> None:
    run = started()
    n_held_back = 0
    while run.fleet.running:
        run.fleet.step()
        if not run.fleet.running:
            break
        assert run.summary["is_underway"] is True
        packets = run.rows("packets")
        assert all(max([row["end_s"], *row["arrivals_s"]]) < run.fleet.now_s for row in packets)
        sent = run.fleet.recorder.rows("packets")
        assert 0 <= len(sent) - len(packets) <= 2  # a slot is 1.8 s, and the way to the farthest less than another
        n_held_back += len(sent) > len(packets)
    assert n_held_back > 0
    crashed = RunSoFar(run.scenario, 3, run.fleet, "crashed").summary
    assert (crashed["is_underway"], crashed["reason"]) == (False, "crashed")
