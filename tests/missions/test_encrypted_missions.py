"""Encrypted missions with one key: no repeated nonce, no accepted packet of another mission, unchanged tables."""

from pathlib import Path

import pytest
from cryptography.hazmat.primitives.ciphers import aead
from diving import BEGAN, together

from exchange.channel.channel import Arrival
from exchange.errors import PeerFault
from missions.errors import ConfigurationError
from missions.nodes import LoneVehicle, NodePlan, alone, read_log
from missions.nodes.logs import LineKind, LogEntry, Logged, back
from missions.runs.assembly import assemble, channel_of
from missions.runs.results import manifest
from missions.runs.run import run
from missions.runs.setup import Setup, resolved
from missions.scenarios import Scenario, load
from remoras.fleet.fleet import Fleet
from remoras.fleet.standalone import Sent

NAMES = ("ASV00", "AUV00")
KEY = "00112233445566778899aabbccddeeff"
RESTART = "fault=[{kind='restarts', vehicle='AUV01', at_s=60, until_s=90, memory='lost'}]"
CLOCKS = "communication.clocks={offset_s=0.1, drift_ppm=50.0}"


@pytest.fixture
def key_file(tmp_path: Path) -> Path:
    path = tmp_path / "fleet.key"
    path.write_text(KEY)
    path.chmod(0o600)
    return path


@pytest.fixture
def used(monkeypatch: pytest.MonkeyPatch) -> list[tuple[bytes, bytes]]:
    """(key, nonce) of all that is encrypted."""
    pairs: list[tuple[bytes, bytes]] = []
    real = aead.AESCCM

    class Spy:
        def __init__(self, key: bytes, tag_length: int) -> None:
            self._key, self._cipher = key, real(key, tag_length)
            self.decrypt = self._cipher.decrypt

        def encrypt(self, nonce: bytes, data: bytes, head: bytes | None) -> bytes:
            pairs.append((self._key, nonce))
            return self._cipher.encrypt(nonce, data, head)

    monkeypatch.setattr(aead, "AESCCM", Spy)
    return pairs


def scenario(key_file: Path, *settings: str) -> Scenario:
    given = (f"communication.key_file='{key_file}'", "scenario.duration_s=150", *settings)
    return load("mapping-rendezvous", [("--set", one) for one in given])


class Tapped:
    """The channel of a scenario, and all that was sent: slot and bytes."""

    def __init__(self, setup: Setup, seed: int) -> None:
        self._channel = channel_of(setup, seed)
        self.sent: list[tuple[int, bytes]] = []

    def transmit(self, slot: int, sender: int, data: bytes, now_s: float, positions_m: object) -> list[Arrival]:
        self.sent.append((slot, data))
        return self._channel.transmit(slot, sender, data, now_s, positions_m)


def flown(setup: Setup, seed: int) -> tuple[Fleet, list[tuple[int, bytes]]]:
    channel = Tapped(setup, seed)
    fleet = assemble(setup, seed, channel)
    fleet.run()
    return fleet, channel.sent


def n_open(fleet: Fleet, setup: Setup, sent: list[tuple[int, bytes]]) -> int:
    """How many packets the vehicles of a fleet can open."""
    codec, found = fleet.vehicles[0].radio.manager._codec, 0
    for slot, data in sent:
        try:
            codec.decode(data, setup.schedule.frame_of(slot), setup.schedule.start_s(slot))
            found += 1
        except PeerFault:
            pass
    return found


@pytest.mark.slow
def test_no_nonce_repeats_and_packets_of_other_missions_are_refused(
    key_file: Path, used: list[tuple[bytes, bytes]]
) -> None:
    """Two seeds, one of them twice, and another loss rate: repeats of a sweep, and missions of other days."""
    plain, lossy = (resolved(scenario(key_file, f"channel.per={per}", RESTART, CLOCKS)) for per in (0.2, 0.5))
    flights = [
        (plain, *flown(plain, 1)),
        (plain, *flown(plain, 2)),
        (plain, *flown(plain, 1)),
        (lossy, *flown(lossy, 1)),
    ]
    assert len(used) > 4 * 60
    assert len(set(used)) == len(used)
    assert len({nonce for _, nonce in used}) == len(used)
    for number, (setup, fleet, _) in enumerate(flights):
        for other, (_, _, sent) in enumerate(flights):
            assert n_open(fleet, setup, sent) == (len(sent) if number == other else 0)


