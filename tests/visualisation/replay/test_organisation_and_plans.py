"""Organisation, plans and motivations of the replay page equal the tables, at any time and in any view."""

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from replayed import asked, data_of, moments_s, recorded
from synthetic_runs import FICTIONS, FLEET, Fiction, nested

from missions.runs.results import Results
from visualisation import run_records
from visualisation.replay import run_data
from visualisation.runs.views import View, view_of

MOMENTS = 12


def rebuilt(view: View, at_s: float) -> dict[str, Any]:
    """Groups that are there, with holders, those of them in the mission, and how many are lacking."""
    found: dict[str, Any] = {}
    for group in view.groups:
        if not any(span.start_s <= at_s < span.end_s for span in view.exists[group.name]):
            continue
        roles = {}
        for role in group.roles:
            own = [one for one in view.holdings.get((group.name, role.name), ()) if one.holds(at_s)]
            present = {one.vehicle for one in own if one.is_present(at_s)}
            roles[role.name] = [
                role.is_head,
                {one.vehicle for one in own},
                present,
                max(0, role.minimum - len(present)),
            ]
        found[group.name] = [group.above, roles]
    return found


ORGANISATION = """([run], times) => times.map((t) => [-1, ...run.vehicles.keys()].map((viewer) => {
  const name = (v) => run.vehicles[v].name, { groups, reserves } = run.organisation(viewer, t);
  const roleOf = ({ name: role, isHead, holders, vacant }) => [role, [isHead, holders.map((one) => name(one.v)),
    holders.filter((one) => !one.isAway).map((one) => name(one.v)), vacant]];
  return [groups.map((group) => [group.name, group.above, group.roles.map(roleOf)]), reserves.map(name)];
}))"""


def check_organisation(results: Results, data: bytes, folder: Path) -> int:
    """Hold the page against the tables; returns how many groups were compared."""
    names = run_records.vehicle_names(results)
    times_s = [0.0, 210.0, *moments_s(results, MOMENTS)]
    n_groups = 0
    views = {viewer: view_of(results, viewer) for viewer in ("", *names)}
    for at_s, told in zip(times_s, asked([data], ORGANISATION, folder, times_s), strict=True):
        for view, (groups, reserves) in zip(views.values(), told, strict=True):
            said = {
                name: [above, {role: [head, set(held), set(here), n] for role, (head, held, here, n) in roles}]
                for name, above, roles in groups
            }
            assert said == rebuilt(view, at_s), (view.viewer, at_s)
            busy = {one.vehicle for own in view.holdings.values() for one in own if one.holds(at_s)}
            assert reserves == [name for name in names if name not in busy]
            n_groups += len(said)
    return n_groups


def test_organisation_in_every_view_equals_that_of_the_tables(lost: Results, tmp_path: Path) -> None:
    assert check_organisation(lost, data_of(lost), tmp_path) == 2 * 5 * (MOMENTS + 2)


def test_group_formed_at_sea_is_shown_while_the_viewer_knows_of_it(tmp_path: Path) -> None:
    """Vehicles without the news have no such group: of 17 views one and the truth have it."""
    results = FICTIONS["nested"].write(tmp_path / "run")
    data = run_data(results)
    assert check_organisation(results, data, tmp_path) > 0
    (told,) = asked([data], ORGANISATION, tmp_path, [600.0])
    ((refused, *others), *_) = [[one for one in of if one["isRefused"]] for of in asked([data], CHANGES, tmp_path)]
    assert (refused["text"], others) == ("refused: AUV00 as Reporter of Fleet, by AUV15: issuer without authority", [])
    turns = asked([data], "([run]) => run.turns.map((one) => [one.time_s, one.text])", tmp_path)
    assert turns == [
        [300.0, "Inspection is formed under AUV06, by AUV05"],
        [520.0, "AUV03 succeeds as Leader of Team A, by AUV03"],
        [700.0, "Inspection is dissolved, by AUV05"],
    ]
    names = [[name for name, *_ in groups] for groups, _ in told]
    assert [viewer for viewer, of in zip(["truth", *FLEET], names, strict=True) if "Inspection" in of] == [
        "truth", FLEET[5]
    ]  # fmt: skip
    assert names[0] == ["Fleet", "Wing", "Team A", "Team B", "Inspection", "Team C"]


