"""Failure of a step during a mission: only its branch is replanned; without repair the mission fails.

The mission of the paper, without losses. AUV02 maps at 0.9 m/s, and so explores its area for longer than the others do
theirs; from when these have finished, nothing but a failure makes anybody plan. Then its sensor dies. After two rows
without a yield it gives up, leaves its role, and the head lets somebody else go on.
"""

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from recorded import flown

import missions.mapping
from missions.runs.run import Run, run
from missions.scenarios import load
from remoras.htn import Task, plan
from remoras.organisation import Group
from remoras.recorder import PLANS
from remoras.social.planning import MissionPlanner
from remoras.strategies.allocation import all_jobs
from remoras.strategies.initial_roles import common_roles
from remoras.strategies.remoras import STRATEGY as REMORAS
from remoras.strategy import Declaration
from remoras.work import Work


class WhenAsked:
    """Nobody negotiates: what the plan of the group's head does not ask for is not allocated."""

    name = "when-asked"
    declaration = Declaration("", {"playsRole": "its roles", "leftRole": "that it leaves one"}, planned_before=False)
    form = staticmethod(REMORAS.form)

    def adapt(self, work: Work) -> Any:
        return all_jobs(work) + common_roles(work)

    def negotiator(self, me: str, group: Group) -> None:
        return None


WHEN_ASKED = WhenAsked()


def broken(folder: Path) -> Run:
    """A run in which the sensor of AUV02 dies, under a strategy that allocates when it is asked."""
    shipped = Path(missions.mapping.__file__).with_name("rendezvous.toml").read_text(encoding="utf-8")
    raw = tomllib.loads(shipped)
    raw["fault"] = [{"kind": "sensor", "vehicle": "AUV02", "at_s": 2300.0}]
    raw["strategy"] = {"name": f"{__name__}:WHEN_ASKED"}
    file = folder / "broken.toml"
    file.write_text(tomli_w.dumps(raw), encoding="utf-8")
    common = ("channel.per=0", "scenario.duration_s=7000", "vehicle.AUV02.survey_speed_mps=0.9")
    return run(load(str(file), [("--set", setting) for setting in common]))


def plans(finished: Run, vehicle: str) -> list[dict[str, Any]]:
    """Rows of the plans that a vehicle carried out for missions."""
    rows = [dict(zip(PLANS.column_names, row, strict=True)) for row in finished.recorder.plans]
    return [row for row in rows if row["vehicle"] == vehicle and not row["role"]]


@pytest.fixture
def planned(monkeypatch: pytest.MonkeyPatch) -> dict[str, list[Task]]:
    """Tasks that are planned: for a whole mission, and as a branch of one."""
    found: dict[str, list[Task]] = {"whole": [], "branch": []}

    def noting(where: str) -> Callable[..., Any]:
        def noted(domain: Any, facts: Any, task: Task, **options: Any) -> Any:
            found[where].append(task)
            return plan(domain, facts, task, **options)

        return noted

    monkeypatch.setattr("remoras.social.planning.plan", noting("whole"))
    monkeypatch.setattr("remoras.htn.execution.plan", noting("branch"))
    return found


def test_only_the_failed_branch_of_a_mission_is_replanned(tmp_path: Path, planned: dict[str, list[Task]]) -> None:
    finished = broken(tmp_path)
    assert finished.completed
    [(given_up_s, _, _, detail)] = [row for row in finished.recorder.faults if row[2] == "cannot"]
    role = detail.split(":")[0]
    area = detail.split("(")[1].rstrip(")")
    branches = [task for task in planned["branch"] if task.name == "Explore"]
    assert branches == [Task("Explore", ("Operational", role, area))]
    rows = plans(finished, "AUV00")
    [failed] = [row for row in rows if row["status"] == "failed"]
    assert failed["task"] == f"AssignObjective(Operational, {role}, Exploring, {area})"
    assert given_up_s < failed["time_s"] < given_up_s + 60.0
    changed = {row["node"] for row in rows if row["time_s"] == failed["time_s"]}
    tree = {row["node"]: row["parent"] for row in rows}
    assert {tree[node] for node in changed - {failed["parent"]}} == {failed["parent"]}  # nothing outside the branch
    [branch] = [row for row in rows if row["node"] == failed["parent"] and row["time_s"] == failed["time_s"]]
    assert branch["method"] == "to another"
    done = [row for row in rows if row["status"] == "done" and row["time_s"] < failed["time_s"]]
    later = {(row["node"], row["status"]) for row in rows if row["time_s"] >= failed["time_s"]}
    assert not any((row["node"], "running") in later for row in done)  # what is done stays done


def test_without_repair_the_mission_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The cause taken away: the same failure, and the head does not look for another way."""
    monkeypatch.setattr(MissionPlanner, "_mend", lambda self, group, vacant, known: True)
    finished = broken(tmp_path)
    assert not finished.completed
    assert [row for row in finished.recorder.faults if row[2] == "cannot"]


def test_a_head_that_plans_gives_no_job_twice_in_one_round() -> None:
    """AUV03 leaves two lifts when it is cut off; the head plans at the end of the frame in which it hears of it."""
    settings = (
        "communication.policy=holdings-repeat", "communication.lease_frames=36", "channel.name=bernoulli",
        "channel.per=0.8", "uncertainty.p_miss=0.001", "scenario.duration_s=1060",
    )  # fmt: skip
    finished = flown("recovery-field", *settings, seed=55)
    given: dict[tuple[float, str], set[str]] = {}
    for _, origin, _, at_s, name, attribute, role, *_ in finished.recorder.items:
        if (origin, attribute) == ("AUV00", "playsRole"):
            given.setdefault((at_s, role), set()).add(name)
    left = {row[6] for row in finished.recorder.items if (row[1], row[5]) == ("AUV03", "leftRole")}
    assert {role for at_s, role in given if at_s > 1050.0} == left
    assert all(len(names) == 1 for names in given.values())
