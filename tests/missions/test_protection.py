"""A scenario that asks for checksums or names a key."""

from pathlib import Path

import pytest

from missions.errors import ConfigurationError
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


@pytest.mark.parametrize(
    ("setting", "why"),
    [
        ("communication.key_file='nowhere.key'", r'\(communication\.key_file\) = ".*nowhere\.key": cannot be read'),
        ("communication.crc_bits=12", r"\(communication\.crc_bits\) = 12: .*0, 8, 16 or 32"),
    ],
)
def test_what_cannot_protect_is_refused_in_one_line(setting: str, why: str) -> None:
    with pytest.raises(ConfigurationError, match=why):
        scenario(setting)
