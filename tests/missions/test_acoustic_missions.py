"""Missions on the channels ``acoustic``, ``trace`` and ``network``: scenarios, receptions, reproduction."""

import json
from itertools import permutations
from pathlib import Path

import pytest
from small_mission import SMALL, faults_of, line_of, pond, with_channel

from missions.errors import ConfigurationError
from missions.runs.assembly import channel_of
from missions.runs.results import Results, summary, write_results
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.scenarios import Scenario, load

SHORT = ("--set", "scenario.duration_s=200")


def text_of(channel: str) -> str:
    return with_channel(channel).replace("s2c-18-34", "seatrac-x150")


# acoustic -----------------------------------------------------------------------------------------


def test_sound_speed_of_the_water_sets_delays_and_guards():
    """10 C, 35 psu, 15 m (a boat at 0 m and three AUVs at 20 m): 1490.05 m/s by Mackenzie, in slots and on the way."""
    setup = resolved(load("mapping-rendezvous", [("--channel", "channel.name=acoustic")]))
    channel = channel_of(setup, 1)
    assert channel.sound_speed_mps == pytest.approx(1490.048, abs=1e-3)
    assert channel.depths_m == (0.0, 20.0, 20.0, 20.0)
    assert setup.schedule.guard_s == pytest.approx(1000.0 / channel.sound_speed_mps)
    warm = resolved(load("mapping-rendezvous", [("", "channel.name=acoustic"), ("", "channel.temperature_c=25")]))
    assert channel_of(warm, 1).sound_speed_mps > 1530.0


def test_acoustic_channel_delivers_beyond_the_declared_range():
    """Vehicles within 900 m, declared range 300 m: short packets arrive, which they do not on other channels."""
    small = ("", "communication.range_m=300")
    ratio = {
        name: summary(run(load("mapping-rendezvous", [("", f"channel.name={name}"), small, SHORT]), seed=1))[
            "delivery_ratio"
        ]
        for name in ("acoustic", "perfect")
    }
    assert ratio["perfect"] < ratio["acoustic"]


@pytest.mark.parametrize(
    ("channel", "setting", "key", "says"),
    [
        ('"acoustic"', "communication.modem=s2c-18-34", "source_level_db",
         "profile s2c-18-34 has no source_level_db; set channel.source_level_db"),
        ('"acoustic"\nper = 0.2', "", "per", "not used by the acoustic channel, only by bernoulli and matrix"),
        ('"network"\nnetwork = "mission-2021"', "", "network", "did you mean 'mission-2012'?"),
        ('"network"\nnetwork = "harbour.csv"\nnodes = { Boat = "quai" }', "", "nodes.Boat",
         "allowed: quay, buoy; did you mean 'quay'?"),
        ('"trace"', "", "file", "missing: a CSV file of time_s, sender, receiver, and lost or per"),
        ('"trace"\nfile = "others.csv"', "", "file", "names the vehicle Raft; the scenario has "),
        ('"trace"\nfile = "short.csv"', "", "file", "ends at 0 s, the run at"),
    ],
)  # fmt: skip
def test_fault_of_a_channel_file_is_one_message(tmp_path: Path, channel: str, setting: str, key: str, says: str):
    (tmp_path / "harbour.csv").write_text(HARBOUR)
    for name, other in (("others", "Raft"), ("short", "Diver")):
        (tmp_path / f"{name}.csv").write_text(f"time_s,sender,receiver,lost\n0,Boat,{other},0\n0,{other},Boat,0\n")
    (fault,) = faults_of(tmp_path, text_of(f"[channel]\nname = {channel}\n"), *filter(None, [setting]))
    assert fault.key == f"channel.{key}"
    assert says in fault.allowed
    assert fault.line in range(line_of(SMALL, "[channel]"), line_of(SMALL, "[channel]") + 4)


# trace --------------------------------------------------------------------------------------------

BURSTS = [("", "channel.name=gilbert-elliott"), ("", "channel.per_bad=0.9"), SHORT]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Results, Path]:
    """A run in bursts, and its trace."""
    folder = tmp_path_factory.mktemp("recorded")
    write_results(run(load("mapping-rendezvous", BURSTS), seed=5), folder / "run")
    return Results.read(folder / "run"), folder


def test_run_on_its_own_trace_is_reproduced(recorded: tuple[Results, Path]):
    """Another seed has other losses; on the trace every packet reaches the same vehicles at the same time."""
    results, folder = recorded
    table = results.table("packets")
    packets = table.to_pandas().rename(columns={"receivers": 0, "lost_by": 1})
    rows = packets.melt(["time_s", "sender"], [0, 1], "lost", "receiver").explode("receiver").dropna()
    assert rows.lost.sum() > 50
    rows.to_csv(folder / "links.csv", index=False)
    on_trace = [("", "channel.name=trace"), ("", f"channel.file={folder / 'links.csv'}"), SHORT]
    again = run(load("mapping-rendezvous", on_trace), seed=6)
    names = table.column_names
    heard = [list(row[names.index("receivers")]) for row in again.recorder.packets]
    assert heard == table.column("receivers").to_pylist()
    with pytest.raises(ConfigurationError, match=r"links\.csv.*is not the file that was used"):
        run(load("mapping-rendezvous", [*on_trace, ("", f"channel.sha256={'0' * 64}")]), seed=6)


NETWORK = '[channel]\nname = "network"\nnetwork = "harbour.csv"\n'


HARBOUR = "sender,receiver,per\nquay,buoy,0.1\nbuoy,quay,0.5\n"


STATIC = "static links on moving vehicles"


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


def test_a_node_may_be_a_whole_number(tmp_path: Path) -> None:
    """In a file and on the command line; its name is stored."""
    (tmp_path / "harbour.csv").write_text(HARBOUR.replace("quay", "21").replace("buoy", "27"))
    in_file = pond(tmp_path, text_of(NETWORK + "nodes = { Boat = 21 }\n"))
    by_option = pond(tmp_path, text_of(NETWORK), "channel.nodes.Boat=21")
    for scenario in (in_file, by_option):
        assert scenario.channel.nodes == {"Boat": "21"}
        assert losses(scenario, 1) == [(0, 1, 0.5), (1, 0, 0.1)]
    assert pond(tmp_path, text_of(NETWORK + 'nodes = { Boat = "21" }\n')) == in_file
    allowed = {"type": "object", "additionalProperties": {"type": ["string", "integer"]}}
    schema = type(in_file.channel).model_json_schema()["properties"]["nodes"]
    assert {key: schema[key] for key in allowed} == allowed


def test_results_keep_the_channel_file_with_its_digest(tmp_path: Path) -> None:
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


def test_fault_in_a_network_file_has_its_line(tmp_path: Path) -> None:
    file = tmp_path / "harbour.toml"
    node = '[[network.node]]\nname = "{}"\nper = {{ {} = {} }}\n'
    file.write_text('[[network]]\nname = "h"\n' + node.format("quay", "buoy", 1.5) + node.format("buoy", "quay", 0.5))
    (fault,) = faults_of(tmp_path, text_of(NETWORK.replace("csv", "toml")))
    assert (fault.file, fault.line, fault.key) == (str(file), 5, "network.h.node.quay.per.buoy")
