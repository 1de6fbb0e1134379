"""Missions on four nodes of a measured network, of which one link loses 97.5 %: what membership and relaying give."""

import statistics
from functools import cache

import pytest
from sampling import sampled

from missions.runs.run import run, summary
from missions.scenarios import load
from remoras.picture import Peers

NODES = {"ASV00": "22", "AUV00": "27", "AUV01": "28", "AUV02": "29"}
MEASURED = ("channel.name=network", *(f'channel.nodes.{name}="{node}"' for name, node in NODES.items()))
ALIKE = ("channel.name=bernoulli", "channel.per=0.546")
"""As much as these twelve links lose on average."""

pytestmark = pytest.mark.slow


@cache
def voyage(strategy: str, seed: int, *settings: str) -> tuple[float, int]:
    """``sailed``, made once."""
    return sailed(strategy, seed, *settings)


def sailed(strategy: str, seed: int, *settings: str) -> tuple[float, int]:
    """How long the mission took (s), and how often somebody was taken for absent."""
    options = [("--set", setting) for setting in (f"strategy.name={strategy}", *settings)]
    finished = run(load("mapping-patches", options), seed)
    assert finished.completed
    return summary(finished)["mission_time_s"], len(finished.recorder.rows("membership"))


@pytest.mark.parametrize("strategy", sampled(["plan-and-dispatch", "central", "remoras", "cbba"], "remoras", "cbba"))
def test_a_measured_sea_takes_hardly_longer_than_losses_that_are_alike(strategy: str) -> None:
    alike_s, measured_s = (
        statistics.fmean(voyage(strategy, seed, *loss)[0] for seed in (1, 2, 3)) for loss in (ALIKE, MEASURED)
    )
    assert measured_s <= 1.10 * alike_s


def test_without_relaying_it_takes_longer() -> None:
    with_it_s, without_s = (
        statistics.fmean(voyage("remoras", seed, *MEASURED, *more)[0] for seed in (1, 2, 3))
        for more in ((), ("communication.relaying=false",))  # it is on where nothing is said
    )
    assert without_s > 1.10 * with_it_s


def test_nobody_is_taken_for_absent_since_others_tell_whom_they_hear(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the word of others the vehicles at the two ends of the bad link take each other for absent."""
    settings = (*MEASURED, "communication.relaying=false")
    assert sailed("plan-and-dispatch", 1, *settings)[1] == 0
    monkeypatch.setattr(Peers, "note_word", lambda self, name, spoke_s: None)
    assert sailed("plan-and-dispatch", 1, *settings)[1] > 0
