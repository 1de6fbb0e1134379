"""Stations in a served sea, without sockets: fates of packets, slots, ranges, positions, and the recording."""

import math
from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import remoras
from exchange.channel.loss import uniform
from exchange.drivers.fjage import line_of
from missions.errors import ConfigurationError
from missions.nodes.recording import Access, Trace, of_network, of_scenario, traces_in, written
from missions.nodes.sea import MOST_QUEUED, Packet, Received, Sea
from missions.nodes.unet import UnetProgram
from missions.runs.setup import Setup, resolved
from missions.verification import verify

PER = 0.4
OFFERS = st.lists(st.tuples(st.floats(0.0, 30.0), st.integers(0, 3), st.integers(1, 64)), min_size=1, max_size=25).map(
    sorted
)
"""Times (s), stations and sizes (bytes) of packets of programs."""


@cache
def setup(access: Access, *overrides: str) -> Setup:
    return resolved(of_scenario("mapping-rendezvous", access, [("--set", text) for text in overrides]))


def lossy(access: Access = "free") -> Setup:
    return setup(access, f"channel.per={PER}")


def played(sea: Sea, offers: Sequence[tuple[float, int, int]], until_s: float = 400.0) -> list[tuple[int, Received]]:
    """Receptions of all stations as (station, reception)."""
    heard: list[tuple[int, Received]] = []
    for number, station in enumerate(sea.stations):
        station.listeners.append(lambda received, number=number: heard.append((number, received)))
    for at_s, number, size in offers:
        sea.advance(at_s)
        sea.offer(sea.stations[number], Packet(bytes(size)))
    sea.advance(until_s)
    return heard


@given(OFFERS, st.integers(0, 1000))
@settings(max_examples=15, deadline=None)
def test_losses_are_the_draws_of_the_simulator_whatever_the_times(offers, seed):
    """Independently: the n-th packet of a station is that of its n-th slot, lost where its draw is below per."""
    sea = Sea(lossy(), seed)
    played(sea, offers)
    sent = [0] * 4
    for slot, _, sender, *_, receivers, lost_by, end_s, _, _, _, _, _, _, collided_at in sea.recorder.packets:
        node = next(station.data.node for station in sea.stations if station.data.name == sender)
        assert slot == 4 * sent[node] + node
        sent[node] += 1
        expected = {
            other.data.name
            for other in sea.stations
            if other.data.node != node and uniform(seed, 0, slot, node, other.data.node) < PER
        }
        assert set(lost_by) == expected, f"packet until {end_s}"
        assert {*receivers, *lost_by, *collided_at} == {s.data.name for s in sea.stations if s.data.node != node}
    assert sent == [sum(number == node for _, number, _ in offers) for node in range(4)]


@given(OFFERS, st.integers(0, 1000))
@settings(max_examples=10, deadline=None)
def test_in_slots_nothing_collides_and_programs_receive_what_is_recorded(offers, seed):
    sea = Sea(lossy("slots"), seed)
    heard = played(sea, offers)
    rows, schedule = sea.recorder.packets, sea.setup.schedule
    assert len(rows) == len(offers)
    assert not any(row[-1] for row in rows)
    assert all(row[1] == schedule.start_s(row[0]) for row in rows)
    assert len(heard) == sum(len(row[6]) for row in rows)


def test_free_packets_collide_and_a_sender_does_not_receive():
    """Two packets of one length, sent at once: both overlap at the others, and neither sender listens."""
    sea = Sea(setup("free"), 1)
    heard = played(sea, [(5.0, 0, 20), (5.0, 1, 20), (50.0, 2, 20)])
    one, other, alone = sea.recorder.packets
    assert len(one[-1]) == len(other[-1]) == 3
    assert one[6] == other[6] == []
    assert sorted(number for number, _ in heard) == [0, 1, 3]
    assert len(alone[6]) == 3
    assert sea.stations[3].counts == {"received": 1, "collided": 2, "lost": 0}


