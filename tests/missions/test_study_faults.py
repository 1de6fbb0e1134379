"""All faults of a study at once, each with its line, and none that is owed to another."""

from pathlib import Path

import pytest

from missions.errors import ConfigurationError
from missions.sweeps.study import load_study

MANY = """[study]
scenario = "mapping-rendezvous"
repeats = 2
strategies = ["remora"]
sampling = "latin"
samples = "many"
[latin]
decision.weight_external = [1, 0]
[stopping]
metric = "goal"
[[unforeseen]]
nme = "x"
"""
ONE = """[study]
name = "bad"
scenario = "mapping-rendezvous"
strategies = ["remoras", "cbba"]
baseline = "cbba"
sampling = "list"
repeats = 2
metrics = ["n_bytes"]
[[point]]
channel.per = 0.1
[stopping]
metric = "n_bytes"
half_width = 1.0
maximum = 10
"""


def faults(tmp_path: Path, text: str) -> list[str]:
    """Line and key of each fault that is told."""
    file = tmp_path / "study.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError) as raised:
        load_study(str(file))
    told = [(fault.line, fault.key) for fault in raised.value.faults]
    assert told == sorted(told, key=lambda place: place[0] or 0)
    return [f"{line} {key}" for line, key in told]


def test_faults_of_every_table_are_told(tmp_path: Path) -> None:
    assert faults(tmp_path, MANY) == [
        "1 study.name", "4 study.strategies", "6 study.samples", "8 latin.decision.weight_external",
        "9 stopping.maximum", "9 stopping.half_width", "10 stopping.metric", "11 unforeseen.1.name",
        "12 unforeseen.1.nme",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("was", "now", "told"),
    [
        ('"remoras", "cbba"]', '"remoras", 3]', "4 study.strategies.2"),  # so nothing is said of the baseline
        ('sampling = "list"', 'sampling = "lst"', "6 study.sampling"),  # nor of [[point]], which another would read
        ("repeats = 2", "repeats = 0", "7 study.repeats"),
        ("repeats = 2\n", "", "2 study.repeats"),
        ('"n_bytes"]', '"n_byte"]', "8 study.metrics"),
        ("channel.per = 0.1", "channel.per = 1.5", "10 point.1.channel.per"),
        ("channel.per = 0.1", "channel = 3", "10 point.1.channel"),
        ("half_width = 1.0", "half_width = 0.0", "13 stopping.half_width"),
        ("maximum = 10", "maximum = 1", "14 stopping.maximum"),
    ],
)
def test_one_fault_is_told_as_one(tmp_path: Path, was: str, now: str, told: str) -> None:
    assert was in ONE
    found = faults(tmp_path, ONE.replace(was, now, 1))
    assert found == [told]
