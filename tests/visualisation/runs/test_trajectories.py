"""The map of the tracks: places by their kinds, panels where they say more."""

from pathlib import Path

import numpy as np
import pytest
from synthetic_runs import Fiction

from missions.figure import Place
from visualisation import style
from visualisation.runs import run_picture
from visualisation.runs.reading import PlanTrack
from visualisation.runs.trajectories import MOST_NAMED, MapContents, _panels


def test_kinds_of_places_have_their_symbols_and_their_words(tmp_path: Path) -> None:
    corners = ((0.0, 0.0), (0.0, 50.0), (50.0, 50.0))
    places = [
        Place("north", "search box", corners), Place("wall", "no-go zone", corners),
        Place("home", "dock", ((5.0, 5.0),)),
        Place("buoy", "beacon", ((90.0, 5.0),)),
    ]  # fmt: skip
    found = run_picture(Fiction().write(tmp_path / "run"), "trajectories", (), places)
    legend = {text.get_text() for text in found.figure.legends[0].get_texts()}
    assert legend == {"A", "B", "start", "end", "search box", "no-go zone", "dock", "beacon"}
    for part in (
        "Outlines (search box): north.", "Dashed outlines (no-go zone): wall.", "Stars (dock): home.",
        "Crosses (beacon): buoy.",
    ):  # fmt: skip
        assert part in found.caption
    axes = found.figure.axes[0]
    assert {patch.get_linestyle() for patch in axes.patches} == {"-", (0, (4, 1.2))} or len(axes.patches) == 2
    assert {"*", "P"} <= {line.get_marker() for line in axes.get_lines()}


def test_a_place_without_points_is_refused() -> None:
    with pytest.raises(ValueError, match="place 'dock' has no point"):
        Place("dock", "dock", ())


def test_the_panel_of_the_ends_shows_the_ends(tmp_path: Path) -> None:
    """Also where the eventful stretch is at the beginning of the mission: ten events in its first tenth."""
    rows = [(10.0 * n, "A", "Team", "Leader", ("active", "inactive")[n % 2]) for n in range(10)]
    fiction = Fiction(roles=(), extra_roles=rows, radius_m=3000.0, vehicles=("A", "B"))
    figure = run_picture(fiction.write(tmp_path / "run"), "trajectories").figure
    titles = {axes.get_title(loc="left"): axes for axes in figure.axes}
    (beginning,) = [axes for title, axes in titles.items() if title.startswith("(b) 0 to")]
    ends = [axes for title, axes in titles.items() if "where the vehicles end" in title]
    for axes in (figure.axes[0], *ends):
        assert sum(line.get_marker() == "s" and len(line.get_xdata()) == 1 for line in axes.get_lines()) == 2
    assert not any(line.get_marker() == "s" and len(line.get_xdata()) == 1 for line in beginning.get_lines())


def scene(out: frozenset[str]) -> MapContents:
    """Two vehicles that end 20 m apart, and a third that ends 600 m from them."""
    ends = {"A": (1000.0, 1000.0), "B": (1000.0, 1020.0), "C": (400.0, 1000.0)}
    times = np.array([0.0, 100.0])
    tracks = {name: PlanTrack(times, np.array([0.0, x_m]), np.array([0.0, y_m])) for name, (x_m, y_m) in ends.items()}
    looks = {name: style.vehicle_look(number) for number, name in enumerate(tracks)}
    return MapContents(tracks, looks, {}, {}, [], [], 100.0, out)


def test_a_lost_vehicle_is_no_end() -> None:
    ends = _panels(scene(frozenset({"C"})), None)[-1]
    assert ends.title == "where the vehicles end"
    assert ends.frame.size_m == 20.0
    assert [panel.title for panel in _panels(scene(frozenset()), None)] == ["whole mission, 0 to 100 s"]


def test_large_fleets_name_those_that_went_farthest(tmp_path: Path) -> None:
    fleet = tuple(f"AUV{number:02}" for number in range(15))
    found = run_picture(Fiction(vehicles=fleet).write(tmp_path / "run"), "trajectories")
    legend = [text.get_text() for text in found.figure.legends[0].get_texts()]
    assert sum(text in fleet for text in legend) == MOST_NAMED - 1
    assert "4 others" in legend
    assert "the others are grey: AUV" in found.caption
    small = run_picture(Fiction(vehicles=fleet[:MOST_NAMED]).write(tmp_path / "small"), "trajectories")
    assert sum(text.get_text() in fleet for text in small.figure.legends[0].get_texts()) == MOST_NAMED
