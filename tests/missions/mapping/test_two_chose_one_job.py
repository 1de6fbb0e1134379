"""Vehicles that plan alike by what each knows may choose one job that has room for both: one of them goes on."""

import tomllib

import pytest
import tomli_w

from missions.document import Document
from missions.files import shipped, text_of
from missions.mapping.drawn_ground import drawn_ground
from missions.runs.results import MemoryResults
from missions.runs.run import Run, run
from missions.scenarios.loading import scenario_from
from remoras.strategies.status_broadcast import Broadcaster
from remoras.work import Work

GROUND = 11
"""All its jobs have room for two, and the first plans of two vehicles differ: each knows where it is itself by now."""


def flown(strategy: str) -> Run:
    tables = drawn_ground(tomllib.loads(text_of(shipped()["mapping-patches"])), GROUND)
    settings = ("--set", f"strategy.name='{strategy}'"), ("--set", "uncertainty.speed_spread=0.0")
    return run(scenario_from(Document.of_text(tomli_w.dumps(tables), "ground.toml"), settings), 1)


def first_jobs(finished: Run) -> list[str]:
    """What each vehicle is at after 60 s."""
    rows = MemoryResults(finished).table("roles").to_pylist()
    held: dict[str, str] = {}
    for row in rows:
        if row["role"].startswith("Piece") and row["time_s"] <= 60.0 and row["event"] == "assigned":
            held[row["vehicle"]] = row["role"]
    return sorted(held.values())


@pytest.fixture(scope="module")
def dispatched_s() -> float:
    return flown("plan-and-dispatch").milestones[-1].time_s


def test_one_of_two_that_chose_the_same_goes_on(dispatched_s: float) -> None:
    finished = flown("status-broadcast")
    assert len(set(first_jobs(finished))) == 4
    assert finished.milestones[-1].time_s < 1.05 * dispatched_s


def test_where_both_stay_the_mission_takes_longer(dispatched_s: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Were the second taken for a helper, as long as the job has room."""
    by_room = Broadcaster._is_later

    def is_later(self: Broadcaster, role: str, doubted: set[str], work: Work) -> bool:
        self._helps = True
        return by_room(self, role, doubted, work)

    monkeypatch.setattr(Broadcaster, "_is_later", is_later)
    finished = flown("status-broadcast")
    assert len(set(first_jobs(finished))) < 4
    assert finished.milestones[-1].time_s > 1.2 * dispatched_s
