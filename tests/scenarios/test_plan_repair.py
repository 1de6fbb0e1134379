"""A step fails in mid-mission: its branch alone is planned anew, and without that the mission fails.

The mission of the paper, without losses. AUV02 maps at 0.9 m/s, and so explores its area for longer than the others do
theirs; from when these have finished, nothing but a failure makes anybody plan. Then its sensor dies. After two rows
without a yield it gives up, leaves its role, and the head lets somebody else go on.
"""

import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import tomli_w

import missions.mapping
from missions.runs.run import Run, run
from missions.scenarios import load
from remoras.htn import Execution, Node, NoPlan, Plan, Task, plan
from remoras.htn.plans import ROOT
from remoras.recorder import PLANS
from remoras.social.planning import MissionPlanner

DIES_S = 2300.0


def broken(folder: Path, strategy: str, *settings: str, until_s: float | None = None) -> Run:
    """A run in which the sensor of AUV02 dies, for good or until a time."""
    shipped = Path(missions.mapping.__file__).with_name("rendezvous.toml").read_text(encoding="utf-8")
    raw = tomllib.loads(shipped)
    fault = {"kind": "sensor", "vehicle": "AUV02", "at_s": DIES_S}
    raw["fault"] = [fault if until_s is None else {**fault, "until_s": until_s}]
    raw["strategy"] = {"name": strategy}
    file = folder / "broken.toml"
    file.write_text(tomli_w.dumps(raw), encoding="utf-8")
    common = ("channel.per=0", "scenario.duration_s=7000", "vehicle.AUV02.survey_speed_mps=0.9")
    return run(load(str(file), [("--set", setting) for setting in (*common, *settings)]))


def plans(finished: Run, vehicle: str, role: str = "") -> list[dict[str, Any]]:
    """Rows of the plans that a vehicle carried out for missions, or for a role of its own."""
    rows = [dict(zip(PLANS.column_names, row, strict=True)) for row in finished.recorder.plans]
    return [row for row in rows if row["vehicle"] == vehicle and row["role"] == role]


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


def test_only_the_branch_that_failed_is_planned_anew(tmp_path: Path, planned: dict[str, list[Task]]) -> None:
    finished = broken(tmp_path, "repairing:WHEN_ASKED")
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
    finished = broken(tmp_path, "repairing:WHEN_ASKED")
    assert not finished.completed
    assert [row for row in finished.recorder.faults if row[2] == "cannot"]


@pytest.mark.slow
def test_a_vehicle_goes_another_way_before_it_gives_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The sensor works again after 900 s: with a second way AUV02 finishes itself, without repair it gives up."""
    mission = "scenario.mission=repairing:OnceMore"
    mended = broken(tmp_path, "repairing:WHEN_ASKED", mission, until_s=DIES_S + 900.0)
    assert mended.completed
    kinds = {row[2] for row in mended.recorder.faults if row[1] == "AUV02"}
    assert "failed step" in kinds
    assert "cannot" not in kinds
    [failed] = [row for row in mended.recorder.faults if row[2] == "failed step"]
    role = failed[3].split(" of ")[1].split(":")[0]
    steps = {row["task"]: row["status"] for row in plans(mended, "AUV02", role) if row["objective"] == "Exploring"}
    assert (steps["ZigzagExploring"], steps["BeginningAgain"]) == ("failed", "done")
    monkeypatch.setattr(Execution, "fail", lambda self, place, facts: False)
    given_up = broken(tmp_path, "repairing:WHEN_ASKED", mission, until_s=DIES_S + 900.0)
    assert "cannot" in {row[2] for row in given_up.recorder.faults if row[1] == "AUV02"}


def test_where_nothing_fails_no_branch_is_planned(tmp_path: Path, planned: dict[str, list[Task]]) -> None:
    """The same mission with a sensor that works: plans for wholes, and no other."""
    finished = run(load("mapping-rendezvous", [("--set", "channel.per=0")]))
    assert finished.completed
    assert planned["whole"]
    assert planned["branch"] == [task for task in planned["branch"] if task.name.startswith("Pursue")]
    assert not [row for row in finished.recorder.plans if "failed" in row]


def turned_round(found: Plan | NoPlan) -> Plan | NoPlan:
    """The same tree, with the tasks below each task in the opposite order."""
    if isinstance(found, NoPlan):
        return found
    nodes: list[Node] = []
    left = [(place, ROOT) for place, node in enumerate(found.nodes) if node.parent == ROOT]
    while left:
        place, parent = left.pop()
        nodes.append(found.nodes[place]._replace(parent=parent))
        left += [(child, len(nodes) - 1) for child in found.children[place]]
    return replace(found, nodes=tuple(nodes))


def test_the_steps_of_a_plan_in_another_order_are_not_carried_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Turned round, roles are to have objectives before they are allocated: these steps wait, and nobody explores.

    Nor is anything given anew: when all have met in vain, the head would do that beside the plan.
    """
    monkeypatch.setattr("missions.mapping.mission.given_anew", lambda *args: [])
    monkeypatch.setattr("remoras.social.planning.plan", lambda *args, **options: turned_round(plan(*args, **options)))
    finished = run(load("mapping-rendezvous", [("--set", "channel.per=0"), ("--set", "scenario.duration_s=2500")]))
    assert not finished.completed
    exploring = "AssignObjective(Operational, LeftWinger, Exploring, left)"
    assert {row["status"] for row in plans(finished, "AUV00") if row["task"] == exploring} <= {"waiting", "dropped"}
    assert not [row for row in finished.recorder.activities if row[3] == "ZigzagExploring"]
