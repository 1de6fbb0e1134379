"""Fleets brought to a size by copies of a vehicle: what a copy is, what is refused, that the mission still works."""

import itertools
import math
import tomllib
from pathlib import Path

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st
from sampling import sampled
from small_mission import SMALL, line_of, shipped_tables

from missions.errors import ConfigurationError, ConfigurationFault
from missions.runs.assembly import assemble
from missions.runs.results import manifest
from missions.runs.run import run as run_scenario
from missions.runs.setup import resolved
from missions.runs.summary import summary
from missions.scenarios import Scenario, VehicleTable, load
from missions.scenarios.copies import LAYER_M, MAX_VEHICLES, with_copies
from remoras.separation import SAME_DEPTH_M

FLEET = '[fleet]\nsize = 6\ncopies_of = "Diver"\n\n'
BOATS = FLEET.replace("Diver", "Boat")


def pond(folder: Path, fleet: str = FLEET, *settings: str, text: str = SMALL) -> Scenario:
    file = folder / "pond.toml"
    file.write_text(fleet + text, encoding="utf-8")
    return load(str(file), [("--set", setting) for setting in settings])


def faults_of(folder: Path, fleet: str, *settings: str, text: str = SMALL) -> tuple[ConfigurationFault, ...]:
    with pytest.raises(ConfigurationError) as caught:
        pond(folder, fleet, *settings, text=text)
    return caught.value.faults


def shipped_at(size: int, *settings: str) -> Scenario:
    return load("mapping-rendezvous", [("--set", setting) for setting in (f"fleet.size={size}", *settings)])


def clear_of_each_other(one: VehicleTable, other: VehicleTable, spacing_m: float) -> bool:
    return abs(one.depth_m - other.depth_m) > SAME_DEPTH_M or math.dist(one.start_m, other.start_m) > 0.99 * spacing_m


# What a copy is -----------------------------------------------------------------------------------


@given(size=st.integers(4, MAX_VEHICLES), spacing_m=st.sampled_from([5.0, 10.0, 40.0]))
def test_copies_are_their_original_but_for_name_slot_depth_and_start(size: int, spacing_m: float) -> None:
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


def test_layers_are_far_enough_apart_to_pass_freely() -> None:
    assert LAYER_M > SAME_DEPTH_M


def test_without_layers_copies_stay_at_the_depth_of_their_original_and_start_apart() -> None:
    scenario = shipped_at(16, "fleet.layers=false")
    divers = [vehicle for vehicle in scenario.vehicle if vehicle.name != "ASV00"]
    assert {vehicle.depth_m for vehicle in divers} == {20.0}
    assert min(math.dist(a.start_m, b.start_m) for a, b in itertools.combinations(divers, 2)) == 10.0


def test_names_and_slots_are_the_next_that_are_free(tmp_path: Path) -> None:
    """Boat owns slot 1 and Diver slot 0; Diver2 is an area here, and the numbers are no wider than they were."""
    scenario = pond(tmp_path, text=SMALL.replace('"north bank"', '"Diver2"'))
    assert [(vehicle.name, vehicle.slot) for vehicle in scenario.vehicle[2:]] == [
        ("Diver3", 2),
        ("Diver4", 3),
        ("Diver5", 4),
        ("Diver6", 5),
    ]


def test_gaps_between_listed_slots_are_filled(tmp_path: Path) -> None:
    scenario = pond(tmp_path, text=SMALL.replace("slot = 1", "slot = 4"))
    assert sorted(vehicle.slot for vehicle in scenario.vehicle) == list(range(6))


