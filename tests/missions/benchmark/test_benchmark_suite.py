"""Suites: which cases count, and that they stay as they are."""

from pathlib import Path

import pytest

from missions.benchmark.running import Contest
from missions.benchmark.suite import suite_named
from missions.errors import ConfigurationError, OutputError
from missions.scenarios.deployment import deployment_of
from remoras.errors import PluginError

FATHOM_1 = "ea2aba0115e7405defc96f77238edc3bba40158ff1673c4883bfa99a3ad432f0"


def test_the_cases_of_a_suite_never_change() -> None:
    """Another digest means other cases: they are those of another suite, fathom-2."""
    assert suite_named("fathom-1").digest == FATHOM_1


@pytest.mark.slow
def test_it_has_forty_cells_and_the_networks_lose_as_much() -> None:
    suite = suite_named("fathom-1")
    study = suite.study(["remoras"])
    assert len(suite.cells) == len(study.configurations) == 40
    assert study.n_runs == 400
    for configuration in study.configurations:
        channel = configuration.scenario.channel
        assert channel.mean_per(deployment_of(configuration.scenario)) == pytest.approx(0.42, abs=1e-4)


@pytest.mark.slow
def test_every_configuration_is_found_under_its_cell() -> None:
    suite = suite_named("fathom-1")
    strategies = "remoras", "cbba", "oracle"
    study = suite.study(strategies)
    for place, strategy in enumerate(strategies):
        for at, cell in enumerate(suite.cells):
            found = study.configurations[suite.place(at, 0, place, len(strategies))[0]]
            assert (found.source, found.unforeseen) == (cell.ground, cell.unforeseen)
            assert found.scenario.strategy.name == strategy
            assert found.scenario.channel.name == suite.file.network[at // 5 % 4].set["channel.name"]


TEXT = """
[suite]
name = "mine"
grounds = ["mapping-patches"]
bound = "missions.mapping.rounds:rounds"
limit_s = 7200.0
repeats = 2

[[network]]
name = "alike"
set."channel.per" = 0.4

[[network]]
name = "worse"
set."channel.per" = 0.6

[[unforeseen]]
name = "nothing"
"""


@pytest.mark.parametrize(
    ("was", "now", "said"),
    [
        ('"mapping-patches"', '"mapping-patch"', "suite.grounds.*a shipped scenario.*mapping-patches"),
        ('"worse"', '"alike"', "network.2.name.*give each its own"),
        ("repeats = 2", "repeats = 0", "suite.repeats = 0"),
        ("limit_s = 7200.0", "limit = 7200.0", "suite.limit"),
    ],
)
def test_a_file_that_is_wrong_is_told_by_key(was: str, now: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(TEXT.replace(was, now), encoding="utf-8")
    with pytest.raises(ConfigurationError, match=said):
        suite_named(str(path))


@pytest.mark.parametrize(
    ("was", "now", "said"),
    [
        ("0.6", "1.6", "channel.per = 1.6"),
        ("0.6", "0.4", "two cases of this suite run alike"),
        ('set."channel.per" = 0.6', 'set."channel.name" = "network"\nset."channel.network" = "lost.csv"', "lost.csv"),
    ],
)
def test_a_network_that_cannot_be_is_told_before_a_run(was: str, now: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(TEXT.replace(was, now), encoding="utf-8")
    with pytest.raises(ConfigurationError, match=said):
        suite_named(str(path)).study(["remoras"])


def test_what_cannot_be_asked_for_is_told() -> None:
    suite = suite_named("fathom-1")
    with pytest.raises(OutputError, match="--repeats 11: allowed: 1 to 10"):
        Contest.of(suite, ["remoras"], 11)
    with pytest.raises(PluginError, match=r'--strategy "remora".*did you mean'):
        Contest.of(suite, ["remora"])
    assert Contest.of(suite, ["remoras", "cbba", "remoras"], 1).strategies == ("remoras", "cbba")
