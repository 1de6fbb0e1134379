"""Every shipped scenario is run: nobody can add one that is never tried."""

import pytest
from sampling import sampled

from missions.runs.results import summary
from missions.runs.run import run
from missions.scenarios import load, shipped

DAY = "pandora-day"
"""Takes too long to be flown to its end in tests."""

SEARCH = "arrows-archaeology"
"""Whether enough is found depends on what lies there; its channel has no loss rate."""

MOST, LEAST = "mps-ack-repeat", "ack"
"""The policies that tell, and repeat, most and least."""
CASES = [(name, policy) for name in shipped() if name not in (DAY, SEARCH) for policy in (MOST, LEAST)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "policy"), sampled(CASES, *[one for one in CASES if one[1] == MOST or one[0].startswith("mapping-r")])
)
def test_it_completes_over_a_lossy_channel(name: str, policy: str) -> None:
    loaded = load(name, [("--per", "channel.per=0.3"), ("--policy", f"communication.policy={policy}")])
    report = summary(run(loaded, seed=2))
    assert report["completed"], report["reason"]
    assert report["false_beliefs"] == 0
    assert 0.95 < report["goal_fraction"] <= 1.0


@pytest.mark.slow
def test_a_day_begins() -> None:
    """The first hour of 24."""
    keys = "scenario.duration_s=3600.0", "fault=[]", "current.surge=[]"
    assert run(load(DAY, [("--set", key) for key in keys]), seed=1).goal_fraction > 0.04


@pytest.mark.parametrize("policy", sampled([MOST, LEAST], MOST))
def test_a_search_ends_with_all_together(policy: str) -> None:
    keys = f"communication.policy={policy}", "mission.search_s=900.0"
    finished = run(load(SEARCH, [("--set", key) for key in keys]), seed=2)
    assert "gathered" in {one.name for one in finished.milestones}
    assert summary(finished)["false_beliefs"] == 0


def test_strategies_and_loss_do_not_touch_each_others_draws() -> None:
    """Whatever a vehicle says, the packets lost in a slot are the same: paired comparison."""
    lost = []
    for policy in ("ack", "m-ack-repeat"):
        loaded = load(
            "mapping-rendezvous",
            [
                ("--set", "channel.per=0.4"),
                ("--set", f"communication.policy={policy}"),
                ("--set", "scenario.duration_s=300"),
            ],
        )
        rows = run(loaded, seed=3).recorder.packets
        lost.append({row[0]: row[7] for row in rows})
    assert lost[0] == lost[1]
