"""Missions on the channel ``network``: who is which node, what is refused where, what results and captions say."""

import json
import math
from collections import Counter
from itertools import permutations
from pathlib import Path

import pytest
from small_mission import SMALL, line_of

from exchange.acoustics.network import shipped
from missions.errors import ConfigurationError, ConfigurationFault
from missions.runs.assembly import channel_of
from missions.runs.results import MemoryResults, Results, write_results
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.runs.summary import identity
from missions.scenarios import Scenario, load
from missions.sweeps import SweepResults, load_study, sweep
from remoras import face

OWN = '[channel]\nname = "bernoulli"\nper = 0.2\n'
NETWORK = '[channel]\nname = "network"\nnetwork = "harbour.csv"\n'
HARBOUR = "sender,receiver,per\nquay,buoy,0.1\nbuoy,quay,0.5\n"
SHORT = [("--set", "scenario.duration_s=120")]
STATIC = "static links on moving vehicles"


def loaded(folder: Path, channel: str, *overrides: tuple[str, str]) -> Scenario:
    file = folder / "pond.toml"
    file.write_text(SMALL.replace(OWN, channel), encoding="utf-8")
    return load(str(file), overrides)


def faults_of(folder: Path, channel: str, *overrides: tuple[str, str]) -> tuple[ConfigurationFault, ...]:
    with pytest.raises(ConfigurationError) as caught:
        loaded(folder, channel, *overrides)
    return caught.value.faults


def losses(scenario: Scenario, seed: int) -> list[tuple[int, int, float]]:
    link = channel_of(resolved(scenario), seed).link
    return sorted((a, b, p) for (a, b), p in link.per_of.items())  # type: ignore[attr-defined]  # it is a Matrix


@pytest.mark.slow
def test_runs_lose_on_all_twenty_links_what_was_measured() -> None:
    """Each link within four standard errors: five vehicles, three seeds, whoever is which node."""
    asked = [("", "channel.name=network"), ("", "fleet.size=5"), ("", "fleet.copies_of=AUV01")]
    scenario, per = load("mapping-patches", asked), shipped()["mission-2012"].per
    n_sent, n_lost = Counter[tuple[str, str]](), Counter[tuple[str, str]]()
    for seed in (1, 2, 3):
        results = MemoryResults(run(scenario, seed))
        node_of = dict(pair.split(" = ") for pair in results.manifest["assumed"].split(", ")[1:])
        for row in results.table("packets").to_pylist():
            for others, is_lost in ((row["receivers"], 0), (row["lost_by"], 1)):
                n_sent.update((node_of[row["sender"]], node_of[other]) for other in others)
                n_lost.update((node_of[row["sender"]], node_of[other]) for other in others if is_lost)
    assert n_sent.keys() == per.keys()
    for link, p in per.items():
        error = math.sqrt(p * (1.0 - p) / n_sent[link])
        assert abs(n_lost[link] / n_sent[link] - p) <= 4.0 * error, (link, n_lost[link], n_sent[link])


def test_nodes_are_drawn_by_the_seed_or_given_by_the_scenario(tmp_path: Path) -> None:
    """Boat is the first vehicle of the file and owns slot 1."""
    (tmp_path / "harbour.csv").write_text(HARBOUR)
    drawn = loaded(tmp_path, NETWORK)
    assert {tuple(losses(drawn, seed)) for seed in range(20)} == {
        ((0, 1, 0.1), (1, 0, 0.5)),
        ((0, 1, 0.5), (1, 0, 0.1)),
    }
    fixed = loaded(tmp_path, NETWORK + 'nodes = { Boat = "quay" }\n')
    assert {tuple(losses(fixed, seed)) for seed in range(20)} == {((0, 1, 0.5), (1, 0, 0.1))}
    by_option = loaded(tmp_path, NETWORK, ("--set", "channel.nodes.Diver=quay"))
    assert losses(by_option, 1) == [(0, 1, 0.1), (1, 0, 0.5)]


NUMBERED = "sender,receiver,per\n21,27,0.1\n27,21,0.5\n"


def test_a_node_may_be_a_whole_number(tmp_path: Path) -> None:
    """In a file and on the command line; what is kept is its name."""
    (tmp_path / "harbour.csv").write_text(NUMBERED)
    in_file = loaded(tmp_path, NETWORK + "nodes = { Boat = 21 }\n")
    by_option = loaded(tmp_path, NETWORK, ("--set", "channel.nodes.Boat=21"))
    for scenario in (in_file, by_option):
        assert scenario.channel.nodes == {"Boat": "21"}
        assert losses(scenario, 1) == [(0, 1, 0.5), (1, 0, 0.1)]
    assert loaded(tmp_path, NETWORK + 'nodes = { Boat = "21" }\n') == in_file
    allowed = {"type": "object", "additionalProperties": {"type": ["string", "integer"]}}
    schema = type(in_file.channel).model_json_schema()["properties"]["nodes"]
    assert {key: schema[key] for key in allowed} == allowed


@pytest.mark.parametrize("value", ["2.5", "21.0", "true", "[21]", "inf"])
def test_what_names_no_node_is_one_line(tmp_path: Path, value: str) -> None:
    (tmp_path / "harbour.csv").write_text(NUMBERED)
    for text, overrides in ((f"nodes = {{ Boat = {value} }}\n", []), ("", [("--set", f"channel.nodes.Boat={value}")])):
        with pytest.raises(ConfigurationError) as refused:
            loaded(tmp_path, NETWORK + text, *overrides)
        (fault,) = refused.value.faults
        assert "channel.nodes.Boat" in fault.key
        assert fault.allowed == 'allowed: the name of a node, such as "quay", "21" or 21'


