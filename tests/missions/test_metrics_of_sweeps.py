"""Metrics of a sweep follow from their declarations: which a study may name, and which value is the better one."""

from pathlib import Path
from typing import Any

import pytest
from sweeping import finished, study_text, written
from sweeping import swept as swept_by

from missions.comparison import compare, ranks
from missions.errors import ConfigurationError, OutputError
from missions.metric import Better, Metric, collected
from missions.runs.metrics import CORE_METRICS
from missions.sweeps import SweepResults, load_study
from missions.sweeps.ledger import FinishedRun
from missions.sweeps.plan import RunTask

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


@pytest.mark.parametrize(
    ("name", "best"),
    [
        ("least_mapped_fraction", "mps-ack"), ("consistent_fraction", "mps-ack"), ("coverage_fraction", "mps-ack"),
        ("delivery_ratio", "mps-ack"), ("duplicate_fraction", "ack"), ("n_bytes", "ack"), ("consistency_time_s", "ack"),
    ],
)  # fmt: skip
def test_the_best_is_the_highest_or_the_lowest_as_declared(tmp_path: Path, name: str, best: str) -> None:
    found = ranks(swept(tmp_path, **{name: 0.02}), name)
    assert {rank.policy: rank.rank for rank in found}[best] == 1.0


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


def test_a_study_that_names_no_metrics_compares_the_headline_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shipped = load_study(str(written(tmp_path, WITHOUT_METRICS)))
    assert shipped.design.metrics is not None
    assert set(shipped.design.metrics) == {
        "mission_time_s", "completed", "goal_fraction", "energy_j", "n_bytes", "coverage_fraction",
        "duplicate_fraction",
    }  # fmt: skip
    declare(monkeypatch, metric("depth_reached_m", headline=True), metric("other_m"))
    results = swept(tmp_path)
    assert set(results.compared) == {
        "completed", "depth_reached_m", "energy_j", "goal_fraction", "mission_time_s", "n_bytes"
    }  # fmt: skip


def test_a_metric_that_no_mission_of_the_study_has_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    declare(monkeypatch, metric("depth_reached_m"))
    text = WITHOUT_METRICS.replace("seed = 7", 'seed = 7\nmetrics = ["depth_reached"]')
    with pytest.raises(ConfigurationError, match=r"study.toml:9: study.metrics = \"depth_reached\": allowed: .*; did "
                       r"you mean 'depth_reached_m'"):  # fmt: skip
        load_study(str(written(tmp_path, text)))
    with pytest.raises(ConfigurationError, match=r'stopping.metric = "coverage_fraction": allowed: .*depth_reached_m'):
        load_study(
            str(written(tmp_path, WITHOUT_METRICS + '[stopping]\nmetric = "coverage_fraction"\nhalf_width = 1\n'
                        "maximum = 10\n"))
        )  # fmt: skip


def test_missions_that_mean_different_things_by_one_name_are_studied_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = Path("missions/mapping/rendezvous.toml").read_text(encoding="utf-8")
    (tmp_path / "other.toml").write_text(scenario.replace('name = "mapping-rendezvous"', 'name = "other"'))
    directions = {"other": Better.LOWER}

    def declared(scenario: Any) -> Any:
        return {"score": metric("score", directions.get(scenario.scenario.name, Better.HIGHER), headline=True)}

    monkeypatch.setattr("missions.sweeps.study.metrics_of", declared)
    text = WITHOUT_METRICS.replace('"mapping-rendezvous"', '["mapping-rendezvous", "other.toml"]')
    with pytest.raises(ConfigurationError, match=r"study.scenario: .* differ in what score means; study them apart"):
        load_study(str(written(tmp_path, text)))


@pytest.mark.parametrize("name", ["seed", "wall_s", "key", "milestones"])
def test_a_metric_with_the_name_of_another_field_is_refused(name: str) -> None:
    with pytest.raises(ConfigurationError, match=f"metric {name}: a field that results have already"):
        collected("own.mission:M", [*CORE_METRICS, metric(name)])


def test_a_metric_of_which_no_value_is_better_is_compared_and_not_ranked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    declare(monkeypatch, metric("heading_rad", Better.NEITHER, "rad"))
    results = swept(tmp_path, heading_rad=1.0)
    assert len(compare(results, ["heading_rad"])) == 2
    with pytest.raises(
        OutputError, match=r"'heading_rad': cannot be ranked, neither .*; allowed are .*mission_time_s, "
    ):
        ranks(results, "heading_rad")
