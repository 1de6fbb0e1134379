"""What the page draws and says at any time is what the tables of the run say."""

import math
import random
import re
import shutil
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from browsing import Window
from chromium import opened, seek, written
from replayed import LOSSY, recorded

from missions.runs.results import Results

pytestmark = pytest.mark.slow
MOMENTS = 20


def moments_s(results: Results) -> list[float]:
    """Random ticks of the motion, where tracks have a row."""
    return [
        float(round(random.Random(n).uniform(1.0, results.summary["mission_time_s"] - 1.0))) for n in range(MOMENTS)
    ]


GLYPHS = """(view) => {
  const drawn = [], draw = R.drawGlyph;
  R.drawGlyph = (pen, x, y, ...rest) => { drawn.push([x, y]); draw(pen, x, y, ...rest); };
  view.map.paint();
  R.drawGlyph = draw;
  const { scale, centre, w, h } = view.frame;
  return { drawn, scale, centre, w, h };
}"""


def test_vehicles_are_drawn_where_the_tables_have_them(window: Window, results: Results) -> None:
    """Within 0.05 m, a bit more than the step of 1/32 m to which the page keeps places."""
    tracks = {(row["time_s"], row["vehicle"]): row for row in results.table("trajectories").to_pylist()}
    times_s = moments_s(results)
    for at_s, told in zip(times_s, seek(window, times_s, GLYPHS), strict=True):
        for vehicle, (x, y) in zip(results.scenario.vehicle, told["drawn"], strict=True):
            x_m = told["centre"][0] + (x - told["w"] / 2) / told["scale"]
            y_m = told["centre"][1] - (y - told["h"] / 2) / told["scale"]
            row = tracks[at_s, vehicle.name]
            assert math.hypot(x_m - row["x_m"], y_m - row["y_m"]) < 0.05, (at_s, vehicle.name)


ROWS = (
    "() => [...document.querySelectorAll('.body table tr')].slice(1).map((tr) => [...tr.cells].map((c) => c.innerText))"
)


def test_what_a_vehicle_knows_is_said_as_its_rebuilt_world_model_has_it(window: Window, results: Results) -> None:
    tracks = {(row["time_s"], row["vehicle"]): row for row in results.table("trajectories").to_pylist()}
    names = [vehicle.name for vehicle in results.scenario.vehicle]
    times_s = moments_s(results)
    for number, at_s in enumerate(times_s):
        name = names[number % len(names)]
        window.ask("(name) => R.app.select(name)", name)
        known = results.known(name, at_s)
        [told] = seek(window, [at_s], ROWS)
        assert [row[0] for row in told] == [peer for peer in names if peer != name]
        for peer, _, place, _, roles, _ in told:
            position = known.value(peer, "position")
            if position is None:
                assert place == "unknown"
            else:
                row = tracks[at_s, peer]
                off_m = math.hypot(position[0] - row["x_m"], position[1] - row["y_m"])
                assert float(re.match(r"(\d+) m", place)[1]) == pytest.approx(off_m, abs=0.6)  # type: ignore[index]
            believed = {one.role for one in known.organisation.assignments if one.vehicle == peer}
            assert set(roles.split(", ")) == (believed or {"none"}), (at_s, name, peer)


def test_silences_are_the_gaps_between_packets_heard(window: Window, results: Results) -> None:
    """The longest of each vehicle: nothing heard from its first to its last second, though packets were sent."""
    packets = results.table("packets").to_pylist()
    told = window.ask("() => R.app.views[0].facts.silences")
    for vehicle, spells in zip(results.scenario.vehicle, told, strict=True):
        heard = [row for row in packets if vehicle.name in row["receivers"]]
        heard_s = [row["time_s"] for row in heard]
        bounds_s = [0.0, *heard_s, results.summary["mission_time_s"]]
        longest_s = max(b - a for a, b in pairwise(bounds_s))
        assert max(spell["to_s"] - spell["from_s"] for spell in spells) == pytest.approx(longest_s, abs=0.01)
        gaps = [(a["time_s"], b["time_s"]) for a, b in pairwise(heard) if b["slot"] - a["slot"] >= 12]  # three frames
        assert [
            (one["from_s"], one["to_s"]) for one in spells if one["from_s"] > 0.0 and one["to_s"] in heard_s
        ] == gaps
        for spell in spells:
            lost = [row for row in packets if spell["from_s"] < row["time_s"] < spell["to_s"]]
            assert spell["lost"] >= len([row for row in lost if vehicle.name in row["lost_by"]]) > 0


@pytest.mark.parametrize("without", [("items",), ("decisions",), ("packets", "items"), ("organisation", "decisions")])
def test_a_run_that_recorded_less_is_shown_and_says_so(
    chrome: Any, results: Results, tmp_path: Path, without: tuple[str, ...]
) -> None:
    shutil.copytree(results.folder, tmp_path / "run")
    for name in without:
        (tmp_path / "run" / f"{name}.parquet").unlink()
    with opened(chrome, written(tmp_path, Results.read(tmp_path / "run")), "#t=900&v=AUV02") as window:
        for tab in ("news", "minds", "matrix", "cost", "why", "events"):
            window.ask("(tab) => R.app.views[0].showTab(tab)", tab)
        window.ask("() => R.app.setPace('slot')")
        assert len(window.texts(".missing")) >= 1


def test_a_run_without_packets_or_work_and_with_odd_names_is_shown(chrome: Any, tmp_path: Path) -> None:
    short = recorded(tmp_path / "run", LOSSY, "scenario.duration_s=1", "vehicle.AUV01.name='<script><b>\"🐟'")
    with opened(chrome, written(tmp_path, short), "#t=1") as window:
        for tab in ("news", "minds", "matrix", "cost", "why", "events"):
            window.ask("(tab) => R.app.views[0].showTab(tab)", tab)
        window.ask("() => R.app.views[0].showTab('news')")
        assert '<script><b>"🐟' in window.texts(".body td:first-child")
        assert window.ask("() => document.querySelectorAll('b b, main > b').length") == 0
        tag = "() => new DOMParser().parseFromString(R.app.svg(), 'image/svg+xml').documentElement.tagName"
        assert window.ask(tag) == "svg"


CROSSED = """(view) => {
  const crossed = [], draw = R.drawCross;
  R.drawCross = (pen, x, y, size, colour) => { if (colour === R.theme.ink) crossed.push([x, y]); };
  view.map.paint();
  R.drawCross = draw;
  const at = (v) => { const { x, y } = view.run.at(v, R.app.clock.t); return [view.frame.x(x), view.frame.y(y)]; };
  return crossed.map((place) => view.run.vehicles.findIndex((_, v) => at(v).join() === place.join()));
}"""


def test_a_vehicle_is_crossed_out_while_it_is_out_of_the_mission(chrome: Any, tmp_path: Path) -> None:
    """Also if it comes back, or joins later."""
    fault = "fault=[{kind='lost',vehicle='AUV02',at_s=40,until_s=70},{kind='joins',vehicle='AUV00',at_s=20}]"
    run = recorded(tmp_path / "run", "scenario.duration_s=100", fault)
    with opened(chrome, written(tmp_path, run)) as window:
        assert seek(window, [10.0, 30.0, 50.0, 80.0], CROSSED) == [[1], [], [3], []]
