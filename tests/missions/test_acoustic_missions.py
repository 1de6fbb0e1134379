"""Missions on the channels ``acoustic`` and ``trace``: what scenarios say, what runs hear, what results repeat."""

import json
from pathlib import Path

import pytest
from small_mission import SMALL, faults_of, line_of, pond

from missions.errors import ConfigurationError
from missions.runs.assembly import channel_of
from missions.runs.results import Results, write_results
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.runs.summary import summary
from missions.scenarios import load
from missions.scenarios.deployment import deployment_of

OWN = '[channel]\nname = "bernoulli"\nper = 0.2\n'
SHORT = ("--set", "scenario.duration_s=200")


def text_of(channel: str) -> str:
    return SMALL.replace(OWN, channel).replace("s2c-18-34", "seatrac-x150")


# acoustic -----------------------------------------------------------------------------------------


def test_the_water_decides_delays_and_guards():
    """10 C, 35 psu, 15 m (a boat at 0 m and three AUVs at 20 m): 1490.05 m/s by Mackenzie, in slots and on the way."""
    setup = resolved(load("mapping-rendezvous", [("--channel", "channel.name=acoustic")]))
    channel = channel_of(setup, 1)
    assert channel.sound_speed_mps == pytest.approx(1490.048, abs=1e-3)
    assert channel.depths_m == (0.0, 20.0, 20.0, 20.0)
    assert setup.schedule.guard_s == pytest.approx(1000.0 / channel.sound_speed_mps)
    warm = resolved(load("mapping-rendezvous", [("", "channel.name=acoustic"), ("", "channel.temperature_c=25")]))
    assert channel_of(warm, 1).sound_speed_mps > 1530.0


def test_on_the_channel_acoustic_the_declared_range_cuts_nothing_off():
    """Vehicles within 900 m, declared range 300 m: short packets are heard all the same, on other channels not."""
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
        ('"acoustic"\nsource_level_db = 170\nacoustic_power_w = 1.0', "", "acoustic_power_w", "leave one of them out"),
        ('"acoustic"\nspreading = 3', "", "spreading", "less than or equal to 2"),
        ('"acoustic"\nfading = "slow"', "", "fading", "'none', 'bit', 'frame' or 'packet'"),
        ('"acoustic"\nper = 0.2', "", "per", "not used by the acoustic channel, only by bernoulli and matrix"),
        ('"acoustic"\nwind = 3', "", "wind", "did you mean 'wind_mps'"),
        ('"trace"', "", "file", "missing: a CSV or Parquet file of time_s, sender, receiver, and lost or per"),
        ('"trace"\nfile = "none.csv"', "", "file", "cannot be read: No such file"),
        ('"trace"\nfile = "others.csv"', "", "file", "is of vehicle Raft; those of the scenario are "),
        ('"trace"\nfile = "short.csv"', "", "file", "ends at 0 s, the run at"),
    ],
)  # fmt: skip
def test_a_fault_is_one_clear_message(tmp_path: Path, channel: str, setting: str, key: str, says: str):
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


def test_a_run_in_its_own_trace_is_the_run_again(recorded: tuple[Results, Path]):
    """Another seed draws other losses; on the trace every packet is heard by the same vehicles, at the same time."""
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


def test_results_say_which_file_it_was(tmp_path: Path):
    """Its path is taken from the scenario's folder; a file that was changed since is refused."""
    channel = '[channel]\nname = "trace"\nfile = "rel.csv"\nrepeat = true\n'
    (tmp_path / "rel.csv").write_text("time_s,sender,receiver,per\n0,Boat,Diver,0.1\n0,Diver,Boat,0.3\n")
    scenario = pond(tmp_path, text_of(channel))
    table = json.loads(scenario.model_dump_json())["channel"]
    assert table["file"] == str(tmp_path / "rel.csv")
    assert len(table["sha256"]) == 64
    assert scenario.channel.mean_per(deployment_of(scenario)) == pytest.approx(0.2)
    (tmp_path / "rel.csv").write_text("time_s,sender,receiver,per\n0,Boat,Diver,0.1\n0,Diver,Boat,0.4\n")
    again = pond(tmp_path, text_of(channel + f'sha256 = "{table["sha256"]}"\n'))
    with pytest.raises(ConfigurationError, match=r"channel\.file.*rel\.csv.*is not the file that was used"):
        run(again, seed=1)
