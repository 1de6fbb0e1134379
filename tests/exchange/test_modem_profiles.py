"""Shipped modem profiles against published figures, and links of a modem with measured losses."""

from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.channel.acoustic import AcousticChannel, MeasuredLinks, per_at
from exchange.channel.models import Deployment
from exchange.channel.modems import Modem, modems

PUBLISHED = dict(zip(range(-3, 7), (0.997, 0.952, 0.804, 0.553, 0.245, 0.089, 0.020, 0.010, 0.003, 0.001), strict=True))
"""Of the nanomodem V3 in multipath, by SNR in dB: Sherlock et al., Electronics 11(9):1446 (2022)."""
LOUD = [modem for modem in modems().values() if modem.source_level_db is not None]


def links(modem: Modem, **settings: object) -> MeasuredLinks:
    fleet = Deployment({"Boat": 0, "Diver": 1}, (10.0, 10.0), modem, 1000.0, 3600.0)
    return AcousticChannel.model_validate(settings).links(fleet)


def range_of(loss: float, modem: Modem, **settings: object) -> float:
    """Range at which so many of the full packets are lost (m)."""
    asked, low_m, high_m = links(modem, **settings), 1.0, 200_000.0
    for _ in range(60):
        middle_m = (low_m + high_m) / 2.0
        low_m, high_m = (middle_m, high_m) if asked.loss_at(middle_m, modem.payload_bits) < loss else (low_m, middle_m)
    return low_m


# Published figures --------------------------------------------------------------------------------


def test_the_nanomodem_has_its_published_waterfall():
    """At the level at which its signal is so strong at 1 m."""
    nano = modems()["nanomodem-v3"]
    near = links(nano).budget.snr_db(1.0)
    for snr_db, per in PUBLISHED.items():
        budget = replace(links(nano).budget, source_level_db=nano.source_level_db - near + snr_db)
        assert replace(links(nano), budget=budget).loss_at(1.0, nano.payload_bits) == pytest.approx(per, abs=1e-6)
    assert nano.receive_w == 0.0125


@pytest.mark.parametrize(
    ("n_bytes", "published_s"), [(1, 0.1721), (8, 0.2377), (20, 0.3688), (32, 0.4999), (64, 0.8603)]
)
def test_the_air_time_of_the_s2c_is_published_within_3_percent(n_bytes: int, published_s: float):
    assert modems()["s2c-18-34"].packet_s(8 * n_bytes) == pytest.approx(published_s, rel=0.03)


def test_the_air_time_of_janus_follows_from_its_chips():
    """32 chips of preamble, 144 of the baseline packet, two a bit of cargo and its 8 bits of tail: 6.25 ms each."""
    janus = modems()["janus"]
    for n_bytes in (1, 10, 60):
        n_chips = 32 + 144 + 2 * (8 * n_bytes + 8)
        assert janus.packet_s(8 * n_bytes) == pytest.approx(6.25e-3 * n_chips)
    assert janus.band_khz[1] - janus.band_khz[0] == pytest.approx(13 * 2 * 0.160)


@pytest.mark.parametrize("modem", LOUD, ids=lambda modem: modem.name)
def test_half_of_the_packets_arrive_within_1_5_times_the_nominal_range(modem: Modem):
    """Spherical spreading. Of the nanomodem more than 2 km are stated for the sea, more than 3 for a lake."""
    nominal_m = 3000.0 if modem.name == "nanomodem-v3" else modem.range_m
    assert nominal_m / 1.5 <= range_of(0.5, modem, spreading=2.0) <= nominal_m * 1.5


@pytest.mark.parametrize("modem", [modem for modem in LOUD if modem.margin_db], ids=lambda modem: modem.name)
def test_the_margin_reduces_the_range_to_the_nominal_one(modem: Modem):
    """Without it the profile would carry more than 1.5 times as far; with it half arrive at 1.25 times, to 0.5 dB."""
    assert range_of(0.5, modem.model_copy(update={"margin_db": 0.0}), spreading=2.0) > 1.5 * modem.range_m
    budget = links(modem, spreading=2.0).budget
    off_db = budget.loss_db(range_of(0.5, modem, spreading=2.0)) - budget.loss_db(1.25 * modem.range_m)
    assert abs(off_db) <= 0.5


# Curves -------------------------------------------------------------------------------------------

CURVES = st.lists(
    st.tuples(st.floats(-20.0, 20.0).map(lambda x: round(x, 2)), st.floats(0.0, 1.0)), min_size=2, max_size=12,
    unique_by=lambda point: point[0],
).map(sorted)  # fmt: skip


@given(CURVES, st.floats(-40.0, 40.0))
def test_a_curve_passes_through_its_points_and_stays_between_them(curve: list[tuple[float, float]], snr_db: float):
    assert [per_at(curve, snr) for snr, _ in curve] == pytest.approx([per for _, per in curve])
    found = per_at(curve, snr_db)
    if snr_db < curve[0][0]:
        assert found == 1.0
    elif snr_db >= curve[-1][0]:
        assert found == curve[-1][1]
    else:
        ends = next((a[1], b[1]) for a, b in pairwise(curve) if a[0] <= snr_db <= b[0])
        assert min(ends) - 1e-12 <= found <= max(ends) + 1e-12


@given(
    st.sampled_from(LOUD),
    st.floats(1.0, 2e4),
    st.floats(0.0, 5e3),
    st.integers(1, 512),
    st.integers(0, 512),
)
def test_losses_grow_with_range_and_size(
    modem: Modem, range_m: float, more_m: float, n_bits: int, more_bits: int
) -> None:
    near = links(modem)
    assert 0.0 <= near.loss_at(range_m, n_bits) <= near.loss_at(range_m + more_m, n_bits) <= 1.0
    assert near.loss_at(range_m, n_bits) <= near.loss_at(range_m, n_bits + more_bits)
