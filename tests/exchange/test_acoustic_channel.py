"""The channel model ``acoustic`` of a fleet: losses, range and required settings."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.channel.acoustic import AcousticChannel
from exchange.channel.channel import BroadcastChannel
from exchange.channel.link import Bernoulli, Transmission
from exchange.channel.models import Deployment
from exchange.channel.modems import modems
from exchange.schedule import TdmaSchedule

NANO = modems()["nanomodem-v3"]
FSK = NANO.model_copy(update={"modulation": "fsk-noncoherent", "per_at_snr": ()})
"""The nanomodem as if its bits were tones and its losses not measured."""
FLEET = Deployment({"Boat": 0, "Diver": 1}, (0.0, 200.0), FSK, 4000.0, 3600.0)
LOUD = [modem for modem in modems().values() if modem.source_level_db is not None]


def loss_at(range_m: float, n_bytes: int, **settings: object) -> float:
    packet = Transmission(0, 0, 0.0, 8 * n_bytes)
    return AcousticChannel.model_validate(settings).link_model(FLEET, 1).p_loss(packet, 1, range_m)


def test_loss_equals_the_value_by_hand():
    """168 dB at 2 km, k = 2, Thorp at 28 kHz: 168 - 66.021 - 2 * 7.3915 - 76.715 of noise in 24 to 32 kHz.

    That is 10.481 dB; B / R = 8000 / 463 is 12.375 dB, so Eb/N0 is 22.856 dB or 193.04. Bits of FSK in a fast fade err
    with 1 / 195.04 each, and 16 of them are lost with 0.07895.
    """
    found = loss_at(2000.0, 2, spreading=2.0, absorption="thorp", fading="bit")
    assert found == pytest.approx(0.07895400, rel=1e-4)


def test_sound_speed_is_that_of_the_water_at_the_mean_depth():
    """10 C, 35 psu, 100 m: 1491.4351 m/s after Mackenzie."""
    assert AcousticChannel().sound_speed_mps(FLEET) == pytest.approx(1491.4351, abs=1e-4)


def test_depth_enters_range_and_arrival_time():
    """300 m apart on the chart and 400 m in depth are 500 m."""
    fleet = replace(FLEET, depths_m=(0.0, 400.0))
    link = AcousticChannel(fading="none").link_model(fleet, 1)
    channel = BroadcastChannel(NANO, link, 1, sound_speed_mps=1500.0, range_m=500.0, depths_m=fleet.depths_m)
    (arrival,) = channel.transmit(0, 0, bytes(64), 0.0, [(0.0, 0.0), (300.0, 0.0)])
    assert arrival.time_s == pytest.approx(512 / 463 + 500.0 / 1500.0)
    assert replace(channel, range_m=499.0).transmit(0, 0, bytes(64), 0.0, [(0.0, 0.0), (300.0, 0.0)]) == []


def test_a_distant_packet_is_accepted_if_it_ends_within_its_slot():
    """1000 m at 1500 m/s: a slot of 64 B at 463 bit/s and 0.667 s. 20 B end 0.760 s sooner: 1140 m farther."""
    link = AcousticChannel(source_level_db=200.0).link_model(FLEET, 1)
    channel = BroadcastChannel(NANO, link, 1, range_m=1000.0, carries_beyond_range=True)
    for n_bytes, reach_m in [(64, 1000.0), (20, 1000.0 + 8 * 44 / 463 * 1500.0)]:
        near, far = (
            channel.transmit(0, 0, bytes(n_bytes), 50.0, [(0.0, 0.0), (reach_m + more_m, 0.0)])
            for more_m in (-1.0, 1.0)
        )
        assert (len(near), len(far)) == (1, 0)
    kept = replace(channel, carries_beyond_range=False)
    assert kept.transmit(0, 0, bytes(20), 50.0, [(0.0, 0.0), (1001.0, 0.0)]) == []


@given(st.integers(0, 100_000), st.floats(0.0, 6000.0), st.integers(1, 64), st.floats(1400.0, 1600.0))
def test_a_distant_packet_is_attributed_to_the_slot_it_was_sent_in(slot, range_m, n_bytes, speed_mps):
    schedule = TdmaSchedule(4, NANO.packet_s(NANO.payload_bits), 1000.0 / speed_mps)
    channel = BroadcastChannel(NANO, Bernoulli(0.0), 1, 0, speed_mps, 1000.0, carries_beyond_range=True)
    for arrival in channel.transmit(slot, 0, bytes(n_bytes), schedule.start_s(slot), [(0.0, 0.0), (range_m, 0.0)]):
        assert schedule.slot_of_arrival(arrival.time_s) == slot


@pytest.mark.parametrize("modem", LOUD, ids=lambda modem: modem.name)
def test_mean_loss_is_the_average_over_ranges(modem: object):
    """Monte Carlo over ranges against the rule of the model, of packets of full size."""
    fleet = replace(FLEET, modem=modem, range_m=12_000.0)
    channel = AcousticChannel(spreading=2.0)
    links = channel.links(fleet)
    ranges_m = np.random.Generator(np.random.Philox(3)).uniform(0.0, 12_000.0, 4000)
    losses = [links.loss_at(range_m, fleet.modem.payload_bits) for range_m in ranges_m]
    error = np.std(losses) / math.sqrt(len(losses))
    assert channel.mean_per(fleet) == pytest.approx(np.mean(losses), abs=4.0 * error + 1e-4)


def test_a_profile_without_source_level_is_refused():
    silent = replace(FLEET, modem=modems()["s2c-18-34"])
    (fault,) = AcousticChannel().misfits(silent)
    assert fault.key == "source_level_db"
    for part in ("s2c-18-34", "channel.source_level_db"):
        assert part in fault.allowed
    assert list(AcousticChannel(source_level_db=180.0).misfits(silent)) == []
    with pytest.raises(ValueError, match="s2c-18-34 has no source level"):
        AcousticChannel().link_model(silent, 1)


@pytest.mark.parametrize("modem", modems().values(), ids=lambda modem: modem.name)
def test_a_profile_marks_only_values_it_declares(modem: object):
    assert all(getattr(modem, key) is not None for key in modem.unverified)
    assert 0.0 < modem.band_khz[0] < modem.band_khz[1]
    assert modem.payload_bits % modem.frame_bits == 0
