"""While the goal is not known to be reached, to come to the meeting answers no call."""

from pathlib import Path
from typing import Any

import pytest

from missions.mapping.jobs import SurveyJob
from missions.mapping.tasks import AfterWork, Unfinished
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.scenarios import load, shipped
from remoras.activities import Activity, ActivityType
from remoras.behaviours import Standing, awaited
from remoras.beliefs import Key
from remoras.motion import Motion
from remoras.picture import Picture

WEST = SurveyJob("west", ((0.0, 0.0), (0.0, 100.0), (100.0, 100.0), (100.0, 0.0)))
EAST = SurveyJob("east", ((100.0, 0.0), (100.0, 100.0), (200.0, 100.0), (200.0, 0.0)))
"""Areas of 16 cells of 25 m each."""


class Facts:
    """What a vehicle knows: values by key; of cells all that were told."""

    def __init__(self) -> None:
        self.known: dict[Key, Any] = {}
        self.cells: dict[str, set[float]] = {"west": set(), "east": set()}

    def get(self, key: Key, default: Any = None, /) -> Any:
        return self.known.get(key, default)

    def values(self, key: Key) -> set[Any]:
        if key[0] == "mappedCell":
            return self.cells[key[1]]
        return {self.known[key]} if key in self.known else set()

    n_told = 0


def answers(facts: Facts, goal: float, finds: tuple[str, ...] = ()) -> float:
    meeting = AfterWork(Standing(), Unfinished([WEST, EAST], goal, finds))
    return meeting.perceive(Motion(0.0, 0.0), Picture(facts=facts), True).settled


@pytest.mark.parametrize(
    ("n_cells", "goal", "expected"), [(29, 0.9, 1.0), (28, 0.9, 0.0), (31, 1.0, 0.0), (0, 0.0, 1.0)]
)
def test_calls_are_answered_from_the_goal_on(n_cells: int, goal: float, expected: float) -> None:
    """Of 32 cells a goal of 0.9 spares three (28.8 are asked for)."""
    facts = Facts()
    facts.cells["west"] = {float(n) for n in range(min(16, n_cells))}
    facts.cells["east"] = {float(n) for n in range(max(0, n_cells - 16))}
    assert answers(facts, goal) == expected


def test_an_area_that_somebody_has_done_counts_whole() -> None:
    facts = Facts()
    facts.known["areaDone", "west"] = "AUV01"
    assert answers(facts, 0.5) == 1.0
    assert answers(facts, 0.6) == 0.0


def test_a_find_that_waits_is_work() -> None:
    facts = Facts()
    facts.known["foundAt", "find 1"] = (0.0, 0.0)
    assert answers(facts, 0.0, ("find 1",)) == 0.0
    facts.known["inspectedBy", "find 1"] = "AUV01"
    assert answers(facts, 0.0, ("find 1",)) == 1.0


@pytest.mark.slow
def test_who_takes_over_is_not_called_off_by_a_head_that_hears_of_no_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """AUV01 is lost, nobody tells what it maps: the discontented head calls AUV02, which has its area now."""
    text = shipped()["mapping-rendezvous"].read_text(encoding="utf-8")
    untold = tmp_path / "untold.toml"
    untold.write_text(text.replace("mappedCell = 1\n", ""), encoding="utf-8")
    lost = 'fault=[{vehicle="AUV01",kind="lost",at_s=900}]'
    scenario = load(str(untold), [("--set", one) for one in ("strategy.name=remoras", "channel.per=0.3", lost)])
    assert run(scenario, 1).completed
    monkeypatch.setattr(Unfinished, "settled", lambda self, found, facts: found.settled)
    monkeypatch.setattr(Unfinished, "answers", lambda self, group, picture: awaited(group, picture))
    finished = run(scenario, 1)
    assert not finished.completed
    assert "82 % of the work done" in finished.reason


class OwnTeamDone:
    """What a vehicle of the northern team knows when its team has done its work: nothing of other teams."""

    n_told = 0

    def get(self, key: Key, default: Any = None, /) -> Any:
        return "AUV01" if key in (("areaDone", "north west"), ("areaDone", "north east")) else default

    def values(self, key: Key) -> set[Any]:
        known = self.get(key)
        return set() if known is None else {known}


@pytest.mark.parametrize(("vehicle", "expected"), [("AUV01", 1.0), ("AUV03", 0.0), ("ASV00", 0.0)])
def test_the_work_of_teams_of_which_a_vehicle_hears_nothing_does_not_keep_it(vehicle: str, expected: float) -> None:
    """To follow the leader: AUV01 is able to map the northern areas alone, AUV03 the eastern ones, ASV00 none."""
    setup = resolved(load("mapping-three-teams"))
    following = Activity("Following", ActivityType.GUIDANCE, ("follower", ("AUV00",)))
    behaviour = setup.mission.behaviour_for(following, setup.database[vehicle])
    assert isinstance(behaviour, AfterWork)
    behaviour._meeting = Standing()
    facts: Any = OwnTeamDone()
    assert behaviour.perceive(Motion(0.0, 0.0), Picture(facts=facts), True).settled == expected
