"""Organisation of a run, read and drawn: role holders over time, vacancies, marked acts."""

import math
from pathlib import Path

from replayed import moments_s
from synthetic_runs import CROWD, FICTIONS, FLEET, Fiction, nested

from missions.runs.results import Results
from missions.spans import Span
from visualisation.runs import run_picture
from visualisation.runs.views import ActMark, View, view_of


def held(view: View, at_s: float) -> set[tuple[str, str, str]]:
    return {(*key, one.vehicle) for key, own in view.holdings.items() for one in own if one.holds(at_s)}


def test_organisation_of_a_viewer_equals_that_of_its_rebuilt_memory(lost: Results) -> None:
    for at_s in moments_s(lost):
        for vehicle in lost.scenario.vehicle:
            known = lost.known(vehicle.name, at_s).organisation.assignments
            view = view_of(lost, vehicle.name)
            assert held(view, at_s) == {(one.group, one.role, one.vehicle) for one in known}, (vehicle.name, at_s)


def test_organisation_without_viewer_has_the_roles_each_vehicle_holds(lost: Results) -> None:
    """As the table ``roles`` has it, which the vehicles write of themselves."""
    rows = lost.table("roles").to_pylist()
    for at_s in moments_s(lost):
        so: set[tuple[str, str, str]] = set()
        for row in rows:
            if row["time_s"] <= at_s and row["event"] in ("assigned", "left"):
                key = (row["group"], row["role"], row["vehicle"])
                (so.add if row["event"] == "assigned" else so.discard)(key)
        assert held(view_of(lost), at_s) == so


def test_succession_ends_the_vacancy_after_a_loss(lost: Results) -> None:
    """AUV00 is lost at 200 s; the role of the Coordinator is vacant until the succession of AUV01."""
    view = view_of(lost)
    (operational,) = [group for group in view.groups if group.name == "Operational"]
    (mark,) = [one for one in view.marks if (one.kind, one.role) == ("succeed", "Coordinator")]
    assert view.vacancies(operational)["Coordinator"] == [Span(200.0, mark.time_s)]
    assert operational.above == "Coordination"
    at_s = 0.5 * (200.0 + mark.time_s)
    assert "Operational (Coordinator AUV00 (absent), 1 vacant; " in run_picture(lost, "organisation", at_s=at_s).caption
    seen_s = [one.time_s for one in view_of(lost, "ASV00").marks if (one.kind, one.role) == ("succeed", "Coordinator")]
    assert seen_s[0] > mark.time_s  # it hears of it


def test_a_group_formed_at_sea_exists_from_its_forming_to_its_dissolution(tmp_path: Path) -> None:
    view = view_of(FICTIONS["nested"].write(tmp_path / "run"))
    assert view.exists["Inspection"] == [Span(300.0, 700.0)]
    assert view.exists["Team A"] == [Span(0.0, math.inf)]
    assert [mark for mark in view.marks if mark.group == "Inspection"] == [
        ActMark(300.0, "create", "Inspection", ""), ActMark(700.0, "dissolve", "Inspection", "")
    ]  # fmt: skip
    (inspection,) = [group for group in view.groups if group.name == "Inspection"]
    assert view.vacancies(inspection) == {
        "Leader": [Span(300.0, 310.0)],
        "Diver": [Span(300.0, 700.0)],
    }
    assert {group.name: group.above for group in view.groups} == {
        "Fleet": "", "Wing": "Fleet", "Team A": "Wing", "Team B": "Wing", "Team C": "Wing", "Inspection": "Team B",
    }  # fmt: skip


def test_caption_names_the_holders_of_the_time_and_of_the_viewer(tmp_path: Path) -> None:
    results = FICTIONS["nested"].write(tmp_path / "run")
    before, within = (run_picture(results, "organisation", at_s=at_s).caption for at_s in (100.0, 600.0))
    assert "Inspection (" not in before
    assert "Inspection (Leader AUV06; Diver AUV07, 1 vacant)" in within
    of_first = run_picture(results, "organisation", at_s=600.0, viewer="AUV00").caption
    assert "Team A (Leader 1 vacant; Diver 2 vacant)" in of_first


def test_groups_are_indented_below_their_supervisors(tmp_path: Path) -> None:
    (axes,) = run_picture(FICTIONS["nested"].write(tmp_path / "run"), "organisation").figure.axes
    names = [text for text in axes.texts if text.get_weight() == "bold"]
    assert [text.get_text() for text in names] == ["Fleet", "Wing", "Team A", "Team B", "Inspection", "Team C"]
    left_px = [text.get_window_extent().x0 for text in names]
    assert left_px[0] < left_px[1] < left_px[2] == left_px[3] == left_px[5] < left_px[4]


def test_end_of_the_run_is_shown_if_no_time_is_named(tmp_path: Path) -> None:
    caption = run_picture(FICTIONS["nested"].write(tmp_path / "nested"), "organisation").caption
    assert "the thick line marks 1000 s" in caption


def test_vehicles_without_role_are_listed_as_reserves(tmp_path: Path) -> None:
    fiction = Fiction(vehicles=FLEET[:2], roles=(), groups=nested()[:1])
    results = fiction.write(tmp_path / "run")
    assert "Reserves hold no role: AUV00 and AUV01." in run_picture(results, "organisation").caption


def test_caption_says_so_if_bars_are_too_low_for_names(tmp_path: Path) -> None:
    """The page has room for the names of 64 bars, not of 96."""
    for groups, is_said in ((("Fleet", "Wing"), False), (("Fleet", "Wing", "Team A"), True)):
        held = [(0.0, v, v, g, "Leader", "assigned", v, "assign", "", "", "success") for v in CROWD for g in groups]
        fiction = Fiction(vehicles=CROWD, roles=(), groups=nested()[:3], changes=held)
        caption = run_picture(fiction.write(tmp_path / str(len(groups))), "organisation").caption
        assert ("too low for the names" in caption) is is_said


def marks(results: Results, viewer: str = "") -> set[str]:
    figure = run_picture(results, "organisation", viewer=viewer).figure
    return {str(line.get_marker()) for axes in figure.axes for line in axes.lines} - {"None", ""}


def test_acts_are_marked_in_the_views_that_know_them(tmp_path: Path) -> None:
    """Refused, succession, mission, formed and dissolved in truth; the first vehicle refused, and gave the mission."""
    results = FICTIONS["nested"].write(tmp_path / "run")
    assert marks(results) == {"X", "*", "d", "|"}
    assert marks(results, "AUV00") == {"X", "d"}
    caption = run_picture(results, "organisation", at_s=600.0, viewer="AUV00").caption
    assert caption.startswith("Organisation in the view of AUV00, over mission time; the thick line marks 600 s. ")
    assert "Requests refused by AUV00 are crossed at 1 place." in caption
