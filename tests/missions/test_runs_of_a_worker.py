"""A worker makes many runs of a scenario from one setup: each is the run that it would be alone."""

from collections.abc import Iterator

import pytest

from missions.scenarios import Scenario, load
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
        ("mapping-objects", 200, [*LOSSY]),
        ("mapping-three-teams", 100, [*LOSSY, ("--set", "navigation.drift=0.02")]),
        ("trident-intervention", 200, [*LOSSY]),
        ("arrows-archaeology", 100, []),
        ("pandora-inspection", 3100, [*LOSSY]),
    ],
)
def test_runs_that_share_a_setup_are_those_made_alone(name: str, duration_s: float, settings: list[tuple[str, str]]):
    scenario = load(name, [*settings, ("--set", f"scenario.duration_s={duration_s}")])
    one, other = (alone(task(scenario, seed)) for seed in (3, 4))
    worker._first.cache_clear()
    assert [result(task(scenario.model_copy(), seed)) for seed in (3, 4, 3)] == [one, other, one]
    assert worker._first.cache_info().hits == 2
    assert one != other