def test_a_whole_number_that_is_no_node_is_told_those_that_are(tmp_path: Path) -> None:
    (tmp_path / "harbour.csv").write_text(NUMBERED)
    with pytest.raises(ConfigurationError, match=r'channel\.nodes\.Boat = "22": allowed: 21, 27'):
        loaded(tmp_path, NETWORK + "nodes = { Boat = 22 }\n")


def test_the_summary_has_one_mean_for_all_seeds() -> None:
    scenario = load("mapping-patches", [("--network", "channel.name=network")])
    (per,) = {identity(scenario, seed)["per"] for seed in range(4)}
    assert per == pytest.approx(0.42, abs=1e-3)


def test_strategies_meet_the_same_nodes() -> None:
    """Draws of nodes are paired as all others are."""
    asked = [[("", "channel.name=network"), ("", f"strategy.name={name}")] for name in ("remoras", "cbba", "central")]
    for seed in (1, 2, 3):
        assert len({tuple(losses(load("mapping-patches", each), seed)) for each in asked}) == 1


def test_results_say_which_file_it_was_and_are_read_when_it_is_gone(tmp_path: Path) -> None:
    file = tmp_path / "harbour.csv"
    file.write_text(HARBOUR)
    scenario = loaded(tmp_path, NETWORK, *SHORT)
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


def test_a_hash_is_that_of_the_file_beside_it(tmp_path: Path) -> None:
    """An option that names another network leaves the scenario's hash aside."""
    (tmp_path / "harbour.csv").write_text(HARBOUR)
    pinned = NETWORK + f'sha256 = "{"0" * 64}"\n'
    assert loaded(tmp_path, pinned).channel.sha256 == "0" * 64
    other = loaded(tmp_path, pinned, ("--network", "channel.network=mission-2012"))
    assert (other.channel.network, other.channel.sha256) == ("mission-2012", "")


def test_a_fault_in_a_file_of_its_own_has_its_line(tmp_path: Path) -> None:
    file = tmp_path / "harbour.toml"
    node = '[[network.node]]\nname = "{}"\nper = {{ {} = {} }}\n'
    file.write_text('[[network]]\nname = "h"\n' + node.format("quay", "buoy", 1.5) + node.format("buoy", "quay", 0.5))
    (fault,) = faults_of(tmp_path, NETWORK.replace("csv", "toml"))
    assert (fault.file, fault.line, fault.key) == (str(file), 5, "network.h.node.quay.per.buoy")
    file.write_text("[[network]\n")
    (fault,) = faults_of(tmp_path, NETWORK.replace("csv", "toml"))
    assert (fault.file, fault.key) == (str(file), "TOML")
    assert "line 1" in fault.allowed
    (tmp_path / "harbour.csv").write_text(HARBOUR.replace("0.5", "-0.5"))
    (fault,) = faults_of(tmp_path, NETWORK)
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
    (fault,) = faults_of(tmp_path, channel)
    assert fault.key == f"channel.{key}"
    assert says in fault.allowed
    assert fault.line == line_of(SMALL.replace(OWN, channel), key.partition(".")[0] + " =")


def test_a_fleet_of_more_vehicles_than_nodes_is_refused() -> None:
    asked = [("--network", "channel.name=network"), ("--set", "fleet.size=6"), ("--set", "fleet.copies_of=AUV01")]
    with pytest.raises(ConfigurationError, match="has 5 nodes, the fleet 6 vehicles"):
        load("mapping-patches", asked)


def test_every_caption_says_what_is_assumed() -> None:
    of_network = face.run("mapping-patches", network="mission-2012", set={"scenario.duration_s": 120.0})
    ranged = face.run("mapping-patches", network="hermes-june", set={"scenario.duration_s": 120.0})
    alike = face.run("mapping-patches", set={"scenario.duration_s": 120.0})
    for kind in ("trajectories", "roles", "satisfaction", "links"):
        assert f"network channel (mission-2012: {STATIC}, ASV00 = " in of_network.plot(kind).caption  # type: ignore[attr-defined]
    assert "hermes-june: losses over range as measured" in ranged.plot("roles").caption  # type: ignore[attr-defined]
    assert "bernoulli channel, PER" in alike.plot("roles").caption  # type: ignore[attr-defined]
    assert "assumed" not in alike._results.manifest


def test_a_study_has_networks_as_an_axis_and_says_of_which_its_figures_are(tmp_path: Path) -> None:
    rows = [f"{a},{b},0.3" for a, b in permutations("PQRS", 2)]
    (tmp_path / "lake.csv").write_text("\n".join(["sender,receiver,per", *rows]))
    file = tmp_path / "study.toml"
    file.write_text(
        '[study]\nname = "seas"\nscenario = "mapping-patches"\nstrategies = ["remoras", "central"]\nrepeats = 1\n'
        f'[[channel]]\nname = "network"\nnetwork = ["mission-2012", "{tmp_path}/lake.csv"]\n'
        '[[channel]]\nname = "bernoulli"\nper = 0.3\n[set]\nscenario.duration_s = 60.0\n'
    )
    study = load_study(str(file))
    sweep(study, tmp_path / "out")
    found = SweepResults.read(tmp_path / "out")
    assert found.assumed({"channel.name": "bernoulli"}) == []
    assert found.assumed({"channel.name": "network", "channel.network": "mission-2012"}) == [f"mission-2012: {STATIC}"]
    assert len(found.assumed({"channel.name": "network"})) == 2
    caption = face.open(tmp_path / "out").plot("packets").caption  # type: ignore[union-attr]
    assert all(text in caption for text in (f"mission-2012: {STATIC}", f"lake: {STATIC}"))
