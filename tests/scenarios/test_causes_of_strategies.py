"""Effects of strategies, and their absence without the cause: on the patches scenario."""

import pytest
from recorded import flown

from missions.mapping.metrics import area_roles, duplicate_fraction
from missions.runs.results import summary
from missions.runs.run import Run

CUT_OFF = 'channel.blackout=[{from_s=200.0, until_s=1200.0, vehicle="AUV00"}]'
NEVER = 10_000
"""As many frames as a parameter allows: 70000 s, far beyond the end of the run."""


def finished(strategy: str, *settings: str) -> Run:
    return flown("mapping-patches", f"strategy.name={strategy}", *settings)


def taken_by(done: Run) -> dict[str, list[str]]:
    """Players of each role with an area, in time order."""
    taken: dict[str, list[str]] = {}
    for _, vehicle, group, role, event in done.recorder.roles:
        if event == "assigned" and (group, role) in area_roles(done.scenario):
            taken.setdefault(role, []).append(vehicle)
    return taken


# Duplicated work comes from loss ------------------------------------------------------------------


@pytest.mark.slow
def test_work_is_duplicated_when_nearly_all_packets_are_lost_and_not_without_loss() -> None:
    assert duplicate_fraction(finished("cbba", "channel.per=0.95")) > 0.05
    assert (
        duplicate_fraction(finished("cbba", "channel.per=0.0")) < 0.005
    )  # who chooses in the same frame hears of it one frame later


# Meetings cost time -------------------------------------------------------------------------------


def test_the_cost_of_rendezvous_is_the_travel_to_them() -> None:
    """Who gets all areas before the dive has nowhere to go between them."""
    often, never = (summary(finished("rendezvous-sync", f"strategy.parameters.jobs_per_leg={n}")) for n in (1, 13))
    assert never["distance_m"] < 0.9 * often["distance_m"]


# Silence is what auctions are repeated for -------------------------------------------------------


@pytest.mark.slow
def test_jobs_of_a_silent_vehicle_are_auctioned_again() -> None:
    """AUV00 is the head: when it is silent the others auction by themselves what it holds."""

    def passed_on(lease_frames: int) -> int:
        lease = f"communication.lease_frames={lease_frames}", "communication.false_absence=0"
        done = finished("contract-net", CUT_OFF, *lease, "scenario.duration_s=3000")
        return sum(len(set(holders)) > 1 for holders in taken_by(done).values())

    assert passed_on(30) > passed_on(NEVER)


# The bound -------------------------------------------------------------------------------------------


def test_the_bound_ends_waits_for_other_vehicles_sooner_than_who_gets_no_help() -> None:
    """Without losses, where lifts take two vehicles; without help the bound took 3959 s and the leader 1782 s."""
    bound, central = (flown("recovery-field", f"strategy.name={name}", seed=2) for name in ("oracle", "central"))
    assert bound.completed
    assert bound.ended_s < 0.9 * central.ended_s
