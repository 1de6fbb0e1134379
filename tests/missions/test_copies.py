"""Fleets enlarged by copies of a vehicle: properties of copies, refusals."""

import itertools
import math
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from small_mission import SMALL, faults_of, line_of, pond

from missions.scenarios import Scenario, VehicleTable, load
from missions.scenarios.fleet import MAX_VEHICLES
from remoras.motion.separation import SAME_DEPTH_M

FLEET = '[fleet]\nsize = 6\ncopies_of = "Diver"\n\n'
BOATS = FLEET.replace("Diver", "Boat")


def shipped_at(size: int, *settings: str) -> Scenario:
    return load("mapping-rendezvous", [("--set", setting) for setting in (f"fleet.size={size}", *settings)])


def clear_of_each_other(one: VehicleTable, other: VehicleTable, spacing_m: float) -> bool:
    return abs(one.depth_m - other.depth_m) > SAME_DEPTH_M or math.dist(one.start_m, other.start_m) > 0.99 * spacing_m


# What a copy is -----------------------------------------------------------------------------------


@settings(max_examples=25)
@example(size=MAX_VEHICLES, spacing_m=5.0)
@given(size=st.integers(4, 64), spacing_m=st.sampled_from([5.0, 10.0, 40.0]))
def test_copies_differ_only_in_name_slot_depth_and_start(size: int, spacing_m: float) -> None:
    scenario = shipped_at(size, f"fleet.spacing_m={spacing_m}")
    listed, copies = scenario.vehicle[:4], scenario.vehicle[4:]
    assert listed == load("mapping-rendezvous").vehicle
    assert [copy.name for copy in copies] == [f"AUV{number:02d}" for number in range(3, size - 1)]
    assert [copy.slot for copy in copies] == list(range(4, size))
    own = {"name", "slot", "depth_m", "start_m"}
    assert all(copy.model_dump(exclude=own) == listed[3].model_dump(exclude=own) for copy in copies)
    assert all(0.0 < copy.depth_m <= copy.depth_limit_m for copy in copies)
    (x_min, x_max), (y_min, y_max) = scenario.world.x_m, scenario.world.y_m
    assert all(x_min <= copy.start_m[0] <= x_max and y_min <= copy.start_m[1] <= y_max for copy in copies)
    pairs = [*itertools.combinations(copies, 2), *itertools.product(copies, listed)]
    assert all(clear_of_each_other(one, other, spacing_m) for one, other in pairs)


def test_without_layers_copies_stay_at_the_depth_of_their_original_and_start_apart() -> None:
    scenario = shipped_at(16, "fleet.layers=false")
    divers = [vehicle for vehicle in scenario.vehicle if vehicle.name != "ASV00"]
    assert {vehicle.depth_m for vehicle in divers} == {20.0}
    assert min(math.dist(a.start_m, b.start_m) for a, b in itertools.combinations(divers, 2)) == 10.0


def test_copies_get_the_next_free_names_and_slots(tmp_path: Path) -> None:
    """Boat owns slot 1 and Diver slot 0; Diver2 is an area here, and the numbers are no wider than they were."""
    scenario = pond(tmp_path, FLEET + SMALL.replace('"north bank"', '"Diver2"'))
    assert [(vehicle.name, vehicle.slot) for vehicle in scenario.vehicle[2:]] == [
        ("Diver3", 2),
        ("Diver4", 3),
        ("Diver5", 4),
        ("Diver6", 5),
    ]


def test_fleet_size_met_or_not_given_adds_no_copies(tmp_path: Path) -> None:
    as_listed = pond(tmp_path)
    for fleet in ("size = 2", 'copies_of = "Diver"', 'copies_of = "Gone"', ""):  # nothing is to be copied
        assert pond(tmp_path, f"[fleet]\n{fleet}\n\n" + SMALL) == as_listed


# What is refused ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fleet", "key", "given", "says"),
    [
        ("size = 1", "fleet.size", "1", "greater than or equal to 2"),
        ("size = 6", "fleet.copies_of", "", "missing: which vehicle the 4 to add are copies of; allowed: Boat, Diver"),
        ('size = 2\ncopies_of = "Dive"', "fleet.copies_of", '"Dive"', "allowed: Boat, Diver; did you mean 'Diver'?"),
    ],
)
def test_fault_of_the_fleet_is_reported_once_with_its_line(
    tmp_path: Path, fleet: str, key: str, given: str, says: str
) -> None:
    [fault] = faults_of(tmp_path, f"[fleet]\n{fleet}\n\n" + SMALL)
    assert (fault.key, fault.given) == (key, given)
    assert says in fault.allowed
    assert fault.line == (line_of(f"[fleet]\n{fleet}", key.split(".")[1]) if given else 1)


def test_world_without_room_for_copies_is_refused(tmp_path: Path) -> None:
    """Between -50 m and 250 m around (0, 0) a lattice of 200 m has 3 more places."""
    [fault] = faults_of(tmp_path, BOATS + "spacing_m = 200.0\n\n" + SMALL)
    assert (fault.key, fault.allowed.split(" that")[0]) == ("fleet.spacing_m", "the world has room for 3 of 4 copies")
