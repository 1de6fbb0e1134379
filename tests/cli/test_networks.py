"""The command ``sea`` of a network, the option ``--network``, and what ``list`` says of networks."""

import json
import re
from pathlib import Path

import pytest
from invoked import refused, remoras

from exchange.acoustics.network import network_of, shipped

SHORT = ("--set", "scenario.duration_s=30")


def test_a_network_is_told_with_its_source_and_what_is_assumed() -> None:
    text = remoras("sea", "mission-2012").stdout
    assert "source: M. Chitre" in text
    assert "assumed: static links on moving vehicles" in text
    assert "not known: which frames were counted" in text
    rows = [line.split() for line in text.splitlines()]
    assert ["27", "0.326", "0.826", "-", "0.975", "0.023"] in rows
    found = json.loads(remoras("sea", "hermes-june", "--json").stdout)
    assert found["per_over_range"][3] == [120.0, 0.484]
    assert found["assumed"] == "losses over range as measured"


def test_all_networks_are_listed() -> None:
    found = {row["name"]: row["description"] for row in json.loads(remoras("list", "networks", "--json").stdout)}
    assert found == {name: network.title for name, network in shipped().items()}


@pytest.mark.parametrize("name", shipped())
def test_what_is_drawn_has_a_caption_and_numbers(name: str, tmp_path: Path) -> None:
    remoras("sea", name, "--out", tmp_path, "--format", "svg")
    stem = tmp_path / f"network-{name}"
    assert stem.with_suffix(".svg").read_text().startswith("<?xml")
    assert shipped()[name].citation in stem.with_suffix(".txt").read_text()
    if not shipped()[name].per_over_range:
        assert network_of(str(stem.with_suffix(".csv"))).per == shipped()[name].per


def test_the_option_names_channel_and_network() -> None:
    found = json.loads(remoras("run", "mapping-patches", *SHORT, "--network", "mission-2012", "--json").stdout)
    assert (found["channel"], found["per"]) == ("network", pytest.approx(0.42, abs=1e-3))
    both = ("--channel", "network", "--network", "mission-2012")
    assert json.loads(remoras("run", "mapping-patches", *SHORT, *both, "--json").stdout) == found


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["run", "mapping-patches", "--network", "mission-2021"], "did you mean 'mission-2012'"),
        (["run", "mapping-patches", "--network", "mission-2012", "--channel", "perfect"], "contradicts --channel"),
        (["run", "mapping-patches", "--network", "mission-2012", "--per", "0.1"], "--per .* not used by the network"),
        (["sea", "mission-2021"], "allowed are ahoi, .*did you mean 'mission-2012'"),
        (["sea", "none.csv"], "cannot be read: No such file"),
        (["sea", "none.toml"], "none.toml: a TOML file or one of "),
        (["sea", "mission-2012", "--draws", "5"], "--draws: is about the modems of a scenario"),
    ],
)
def test_what_is_no_network_is_refused(arguments: list[str], says: str) -> None:
    assert re.search(says, refused(*arguments))
