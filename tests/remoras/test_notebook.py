"""What a notebook shows of runs and scenarios, and a run that its caller steps."""

import subprocess
import sys
from pathlib import Path

import pytest

import remoras
from missions.cards import MOST_ROWS, card, own_names
from missions.errors import ConfigurationError
from missions.files import shipped
from remoras import progress as said_progress
from remoras.progress import Progress

SHORT = {"scenario": {"duration_s": 60.0}}
LONGEST = 400
"""Characters that a notebook shows of a value without a card."""

STUDY = """
[study]
name = "small"
scenario = "mapping-rendezvous"
policies = ["ack", "mps-ack"]
repeats = 1
[channel]
name = "bernoulli"
per = 0.4
[set]
scenario.duration_s = 20
"""

CALLER = """
from pathlib import Path

import remoras


def times(folder: Path) -> list[float]:
    scenario = remoras.load("mapping-rendezvous", per=0.4, set={"scenario": {"duration_s": 60.0}})
    run: remoras.Run = remoras.run(scenario, seed=3, progress=False)
    figure = run.plot("trajectories", width_in=3.5)
    text: str = figure.caption
    figure.savefig(folder / "figure.pdf")
    known = run.known("AUV02", at_s=50.0)
    vehicles: int = len(scenario.vehicle) + len(known.organisation.members("Operational"))
    opened = remoras.open(run.save(folder / "run"))
    if isinstance(opened, remoras.Run):
        vehicles += len(opened.milestones)
    for state in remoras.stepping("mapping-rendezvous", set="scenario.duration_s=5"):
        vehicles += len(state.vehicles)
    swept = remoras.sweep("study.toml", folder / "swept", jobs=1)
    per: float | None = scenario.channel.per
    return [row["time_s"] for row in run.milestones] + [float(len(text) + vehicles + swept.status["done"]), per or 0.0]
"""


@pytest.fixture(scope="module")
def short() -> remoras.Run:
    return remoras.run("mapping-rendezvous", per=0.4, seed=3, set=SHORT)


def shown(value: object) -> str:
    """What a notebook shows: the card if there is one, else the text."""
    as_card = getattr(value, "_repr_html_", None)
    return as_card() if as_card else repr(value)


def test_every_value_of_a_notebook_is_short_or_a_card(short: remoras.Run, tmp_path: Path) -> None:
    study = tmp_path / "study.toml"
    study.write_text(STUDY, encoding="utf-8")
    swept = remoras.sweep(study, tmp_path / "swept")
    state = next(remoras.stepping("mapping-rendezvous", set=SHORT))
    values = [
        short, short.scenario, short.summary, short.milestones, short.table("roles"), short.known("AUV02", at_s=50.0),
        short.scenario.vehicle[0], short.scenario.channel, swept, swept.runs(), state, remoras.scenarios(),
    ]  # fmt: skip
    for value in values:
        assert hasattr(value, "_repr_html_"), value
        assert "<table" in shown(value)
    cards = [short, short.scenario, short.scenario.vehicle[0], swept, state, short.known("AUV02", at_s=50.0)]
    assert [repr(value) for value in cards if len(repr(value)) > LONGEST] == []
    for value in (short.scenario.vehicle, short.scenario.scenario.metrics, swept.status, short.tables):
        assert len(repr(value)) <= LONGEST


@pytest.mark.parametrize("name", shipped())
def test_every_shipped_scenario_is_shown_in_a_line(name: str) -> None:
    scenario = remoras.load(name)
    assert repr(scenario).startswith(f"<Scenario {name}: ")
    assert len(repr(scenario)) <= 200
    assert scenario.scenario.title in scenario._repr_html_().replace("&#x27;", "'")


def test_a_card_has_units_and_no_markup_of_others(short: remoras.Run) -> None:
    assert ">mission_time_s</th><td>60</td><td>s</td>" in short._repr_html_()
    assert ">energy_j</th>" in short.summary._repr_html_()  # type: ignore[attr-defined]
    assert "<script>" not in card("<script>", [("<script>", "<script>")], "<script>")
    assert "and 5 more" in card("many", [("a", "b")] * (MOST_ROWS + 5))


def test_tab_offers_own_names_only(short: remoras.Run) -> None:
    assert [name for name in dir(remoras) if not name.startswith("__")] == sorted(remoras.__all__)
    for value in (short.scenario, short.scenario.channel, short.scenario.vehicle[0]):
        foreign = {name for name in dir(value) if not name.startswith("__")} & {
            name for kind in type(value).__mro__ if kind.__module__.startswith("pydantic") for name in vars(kind)
        }
        assert foreign == set()
        assert set(type(value).model_fields) <= set(dir(value))  # type: ignore[attr-defined]
    assert "plot" in own_names(short)
    assert "names_by_slot" in dir(short.scenario)


