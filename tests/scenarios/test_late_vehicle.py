"""Influence signals in both directions: a vehicle that is late is called off, whatever its role."""

import pytest
from flicker import undone
from recorded import flown

ROLES = "Performer", "Cartographer", "LeftWinger", "Midfield", "RightWinger"
LEADING = "MissionAdministrator", "Tactician", "Coordinator"
MUTUAL = (
    "decision.updates_satisfy=false",
    'group.Operational.role.Performer.influences=["Coordinator","Performer"]',
    "channel.name=perfect",
)
"""A leader that waits is dissatisfied, and Performers call each other."""


@pytest.mark.parametrize("late", ["AUV00", "AUV02"])
def test_calls_save_a_twentieth_of_a_mission_that_waits_for_any_vehicle(late: str) -> None:
    slow = f'fault=[{{vehicle="{late}",kind="slow",factor=0.8,at_s=0}}]'
    called = flown("mapping-rendezvous", slow, *MUTUAL)
    uncalled = flown("mapping-rendezvous", slow, *MUTUAL, "decision.weight_external=0")
    assert called.completed
    assert uncalled.completed
    assert called.end_s <= 0.95 * uncalled.end_s
    n_undone, n_changes = undone(called.recorder.rows("activities"))
    assert n_undone <= 0.02 * n_changes


def test_the_late_vehicle_of_the_paper_gives_up_under_another_leader() -> None:
    """AUV00 finishes its area at 1974 s if nobody calls it off."""
    leader = "AUV02"
    of_leader = f"vehicle.{leader}.playable_roles={[*LEADING, *ROLES]}"
    playable = [f"vehicle.AUV0{n}.playable_roles={[*ROLES]}" for n in range(3) if f"AUV0{n}" != leader] + [of_leader]
    finished = flown("mapping-rendezvous", *MUTUAL, *playable)
    stops = {one.vehicle: one.time_s for one in finished.milestones if one.name == "mapping_stopped"}
    assert stops.keys() == {"AUV00"}
    assert stops["AUV00"] < 1974.0
    assert finished.end_s < 2100.0
