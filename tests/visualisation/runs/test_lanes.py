"""Lanes that stand for several vehicles, and the pages that they save."""

from pathlib import Path

import pytest
from legibility import check_texts
from synthetic_runs import Fiction

from missions.runs.results import Results
from visualisation.runs import roles, run_picture
from visualisation.runs.reading import Tenure
from visualisation.spans import Span

FLEET = [f"AUV{number:02}" for number in range(32)]


def held(role: str, start_s: float = 0.0) -> Tenure:
    return Tenure("Team", role, (Span(start_s, 100.0),), (Span(start_s + 10.0, 100.0),))


TENURES = {
    "A": [held("Leader")],
    "B": [held("Diver"), held("Left", 20.0)],
    "C": [held("Diver")],
    "D": [held("Diver", 5.0)],
}


def test_vehicles_with_the_same_roles_share_a_lane_or_those_that_began_with_the_same() -> None:
    assert [lane.vehicles for lane in roles.same_roles(TENURES)] == [("A",), ("B",), ("C", "D")]
    found = roles.same_beginning(TENURES)
    assert [lane.vehicles for lane in found] == [("A",), ("B", "C", "D")]
    assert [row.role for row in found[1].rows] == ["Diver", "Left"]


def test_shares_are_of_all_vehicles_of_the_lane() -> None:
    """Three divers, driven from 10 s on, one of them from 15 s on."""
    (row, _) = roles.same_beginning(TENURES)[1].rows
    assert roles.shares(row.active, 3) == [(Span(10.0, 15.0), 2 / 3), (Span(15.0, 100.0), 1.0)]


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """32 vehicles with two roles each; every fourth has a role of its own besides."""
    own = [(100.0, name, "Team", f"Left{at}", "assigned") for at, name in enumerate(FLEET) if at % 4 == 0]
    fiction = Fiction(vehicles=FLEET, extra_roles=own)  # type: ignore[arg-type]
    return fiction.write(tmp_path_factory.mktemp("fleet") / "run")


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind", ["roles", "satisfaction", "motivation", "htn", "knowledge", "delivery", "tdma", "links"]
)
def test_32_vehicles_fit_a_page_of_a_paper(fleet: Results, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = run_picture(fleet, kind)
    assert drawn.figure.get_figwidth() == 7.2
    assert drawn.figure.get_figheight() <= 9.0
    check_texts(drawn.figure, monkeypatch)


@pytest.mark.parametrize(("n_vehicles", "n_lanes"), [(12, 12), (13, 1)])
def test_more_than_twelve_lanes_are_folded(tmp_path: Path, n_vehicles: int, n_lanes: int) -> None:
    """Although both would fit a page."""
    fleet = FLEET[:n_vehicles]
    roles = [(0.0, name, "Team", "Diver", "assigned") for name in fleet]
    fiction = Fiction(vehicles=fleet, roles=(), extra_roles=roles)  # type: ignore[arg-type]
    drawn = run_picture(fiction.write(tmp_path / "run"), "roles")
    names = [text.get_text() for text in drawn.figure.axes[0].texts if text.get_weight() == "bold"]
    assert names == (fleet if n_lanes == 12 else ["13 vehicles"])
    assert ("13 vehicles: AUV00, AUV01, AUV02, " in drawn.caption) is (n_lanes == 1)
