"""All are cut off while they are at work: each does what is its own, they meet, and only then take anything over."""

import math
from functools import cache

import pytest

from missions.runs.run import Run, run
from missions.runs.summary import summary
from missions.scenarios import load
from remoras.social import layer, standing
from remoras.social.negotiation import Negotiation
from remoras.social.patience import Patience

BIDDERS = ("contract-net", "cbba", "status-broadcast")
VEHICLES = ("ASV00", "AUV00", "AUV01", "AUV02")


def blackout(until_s: float) -> str:
    rows = (f'{{from_s=200.0, until_s={until_s}, vehicle="{name}"}}' for name in VEHICLES)
    return f"channel.blackout=[{', '.join(rows)}]"


def finished(strategy: str, *settings: str) -> Run:
    given = [("--set", one) for one in (f"strategy.name={strategy}", "channel.per=0", *settings)]
    return run(load("mapping-patches", given), seed=1)


@cache
def silent_s() -> float:
    return float(summary(finished("fixed-partition"))["mission_time_s"])


def takes_over_at_once(*asked: object) -> Patience:
    return Patience(-math.inf, -math.inf, frozenset())


@pytest.mark.parametrize(
    "strategy",
    [
        "remoras",
        pytest.param("plan-and-dispatch", marks=pytest.mark.slow),
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("central", *BIDDERS)),
    ],
)
def test_a_fleet_that_is_cut_off_for_good_is_not_much_later_than_one_that_never_speaks(strategy: str) -> None:
    figures = summary(finished(strategy, blackout(7200.0)))
    assert figures["mission_time_s"] <= 1.3 * silent_s()
    assert figures["duplicate_fraction"] <= 0.1


@pytest.mark.slow
def test_without_its_claims_a_bidder_leaves_its_own_jobs_to_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """Jobs that nobody is known to have are then another's by the plan before the mission, who has bid for others."""
    monkeypatch.setattr(Negotiation, "division", lambda *asked: {})
    figures = summary(finished("cbba", blackout(7200.0)))
    assert figures["mission_time_s"] > 1.25 * silent_s()


@pytest.mark.slow
def test_without_doubt_vehicles_take_what_nobody_will_know_of(monkeypatch: pytest.MonkeyPatch) -> None:
    """Between their last word and the end of the lease they take jobs of others, which these do too."""
    monkeypatch.setattr(standing, "DOUBT", 1.0)
    assert summary(finished("contract-net", blackout(7200.0)))["duplicate_fraction"] > 0.1


@pytest.mark.slow
def test_without_meeting_whoever_has_come_they_wait_for_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever has come early waits until the last should have come, though all have."""
    with_own_work_done = summary(finished("remoras", blackout(7200.0)))["mission_time_s"]
    monkeypatch.setattr(layer.SocialLayer, "_has_left", lambda self, work: work.has_something_left)
    assert summary(finished("remoras", blackout(7200.0)))["mission_time_s"] > with_own_work_done + 200.0


@pytest.mark.slow
def test_without_patience_all_do_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(layer, "patience_with", takes_over_at_once)
    figures = summary(finished("remoras", blackout(7200.0)))
    assert figures["mission_time_s"] > 2.0 * silent_s()
    assert figures["duplicate_fraction"] > 0.5


@pytest.mark.slow
@pytest.mark.parametrize("strategy", ["remoras", "central", "cbba"])
def test_the_only_one_left_waits_and_then_does_it_all(strategy: str) -> None:
    lost = ", ".join(f'{{kind="lost", vehicle="{name}", at_s=600.0}}' for name in ("ASV00", "AUV01", "AUV02"))
    done = finished(strategy, f"fault=[{lost}]")
    assert done.completed, done.reason
    met = [one.time_s for one in done.milestones if one.name == "gathered"]
    assert min(met) < done.end_s - 1000.0, "it met before it took over"


@pytest.mark.slow
@pytest.mark.parametrize("strategy", ["remoras", "plan-and-dispatch", "central", "cbba"])
def test_nothing_is_done_twice_when_contact_returns(strategy: str) -> None:
    figures = summary(finished(strategy, blackout(1500.0)))
    assert figures["mission_time_s"] < silent_s()
    assert figures["duplicate_fraction"] == 0.0
