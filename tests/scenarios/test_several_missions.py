"""A group is given a further mission while it has one, by its own head's plan; both are carried out side by side."""

import itertools

import pytest
from recorded import flown

from missions.runs.assembly import assemble
from missions.runs.run import Run
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.htn.domain import ROOT
from remoras.recorder import PLANS
from worldmodel import merge


def given(finished: Run, viewer: str) -> list[str]:
    """Missions that the operational group was given, in the view of one vehicle."""
    rows = [row for row in finished.recorder.organisation if row[1] == viewer and row[3] == "Operational"]
    return [row[9] for row in rows if row[5] == "given" and row[7] == "mission"]


@pytest.mark.slow
def test_the_planner_makes_a_mission_of_what_is_found() -> None:
    settings = ("scenario.mission='further:Further'", "finds.number=2", "channel.per=0.4")
    finished = flown("mapping-rendezvous", *settings)
    assert finished.completed, finished.reason
    for viewer in ("AUV00", "AUV01", "AUV02"):
        assert given(finished, viewer) == ["AreaMapping", "Inspection"]
    rows = [dict(zip(PLANS.column_names, row, strict=True)) for row in finished.recorder.plans]
    roots = [row for row in rows if row["vehicle"] == "AUV00" and row["parent"] == ROOT and not row["role"]]
    of_group = [row for row in roots if row["group"] == "Operational"]
    tasks = list(dict.fromkeys(row["task"] for row in of_group))
    assert tasks == ["AreaMapping(Operational)", "Inspection(Operational)"]
    since_s = min(row["time_s"] for row in of_group if row["task"].startswith("Inspection"))
    mapping = [row for row in of_group if row["task"].startswith("AreaMapping")]
    assert max(row["time_s"] for row in mapping) > since_s  # it is under way beside


def test_several_missions_are_the_same_in_whatever_order_they_are_heard() -> None:
    settings = [("--set", "scenario.mission='further:Further'"), ("--set", "finds.number=1")]
    by = assemble(resolved(load("mapping-rendezvous", settings)), seed=1)
    names = ("ASV00", "AUV00")
    says = {vehicle.name: vehicle.beliefs for vehicle in by.vehicles}
    said = [("ASV00", "AreaMapping"), ("AUV00", "Inspection")]
    blocks = [
        says[name].model.record([says[name].fact("Operational", "hasMission", mission)], 1.0 + n).block
        for n, (name, mission) in enumerate(said)
    ]
    for order in itertools.permutations(blocks):
        fleet = assemble(resolved(load("mapping-rendezvous", settings)), seed=1)
        heard = fleet.vehicles[2]
        assert heard.name not in names
        for block in order:
            heard.consider(merge(heard.beliefs.model, [block]).changes, 3.0)
        assert heard.social.missions["Operational"] == ("AreaMapping", "Inspection")
        fleet.close()
    by.close()
