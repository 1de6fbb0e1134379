"""The physics of the channel ``acoustic``, against values computed elsewhere, by hand, or by another method.

Sound speed, absorption and noise: arlpy 1.9.3 (``uwa.soundspeed``, ``uwa.absorption``) and the formulas of Coates as
Stojanovic (2007) prints them, each to the digits that were noted.
"""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from exchange.channel.error_rates import (
    Fading,
    Modulation,
    block_loss,
    faded,
    faded_block_loss,
    frame_loss,
    needed_ebn0,
    packet_loss,
    steady,
)
from exchange.channel.link_budget import (
    Budget,
    francois_garrison_db_per_km,
    noise_db_per_hz,
    noise_in_band_db,
    sound_speed_mps,
    thorp_db_per_km,
)

FSK, FSK_C, PSK, DPSK = Modulation.FSK_NONCOHERENT, Modulation.FSK_COHERENT, Modulation.PSK, Modulation.DPSK
CLOSE = 1e-4


def ratio(db: float) -> float:
    return 10.0 ** (db / 10.0)


@pytest.mark.parametrize(
    ("temperature_c", "salinity_psu", "depth_m", "mackenzie", "medwin"),
    [
        (27.0, 35.0, 10.0, 1539.0866, 1539.1731),
        (10.0, 35.0, 100.0, 1491.4351, 1491.5900),
        (4.0, 35.0, 1000.0, 1482.9552, 1482.7386),
        (0.0, 35.0, 0.0, 1448.9600, 1449.2000),
        (15.0, 0.0, 10.0, 1465.3365, 1465.3138),
    ],
)
def test_sound_speed_is_that_of_mackenzie_and_near_that_of_medwin(
    temperature_c: float, salinity_psu: float, depth_m: float, mackenzie: float, medwin: float
):
    found = sound_speed_mps(temperature_c, salinity_psu, depth_m)
    assert found == pytest.approx(mackenzie, abs=6e-5)
    assert found == pytest.approx(medwin, abs=0.5)


SPECTRA = [
    # kHz, Thorp; Francois-Garrison at 27 C, 10 m and at 10 C, 100 m; noise (s 0.5, w 5), (s 0.5, w 0), (s 1, w 10)
    (1.0, 0.06900, 0.05257, 0.07007, 60.955, 45.373, 67.931),
    (10.0, 1.18703, 0.67365, 0.97280, 46.090, 29.355, 53.037),
    (25.0, 6.10480, 2.98189, 4.95076, 38.548, 22.307, 45.485),
    (50.0, 17.46712, 10.71033, 15.19774, 32.835, 20.712, 39.637),
    (100.0, 34.06866, 35.61136, 33.19267, 28.944, 25.133, 34.204),
]


@pytest.mark.parametrize(("khz", "thorp", "warm", "cool", "sea", "calm", "storm"), SPECTRA, ids=[s[0] for s in SPECTRA])
def test_absorption_and_noise_over_the_spectrum(khz, thorp, warm, cool, sea, calm, storm):
    assert thorp_db_per_km(khz) == pytest.approx(thorp, rel=CLOSE)
    assert francois_garrison_db_per_km(khz, 27.0, 35.0, 10.0, 8.1) == pytest.approx(warm, rel=1.1 * CLOSE)
    assert francois_garrison_db_per_km(khz, 10.0, 35.0, 100.0, 8.1) == pytest.approx(cool, rel=CLOSE)
    assert noise_db_per_hz(khz, 0.5, 5.0) == pytest.approx(sea, abs=6e-4)
    assert noise_db_per_hz(khz, 0.5, 0.0) == pytest.approx(calm, abs=6e-4)
    assert noise_db_per_hz(khz, 1.0, 10.0) == pytest.approx(storm, abs=6e-4)


@pytest.mark.parametrize(
    ("khz", "temperature_c", "salinity_psu", "depth_m", "ph", "expected"),
    [
        (10.0, 4.0, 35.0, 1000.0, 8.0, 1.0053),
        (50.0, 4.0, 35.0, 1000.0, 8.0, 13.1304),
        (25.0, 20.0, 35.0, 100.0, 8.1, 3.6685),
        # by hand, without salt: A3 = 4.937e-4 - 2.59e-4 + 9.11e-5 - 1.5e-5 = 3.108e-4; times 625
        (25.0, 10.0, 0.0, 0.0, 8.0, 0.19425),
    ],
)
def test_absorption_in_deep_warm_and_fresh_water(khz, temperature_c, salinity_psu, depth_m, ph, expected):
    assert francois_garrison_db_per_km(khz, temperature_c, salinity_psu, depth_m, ph) == pytest.approx(
        expected, rel=CLOSE
    )


@given(st.floats(1.0, 60.0), st.floats(0.1, 8.0), st.floats(0.0, 1.0), st.floats(0.0, 20.0))
def test_noise_in_a_band_is_the_integral_of_its_density(low: float, width: float, shipping: float, wind: float):
    integral, _ = quad(lambda khz: 1000.0 * ratio(noise_db_per_hz(khz, shipping, wind)), low, low + width, epsrel=1e-10)
    assert noise_in_band_db(low, low + width, shipping, wind) == pytest.approx(10.0 * math.log10(integral), abs=1e-4)


