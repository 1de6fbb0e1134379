"""Tables I and II of the REMORAS paper, on the shipped scenario after consultation over a perfect channel.

Source: Carlesi, Michel, Jouvencel, Ferber 2011, section VII. The paper prints ``OrganizationalPerformanceOptimizer``
and lists ``LeaderInformationGathering`` twice; here activities are spelt as the program spells them, each once.
"""

from collections.abc import Iterator

import pytest

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.activities import Activity, Objective
from remoras.fleet.fleet import Fleet
from remoras.fleet.vehicle import Vehicle

GATHERED_M = {"Coordination": (500.0, 500.0), "Operational": (450.0, 450.0)}
ROLES = {
    "ASV00": {("Coordination", "MissionAdministrator")},
    "AUV00": {
        ("Coordination", "Tactician"), ("Operational", "Coordinator"), ("Operational", "Cartographer"),
        ("Operational", "Midfield"),
    },
    "AUV01": {("Operational", "Performer"), ("Operational", "Cartographer"), ("Operational", "LeftWinger")},
    "AUV02": {("Operational", "Performer"), ("Operational", "Cartographer"), ("Operational", "RightWinger")},
}  # fmt: skip
OBJECTIVES = {
    "MissionAdministrator": {"GroupSupervision", "RendezVous"},
    "Tactician": {"MissionGathering", "RendezVous"},
    "Coordinator": {"GroupSupervision", "RendezVous"},
    "Performer": {"MissionGathering", "RendezVous"},
    "Cartographer": {"Mapping"},
    "LeftWinger": {"Positioning", "Exploring"},
    "Midfield": {"Positioning", "Exploring"},
    "RightWinger": {"Positioning", "Exploring"},
}
AREAS = {
    "LeftWinger": {(350.0, 100.0), (350.0, 350.0), (600.0, 350.0), (600.0, 100.0)},
    "Midfield": {(100.0, 100.0), (100.0, 350.0), (350.0, 350.0), (350.0, 100.0)},
    "RightWinger": {(100.0, 350.0), (100.0, 600.0), (350.0, 600.0), (350.0, 350.0)},
}
ACTIVITIES_OF_AUV00 = {
    ("Tactician", "MissionGathering"): {"Following"},
    ("Tactician", "RendezVous"): {"Homing"},
    ("Coordinator", "GroupSupervision"): {
        "Following", "LeaderInformationGathering", "OrganisationalPerformanceOptimiser", "MissionPlanner"
    },
    ("Coordinator", "RendezVous"): {"Homing"},
    ("Cartographer", "Mapping"): {"Mapping"},
    ("Midfield", "Positioning"): {"Positioning"},
    ("Midfield", "Exploring"): {"ZigzagExploring"},
}  # fmt: skip


@pytest.fixture(scope="module")
def fleet() -> Iterator[Fleet]:
    """The fleet at the first tick after consultation."""
    scenario = load("mapping-rendezvous")
    assert scenario.channel.per == 0.0
    assembled = assemble(resolved(scenario), seed=1)
    while not assembled.truth.milestones and assembled.now_s < 60.0:
        assembled.step()
    yield assembled
    assembled.close()


def vehicles(fleet: Fleet) -> dict[str, Vehicle]:
    return {vehicle.name: vehicle for vehicle in fleet.vehicles}


def held_in(fleet: Fleet, name: str) -> set[str]:
    """Groups in which a vehicle plays a role, as it sees itself."""
    return {held.group for held in vehicles(fleet)[name].social.organisation.roles_of(name)}


def activities(fleet: Fleet, name: str) -> dict[Objective, list[Activity]]:
    """Activities of a vehicle by the objective they are for."""
    found: dict[Objective, list[Activity]] = {}
    for one in vehicles(fleet)[name].executive.sets:
        if one.objective is not None:
            found.setdefault(one.objective, []).extend(one.activities)
    return found