def test_surface_vehicles_have_no_layers_and_start_apart(tmp_path: Path) -> None:
    """Boat starts at (0, 0), Diver 5 m below (10, 0): nearer than a layer's distance it would be in the way."""
    text = SMALL.replace('["Skipper"]', '["Skipper", "Hand"]').replace("depth_m = 5.0", "depth_m = 2.0")
    boats = [v for v in pond(tmp_path, BOATS, text=text).vehicle if v.name.startswith("Boat")]
    assert {boat.depth_m for boat in boats} == {0.0}
    places = [boat.start_m for boat in boats] + [(10.0, 0.0)]
    assert min(math.dist(a, b) for a, b in itertools.combinations(places, 2)) == 10.0


def test_a_size_that_is_met_or_not_given_adds_nothing(tmp_path: Path) -> None:
    as_listed = pond(tmp_path, "")
    assert pond(tmp_path, "[fleet]\nsize = 2\n\n") == as_listed
    assert pond(tmp_path, '[fleet]\ncopies_of = "Diver"\n\n') == as_listed
    assert pond(tmp_path, '[fleet]\ncopies_of = "Gone"\n\n') == as_listed  # nothing is to be copied
    assert pond(tmp_path, "[fleet]\n\n") == as_listed


def test_the_shipped_scenario_is_as_if_it_had_no_fleet_table(tmp_path: Path) -> None:
    raw = shipped_tables()
    del raw["fleet"]
    (tmp_path / "without.toml").write_text(tomli_w.dumps(raw), encoding="utf-8")
    without = load(str(tmp_path / "without.toml"))
    assert without.model_dump_json() == load("mapping-rendezvous").model_dump_json()


def test_settings_of_the_original_reach_its_copies(tmp_path: Path) -> None:
    scenario = pond(tmp_path, FLEET, "vehicle.Diver.hotel_w=12.5")
    assert [vehicle.hotel_w for vehicle in scenario.vehicle] == [10.0] + [12.5] * 5


def test_the_manifest_lists_every_vehicle_and_repeats_the_run(tmp_path: Path) -> None:
    scenario = pond(tmp_path, FLEET, "scenario.duration_s=30")
    kept = manifest(run_scenario(scenario, 1))["scenario"]
    assert len(tomllib.loads(kept)["vehicle"]) == 6
    (tmp_path / "again.toml").write_text(kept, encoding="utf-8")
    again = load(str(tmp_path / "again.toml"))
    assert again == scenario
    assert run_scenario(again, 1).recorder.trajectories == run_scenario(scenario, 1).recorder.trajectories


# What is refused ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fleet", "key", "given", "says"),
    [
        ("size = 1", "fleet.size", "1", "greater than or equal to 2"),
        ("size = 65", "fleet.size", "65", "less than or equal to 64"),
        ('size = "6"', "fleet.size", '"6"', "integer"),
        ("size = 6", "fleet.copies_of", "", "missing: which vehicle the 4 to add are copies of; allowed: Boat, Diver"),
        ('size = 2\ncopies_of = "Dive"', "fleet.copies_of", '"Dive"', "allowed: Boat, Diver; did you mean 'Diver'?"),
        ('size = 6\ncopies_of = "Dive"', "fleet.copies_of", '"Dive"', "did you mean 'Diver'?"),
        ("sise = 6", "fleet.sise", "6", "did you mean 'size'?"),
        ('layers = "no"', "fleet.layers", '"no"', "boolean"),
        ("spacing_m = 0.5", "fleet.spacing_m", "0.5", "greater than or equal to 1"),
    ],
)
def test_what_is_wrong_with_the_fleet_is_said_once_with_its_line(
    tmp_path: Path, fleet: str, key: str, given: str, says: str
) -> None:
    [fault] = faults_of(tmp_path, f"[fleet]\n{fleet}\n\n")
    assert (fault.key, fault.given) == (key, given)
    assert says in fault.allowed
    assert fault.line == (line_of(f"[fleet]\n{fleet}", key.split(".")[1]) if given else 1)


def test_copies_that_would_start_too_near_to_each_other_are_refused() -> None:
    with pytest.raises(
        ConfigurationError, match=r"fleet.size\) = 8: its copy AUV04 has start_m = .*: 4 m from the start of AUV02"
    ):
        shipped_at(8, "fleet.layers=false", "fleet.spacing_m=4.0")


