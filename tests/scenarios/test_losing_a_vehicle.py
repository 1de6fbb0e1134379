"""A vehicle low on energy goes home, releases its roles, and its area is reassigned."""

from recorded import flown


def test_the_area_of_a_lost_vehicle_is_reallocated_and_the_others_meet() -> None:
    """150 kJ of the usual 5 MJ last AUV01 for half of an area: it is given one, for others go on with it."""
    finished = flown("mapping-rendezvous", "vehicle.AUV01.energy_j=150000")
    roles = finished.recorder.roles
    left_s = min(row[0] for row in roles if row[1] == "AUV01" and row[4] == "left")
    taken_over = [row for row in roles if row[3] == "LeftWinger" and row[4] == "assigned" and row[1] != "AUV01"]
    assert taken_over
    assert left_s < taken_over[0][0] < left_s + 60.0
    assert finished.completed


def test_a_leader_that_joins_late_yields_to_its_successor() -> None:
    """It gives out jobs before it hears of its successor: these are taken back, or both would wait for good."""
    late = 'fault=[{kind="joins", vehicle="AUV00", at_s=900.0}]'
    finished = flown("mapping-patches", "strategy.name=central", "channel.per=0.4", late, seed=3)
    assert finished.completed
    assert finished.end_s < 3000.0


def test_a_job_not_needed_for_the_goal_is_not_reassigned_after_a_loss() -> None:
    """All but a few cells are mapped. The successor waits for nothing that nobody needs, and meets the others."""
    fault = 'fault=[{kind="lost", vehicle="AUV00", at_s=1920}]'
    finished = flown("mapping-rendezvous", fault, "channel.per=0.2")
    assert finished.completed
    assert finished.end_s <= 2350.0