def parameters(fleet: Fleet, name: str, role: str, activity: str) -> list[tuple[object, ...]]:
    return [
        one.parameters
        for objective, found in activities(fleet, name).items()
        for one in found
        if (objective.role, one.name) == (role, activity)
    ]


def test_consultation_takes_one_round(fleet: Fleet) -> None:
    """ "After the consultation phase at 7.1 s": here one TDMA frame, in which every vehicle has had its say."""
    (milestone,) = fleet.truth.milestones
    assert milestone.name == "consultation_done"
    assert milestone.time_s == fleet.schedule.frame_s
    assert round(milestone.time_s, 1) == 7.1


def test_table_i_every_vehicle_knows_who_plays_what(fleet: Fleet) -> None:
    expected = {(group, role, name) for name, played in ROLES.items() for group, role in played}
    for vehicle in fleet.vehicles:
        assignments = vehicle.social.organisation.assignments
        assert {(a.group, a.role, a.vehicle) for a in assignments} == expected, vehicle.name


def test_table_i_missions(fleet: Fleet) -> None:
    for vehicle in fleet.vehicles:
        assert vehicle.social.missions == {"Coordination": ("Supervision",), "Operational": ("AreaMapping",)}


@pytest.mark.parametrize("name", ROLES)
def test_table_i_objectives(fleet: Fleet, name: str) -> None:
    social = vehicles(fleet)[name].social
    found: dict[tuple[str, str], set[str]] = {}
    for objective in social.objectives_of(name):
        found.setdefault((objective.group, objective.role), set()).add(objective.name)
    assert found == {played: OBJECTIVES[played[1]] for played in ROLES[name]}


@pytest.mark.parametrize("name", ROLES)
def test_table_i_rally_points(fleet: Fleet, name: str) -> None:
    homing = {
        (objective.group, one.parameters[0])
        for objective, found in activities(fleet, name).items()
        for one in found
        if one.name == "Homing"
    }
    assert homing == {(group, GATHERED_M[group]) for group in held_in(fleet, name)}


@pytest.mark.parametrize(("name", "role"), [("AUV00", "Midfield"), ("AUV01", "LeftWinger"), ("AUV02", "RightWinger")])
def test_table_i_areas(fleet: Fleet, name: str, role: str) -> None:
    ((area, group, others),) = parameters(fleet, name, role, "ZigzagExploring")
    assert (group, others) == ("Operational", ())
    assert [set(one.corners_m) for one in load("mapping-rendezvous").area if one.name == area] == [AREAS[role]]


def test_table_ii_activities(fleet: Fleet) -> None:
    found = {
        (objective.role, objective.name): sorted(one.name for one in done)
        for objective, done in activities(fleet, "AUV00").items()
    }
    assert found == {key: sorted(names) for key, names in ACTIVITIES_OF_AUV00.items()}


def test_table_ii_parameters(fleet: Fleet) -> None:
    """Follower to MissionAdministrator, Leader to Performer, Positioning(Top, Middle)."""
    assert [found[:2] for found in parameters(fleet, "AUV00", "Tactician", "Following")] == [("follower", ("ASV00",))]
    assert [found[:2] for found in parameters(fleet, "AUV00", "Coordinator", "Following")] == [
        ("leader", ("AUV01", "AUV02"))
    ]
    assert [found[0] for found in parameters(fleet, "AUV00", "Midfield", "Positioning")] == [("top", "middle")]


def test_after_consultation_the_vehicles_move(fleet: Fleet) -> None:
    """Section VII.B: the MissionAdministrator goes to its rally point; AUV00 neglects its role of Tactician and goes
    to the central area, the wingers to theirs."""
    driving = {vehicle.name: {role for _, role in vehicle.executive.decision.driving} for vehicle in fleet.vehicles}
    assert driving["ASV00"] == {"MissionAdministrator"}
    assert driving["AUV00"] == {"Midfield", "Cartographer"}
    assert driving["AUV01"] == {"LeftWinger", "Cartographer"}
    assert driving["AUV02"] == {"RightWinger", "Cartographer"}
