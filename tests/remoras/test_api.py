"""The Python API: functions of ``import remoras`` in a script and in a notebook."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import remoras
from missions.errors import ConfigurationError, OutputError
from remoras.strategies.central import Central

SHORT = {"scenario.duration_s": 60.0}


@pytest.fixture(scope="module")
def short() -> remoras.Run:
    return remoras.run("mapping-rendezvous", per=0.4, seed=3, set=SHORT)


def test_importing_the_package_loads_no_heavy_library() -> None:
    program = (
        "import sys, remoras; heavy = {'mesa', 'numpy', 'pandas', 'pyarrow', 'rdflib', 'matplotlib', 'pydantic'};"
        "print(*sorted(heavy & sys.modules.keys()))"
    )
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout == "\n"


def test_api_options_equal_those_of_the_command_line(short: remoras.Run) -> None:
    assert (short.summary["per"], short.summary["seed"], short.scenario.scenario.duration_s) == (0.4, 3, 60.0)
    loaded = remoras.load("mapping-rendezvous", strategy="cbba", policy="mps-ack", channel="perfect", set=SHORT)
    assert (loaded.strategy.name, loaded.communication.policy, loaded.channel.name) == ("cbba", "mps-ack", "perfect")


def test_tables_are_data_frames_with_units(short: remoras.Run) -> None:
    frame = short.table("trajectories")
    assert frame.attrs["units"] == {
        "time_s": "s", "x_m": "m", "y_m": "m", "heading_rad": "rad", "speed_mps": "m/s", "energy_j": "J",
        "depth_m": "m",
    }  # fmt: skip
    assert set(frame["vehicle"]) == {"ASV00", "AUV00", "AUV01", "AUV02"}
    with pytest.raises(OutputError, match="did you mean 'trajectories'"):
        short.table("trajectory")


def test_names_are_listed_and_a_mistyped_figure_has_the_nearest(short: remoras.Run) -> None:
    assert (short.seed, short.completed) == (3, False)
    known = remoras.metrics()
    assert set(known.index) >= set(known.index) & set(short.summary) >= {"mission_time_s", "coverage_fraction"}
    assert remoras.load("mapping-rendezvous").communication.policy in remoras.policies().index
    assert "mapping-rendezvous" in remoras.scenarios().index
    with pytest.raises(KeyError, match="no figure 'mision_time_s'; did you mean 'mission_time_s'"):
        short.summary["mision_time_s"]


def test_trajectories_by_vehicle_time_and_axis(short: remoras.Run) -> None:
    pytest.importorskip("xarray")
    data, frame = short.to_xarray(), short.table("trajectories")
    assert data.position_m.dims == ("vehicle", "time", "axis")
    assert {name: data[name].attrs["units"] for name in ("position_m", "speed_mps", "time")} == {
        "position_m": "m", "speed_mps": "m/s", "time": "s",
    }  # fmt: skip
    for row in frame.iloc[::37].itertuples():
        at = data.sel(vehicle=row.vehicle, time=row.time_s)
        assert at.position_m.values.tolist() == [row.x_m, row.y_m]
        assert float(at.depth_m) == row.depth_m
    assert data.attrs["seed"] == 3


def test_saved_results_equal_those_in_memory(short: remoras.Run, tmp_path: Path) -> None:
    short.save(tmp_path / "run")
    opened = remoras.open(tmp_path / "run")
    assert opened.tables == short.tables
    for name in short.tables:
        assert opened.table(name).equals(short.table(name))
    assert opened.milestones == short.milestones
    assert opened.scenario == short.scenario
    with pytest.raises(OutputError, match="not empty"):
        short.save(tmp_path / "run")
    with pytest.raises(OutputError, match="already"):
        opened.save(tmp_path / "copy")


def test_a_strategy_may_be_an_object() -> None:
    by_object = remoras.run("mapping-rendezvous", strategy=Central(queue=1), set=SHORT)
    by_name = remoras.run("mapping-rendezvous", strategy="central", set={**SHORT, "strategy.parameters.queue": 1})
    assert by_object.summary["strategy"] == "central"
    assert by_object.table("packets").equals(by_name.table("packets"))


@pytest.mark.parametrize("make", [remoras.run, remoras.stepping])
def test_loaded_scenario_takes_no_option_but_a_seed_and_a_strategy_as_object(make: Any) -> None:
    loaded = remoras.load("mapping-rendezvous")
    options = {"strategy": "cbba", "policy": "ack", "channel": "perfect", "network": "ahoi", "per": 0.0, "set": {}}
    for name, value in options.items():
        with pytest.raises(TypeError, match="takes no options beside seed: give them to load"):
            make(loaded, seed=2, **{name: value})
    with pytest.raises(TypeError, match="unexpected keyword argument 'polcy'"):
        make(loaded, polcy="ack")


def test_errors_of_arguments_state_the_allowed_values() -> None:
    with pytest.raises(TypeError, match=r"seed is 1\.5; allowed: a whole number, 0 or more"):
        remoras.run("mapping-rendezvous", seed=1.5, set=SHORT)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="seed is -1"):
        remoras.run("mapping-rendezvous", seed=-1, set=SHORT)
    with pytest.raises(TypeError, match="strategy 3: lacks name, declaration, form, adapt, negotiator"):
        remoras.run("mapping-rendezvous", strategy=3, set=SHORT)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"per is 0.1; allowed: a list, as \[0.1\]"):
        remoras.exchange_study(per=0.1)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="policies is 'ack'"):
        remoras.exchange_study(policies="ack")


def test_faults_name_the_argument() -> None:
    with pytest.raises(ConfigurationError, match=r"per \(channel.per\) = 1.5"):
        remoras.run("mapping-rendezvous", per=1.5)
    with pytest.raises(ConfigurationError, match="did you mean 'mapping-rendezvous'"):
        remoras.load("mapping-rendezvouz")


def test_knowledge_of_vehicles_can_be_queried(short: remoras.Run) -> None:
    found = short.query("SELECT ?role WHERE { ?vehicle0 rm:playsRole ?role }")
    assert list(found.columns) == ["vehicle", "role"]
    assert set(found["vehicle"]) == {"ASV00", "AUV00", "AUV01", "AUV02"}
    before = short.query("ASK { ?vehicle0 rm:playsRole ?role }", vehicle="AUV01", at_s=0.0)
    assert list(before.itertuples(index=False, name=None)) == [(False,)]
    with pytest.raises(OutputError, match=r"no vehicle 'AUV1'; there are .* did you mean 'AUV01'"):
        short.query("ASK {}", vehicle="AUV1")


def test_the_exchange_study_is_a_data_frame() -> None:
    rows = remoras.exchange_study(nodes=3, per=[0.1], policies=["ack", "ack-repeat"], trials=50)
    assert list(rows["policy"]) == ["ack", "ack-repeat"]
    assert (rows["source_acked_slots.mean"] > 3).all()


def test_a_sweep_can_be_run_opened_and_compared(tmp_path: Path) -> None:
    study = tmp_path / "tiny.toml"
    study.write_text(
        '[study]\nname = "tiny"\nscenario = "mapping-rendezvous"\nstrategies = ["central", "remoras"]\nrepeats = 2\n'
        '[set]\n"scenario.duration_s" = 30.0\n"channel.per" = 0.2\n',
        encoding="utf-8",
    )
    made = remoras.sweep(study, out=tmp_path / "out")
    assert repr(made) == f"<Sweep in {tmp_path / 'out'}: 4 of 4 runs done, 0 failed>"
    found = remoras.compare(tmp_path / "out", "mission_time_s")
    assert list(found["strategy"]) == ["central", "remoras"]
    assert found.equals(made.compare("mission_time_s"))
    assert len(made.runs()) == made.status["done"] == 4
    figure = made.plot("differences")
    assert figure._repr_png_()[:4] == b"\x89PNG"  # type: ignore[attr-defined]
    assert "n = 2 instances per point, master seed" in figure.caption  # type: ignore[attr-defined]
