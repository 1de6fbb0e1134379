"""A short run and a small sweep, shared by all tests of commands."""

from pathlib import Path

import pytest
from invoked import remoras

STUDY = """[study]
name = "two"
scenario = "mapping-rendezvous"
policies = ["ack", "m-ack"]
repeats = 2
[[channel]]
name = "bernoulli"
per = [0.1, 0.5]
[set]
scenario.duration_s = 30
"""


@pytest.fixture(scope="session")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("results") / "run"
    short = ("--per", "0.6", "--set", "scenario.duration_s=30")
    assert remoras("run", "mapping-rendezvous", *short, "--out", out).exit_code == 1
    return out


@pytest.fixture(scope="session")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("swept")
    (folder / "two.toml").write_text(STUDY, encoding="utf-8")
    made = remoras("sweep", folder / "two.toml", "--out", folder / "out", "--jobs", "1")
    assert "done 8, none to do" in made.stdout
    return folder / "out"