def test_a_size_below_the_vehicles_listed_is_refused_by_the_option_that_asked_for_it() -> None:
    with pytest.raises(ConfigurationError, match=r"--set \(fleet.size\) = 3: allowed: 4, the vehicles that are listed"):
        shipped_at(3)


def test_a_world_without_room_is_said(tmp_path: Path) -> None:
    """Between -50 m and 250 m around (0, 0) a lattice of 200 m has 3 more places."""
    [fault] = faults_of(tmp_path, BOATS + "spacing_m = 200.0\n\n")
    assert (fault.key, fault.allowed.split(" that")[0]) == ("fleet.spacing_m", "the world has room for 3 of 4 copies")


def test_a_fault_that_all_copies_share_with_their_original_is_said_once(tmp_path: Path) -> None:
    [fault] = faults_of(tmp_path, FLEET, "vehicle.Diver.survey_speed_mps=9")
    assert fault.key == "--set (vehicle.Diver.survey_speed_mps)"


def test_a_fault_of_the_copies_alone_names_the_size(tmp_path: Path) -> None:
    """A name of 40 characters is allowed; with a number behind it, it is too long."""
    name = "D" * 40
    [fault] = faults_of(tmp_path, FLEET.replace("Diver", name), text=SMALL.replace("Diver", name))
    assert (fault.key, fault.given, fault.line) == ("fleet.size", "6", 2)
    assert fault.allowed.startswith(f'its copy {name}2 has name = "{name}2": string should have at most 40')


def test_checks_between_tables_see_the_copies() -> None:
    """31 * 32 = 992 bits of acknowledgements are more than the 512 bits of the modem."""
    with pytest.raises(ConfigurationError, match="992 bits for 32 vehicles"):
        shipped_at(32, "communication.policy=m-ack")
    assert len(shipped_at(32, "communication.policy=m-ack", "communication.modem=whoi-psk-1").vehicle) == 32


JUNK = st.sampled_from([None, True, 3, -1.5, float("nan"), float("inf"), "AUV02", [], [1], {}, {"size": 9}, 10**30])


@given(st.dictionaries(st.sampled_from(["size", "copies_of", "spacing_m"]), JUNK), st.data())
def test_malformed_tables_are_left_as_they_are(fleet: dict[str, object], data: st.DataObject) -> None:
    """What is wrong with them is for others to say."""
    raw = shipped_tables()
    raw["fleet"] = {"size": 8, "copies_of": "AUV02"} | fleet
    for table, key in (("world", "x_m"), ("world", "y_m"), ("vehicle", "start_m"), ("vehicle", "depth_limit_m")):
        if data.draw(st.booleans()):
            (raw[table] if table == "world" else raw[table][3])[key] = data.draw(JUNK)
    copies = with_copies(raw)
    assert len(copies.raw["vehicle"]) in (4, 8, 9)
    assert (len(copies.raw["vehicle"]) == 4) == (not copies.names)


# The mission --------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "per"),
    sampled(itertools.product((8, 16, 32), (0.0, 0.3)), (8, 0.3)),
)
def test_the_mission_completes_with_more_vehicles(size: int, per: float) -> None:
    found = summary(run_scenario(shipped_at(size, f"channel.per={per}"), 1))
    assert found["completed"], found["reason"]
    assert (found["n_vehicles"], found["coverage_fraction"], found["false_beliefs"]) == (size, 1.0, 0)


def test_the_largest_fleet_starts() -> None:
    fleet = assemble(resolved(shipped_at(MAX_VEHICLES, "scenario.duration_s=120")), seed=1)
    fleet.run()
    n_packets = len(fleet.recorder.packets)
    fleet.close()
    assert n_packets == 68  # slots of 1.772 s that open up to 120 s
