"""Missions on the channel ``network``: who is which node, what is refused where, what results and captions say."""

import json
from itertools import permutations
from pathlib import Path

import pytest
from small_mission import SMALL, faults_of, line_of, pond

from missions.errors import ConfigurationError
from missions.runs.assembly import channel_of
from missions.runs.results import Results, write_results
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.scenarios import Scenario

OWN = '[channel]\nname = "bernoulli"\nper = 0.2\n'
NETWORK = '[channel]\nname = "network"\nnetwork = "harbour.csv"\n'
HARBOUR = "sender,receiver,per\nquay,buoy,0.1\nbuoy,quay,0.5\n"
STATIC = "static links on moving vehicles"


def text_of(channel: str) -> str:
    return SMALL.replace(OWN, channel)


def losses(scenario: Scenario, seed: int) -> list[tuple[int, int, float]]:
    link = channel_of(resolved(scenario), seed).link
    return sorted((a, b, p) for (a, b), p in link.per_of.items())  # type: ignore[attr-defined]  # it is a Matrix


def test_nodes_are_drawn_by_the_seed_or_given_by_the_scenario(tmp_path: Path) -> None:
    """Boat is the first vehicle of the file and owns slot 1."""
    (tmp_path / "harbour.csv").write_text(HARBOUR)
    drawn = pond(tmp_path, text_of(NETWORK))
    assert {tuple(losses(drawn, seed)) for seed in range(20)} == {
        ((0, 1, 0.1), (1, 0, 0.5)),
        ((0, 1, 0.5), (1, 0, 0.1)),
    }
    fixed = pond(tmp_path, text_of(NETWORK + 'nodes = { Boat = "quay" }\n'))
    assert {tuple(losses(fixed, seed)) for seed in range(20)} == {((0, 1, 0.5), (1, 0, 0.1))}
    by_option = pond(tmp_path, text_of(NETWORK), "channel.nodes.Diver=quay")
    assert losses(by_option, 1) == [(0, 1, 0.1), (1, 0, 0.5)]


NUMBERED = "sender,receiver,per\n21,27,0.1\n27,21,0.5\n"


def test_a_node_may_be_a_whole_number(tmp_path: Path) -> None:
    """In a file and on the command line; what is kept is its name."""
    (tmp_path / "harbour.csv").write_text(NUMBERED)
    in_file = pond(tmp_path, text_of(NETWORK + "nodes = { Boat = 21 }\n"))
    by_option = pond(tmp_path, text_of(NETWORK), "channel.nodes.Boat=21")
    for scenario in (in_file, by_option):
        assert scenario.channel.nodes == {"Boat": "21"}
        assert losses(scenario, 1) == [(0, 1, 0.5), (1, 0, 0.1)]
    assert pond(tmp_path, text_of(NETWORK + 'nodes = { Boat = "21" }\n')) == in_file
    allowed = {"type": "object", "additionalProperties": {"type": ["string", "integer"]}}
    schema = type(in_file.channel).model_json_schema()["properties"]["nodes"]
    assert {key: schema[key] for key in allowed} == allowed


def test_results_say_which_file_it_was_and_are_read_when_it_is_gone(tmp_path: Path) -> None:
    file = tmp_path / "harbour.csv"
    file.write_text(HARBOUR)
    scenario = pond(tmp_path, text_of(NETWORK), "scenario.duration_s=120")
    table = json.loads(scenario.model_dump_json())["channel"]
    assert (table["network"], len(table["sha256"])) == (str(file), 64)
    write_results(run(scenario, seed=1), tmp_path / "out")
    file.write_text(HARBOUR.replace("0.5", "0.6"))
    again = Results.read(tmp_path / "out")
    assert again.scenario.channel.network == str(file)
    assert again.manifest["assumed"] in (
        f"harbour: {STATIC}, Diver = {one}, Boat = {other}" for one, other in permutations(("quay", "buoy"))
    )
    with pytest.raises(ConfigurationError, match=r"channel\.network.*harbour\.csv.*is not the file that was used"):
        run(again.scenario, seed=1)
    file.unlink()
    with pytest.raises(ConfigurationError, match=r"channel\.network.*cannot be read: No such file"):
        run(again.scenario, seed=1)


def test_a_fault_in_a_file_of_its_own_has_its_line(tmp_path: Path) -> None:
    file = tmp_path / "harbour.toml"
    node = '[[network.node]]\nname = "{}"\nper = {{ {} = {} }}\n'
    file.write_text('[[network]]\nname = "h"\n' + node.format("quay", "buoy", 1.5) + node.format("buoy", "quay", 0.5))
    (fault,) = faults_of(tmp_path, text_of(NETWORK.replace("csv", "toml")))
    assert (fault.file, fault.line, fault.key) == (str(file), 5, "network.h.node.quay.per.buoy")
    file.write_text("[[network]\n")
    (fault,) = faults_of(tmp_path, text_of(NETWORK.replace("csv", "toml")))
    assert (fault.file, fault.key) == (str(file), "TOML")
    assert "line 1" in fault.allowed
    (tmp_path / "harbour.csv").write_text(HARBOUR.replace("0.5", "-0.5"))
    (fault,) = faults_of(tmp_path, text_of(NETWORK))
    assert (
        fault.text("pond.toml") == f'{tmp_path / "harbour.csv"}:3: per = "-0.5": of buoy to quay: a number from 0 to 1'
    )


@pytest.mark.parametrize(
    ("channel", "key", "says"),
    [
        (NETWORK.replace("harbour.csv", "mission-2021"), "network", "did you mean 'mission-2012'?"),
        (NETWORK.replace("harbour.csv", "lake.csv"), "network", "cannot be read: No such file"),
        (NETWORK + 'nodes = { Boat = "quai" }\n', "nodes.Boat", "allowed: quay, buoy; did you mean 'quay'?"),
        (NETWORK + "nodes = { Boat = 3 }\n", "nodes.Boat", "allowed: quay, buoy"),
        (NETWORK + "per = 0.1\n", "per", "not used by the network channel, only by bernoulli and matrix"),
    ],
)
def test_what_does_not_fit_is_one_line_of_the_scenario(tmp_path: Path, channel: str, key: str, says: str) -> None:
    (tmp_path / "harbour.csv").write_text(HARBOUR)
    (fault,) = faults_of(tmp_path, text_of(channel))
    assert fault.key == f"channel.{key}"
    assert says in fault.allowed
    assert fault.line == line_of(SMALL.replace(OWN, channel), key.partition(".")[0] + " =")