def test_settings_merge_and_are_texts_too() -> None:
    whole = remoras.load("mapping-rendezvous", set={"mission": {"goal": 0.9}, "scenario.duration_s": 60.0})
    before = remoras.load("mapping-rendezvous")
    assert whole.mission.goal == 0.9  # type: ignore[attr-defined]
    assert whole.mission.patience_s == before.mission.patience_s  # type: ignore[attr-defined]
    for texts in ("scenario.duration_s=60", ["scenario.duration_s=60", "mission.goal=0.9"]):
        assert remoras.load("mapping-rendezvous", set=texts).scenario.duration_s == 60.0
    named = remoras.load("mapping-rendezvous", set={"vehicle": {"AUV01": {"energy_j": 5e5}}})
    assert [vehicle.energy_j for vehicle in named.vehicle if vehicle.name == "AUV01"] == [5e5]
    with pytest.raises(ConfigurationError, match=r"set \(mission.goal\) = 2: .*less than or equal to 1"):
        remoras.load("mapping-rendezvous", set={"mission": {"goal": 2}})
    with pytest.raises(ConfigurationError, match="KEY=VALUE"):
        remoras.load("mapping-rendezvous", set="scenario.duration_s")
    with pytest.raises(TypeError, match="set is 3; allowed: a table"):
        remoras.load("mapping-rendezvous", set=3)  # type: ignore[arg-type]


@pytest.mark.parametrize("jobs", [-3, 0, 1.5, True, "2"])
def test_jobs_are_a_number_of_processes(jobs: int, tmp_path: Path) -> None:
    with pytest.raises(TypeError, match=r"jobs is .*allowed: a whole number, 1 to 1024"):
        remoras.sweep("strategies-quick", tmp_path, jobs=jobs)
    with pytest.raises(TypeError, match="jobs is"):
        remoras.exchange_study(jobs=jobs)


def test_a_run_that_is_stepped_is_the_run(short: remoras.Run) -> None:
    steps = remoras.stepping("mapping-rendezvous", per=0.4, seed=3, set=SHORT)
    assert isinstance(steps, remoras.Stepping)
    states = list(steps)
    tracks = short.table("trajectories")
    for state in states[:: len(states) // 5]:
        for name, now in state.vehicles.items():
            row = tracks[(tracks.vehicle == name) & (tracks.time_s == state.time_s)].iloc[0]
            assert (now.x_m, now.y_m) == pytest.approx((row.x_m, row.y_m), abs=1.0 / 128)
    assert [told.name for state in states for told in state.milestones] == [m["name"] for m in short.milestones]
    assert states[-1].time_s == short.summary["mission_time_s"]
    assert len(states[-1].vehicles["AUV00"].roles) == 4
    finished = steps.run()
    assert finished.summary == short.summary
    for name in short.tables:
        assert finished.table(name).equals(short.table(name)), name
    assert list(steps) == []


def test_who_stops_early_may_let_it_run_to_its_end(short: remoras.Run) -> None:
    with remoras.stepping("mapping-rendezvous", per=0.4, seed=3, set=SHORT) as steps:
        assert next(steps).time_s == 0.0
        assert len(steps.table("trajectories")) == 4
        assert steps.run().summary == short.summary


def test_a_notebook_shows_a_line_that_is_written_over(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    passed = iter(range(0, 100, 2))
    monkeypatch.setattr(said_progress.time, "monotonic", lambda: float(next(passed)))
    monkeypatch.setattr(said_progress, "is_notebook", lambda: True)
    assert said_progress.is_watched()
    with Progress("run", 10, "s") as progress:
        for done in range(4):
            progress.at(done)
    told = capsys.readouterr().err
    assert told.startswith("\rrun: 1 of 10 s")
    assert "\n" not in told
    assert told.endswith("\r")


def test_nothing_is_said_where_nobody_looks(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delitem(sys.modules, "ipykernel", raising=False)  # another test may have made a notebook
    assert not said_progress.is_watched()
    remoras.run("mapping-rendezvous", set={"scenario.duration_s": 5.0})
    assert capsys.readouterr().err == ""


@pytest.mark.slow
def test_the_types_hold_for_a_caller_under_mypy_strict(tmp_path: Path) -> None:
    caller = tmp_path / "caller.py"
    caller.write_text(CALLER, encoding="utf-8")
    root = Path(__file__).resolve().parents[2]
    command = [sys.executable, "-m", "mypy", "--config-file", str(root / "pyproject.toml"), "--strict", str(caller)]
    checked = subprocess.run(command, capture_output=True, text=True, check=False, cwd=root)
    assert "Success" in checked.stdout, checked.stdout
