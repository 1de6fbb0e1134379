"""Metrics of a sweep: of missions or users, named by a study, with their direction."""

import itertools
import json
from pathlib import Path
from typing import Any

import pytest
from sweeping import Serial, finished, study_text, written
from sweeping import swept as swept_by

import remoras
from missions.comparison import compare, ranks
from missions.errors import ConfigurationError, OutputError, StudyChangedError
from missions.metric import Better, Metric, collected
from missions.runs.metrics import CORE_METRICS
from missions.sweeps import load_study
from missions.sweeps.driver import sweep
from missions.sweeps.folder import SweepResults
from missions.sweeps.ledger import FinishedRun
from missions.sweeps.plan import RunTask
from remoras.errors import PluginError

WITHOUT_METRICS = study_text(repeats=3, per="[0.1]").replace('metrics = ["mission_time_s", "n_bytes"]\n', "")


def metric(name: str, better: Any = Better.HIGHER, unit: str = "m", headline: bool = False) -> Metric:
    return Metric(name, unit, better, name.replace("_", " "), lambda run: None, headline)


def declare(monkeypatch: pytest.MonkeyPatch, *metrics: Metric) -> None:
    """Let the mission of every scenario declare these metrics."""
    monkeypatch.setattr(
        "missions.sweeps.study.metrics_of", lambda scenario: collected("a mission", (*CORE_METRICS, *metrics))
    )


def swept(folder: Path, text: str = WITHOUT_METRICS, **values: float) -> SweepResults:
    """A sweep over ack and mps-ack in which all runs have these values, ten times as high with mps-ack."""

    def made(task: RunTask) -> FinishedRun:
        factor = 10.0 if task.scenario.communication.policy == "mps-ack" else 1.0
        own = {name: factor * value for name, value in values.items()}
        return finished(task, completed=True, mission_time_s=1.0, **own)

    return swept_by(folder, text, made)


def test_a_metric_of_a_mission_can_be_studied_compared_and_ranked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    declare(monkeypatch, metric("depth_reached_m"))
    results = swept(tmp_path, WITHOUT_METRICS.replace("seed = 7", 'seed = 7\nmetrics = ["depth_reached_m"]'),
                    depth_reached_m=3.0)  # fmt: skip
    monkeypatch.undo()  # who reads the folder does not have the mission
    assert [(row.policy, row.mean) for row in compare(results)] == [("ack", 3.0), ("mps-ack", 30.0)]
    assert {rank.policy: rank.rank for rank in ranks(results, "depth_reached_m")} == {"mps-ack": 1.0, "ack": 2.0}
    found = results.metrics["depth_reached_m"]
    assert (found.unit, found.label, found.better) == ("m", "depth reached m", Better.HIGHER)


