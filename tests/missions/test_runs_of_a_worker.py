"""A worker makes many runs of a scenario from one setup: each is the run that it would be alone."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from small_mission import SMALL

from missions.document import Document
from missions.scenarios import Scenario, load
from missions.scenarios.loading import scenario_from
from missions.sweeps import worker
from missions.sweeps.plan import RunTask
from missions.sweeps.worker import run_task

LOSSY = [("--set", "channel.per=0.3")]


@pytest.fixture(autouse=True)
def forgotten() -> Iterator[None]:
    worker._first.cache_clear()
    yield
    worker._first.cache_clear()


def task(scenario: Scenario, seed: int) -> RunTask:
    return RunTask(f"key{seed}", scenario, seed, 0, {}, "", True)


def result(of: RunTask) -> tuple[dict[str, object], dict[str, bytes]]:
    """Line without what depends on the machine, and tables."""
    finished = run_task(of)
    assert not finished.line["error"]
    return {key: value for key, value in finished.line.items() if key != "machine"}, dict(finished.tables)


def alone(of: RunTask) -> tuple[dict[str, object], dict[str, bytes]]:
    worker._first.cache_clear()
    return result(of)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "duration_s", "settings"),
    [
        ("mapping-rendezvous", 250, [*LOSSY]),
        ("mapping-rendezvous", 250, [*LOSSY, ("--set", "communication.needs_follow=groups")]),
        ("mapping-patches", 120, [*LOSSY, ("--set", "strategy.name=cbba")]),
        ("mapping-patches", 120, [*LOSSY, ("--set", "strategy.name=oracle")]),
        ("mapping-objects", 200, [*LOSSY]),
        ("mapping-three-teams", 100, [*LOSSY, ("--set", "navigation.drift=0.02")]),
        ("trident-intervention", 200, [*LOSSY]),
        ("arrows-archaeology", 100, []),
        ("pandora-inspection", 3100, [*LOSSY]),
    ],
)
def test_runs_that_share_a_setup_are_those_made_alone(name: str, duration_s: float, settings: list[tuple[str, str]]):
    scenario = load(name, [*settings, ("--set", f"scenario.duration_s={duration_s}")])
    seeds = (3, 4, 3)
    expected = [alone(task(scenario, seed)) for seed in seeds]
    worker._first.cache_clear()
    copies = [scenario.model_copy() for _ in seeds]
    assert [result(task(copy, seed)) for copy, seed in zip(copies, seeds, strict=True)] == expected
    assert worker._first.cache_info().hits == 2
    assert expected[0] == expected[2] != expected[1]


def test_many_runs_are_resolved_once(monkeypatch: pytest.MonkeyPatch):
    made: list[float] = []
    resolved = worker.resolved

    def counted(scenario: Scenario) -> object:
        made.append(scenario.channel.per)  # type: ignore[attr-defined]
        return resolved(scenario)

    monkeypatch.setattr(worker, "resolved", counted)
    settings = [[("--set", "scenario.duration_s=10"), ("--set", f"channel.per={per}")] for per in (0.1, 0.2)]
    scenarios = [load("mapping-rendezvous", each) for each in settings]
    for seed in range(4):
        for scenario in scenarios:
            result(task(scenario, seed))
    assert made == [0.1, 0.2]


def test_a_number_and_a_truth_value_that_are_equal_are_two_scenarios(monkeypatch: pytest.MonkeyPatch):
    scenario = load("mapping-rendezvous", [("--set", "scenario.duration_s=10")])
    others = [
        scenario.model_copy(update={"strategy": scenario.strategy.model_copy(update={"parameters": {"x": value}})})
        for value in (1, 1.0, True)
    ]
    assert len({worker._Common.of(other).content for other in others}) == 3


COUNTING = """
from missions.mapping import MappingMission

class Counting(MappingMission):
    n_worlds, all_numbers = 0, []

    def world(self, seed):
        self.n_worlds += 1
        self.all_numbers.append(self.n_worlds)
        return super().world(seed)
"""


def test_a_mission_of_a_users_own_is_made_for_each_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "counting_mission.py").write_text(COUNTING)
    monkeypatch.syspath_prepend(tmp_path)
    text = SMALL.replace("missions.mapping:MappingMission", "counting_mission:Counting").replace("1200.0", "20.0")
    scenario = scenario_from(Document.of_text(text, "pond.toml"))
    numbers: list[int] = sys.modules["counting_mission"].Counting.all_numbers

    def of_two_runs() -> list[int]:
        numbers.clear()
        for seed in (1, 2):
            result(task(scenario, seed))
        return numbers

    assert of_two_runs().count(1) == 2
    worker._first.cache_clear()
    monkeypatch.setattr(worker, "references", lambda _: frozenset())  # taken for one of ours it is shared
    assert of_two_runs().count(1) == 1
