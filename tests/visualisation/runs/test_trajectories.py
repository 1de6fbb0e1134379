"""Map of the tracks, and run data: tenures of roles, tracks, faults."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from matplotlib.figure import Figure
from synthetic_runs import FICTIONS, Fiction

import remoras
from missions.figure import Layer, Place
from missions.spans import Span
from visualisation import DrawingError, run_records
from visualisation.run_records import Tenure, Track, VehicleFault
from visualisation.runs import run_picture
from visualisation.runs.trajectories import MOST_NAMED


def test_kinds_of_places_have_symbols_and_legend_texts(tmp_path: Path) -> None:
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
    assert len(found.figure.axes[0].patches) == 2
    assert {"*", "P"} <= {line.get_marker() for line in found.figure.axes[0].get_lines()}


@pytest.mark.parametrize(("n", "text"), [(2, "Stars (dock): dock 1 and dock 2."), (5, "Stars (dock): 5 in all.")])
def test_a_caption_lists_few_places_of_a_kind_and_counts_many(tmp_path: Path, n: int, text: str) -> None:
    places = [Place(f"dock {number}", "dock", ((float(number), 5.0),)) for number in range(1, n + 1)]
    assert text in run_picture(Fiction().write(tmp_path / "run"), "trajectories", (), places).caption


def test_a_caption_gives_first_and_last_of_many_events() -> None:
    """Twelve contacts take more than four views."""
    run = remoras.run("minehunting-contacts", seed=1, set={"scenario.duration_s": 500})
    times_s = [milestone["time_s"] for milestone in run.milestones if milestone["name"] == "job_done"]
    assert len(times_s) > 4
    text = f"View done {len(times_s)} times, at {times_s[0]:.0f} s to {times_s[-1]:.0f} s."
    assert text in run.plot("trajectories").caption


def test_a_place_without_points_is_refused() -> None:
    with pytest.raises(ValueError, match="place 'dock' has no point"):
        Place("dock", "dock", ())


def test_final_positions_close_together_have_a_panel(tmp_path: Path) -> None:
    """In an area that is much wider than the tracks."""
    wide = Place("border", "area", ((-900.0, -900.0), (900.0, -900.0), (900.0, 900.0)))
    panels = run_picture(Fiction().write(tmp_path / "run"), "trajectories", (), [wide]).figure.axes
    assert [axes.get_title(loc="left") for axes in panels] == ["(a) whole mission", "(b) final positions"]
    for axes in panels:
        assert sum(line.get_marker() == "s" and len(line.get_xdata()) == 1 for line in axes.get_lines()) == 2


@pytest.mark.parametrize(("panel", "title"), [("a", "whole mission"), ("b", "final positions")])
def test_one_panel_is_drawn_alone_with_the_same_limits(tmp_path: Path, panel: str, title: str) -> None:
    """Its frame holds that of the same panel beside the other one."""
    wide = Place("border", "area", ((-900.0, -900.0), (900.0, -900.0), (900.0, 900.0)))
    run = Fiction().write(tmp_path / "run")
    (alone,) = run_picture(run, "trajectories", (), [wide], 3.5, panel=panel).figure.axes
    assert alone.get_title(loc="left") == title
    together = run_picture(run, "trajectories", (), [wide], 3.5).figure.axes["ab".index(panel)]
    assert together.get_title(loc="left") == f"({panel}) {title}"
    assert sum(alone.get_xlim()) == pytest.approx(sum(together.get_xlim()))
    with pytest.raises(DrawingError, match=r"panel 'c': .* have a \(whole mission\), b \(final positions\)$"):
        run_picture(run, "trajectories", (), [wide], 3.5, panel="c")


def test_axes_of_a_user_get_one_panel_of_equal_scale_and_keep_their_figure(tmp_path: Path) -> None:
    wide = Place("border", "area", ((-900.0, -900.0), (900.0, -900.0), (900.0, 900.0)))
    run, page = Fiction().write(tmp_path / "run"), Figure(figsize=(9.0, 3.0))
    left, right = page.subfigures(1, 2)
    other, own = left.subplots(), right.subplots()
    for panel in ("", "b"):
        drawn = run_picture(run, "trajectories", (), [wide], panel=panel, ax=own).shown()
        assert drawn is page
        assert tuple(drawn.get_size_inches()) == (9.0, 3.0)
        assert drawn.caption.startswith("Trajectories of the vehicles")
        alone = run_picture(run, "trajectories", (), [wide], panel=panel or "a").figure.axes[0]
        assert own.get_title(loc="left") == alone.get_title(loc="left")
        assert (*own.get_xlim(), *own.get_ylim()) == pytest.approx((*alone.get_xlim(), *alone.get_ylim()))
        own.apply_aspect()
        metres, pixels = own.viewLim.size, own.get_window_extent().size
        assert pixels[0] / metres[0] == pytest.approx(pixels[1] / metres[1])
    assert own.get_legend() is not None
    assert not other.has_data()
    with pytest.raises(DrawingError, match=r"roles: fills a page of its own; allowed with ax: trajectories$"):
        run_picture(run, "roles", ax=own)


def test_legend_of_a_large_fleet_names_the_farthest_vehicles(tmp_path: Path) -> None:
    fleet = tuple(f"AUV{number:02}" for number in range(MOST_NAMED + 3))
    found = run_picture(Fiction(vehicles=fleet).write(tmp_path / "run"), "trajectories")
    legend = [text.get_text() for text in found.figure.legends[0].get_texts()]
    assert sum(text in fleet for text in legend) == MOST_NAMED - 1
    assert "4 others" in legend
    assert "the others are grey: AUV" in found.caption
    small = run_picture(Fiction(vehicles=fleet[:MOST_NAMED]).write(tmp_path / "small"), "trajectories")
    assert sum(text.get_text() in fleet for text in small.figure.legends[0].get_texts()) == MOST_NAMED


# What is read out of results: tenures of roles, tracks


@pytest.mark.parametrize(
    ("events", "held", "active"),
    [
        ([(10.0, "assigned"), (20.0, "active"), (30.0, "left")], [Span(10.0, 30.0)], [Span(20.0, 30.0)]),
        (  # never left: it lasts to the end
            [(10.0, "assigned"), (20.0, "active"), (30.0, "inactive"), (40.0, "active")],
            [Span(10.0, 1000.0)], [Span(20.0, 30.0), Span(40.0, 1000.0)],
        ),  # without a beginning, or told twice: nothing changes
        ([(5.0, "inactive"), (10.0, "assigned"), (15.0, "assigned"), (50.0, "left")], [Span(10.0, 50.0)], []),
    ],
)  # fmt: skip
def test_held_and_active_spans_of_a_role_follow_from_events(
    tmp_path: Path, events: list[tuple[float, str]], held: list[Span], active: list[Span]
) -> None:
    rows = [(time_s, "A", "Team", "Diver", event) for time_s, event in events]
    run = Fiction(roles=(), extra_roles=rows).write(tmp_path / "run")  # type: ignore[arg-type]
    assert run_records.tenures(run) == {"A": [Tenure("Team", "Diver", tuple(held), tuple(active))], "B": []}


def test_no_role_is_active_while_the_vehicle_is_out(tmp_path: Path) -> None:
    """It holds the role all the time; lost from 30 s to 50 s and for good at 70 s."""
    rows = [(10.0, "A", "Team", "Diver", "assigned"), (20.0, "A", "Team", "Diver", "active")]
    run = Fiction(vehicles=("A", "B"), roles=(), extra_roles=rows).write(tmp_path / "run")
    faults = [(30.0, "lost", "until 50 s"), (50.0, "lost", "over"), (70.0, "energy", "for good")]
    table = pa.Table.from_pylist(
        [{"time_s": at_s, "vehicle": "A", "kind": kind, "detail": detail} for at_s, kind, detail in faults]
    )
    pq.write_table(table.replace_schema_metadata(run.table("roles").schema.metadata), run.folder / "faults.parquet")
    (found,) = run_records.tenures(run)["A"]
    assert found.held == (Span(10.0, 1000.0),)
    assert found.active == (Span(20.0, 30.0), Span(50.0, 70.0))


def test_roles_of_one_group_are_adjacent(tmp_path: Path) -> None:
    rows = [
        (float(at), "A", group, role, "assigned")
        for at, (group, role) in enumerate([("One", "p"), ("Two", "q"), ("One", "r")])
    ]
    run = Fiction(roles=(), extra_roles=rows).write(tmp_path / "run")
    assert [(own.group, own.role) for own in run_records.tenures(run)["A"]] == [
        ("One", "p"),
        ("One", "r"),
        ("Two", "q"),
    ]


def test_position_between_two_records_is_interpolated() -> None:
    times_s, x_m, rest = np.array([0.0, 10.0]), np.array([0.0, 20.0]), np.array([5.0, 5.0])
    assert Track(times_s, x_m, *[rest] * 5).at(2.5, 5.0) == [(5.0, 5.0, 5.0), (10.0, 5.0, 5.0)]


def test_faults_of_vehicles_have_begin_and_end(tmp_path: Path) -> None:
    """An empty battery is none that the scenario declares."""
    run = FICTIONS["faults"].write(tmp_path / "run")
    assert run_records.vehicle_faults(run) == [
        VehicleFault("B", "joins", "away until 200 s", Span(0.0, 200.0)),
        VehicleFault("A", "mute", "until 600 s", Span(300.0, 600.0)),
        VehicleFault("B", "lost", "for good", Span(500.0, 1000.0)),
    ]
    (run.folder / "faults.parquet").unlink()  # as an older version wrote it
    assert run_records.vehicle_faults(run) == []


def test_name_of_an_outline_is_clear_of_the_content_of_layers(tmp_path: Path) -> None:
    """A point with its name lies at the middle of the outline, where the outline's name would be."""

    def draw(axes: Any, results: Any, look: Any) -> str:
        axes.scatter([50.0], [50.0], s=40)
        axes.annotate("anomaly", (50.0, 50.0), (5, 4), textcoords="offset points", fontsize="x-small")
        return ""

    place = Place("bay", "search box", ((0.0, 0.0), (0.0, 100.0), (100.0, 100.0), (100.0, 0.0)))
    results = Fiction(radius_m=0.0).write(tmp_path / "run")
    axes = run_picture(results, "trajectories", (Layer("finds", draw, needs=()),), (place,)).figure.axes[0]
    axes.figure.canvas.draw()
    found = {text.get_text(): text.get_window_extent() for text in axes.texts}
    assert not found["bay"].overlaps(found["anomaly"])
    assert not found["bay"].contains(*axes.transData.transform((50.0, 50.0)))


def test_crossing_lines_are_all_named() -> None:
    """The middles of the sixteen deliveries lie at four places, so that most names stand at an end."""
    names = [text.get_text() for text in remoras.run("ferry-passage", seed=1).plot("trajectories").axes[0].texts]
    assert {f"load {number}" for number in range(1, 17)} <= set(names)
