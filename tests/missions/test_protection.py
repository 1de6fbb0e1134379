"""A scenario that asks for checksums or names a key."""

from pathlib import Path

from missions.runs.results import manifest
from missions.runs.run import run
from missions.scenarios import Scenario, load

SHORT = "scenario.duration_s=120"
PERFECT = 'channel.name="perfect"'
KEY = "00112233445566778899aabbccddeeff"


def scenario(*settings: str) -> Scenario:
    return load("mapping-rendezvous", [("--set", setting) for setting in (SHORT, PERFECT, *settings)])


def test_a_key_changes_nothing_but_bytes_and_is_written_nowhere(tmp_path: Path) -> None:
    path = tmp_path / "fleet.key"
    path.write_text(KEY)
    path.chmod(0o600)
    plain = run(scenario())
    sealed = run(scenario(f"communication.key_file='{path}'", "communication.crc_bits=16"))
    assert sealed.milestones == plain.milestones
    assert not [row for row in sealed.recorder.faults if row[2] == "bad packet"]
    assert KEY not in repr(manifest(sealed)) + repr(sealed.scenario)
    assert str(path) in manifest(sealed)["scenario"]
    assert "key_file" not in manifest(plain)["scenario"]