@pytest.mark.parametrize(
    ("band_khz", "source_db", "spreading", "snr_db_at_km"),
    [
        ((22.5, 27.5), 185.0, 1.5, {1.0: 58.32, 2.0: 47.70, 3.5: 34.89, 5.0: 23.41, 8.0: 2.04}),
        ((22.5, 27.5), 185.0, 2.0, {1.0: 43.32, 2.0: 31.19, 3.5: 17.17, 5.0: 4.92, 8.0: -17.48}),
        ((7.0, 17.0), 184.0, 2.0, {1.0: 37.02, 2.0: 29.36, 5.0: 16.46, 8.0: 7.45}),
    ],
)
def test_the_link_budget(band_khz, source_db, spreading, snr_db_at_km):
    """Shipping 0.5, wind 5 m/s, absorption of Thorp at the centre of the band."""
    noise_db, centre_khz = noise_in_band_db(*band_khz, 0.5, 5.0), sum(band_khz) / 2.0
    band_hz = 1000.0 * (band_khz[1] - band_khz[0])
    budget = Budget(source_db, noise_db, 0.0, spreading, thorp_db_per_km(centre_khz), band_hz, 100.0)
    for range_km, snr_db in snr_db_at_km.items():
        assert budget.snr_db(1000.0 * range_km) == pytest.approx(snr_db, abs=6e-3)
        gain_db = budget.ebn0_db(1000.0 * range_km) - budget.snr_db(1000.0 * range_km)
        assert gain_db == pytest.approx(10.0 * math.log10(band_hz / 100.0))


def test_transmission_loss_by_hand():
    """2 km: 15 log10(2000) = 49.515 dB and 2 * 6.1048 dB."""
    budget = Budget(185.0, 80.0, 0.0, 1.5, 6.1048, 5000.0, 100.0)
    assert budget.loss_db(2000.0) == pytest.approx(49.51545 + 12.2096, rel=CLOSE)
    assert budget.loss_db(0.0) == budget.loss_db(1.0)


# Bits ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("db", "fsk", "psk"), [(10.0, 3.369e-3, 3.872e-6), (15.0, 6.795e-8, 9.124e-16)])
def test_bit_error_rates(db: float, fsk: float, psk: float):
    """To four digits."""
    assert (steady(FSK, ratio(db)), steady(PSK, ratio(db))) == pytest.approx((fsk, psk), rel=2.5 * CLOSE)


def test_bit_error_rates_of_other_modulations_by_hand():
    """At Eb/N0 = 10: DPSK exp(-10) / 2; coherent FSK is PSK at half of it: Q(sqrt 10) = 7.827e-4."""
    assert (steady(DPSK, 10.0), steady(FSK_C, 10.0)) == pytest.approx((2.26999649e-5, 7.82701e-4), rel=CLOSE)


@pytest.mark.parametrize("modulation", Modulation)
@pytest.mark.parametrize("db", [-10.0, 0.0, 10.0, 20.0])
def test_a_faded_rate_is_the_mean_of_the_steady_one_over_the_fade(modulation: Modulation, db: float):
    g = ratio(db)
    mean, _ = quad(lambda x: steady(modulation, x) * math.exp(-x / g) / g, 0.0, 200.0, epsrel=1e-11, limit=500)
    assert faded(modulation, g) == pytest.approx(mean, rel=1e-6)


@given(st.sampled_from(Modulation), st.floats(1e-12, 0.5))
def test_the_snr_for_a_bit_error_rate_gives_that_rate(modulation: Modulation, rate: float):
    assert steady(modulation, needed_ebn0(modulation, rate)) == pytest.approx(rate, rel=1e-6)


# Packets ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("modulation", Modulation)
@pytest.mark.parametrize("n_bits", [1, 256, 16384])
@pytest.mark.parametrize("db", [-5.0, 20.0, 40.0])
def test_a_block_under_one_fade_against_another_quadrature(modulation: Modulation, n_bits: int, db: float):
    """QUADPACK on the integral as it stands, in pieces; ours sums over thresholds."""
    g = ratio(db)

    def density(x: float) -> float:
        rate = steady(modulation, x)
        return (block_loss(rate, n_bits) if rate < 0.5 else 1.0 - 0.5**n_bits) * math.exp(-x / g) / g

    edges = [0.0, 1.0, 3.0, 6.0, 10.0, 15.0, 20.0, 30.0, 50.0, 120.0]
    expected = sum(quad(density, low, high, epsabs=0.0, epsrel=1e-10, limit=300)[0] for low, high in pairwise(edges))
    assert faded_block_loss(modulation, n_bits, g) == pytest.approx(expected, rel=1e-6)
    assert packet_loss(modulation, Fading.PACKET, n_bits, 64, g) == faded_block_loss(modulation, n_bits, g)


@pytest.mark.parametrize("modulation", Modulation)
@pytest.mark.parametrize("fading", Fading)
def test_with_noise_alone_the_bit_error_rate_is_one_half(modulation: Modulation, fading: Fading):
    """Of n bits all are right by chance in one of 2^n packets."""
    for n_bits in (1, 3, 10):
        assert packet_loss(modulation, fading, n_bits, 16, 0.0) == pytest.approx(1.0 - 0.5**n_bits)


@given(
    st.sampled_from(Modulation), st.sampled_from(Fading), st.integers(0, 4096), st.integers(8, 4096), st.floats(-40, 60)
)
def test_a_loss_is_a_probability_that_falls_as_the_signal_grows(modulation, fading, n_bits, frame_bits, db):
    weak, strong = (packet_loss(modulation, fading, n_bits, frame_bits, ratio(db + gain)) for gain in (0.0, 1.0))
    assert 0.0 <= strong <= weak <= 1.0
    assert n_bits > 0 or weak == 0.0


def test_a_short_last_frame_enters_with_its_own_size():
    g = ratio(20.0)
    whole, rest = (frame_loss(FSK, Fading.FRAME, n, g) for n in (256, 40))
    assert packet_loss(FSK, Fading.FRAME, 552, 256, g) == pytest.approx(1.0 - (1.0 - whole) ** 2 * (1.0 - rest))