def test_study_without_metrics_compares_headline_metrics(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shipped = load_study(str(written(tmp_path, WITHOUT_METRICS)))
    assert {name for name, declared in shipped.metrics.items() if declared.headline} == {
        "mission_time_s", "completed", "goal_fraction", "energy_j", "n_bytes", "coverage_fraction",
        "duplicate_fraction",
    }  # fmt: skip
    declare(monkeypatch, metric("depth_reached_m", headline=True), metric("other_m"))
    results = swept(tmp_path)
    assert set(results.compared) == {
        "completed", "depth_reached_m", "energy_j", "goal_fraction", "mission_time_s", "n_bytes"
    }  # fmt: skip


def test_metric_of_no_mission_of_the_study_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    declare(monkeypatch, metric("depth_reached_m"))
    text = WITHOUT_METRICS.replace("seed = 7", 'seed = 7\nmetrics = ["depth_reached"]')
    with pytest.raises(ConfigurationError, match=r"study.toml:9: study.metrics = \"depth_reached\": allowed: .*; did "
                       r"you mean 'depth_reached_m'"):  # fmt: skip
        load_study(str(written(tmp_path, text)))


def test_missions_with_conflicting_metrics_of_one_name_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = Path("missions/mapping/rendezvous.toml").read_text(encoding="utf-8")
    (tmp_path / "other.toml").write_text(scenario.replace('name = "mapping-rendezvous"', 'name = "other"'))
    directions = {"other": Better.LOWER}

    def declared(scenario: Any) -> Any:
        return {"score": metric("score", directions.get(scenario.scenario.name, Better.HIGHER), headline=True)}

    monkeypatch.setattr("missions.sweeps.study.metrics_of", declared)
    text = WITHOUT_METRICS.replace('"mapping-rendezvous"', '["mapping-rendezvous", "other.toml"]')
    with pytest.raises(ConfigurationError, match=r"study.scenario = .* differ in what score means; study them apart"):
        load_study(str(written(tmp_path, text)))


@pytest.mark.parametrize("name", ["seed", "wall_s", "key", "milestones"])
def test_a_metric_with_the_name_of_another_field_is_refused(name: str) -> None:
    with pytest.raises(ConfigurationError, match=f"metric {name}: a field that results have already"):
        collected("own.mission:M", [*CORE_METRICS, metric(name)])


def test_metric_without_direction_is_compared_but_not_ranked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    declare(monkeypatch, metric("heading_rad", Better.NEITHER, "rad"))
    results = swept(tmp_path, heading_rad=1.0)
    assert len(compare(results, ["heading_rad"])) == 2
    with pytest.raises(
        OutputError, match=r"'heading_rad': cannot be ranked, neither .*; allowed are .*mission_time_s, "
    ):
        ranks(results, "heading_rad")


OWN = """
from remoras import Better, Figure, Metric


def n_assigned(run):
    return sum(event == "assigned" for *_, event in run.recorder.rows("roles"))


def last_s(run):
    times = [row[0] for row in run.recorder.rows("trajectories")]
    assert times == sorted(times)
    return times[-1] + 1000.0 * len(run.scenario.vehicle)


def draw(axes, results, style):
    axes.plot(results.table("trajectories")["time_s"].to_numpy(), color=style.black)
    return "Drawn by somebody else."


HANDED = Metric("n_assigned", "", Better.LOWER, "roles taken", n_assigned)
LAST = Metric("last_s", "s", Better.LOWER, "last row", last_s)
TIMES = Figure("times", "Times", draw, needs=("trajectories",))
TAKEN = Metric("n_bytes", "B", Better.LOWER, "mine", n_assigned)
RAISES = Metric("raises", "", Better.LOWER, "raises", lambda run: 1 / 0)
"""
COUNTER = itertools.count()
FACTS = {"scenario.duration_s": 20.0}


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """A file of a name that no other test has: a module is imported once."""
    path = tmp_path / "elsewhere" / f"metrics_of_mine_{next(COUNTER)}.py"
    path.parent.mkdir()
    path.write_text(OWN, encoding="utf-8")
    return path


def study_of(folder: Path, *named: str, **others: Any) -> Path:
    text = study_text(repeats=2, per="[0.1]", **others).replace('["ack", "mps-ack"]', '["ack"]')
    return written(folder, text.replace('metrics = ["mission_time_s", "n_bytes"]', f"metrics = {json.dumps(named)}"))


def made(study: Path, out: Path) -> SweepResults:
    sweep(load_study(str(study)), out, executor=Serial())
    return SweepResults.read(out)


# The same wherever the run is ------------------------------------------------------------------


def test_metric_is_equal_in_memory_from_a_folder_and_in_the_summary(own: Path, tmp_path: Path) -> None:
    """The last tick is at 20 s; four vehicles. A group of the mission has its roles assigned at the beginning."""
    named = f"{own}:LAST"
    run = remoras.run("mapping-rendezvous", set={**FACTS, "scenario.metrics": [named]})
    read = remoras.open(run.save(tmp_path / "run"))
    assert isinstance(read, remoras.Run)
    assert run.metric(named) == read.metric(named) == run.summary["last_s"] == read.summary["last_s"] == 4020.0


# In a sweep --------------------------------------------------------------------------------------


def test_metrics_of_a_finished_sweep_are_computed_from_kept_tables(own: Path, tmp_path: Path) -> None:
    """Both repeats have kept theirs, so the new metrics have as many values as the others."""
    made(study_of(tmp_path, "n_bytes"), tmp_path / "out")
    found = remoras.compare(tmp_path / "out", f"{own}:HANDED", f"{own}:LAST", "n_bytes")
    assert found.set_index("metric")["n"].to_dict() == {"n_assigned": 2, "last_s": 2, "n_bytes": 2}
    assert found.set_index("metric")["mean"]["last_s"] == 4020.0


def test_sweep_without_tables_is_refused_with_the_remedy(own: Path, tmp_path: Path) -> None:
    path = study_of(tmp_path, "n_bytes")
    path.write_text(path.read_text(encoding="utf-8").replace("seed = 7", "seed = 7\nkeep_tables = 0"))
    made(path, tmp_path / "out")
    with pytest.raises(OutputError, match=r"kept no tables, of which n_assigned .* study.metrics, or set study.keep_t"):
        remoras.compare(tmp_path / "out", f"{own}:HANDED")


def test_metric_may_be_removed_from_a_study_but_not_added(own: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    made(study_of(tmp_path, f"{own}:HANDED", f"{own}:LAST"), out)
    sweep(load_study(str(study_of(tmp_path, f"{own}:HANDED"))), out, executor=Serial())
    made(study_of(tmp_path, f"{own}:HANDED"), tmp_path / "less")
    more = load_study(str(study_of(tmp_path, f"{own}:HANDED", f"{own}:LAST")))
    with pytest.raises(StudyChangedError, match=r"metrics: was .*HANDED.* now .*LAST.*; runs that were made lack it"):
        sweep(more, tmp_path / "less", executor=Serial())


# What cannot be --------------------------------------------------------------------------------

WRONG = {
    "NOWHERE": "has no NOWHERE",
    "TIMES": "it is a Figure; expected a remoras.Metric",
    "TAKEN": "metric n_bytes: declared twice",
}


@pytest.mark.parametrize("name", WRONG)
def test_invalid_metric_of_a_study_is_refused_in_one_line(own: Path, tmp_path: Path, name: str) -> None:
    with pytest.raises(ConfigurationError) as raised:
        load_study(str(study_of(tmp_path, "n_bytes", f"{own}:{name}")))
    (line,) = str(raised.value).splitlines()
    assert "study.toml" in line
    assert "study.metrics" in line
    assert WRONG[name] in line


def test_failing_metric_is_named_with_its_run(own: Path, tmp_path: Path) -> None:
    name, said = "RAISES", "raised ZeroDivisionError"
    made(study_of(tmp_path, "n_bytes"), tmp_path / "out")
    with pytest.raises(PluginError, match=rf"metric \w+ of .*{name}, run \w+: .*{said}"):
        remoras.compare(tmp_path / "out", f"{own}:{name}")
    with pytest.raises(PluginError, match=said):
        remoras.run("mapping-rendezvous", set={**FACTS, "scenario.metrics": [f"{own}:{name}"]}).summary  # noqa: B018
