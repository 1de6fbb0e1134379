"""All faults of a study at once, each with its line, and none that is owed to another."""

from pathlib import Path

import pytest

from missions.errors import ConfigurationError
from missions.sweeps.study import load_study

FOUR = """[study]
name = "bad"
scenario = "mapping-rendezvous"
strategies = ["remora", "cbba"]
repeats = 0
metrics = ["speed"]
[channel]
name = "bernoulli"
per = "x"
"""
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


def test_a_study_with_four_faults_names_four(tmp_path: Path) -> None:
    assert faults(tmp_path, FOUR) == ["4 study.strategies", "5 study.repeats", "6 study.metrics", "9 channel.per"]


def test_faults_of_every_table_are_told(tmp_path: Path) -> None:
    assert faults(tmp_path, MANY) == [
        "1 study.name", "4 study.strategies", "6 study.samples", "8 latin.decision.weight_external",
        "9 stopping.maximum", "9 stopping.half_width", "10 stopping.metric", "11 unforeseen.1.name",
        "12 unforeseen.1.nme",
    ]  # fmt: skip


def test_the_rest_of_a_table_is_looked_at(tmp_path: Path) -> None:
    text = FOUR + '[grid]\nmission.goal = []\ndecision.weight_external = [0.1, "b"]\n'
    assert faults(tmp_path, text)[-2:] == ["11 grid.mission.goal", "12 grid.decision.weight_external"]


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


def test_a_key_that_is_misspelt_is_missing_too(tmp_path: Path) -> None:
    assert faults(tmp_path, ONE.replace("scenario =", "scenari =")) == ["2 study.scenario", "3 study.scenari"]


def test_a_scenario_at_fault_is_told_after_the_study(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text('[scenario]\nname = "own"\n', encoding="utf-8")
    text = ONE.replace("mapping-rendezvous", "own.toml")
    file = tmp_path / "study.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError, match=r"own\.toml"):
        load_study(str(file))
    assert faults(tmp_path, text.replace("repeats = 2", "repeats = 0")) == ["7 study.repeats"]