def test_no_table_depends_on_the_bytes_of_packets(key_file: Path) -> None:
    """Twice the same scenario and seed: other bytes on the way, the same rows."""
    setup = resolved(scenario(key_file, "channel.per=0.3"))
    (one, first), (other, second) = flown(setup, 3), flown(setup, 3)
    assert not {data for _, data in first} & {data for _, data in second}
    tables = [{name: list(fleet.recorder.rows(name)) for name in fleet.recorder.tables} for fleet in (one, other)]
    assert repr(tables[0]) == repr(tables[1])


def test_key_changes_only_packet_bytes_and_is_never_written(key_file: Path) -> None:
    given = [("--set", "scenario.duration_s=150"), ("--set", "channel.name='perfect'")]
    plain = run(load("mapping-rendezvous", given))
    sealed = run(scenario(key_file, "channel.name='perfect'", "communication.crc_bits=16"))
    assert sealed.milestones == plain.milestones
    assert not [row for row in sealed.recorder.faults if row[2] == "bad packet"]
    assert KEY not in repr(manifest(sealed)) + repr(sealed.scenario)
    assert str(key_file) in manifest(sealed)["scenario"]
    assert "key_file" not in manifest(plain)["scenario"]


@pytest.mark.parametrize("mode", [0o644, 0o640, 0o604, 0o660])
def test_key_file_open_to_others_is_refused_with_the_remedy(key_file: Path, mode: int) -> None:
    key_file.chmod(mode)
    with pytest.raises(ConfigurationError, match=f"open to others .mode {mode:03o}.: chmod 600 .*fleet.key") as raised:
        scenario(key_file)
    assert KEY not in str(raised.value)


# Vehicles in processes of their own ---------------------------------------------------------------


def plans(key_file: Path) -> list[NodePlan]:
    return [NodePlan.of(scenario(key_file), name, 1, 100.0, 50.0) for name in NAMES]


def test_dives_share_no_nonce_and_packets_of_the_first_are_refused(
    key_file: Path, tmp_path: Path, used: list[tuple[bytes, bytes]]
) -> None:
    """All packets of the first dive are replayed in the second, before the true ones of that time."""
    together(plans(key_file), tmp_path / "one")
    first = len(used)
    heard = {name: read_log(tmp_path / "one" / f"{name}.jsonl").entries for name in NAMES}
    own = [alone(plan) for plan in plans(key_file)]
    for one in own:
        packets = [entry for entry in heard[one.plan.vehicle] if entry.kind == "heard"]
        for entry in packets:
            one.solo.hear(entry.data, entry.time_s)
        one.solo.advance(one.plan.end_s)
        assert len(packets) > 20
        assert one.solo.n_refused >= len(packets) - 2  # two may be introductions, which repeat another salt
        vehicle = one.solo.vehicle
        assert {origin for origin, _ in vehicle.beliefs.model.digest()} <= {vehicle.data.node}
    assert len(set(used)) == len(used) > first > 30


def said(sent: list[Sent]) -> list[LogEntry]:
    return [LogEntry(LineKind.SENT, one.time_s, one.packet.data) for one in sent]


def gone_on(log: Logged, now_s: float) -> tuple[LoneVehicle, Logged]:
    """Resume at a time and run half a minute: the log is reproduced, and the next packet announces the new salt."""
    own, difference = back(log, now_s)
    assert difference == ""
    entries = said(own.solo.advance(now_s + 30.0))
    assert own.salt in entries[0].data
    return own, Logged(log.plan, (*log.entries, LogEntry(LineKind.BACK, now_s, own.salt), *entries), None, BEGAN)


def test_processes_resumed_from_one_log_have_different_salts(key_file: Path) -> None:
    plan = plans(key_file)[1]
    own = alone(plan)
    log = Logged(plan, (LogEntry(LineKind.SALT, 0.0, own.salt), *said(own.solo.advance(40.0))), None, BEGAN)
    salts = [own.salt]
    for _ in range(2):
        first, longer = gone_on(log, 45.0)
        second, _ = gone_on(longer, 90.0)
        salts += first.salt, second.salt
    assert len(set(salts)) == 5