LABELS = """([run]) => run.vehicles.map((_, v) => [
  new R.Facts(run, new Map(run.bars(v).map((bar) => [bar.role, {}]))).driving[v].map((spell) => spell.text),
  run.decisions(v).flatMap((one) => one.candidates.filter((c) => c.role).map((c) => [c.label, c.group, c.role])),
  run.events.filter((one) => one.kind === "role" && one.vehicle === v).map((one) => one.text)])"""


def test_role_has_its_group_as_prefix_if_groups_share_its_name(tmp_path: Path) -> None:
    """West, Middle and East have the same roles; those of Fleet are its own."""
    results = recorded(tmp_path / "run", "scenario.duration_s=90", scenario="mapping-nine-teams")
    names = run_records.vehicle_names(results)
    told = dict(zip(names, asked([data_of(results)], LABELS, tmp_path, more=["facts.js"]), strict=True))
    spells, choices, events = told["AUV00"]
    assert "West.Coordinator" in spells
    assert any(text.startswith("AUV00 has active role West.Coordinator") for text in events)
    assert "MissionAdministrator" in told["ASV00"][0]
    of_teams = [one for _, own, _ in told.values() for one in own if one[1] != "Fleet"]
    assert {group for _, group, _ in of_teams} == {"West", "Middle", "East"}
    assert all(label.endswith(f"({group}.{role})") for label, group, role in of_teams)
    assert all(label.endswith(f"({role})") for label, group, role in choices if group == "Fleet")


AIMS = """([run], times) => times.map((t) => [...run.vehicles.keys()].map((viewer) => run.organisation(viewer, t).groups
  .map((group) => [group.name, group.mission, group.roles.map((role) => [role.name, role.aims])])))"""


def test_missions_and_objectives_are_those_known_to_the_viewer(lost: Results, tmp_path: Path) -> None:
    rows = lost.table("organisation").to_pylist()
    times_s, n_aims = [0.0, 210.0, *moments_s(lost, MOMENTS)], 0
    for at_s, told in zip(times_s, asked([data_of(lost)], AIMS, tmp_path, times_s), strict=True):
        for vehicle, groups in zip(lost.scenario.vehicle, told, strict=True):
            own = [row for row in rows if row["vehicle"] == vehicle.name and row["time_s"] <= at_s]
            for group, mission, roles in groups:
                given = [row for row in own if row["group"] == group and row["event"] == "given"]
                missions = [row["argument"] for row in given if row["act"] == "mission"]
                assert mission == (missions[-1] if missions else "")
                for role, aims in roles:
                    so = {row["objective"]: row["argument"] for row in given if row["role"] == role}
                    assert aims == [f"{name}({about})" if about else name for name, about in so.items()]
                    n_aims += len(aims)
    assert n_aims > 100


CHANGES = "([run]) => [-1, ...run.vehicles.keys()].map((v) => run.changes(v, Infinity, Infinity).reverse())"


def test_changes_are_those_that_the_viewer_applied_or_refused(lost: Results, tmp_path: Path) -> None:
    rows = lost.table("organisation").to_pylist()
    truth, *told = asked([data_of(lost)], CHANGES, tmp_path)
    for vehicle, changes in zip(lost.scenario.vehicle, told, strict=True):
        own = [row for row in rows if row["vehicle"] == vehicle.name]
        assert [(one["time_s"], one["isRefused"]) for one in changes] == [
            (row["time_s"], row["event"] == "refused") for row in own
        ]
        for change, row in zip(changes, own, strict=True):
            assert row["group"] in change["text"]
            assert (f"by {row['issuer']}" if row["issuer"] else "agreed before") in change["text"]
            assert row["event"] != "refused" or change["text"].endswith(row["outcome"])
    successions = [one["text"] for one in truth if "succeeds" in one["text"]]
    assert "AUV01 succeeds as Coordinator of Operational, by AUV01" in successions
    listed = "([run]) => run.events.filter((one) => one.kind === 'organisation').map((one) => one.text)"
    assert asked([data_of(lost)], listed, tmp_path) == successions


PLANS = """([run], times) => times.map((t) => [...run.vehicles.keys()].map((v) => run.plansOf(v, t)
  .map((plan) => [[plan.group, plan.role, plan.objective, plan.argument], run.tasksOf(plan, t)])))"""


