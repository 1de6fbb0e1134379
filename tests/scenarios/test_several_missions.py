"""A group is given a further mission while it has one, by its own head's plan; both are carried out side by side."""

import pytest
from recorded import flown

from missions.runs.run import Run
from remoras.htn.domain import ROOT
from remoras.recorder import PLANS


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