def test_a_packet_takes_the_time_of_modem_and_water():
    """By hand: 16 bytes at 463 bit/s, and 411.6 m of the network's map at 1500 m/s."""
    sea = Sea(resolved(of_network("mission-2012", "free", ["21", "22"], [])), 3)
    heard = [received for _, received in played(sea, [(5.0, 0, 16)] * 8, 50.0)]
    sent_s = [row[1] for row in sea.recorder.packets if row[6]]
    assert {received.sender for received in heard} == {21}
    assert [received.time_s for received in heard] == pytest.approx(
        [at_s + 8 * 16 / 463.0 + math.hypot(398.0, 105.0) / 1500.0 for at_s in sent_s]
    )


def test_an_outage_and_a_burst_lose_packets():
    out = Sea(setup("free", "channel.blackout=[{from_s=10,until_s=20}]"), 1)
    played(out, [(5.0, 0, 8), (12.0, 0, 8), (25.0, 0, 8)])
    assert [len(row[7]) for row in out.recorder.packets] == [0, 3, 0]
    bursts = "channel={name='gilbert-elliott',p_good_to_bad=0.02,p_bad_to_good=0.02,per_good=0.0,per_bad=1.0}"
    sea = Sea(setup("free", bursts), 2)
    played(sea, [(2.0 * number, 0, 8) for number in range(200)], 500.0)
    lost = [sea.stations[1].data.name in row[7] for row in sea.recorder.packets]
    changes = sum(one != other for one, other in pairwise(lost))
    # Independent losses of one half would change at every second packet; states last 50 slots, 12 packets.
    assert 0 < changes < 60


def test_a_range_is_the_distance_and_no_answer_ends_in_time():
    sea, found = Sea(setup("free"), 1), []
    sea.advance(1.0)
    assert sea.measure(sea.stations[0], sea.stations[2].address, found.append) == ""
    sea.advance(20.0)
    (x_m, y_m), (to_x_m, to_y_m) = (sea.stations[number].at_m for number in (0, 2))
    assert found == [pytest.approx(math.hypot(to_x_m - x_m, to_y_m - y_m))]
    cut = Sea(setup("free", "channel.blackout=[{from_s=0,until_s=100}]"), 1)
    cut.measure(cut.stations[0], cut.stations[2].address, found.append)
    cut.advance(20.0)
    assert found[1:] == [None]


def test_what_the_modem_cannot_take_is_refused_and_counted():
    sea = Sea(setup("free"), 1)
    station = sea.stations[0]
    assert "allowed: 1 to 64" in sea.offer(station, Packet(bytes(65)))
    assert sea.offer(station, Packet(b""))
    assert [bool(sea.offer(station, Packet(b"x"))) for _ in range(MOST_QUEUED + 2)] == [False] * MOST_QUEUED + [
        True
    ] * 2
    assert station.counts["refused"] == 4
    sea.place(station, math.inf, 0.0)
    sea.place(station, math.nan, 0.0)
    assert station.counts["refused"] == 6
    assert station.target_m == station.data.start_m


@pytest.mark.parametrize("access", ["free", "slots"])
def test_the_recording_follows_by_the_independent_checker(access: Access, tmp_path: Path):
    sea = Sea(lossy(access), 7, {"AUV00": [(0.0, (0.0, 0.0)), (10.0, (60.0, 80.0)), (30.0, (60.0, 80.0))]})
    sea.place(sea.stations[2], 300.0, 40.0)
    played(sea, [(0.7 * number, number % 4, 8 + number) for number in range(40)], 33.3)
    end_s = sea.finish()
    assert end_s == 34.0
    assert sea.stations[1].at_m == (60.0, 80.0)
    assert sea.stations[2].at_m == pytest.approx((300.0, 40.0))
    written(sea.setup, sea.seed, sea.recorder, tmp_path / "sea")
    report = verify(tmp_path / "sea")
    assert not report.findings, report.findings[:3]
    assert report.checked["arrivals"] > 20
    caption = remoras.open(tmp_path / "sea").plot("tdma").caption
    assert "strategy none, policy none" in caption
    assert ("TDMA" in caption) == (access == "slots")
    # The same rows with one packet that its sender could not have sent yet.
    late = next(row for row in sea.recorder.packets if row[2] == sea.recorder.packets[0][2] and row[0] > 3)
    sea.recorder.packets[sea.recorder.packets.index(late)] = (late[0], late[1] - 1.5, *late[2:])
    sea.recorder.packets.sort(key=lambda row: row[1])
    written(sea.setup, sea.seed, sea.recorder, tmp_path / "other")
    assert verify(tmp_path / "other").findings