def tree_of(rows: list[dict[str, Any]], at_s: float) -> list[list[Any]]:
    """Tasks of one plan from the top down: depth, task, method, status, when it should end, whether it was mended."""
    nodes: dict[int, list[dict[str, Any]]] = {}
    for row in rows:
        if row["time_s"] <= at_s:
            nodes.setdefault(row["node"], []).append(row)
    found: list[list[Any]] = []

    def add(node: int, depth: int) -> None:
        last = nodes[node][-1]
        span_s = last["expected_time_s"]
        ends = last["status"] == "running" and span_s is not None and not math.isnan(span_s) and span_s > 0.0
        methods = {row["method"] for row in nodes[node]} - {""}
        end_s = pytest.approx(last["time_s"] + span_s, abs=0.07) if ends else None  # kept to 1/8 s
        found.append([depth, last["task"], last["method"], last["status"], end_s, len(methods) > 1])
        for below in sorted(nodes):
            if nodes[below][0]["parent"] == node:
                add(below, depth + 1)

    for top in sorted(nodes):
        if nodes[top][0]["parent"] == -1:
            add(top, 0)
    return found


def test_plans_have_the_progress_of_the_tables(lost: Results, tmp_path: Path) -> None:
    rows = lost.table("plans").to_pylist()
    times_s = [0.0, 210.0, *moments_s(lost, MOMENTS)]
    mended = set()
    for at_s, told in zip(times_s, asked([data_of(lost)], PLANS, tmp_path, times_s), strict=True):
        for vehicle, plans in zip(lost.scenario.vehicle, told, strict=True):
            so: dict[tuple[str, ...], list[dict[str, Any]]] = {}
            for row in rows:
                if row["vehicle"] == vehicle.name and row["time_s"] <= at_s:
                    about = tuple(row[name] for name in ("group", "role", "objective", "argument"))
                    so.setdefault(about, []).append(row)
            assert {tuple(about) for about, _ in plans} == set(so)
            assert [bool(about[1]) for about, _ in plans] == sorted(bool(about[1]) for about, _ in plans)
            for about, tasks in plans:
                names = ("depth", "task", "method", "status", "expected_s", "isMended")
                assert [[task[name] for name in names] for task in tasks] == tree_of(so[tuple(about)], at_s)
                mended |= {task["task"] for task in tasks if task["isMended"]}
    assert mended
    assert mended == {row["task"] for row in rows if row["method"] and is_mended(rows, row)}


def is_mended(rows: list[dict[str, Any]], of: dict[str, Any]) -> bool:
    keys = ("vehicle", "group", "role", "objective", "argument", "node")
    own = [row["method"] for row in rows if all(row[key] == of[key] for key in keys) and row["method"]]
    return any(a != b for a, b in pairwise(own))


MEANS = """([run]) => [...run.vehicles.keys()].map((v) => run.decisions(v).map((one) => [one.time_s,
  one.candidates.map((of) => [of.own, of.external, of.chosen, of.bestMean]),
  new Set(one.candidates.map((of) => [of.label, of.group, of.objective, of.argument].join())).size]))"""


def test_motivations_have_the_mean_of_each_combination(lost: Results, tmp_path: Path) -> None:
    """Of several decisions at one time the last counts."""
    rows = lost.table("decisions").to_pylist()
    for vehicle, decisions in zip(lost.scenario.vehicle, asked([data_of(lost)], MEANS, tmp_path), strict=True):
        own = [row for row in rows if row["vehicle"] == vehicle.name]
        assert [time_s for time_s, *_ in decisions] == list(dict.fromkeys(row["time_s"] for row in own))
        for time_s, candidates, n_different in decisions:
            assert n_different == len(candidates)
            so = [row for row in own if row["time_s"] == time_s][-len(candidates) :]
            for (mine, external, chosen, mean), row in zip(candidates, so, strict=True):
                assert (mine, external) == pytest.approx((row["own"], row["external"]), abs=1e-5)
                assert chosen == row["chosen"]
                assert mean == (None if row["best_mean"] is None else pytest.approx(row["best_mean"], abs=1e-5))


def test_nested_groups_are_listed_below_their_supervisors_at_any_depth(tmp_path: Path) -> None:
    deep = [{**nested()[0], "name": f"G{n}", "within": f"G{n - 1}" if n else ""} for n in range(9)]
    data = run_data(Fiction(groups=deep, roles=[("G8", "Leader")]).write(tmp_path / "run"))
    depths = "([run]) => run.organisation(-1, 0).groups.map((group) => [group.name, group.depth])"
    assert asked([data], depths, tmp_path) == [[f"G{n}", n] for n in range(9)]
