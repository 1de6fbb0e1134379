"""Metrics and figures of a user's own, named where they are wanted, of runs to come and of results that exist."""

import itertools
import json
from pathlib import Path
from typing import Any

import pytest
from sweeping import Serial, study_text, written

import remoras
from missions.errors import ConfigurationError, OutputError, StudyChangedError
from missions.sweeps import load_study
from missions.sweeps.driver import sweep
from missions.sweeps.folder import SweepResults
from remoras.errors import PluginError

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
LABEL = Metric("mine", "B", Better.LOWER, "bytes", n_assigned)
RAISES = Metric("raises", "", Better.LOWER, "raises", lambda run: 1 / 0)
TEXT = Metric("text", "", Better.LOWER, "text", lambda run: "much")
DIRECTION = Metric("up", "", "up", "up", n_assigned)
NUMBER = 3
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


def test_a_metric_gives_the_same_in_memory_of_a_folder_and_in_the_summary(own: Path, tmp_path: Path) -> None:
    """The last tick is at 20 s; four vehicles. A group of the mission has its roles assigned at the beginning."""
    named = f"{own}:LAST"
    run = remoras.run("mapping-rendezvous", set={**FACTS, "scenario.metrics": [named]})
    read = remoras.open(run.save(tmp_path / "run"))
    assert isinstance(read, remoras.Run)
    assert run.metric(named) == read.metric(named) == run.summary["last_s"] == read.summary["last_s"] == 4020.0


# In a sweep --------------------------------------------------------------------------------------


def test_a_finished_sweep_is_asked_of_its_kept_tables(own: Path, tmp_path: Path) -> None:
    """Both repeats have kept theirs, so the new metrics have as many values as the others."""
    made(study_of(tmp_path, "n_bytes"), tmp_path / "out")
    found = remoras.compare(tmp_path / "out", f"{own}:HANDED", f"{own}:LAST", "n_bytes")
    assert found.set_index("metric")["n"].to_dict() == {"n_assigned": 2, "last_s": 2, "n_bytes": 2}
    assert found.set_index("metric")["mean"]["last_s"] == 4020.0


def test_a_sweep_without_tables_says_what_to_do(own: Path, tmp_path: Path) -> None:
    path = study_of(tmp_path, "n_bytes")
    path.write_text(path.read_text(encoding="utf-8").replace("seed = 7", "seed = 7\nkeep_tables = 0"))
    made(path, tmp_path / "out")
    with pytest.raises(OutputError, match=r"kept no tables, of which n_assigned .* study.metrics, or set study.keep_t"):
        remoras.compare(tmp_path / "out", f"{own}:HANDED")


def test_a_study_may_lose_a_metric_and_gets_one_in_another_folder(own: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    made(study_of(tmp_path, f"{own}:HANDED", f"{own}:LAST"), out)
    sweep(load_study(str(study_of(tmp_path, f"{own}:HANDED"))), out, executor=Serial())
    made(study_of(tmp_path, f"{own}:HANDED"), tmp_path / "less")
    more = load_study(str(study_of(tmp_path, f"{own}:HANDED", f"{own}:LAST")))
    with pytest.raises(StudyChangedError, match=r"metrics: was .*HANDED.* now .*LAST.*; runs that were made lack it"):
        sweep(more, tmp_path / "less", executor=Serial())


# What cannot be --------------------------------------------------------------------------------

WRONG = {
    "NOWHERE": "has no attribute 'NOWHERE'",
    "NUMBER": "it is a int; expected a remoras.Metric",
    "TIMES": "it is a Figure; expected a remoras.Metric",
    "DIRECTION": "better = 'up': allowed: Better.HIGHER, Better.LOWER, Better.NEITHER",
    "TAKEN": "metric n_bytes: declared twice",
    "LABEL": "is also the label of n_bytes",
}


@pytest.mark.parametrize("name", WRONG)
def test_a_study_refuses_what_is_no_metric_in_one_line(own: Path, tmp_path: Path, name: str) -> None:
    with pytest.raises(ConfigurationError) as raised:
        load_study(str(study_of(tmp_path, "n_bytes", f"{own}:{name}")))
    (line,) = str(raised.value).splitlines()
    assert "study.toml" in line
    assert "study.metrics" in line
    assert WRONG[name] in line


@pytest.mark.parametrize(("name", "said"), [("RAISES", "raised ZeroDivisionError"), ("TEXT", "it gave str")])
def test_a_metric_that_fails_is_named_with_its_run(own: Path, tmp_path: Path, name: str, said: str) -> None:
    made(study_of(tmp_path, "n_bytes"), tmp_path / "out")
    with pytest.raises(PluginError, match=rf"metric \w+ of .*{name}, run \w+: .*{said}"):
        remoras.compare(tmp_path / "out", f"{own}:{name}")
    with pytest.raises(PluginError, match=said):
        remoras.run("mapping-rendezvous", set={**FACTS, "scenario.metrics": [f"{own}:{name}"]}).summary  # noqa: B018
