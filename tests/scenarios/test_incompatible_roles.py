"""Incompatible roles: no vehicle plays both, whoever assigns them, and the mission completes."""

from __future__ import annotations

from itertools import groupby

import pytest
from recorded import flown

from missions.runs.run import Run

JOBS = ("LeftWinger", "Midfield", "RightWinger")
HEAD_WORKS_NOT = 'group.Operational.role.Coordinator.incompatible=["LeftWinger","Midfield","RightWinger"]'


def played_together(finished: Run, one: str, *others: str) -> set[str]:
    """Vehicles that at any time took themselves to play the one role and another of these."""
    held: dict[str, set[str]] = {}
    found = set()
    for _, rows in groupby(finished.recorder.roles, key=lambda row: row[0]):  # what is agreed counts at one time
        for _, vehicle, _, role, event in rows:
            own = held.setdefault(vehicle, set())
            if event == "assigned":
                own.add(role)
            elif event == "left":
                own.discard(role)
        found |= {vehicle for vehicle, own in held.items() if one in own and own.intersection(others)}
    return found


@pytest.mark.slow
@pytest.mark.parametrize("strategy", ["remoras", "cbba"])
def test_the_leader_takes_no_job_incompatible_with_leading(strategy: str) -> None:
    """Two vehicles have to map three areas; without the key the Coordinator maps one of them."""
    finished = flown("mapping-rendezvous", HEAD_WORKS_NOT, f"strategy.name={strategy}")
    assert finished.completed, finished.reason
    assert played_together(finished, "Coordinator", *JOBS) == set()


def test_a_successor_releases_roles_incompatible_with_leading() -> None:
    """The first Performer becomes the Coordinator and is a Performer no longer."""
    lost = 'fault=[{kind="lost",vehicle="AUV00",at_s=400.0}]'
    apart = 'group.Operational.role.Coordinator.incompatible=["Performer"]'
    finished = flown("mapping-rendezvous", lost, apart, "scenario.duration_s=1000")
    leads = [row[1] for row in finished.recorder.roles if row[3:] == ("Coordinator", "assigned") and row[0] > 400.0]
    assert len(leads) == 1
    assert [row[1] for row in finished.recorder.roles if row[3:] == ("Performer", "left")] == leads
    assert played_together(finished, "Coordinator", "Performer") == set()
