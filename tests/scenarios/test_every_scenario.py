"""Every shipped scenario runs; a new one cannot be left untested."""

import pytest
from recorded import flown
from sampling import sampled

from missions.runs.results import summary
from missions.scenarios import shipped

DAY = "pandora-day"
"""Takes too long to be flown to its end in tests."""

SEARCH = "arrows-archaeology"
"""Whether enough is found depends on what lies there; its channel has no loss rate."""

POLICY = "communication.policy=mps-ack-repeat"
"""The policy that tells, and repeats, most."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    sampled(
        [name for name in shipped() if name not in (DAY, SEARCH)],
        "mapping-corridor", "mapping-inspection", "mapping-nine-teams", "escort-lines",
    ),
)  # fmt: skip
def test_every_scenario_completes_over_a_lossy_channel(name: str) -> None:
    report = summary(flown(name, "channel.per=0.3", POLICY, seed=2))
    assert report["completed"], report["reason"]
    assert report["false_beliefs"] == 0
    assert 0.95 < report["goal_fraction"] <= 1.0


@pytest.mark.slow
def test_the_day_long_scenario_progresses_in_its_first_hour() -> None:
    """The first hour of 24."""
    assert flown(DAY, "scenario.duration_s=3600.0", "fault=[]", "current.surge=[]").goal_fraction > 0.04


def test_a_search_ends_with_all_vehicles_gathered() -> None:
    finished = flown(SEARCH, POLICY, "mission.search_s=900.0", seed=2)
    assert "gathered" in {one.name for one in finished.milestones}
    assert summary(finished)["false_beliefs"] == 0


def test_draws_of_strategies_and_of_loss_are_independent() -> None:
    """Whatever a vehicle says, the packets lost in a slot are the same: paired comparison."""
    lost = []
    for policy in ("ack", "m-ack-repeat"):
        settings = "channel.per=0.4", f"communication.policy={policy}", "scenario.duration_s=300"
        rows = flown("mapping-rendezvous", *settings, seed=3).recorder.packets
        lost.append({row[0]: row[7] for row in rows})
    assert lost[0] == lost[1]
