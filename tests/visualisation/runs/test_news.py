"""What vehicles heard of each other, on traffic small enough to count by hand."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_runs import Fiction

from visualisation.outages import Outage
from visualisation.runs import news, tdma
from visualisation.runs.news import Outcome, Traffic


def traffic() -> Traffic:
    """A sends at 0, 20 and 40 s, B at 10 and 30 s, until 50 s. B hears A at 20 s only, A hears B both times."""
    heard = np.array([[0, 0], [1, 0], [0, 1], [1, 0], [0, 0]], dtype=bool)
    lost = np.array([[0, 1], [0, 0], [0, 0], [0, 0], [0, 1]], dtype=bool)
    times_s = np.array([0.0, 10.0, 20.0, 30.0, 40.0])
    return Traffic(("A", "B"), times_s, np.arange(5), np.array([0, 1, 0, 1, 0]), Outcome(heard, lost), 50.0)


def test_the_share_that_was_lost_is_of_what_could_be_heard() -> None:
    """B lost two of three packets of A, A none of B; nobody hears itself."""
    shares = traffic().lost_shares
    assert shares[1, 0] == pytest.approx(2 / 3)
    assert shares[0, 1] == 0.0
    assert np.isnan(shares[0, 0])


def test_news_are_as_old_as_the_last_packet_that_was_heard() -> None:
    ages_s = traffic().ages_s(np.array([5.0, 25.0, 50.0]))
    assert ages_s[1, 0].tolist() == [5.0, 5.0, 30.0]  # from the start, then since 20 s
    assert ages_s[0, 1].tolist() == [5.0, 15.0, 20.0]  # since 10 s, then since 30 s


def test_the_mean_age_is_that_of_the_ages_over_the_mission() -> None:
    """B of A: (20**2 / 2 + 30**2 / 2) / 50 = 13; A of B: (10**2 + 20**2 + 20**2) / 2 / 50 = 9."""
    assert traffic().mean_ages_s[1, 0] == pytest.approx(13.0)
    assert traffic().mean_ages_s[0, 1] == pytest.approx(9.0)
    at_s = (np.arange(5000) + 0.5) / 100.0
    assert traffic().ages_s(at_s).mean(axis=2)[1, 0] == pytest.approx(13.0, abs=1e-6)


def test_who_is_out_of_the_mission_has_no_news_and_gives_none() -> None:
    """B is out from 25 s: its news of A are 0 to 20 s old, then 0 to 5 s, a mean of (20**2 + 5**2) / 2 / 25 = 8.5 s."""
    cut = replace(traffic(), out={"B": [Outage(25.0, math.inf)]})
    ages_s = cut.ages_s(np.array([24.0, 25.0, 50.0]))
    assert ages_s[1, 0, 0] == 4.0
    assert np.isnan(ages_s[:, :, 1:]).all()
    assert cut.mean_ages_s[1, 0] == pytest.approx(8.5)
    never = replace(traffic(), out={"B": [Outage(0.0, math.inf)]})
    assert np.isnan(never.mean_ages_s).all()


def test_a_vehicle_lacks_what_was_told_and_not_received(tmp_path: Path) -> None:
    """One item is told in each slot of 10 s, by each of 4 vehicles in turn; of 3 listeners one loses it, in turn.

    After all 100 slots 75 items are of others. Each vehicle is one of three listeners to each, who lose one third.
    """
    results = Fiction(vehicles=("A", "B", "C", "D")).write(tmp_path / "run")
    lacking = news.lacking(results, np.array([0.0, 11.5, 1000.0]))
    assert lacking[0, 0] == 0.0  # its own item is all there is
    assert lacking[:, 0].sum() == 3.0  # nobody has heard the first one yet
    assert lacking[:, 2].sum() == news.traffic(results).outcome.lost.sum() == 100


def test_the_stretch_is_that_of_the_most_losses() -> None:
    """300 slots of two vehicles; only from slot 200 to 235 everything is lost."""
    n = 300
    lost = np.zeros((n, 2), dtype=bool)
    lost[200:236] = True
    lost[np.arange(n), np.arange(n) % 2] = False
    heard = ~lost
    heard[np.arange(n), np.arange(n) % 2] = False
    slots = np.arange(n)
    found = tdma.worst_stretch(Traffic(("A", "B"), slots * 2.0, slots, slots % 2, Outcome(heard, lost), 600.0))
    assert (found.start_s, found.end_s) == (400.0, 472.0)
