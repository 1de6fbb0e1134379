"""The site term of the channel ``acoustic``: how links of one length differ by place, time and receiver."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.site import correlation
from exchange.channel.acoustic import AcousticChannel
from exchange.channel.link import Transmission
from exchange.channel.models import Deployment
from exchange.channel.modems import modems
from exchange.channel.site import Site, SiteLinks, SiteTable

FLEET = Deployment({"Boat": 0, "Diver": 1, "Buoy": 2}, (5.0, 5.0, 5.0), modems()["whoi-psk-1"], 4000.0, 3600.0)
TABLE = SiteTable(spread_db=6.0, distance_m=300.0, time_h=0.5, receiver_db=3.0)
HOME, QUAY, BUOY = (0.0, 0.0), (5000.0, 0.0), (0.0, 6500.0)
PLACES = [HOME, QUAY, BUOY]
POINTS = st.tuples(st.floats(-5000.0, 5000.0), st.floats(-5000.0, 5000.0))
N_SEEDS = 600


def links(seed: int = 1, table: SiteTable | None = TABLE, **settings: object) -> SiteLinks:
    return AcousticChannel.model_validate({"spreading": 2.0, "site": table, **settings}).link_model(FLEET, seed)


def p_loss(asked: SiteLinks, sender: int, receiver: int, now_s: float = 0.0) -> float:
    packet = Transmission(0, sender, now_s, FLEET.modem.payload_bits, PLACES)
    return asked.p_loss(packet, receiver, math.dist(PLACES[sender], PLACES[receiver]))


# What it is ---------------------------------------------------------------------------------------


@given(POINTS, POINTS, st.floats(0.0, 1e5), st.integers(0, 2**40))
def test_the_site_term_is_symmetric(a: tuple[float, float], b: tuple[float, float], now_s: float, seed: int):
    site = Site.drawn(TABLE, 3, seed)
    assert site.spread_db(a, b, now_s) == pytest.approx(site.spread_db(b, a, now_s), abs=1e-9)
    there, back = site.excess_db(a, b, 1, now_s), site.excess_db(b, a, 0, now_s)
    assert there - back == pytest.approx(site.receivers_db[0] - site.receivers_db[1], abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("one", "other", "later_s"),
    [
        ((HOME, QUAY), (HOME, QUAY), 0.0),
        ((HOME, QUAY), (QUAY, HOME), 900.0),
        ((HOME, QUAY), ((150.0, 0.0), (5000.0, 200.0)), 0.0),
        ((HOME, QUAY), ((4900.0, 0.0), (0.0, 250.0)), 1200.0),
        ((HOME, (100.0, 0.0)), (HOME, (200.0, 0.0)), 0.0),
        ((HOME, QUAY), (HOME, BUOY), 0.0),
    ],
)
def test_spread_and_correlation_equal_the_settings(one: tuple, other: tuple, later_s: float):
    """Over seeds: mean 0, the spread in all places, and correlated over 300 m and half an hour."""
    drawn = np.array(
        [
            (site.spread_db(*one, 0.0), site.spread_db(*other, later_s))
            for site in (Site.drawn(TABLE, 3, seed) for seed in range(N_SEEDS))
        ]
    )
    wanted = correlation(one, other, 300.0) * math.exp(-((later_s / 1800.0) ** 2) / 2.0)
    error = 4.0 / math.sqrt(N_SEEDS)
    assert np.abs(drawn.mean(axis=0) / 6.0).max() <= error
    assert drawn.std(axis=0) == pytest.approx(6.0, rel=error / math.sqrt(2.0))
    assert np.mean(drawn[:, 0] * drawn[:, 1]) / 36.0 == pytest.approx(wanted, abs=error * math.sqrt(1.0 + wanted**2))


@given(POINTS, POINTS, POINTS, POINTS, st.floats(1.0, 1e4))
def test_site_correlation_is_symmetric_in_0_to_1(a: tuple, b: tuple, c: tuple, d: tuple, distance_m: float):
    """Of a link with itself and with its way back 1; of any two between 0 and 1."""
    assert correlation((a, b), (a, b), distance_m) == pytest.approx(1.0)
    assert correlation((a, b), (b, a), distance_m) == pytest.approx(1.0)
    assert 0.0 <= correlation((a, b), (c, d), distance_m) <= 1.0 + 1e-9
    assert correlation((a, b), (c, d), distance_m) == pytest.approx(correlation((c, d), (a, b), distance_m))


def test_receivers_differ_by_seed_and_node_alone():
    noise = np.array([Site.drawn(TABLE, 3, seed).receivers_db for seed in range(N_SEEDS)])
    assert noise.std(axis=0) == pytest.approx(3.0, rel=4.0 / math.sqrt(2 * N_SEEDS))
    assert np.abs(np.corrcoef(noise.T) - np.eye(3)).max() <= 4.0 / math.sqrt(N_SEEDS)
    assert Site.drawn(TABLE, 2, 7).receivers_db == Site.drawn(TABLE, 3, 7).receivers_db[:2]


# Links --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("table", [None, SiteTable(), SiteTable(distance_m=50.0)])
def test_a_disabled_site_term_creates_no_model(table: SiteTable | None):
    plain = AcousticChannel(spreading=2.0).link_model(FLEET, 1)
    assert links(table=table) == plain
    assert not isinstance(links(table=table), SiteLinks)


def test_losses_are_those_of_the_budget_shifted():
    asked = links()
    excess_db = asked.site.excess_db(HOME, QUAY, 1, 60.0)
    louder = AcousticChannel(spreading=2.0, source_level_db=185.0 + excess_db).link_model(FLEET, 1)
    assert p_loss(asked, 0, 1, 60.0) == pytest.approx(louder.loss_at(5000.0, FLEET.modem.payload_bits), abs=1e-12)
    assert p_loss(links(2), 0, 1, 60.0) != p_loss(asked, 0, 1, 60.0)
    means = [AcousticChannel(spreading=2.0, site=one).links(FLEET).loss_at(5000.0, 256) for one in (TABLE, None)]
    assert means[0] != means[1]
