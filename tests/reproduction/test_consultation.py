"""The fleet of the REMORAS paper after consultation; ``remoras reproduce remoras-table-1`` has the tables."""

from collections.abc import Iterator

import pytest

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.fleet.fleet import Fleet


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


def test_consultation_takes_one_round(fleet: Fleet) -> None:
    """ "After the consultation phase at 7.1 s": here one TDMA frame, in which every vehicle has had its say."""
    (milestone,) = fleet.truth.milestones
    assert milestone.name == "consultation_done"
    assert milestone.time_s == fleet.schedule.frame_s
    assert round(milestone.time_s, 1) == 7.1


def test_after_consultation_the_vehicles_move(fleet: Fleet) -> None:
    """Section VII.B: the MissionAdministrator goes to its rally point; AUV00 neglects its role of Tactician and goes
    to the central area, the wingers to theirs."""
    driving = {vehicle.name: {role for _, role in vehicle.executive.decision.driving} for vehicle in fleet.vehicles}
    assert driving["ASV00"] == {"MissionAdministrator"}
    assert driving["AUV00"] == {"Midfield", "Cartographer"}
    assert driving["AUV01"] == {"LeftWinger", "Cartographer"}
    assert driving["AUV02"] == {"RightWinger", "Cartographer"}