def test_positions_come_from_a_file_or_a_run_and_bad_ones_are_named(tmp_path: Path):
    scenario, file = lossy().scenario, tmp_path / "tracks.csv"
    file.write_text("time_s, vehicle, x_m, y_m\n0, AUV00, 1, 2\n5, AUV00, 3, 4\n")
    expected: Trace = [(0.0, (1.0, 2.0)), (5.0, (3.0, 4.0))]
    assert traces_in(file, scenario)["AUV00"] == expected
    for bad in ("0,AUV99,1,2", "5,AUV00,1,2\n4,AUV00,1,2", "0,AUV00,nan,2", "0,AUV00,1e9,2", "0,AUV00"):
        file.write_text(f"time_s,vehicle,x_m,y_m\n{bad}\n")
        with pytest.raises(ConfigurationError, match=r"row \d = "):
            traces_in(file, scenario)
    file.write_text("time,name\n1,AUV00\n")
    with pytest.raises(ConfigurationError, match="time_s,vehicle,x_m,y_m"):
        traces_in(file, scenario)
    sea = Sea(lossy(), 1)
    sea.place(sea.stations[0], 30.0, 0.0)
    sea.advance(5.0)
    written(sea.setup, 1, sea.recorder, tmp_path / "run")
    again = Sea(lossy(), 1, traces_in(tmp_path / "run", scenario))
    again.advance(5.0)
    assert again.stations[0].at_m == (30.0, 0.0)


def test_networks_of_ranges_need_names_of_stations():
    with pytest.raises(ConfigurationError, match="two stations or more"):
        of_network("ahoi", "free", [], [])
    with pytest.raises(ConfigurationError, match="allowed: 21, 22, 27, 28, 29"):
        of_network("mission-2012", "free", ["21", "23"], [])
    with pytest.raises(ConfigurationError, match="used 2 times"):
        of_network("ahoi", "free", ["A", "A"], [])
    near = of_network("ahoi", "free", ["A", "B"], [("--set", "vehicle.B.start_m=[46.0,0.0]")])
    assert [vehicle.start_m for vehicle in near.vehicle] == [(0.0, 0.0), (46.0, 0.0)]


WORDS = (
    "node", "phy", "ranging", "location", "address", "MTU", "ParameterReq", "DatagramReq", "TxFrameReq", "RangeReq",
    "AddressResolutionReq", "send", "agentForService", "wantsMessagesFor", "agents", "[B", "PHYSICAL",
)  # fmt: skip
KEYS = (
    "action", "id", "message", "clazz", "data", "recipient", "sender", "msgID", "param", "value", "requests", "to",
    "protocol", "reliability", "service", "agentIDs", "agentID", "name", "alive", "inResponseTo", "index",
)  # fmt: skip
LEAVES = st.none() | st.booleans() | st.integers() | st.just(10**400) | st.floats() | st.sampled_from(WORDS)
VALUES = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(KEYS), inner, max_size=6),
    max_leaves=12,
)
TABLES = st.dictionaries(st.sampled_from(KEYS), VALUES, max_size=6)
HEAD = {"sender": "me", "msgID": "1"}
MESSAGES = st.builds(
    lambda name, data, to: {
        "action": "send",
        "message": {"clazz": f"org.arl.unet.{name}", "data": {**data, **HEAD, "recipient": to}},
    },
    st.sampled_from(WORDS),
    TABLES,
    st.sampled_from(WORDS[:3]),
)


@given(st.lists(MESSAGES | TABLES, max_size=8))
@settings(max_examples=60, deadline=None)
def test_no_request_of_a_program_ends_the_service(requests):
    sea, said = Sea(setup("free"), 1), []
    program = UnetProgram(sea, sea.stations[0], lambda value: said.append(line_of(value)), 0.0)
    for request in requests:
        program.take(request)
    sea.advance(60.0)
    asked = Packet(b"still served")
    assert sea.offer(sea.stations[1], asked) == ""
    sea.advance(120.0)
    assert sea.stations[1].counts["sent"] > 0
