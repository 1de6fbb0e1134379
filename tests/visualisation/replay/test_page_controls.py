"""Controls of the replay page: time, pace, selection, panels, links, files, two runs."""

import math
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from browsing import Window
from chromium import opened, seek, written
from replayed import LOSSY, recorded

from missions.runs.results import Results

pytestmark = pytest.mark.slow
EBML = bytes.fromhex("1a45dfa3")
"""The first bytes of every WebM file (RFC 8794)."""


def test_time_plays_at_the_chosen_pace_and_stops(window: Window) -> None:
    """At 600 times real time more passes than at 10 times, however slow the machine is."""
    passed_s = []
    for pace in ("10", "600"):
        window.page.select_option("select", pace)
        window.page.locator("select").blur()
        before_s = window.time_s
        window.page.keyboard.press(" ")
        window.page.wait_for_timeout(800)
        window.page.keyboard.press(" ")
        passed_s.append(window.time_s - before_s)
        stopped_s = window.time_s
        window.page.wait_for_timeout(200)
        assert window.time_s == stopped_s
    assert 0.0 < passed_s[0] < 0.5 * passed_s[1]


def test_a_step_is_a_slot_or_a_frame_of_the_record(window: Window, results: Results) -> None:
    """A slot opens when its packet was sent; four vehicles make a frame of four slots."""
    start_s = {row["slot"]: row["time_s"] for row in results.table("packets").to_pylist()}
    for key, slot in (("ArrowRight", 4), (".", 5), ("ArrowLeft", 4), (",", 3), ("ArrowRight", 4)):
        window.page.keyboard.press(key)
        assert window.time_s == start_s[slot]
        assert window.texts(".now")[0].endswith(f"slot {slot}")
    window.ask("() => R.app.setPace('slot')")
    window.page.keyboard.press("ArrowRight")
    window.page.keyboard.press("ArrowRight")
    window.page.wait_for_function("(t) => !R.app.clock.playing && R.app.clock.t > t", arg=start_s[5])
    assert window.time_s == start_s[6]
    slots = window.ask("(times) => times.map((t) => R.app.longest.slotAt(t))", list(start_s.values()))
    assert slots == list(start_s)


def test_scrub_bar_and_end_keys_set_the_time(window: Window, results: Results) -> None:
    window.page.locator(".scrub").fill("1200")
    assert window.time_s == pytest.approx(1200.0)
    window.page.keyboard.press("End")
    assert window.time_s == results.summary["mission_time_s"]
    window.page.keyboard.press("Home")
    assert window.time_s == 0.0


def test_a_click_selects_and_a_click_on_a_change_explains(window: Window) -> None:
    lane = window.ask("() => R.app.views[0].layout.lanes.find((one) => one.v === 3)")
    box = window.page.locator(".lanes canvas").first.bounding_box()
    window.page.mouse.click(box["x"] + 40, box["y"] + lane["y"] + lane["h"] / 2)
    assert window.ask("() => R.app.selected") == "AUV02"
    assert "Knowledge of AUV02" in window.texts(".body h2")[0]
    window.ask("() => R.app.clock.seek(1000)")
    place = "() => { const v = R.app.views[0], at = v.run.at(1, 1000); return [v.frame.x(at.x), v.frame.y(at.y)]; }"
    x, y = window.ask(place)
    chart = window.page.locator(".map canvas").bounding_box()
    window.page.mouse.click(chart["x"] + x, chart["y"] + y)
    assert window.ask("() => R.app.selected") == "AUV00"
    changes = "R.app.views[0].facts.decisions[1].find((one) => one.changed && one.time_s > 1900).time_s"
    change_s = window.ask(f"() => {changes}")
    place = "(t) => { const v = R.app.views[0]; return v.scale(v.laneNow.w).x(t); }"
    row = window.ask("() => R.app.views[0].layout.lanes.find((one) => one.v === 1)")
    window.page.mouse.click(box["x"] + window.ask(place, change_s), box["y"] + row["y"] + 20)
    assert window.time_s == pytest.approx(change_s)
    assert window.texts(".tabs [aria-selected=true]") == ["Why"]
    assert len(window.texts(".bar")) > 1
    window.page.locator(".chain button").last.click()
    assert window.time_s < change_s


def test_keys_open_panels(window: Window) -> None:
    window.page.keyboard.press("3")
    tabs = ("Knowledge", "Minds", "Matrix", "Cost", "Why", "Events", "Organisation", "Plans")
    for key, tab in zip("kmxcweop", tabs, strict=True):
        window.page.keyboard.press(key)
        assert window.texts(".tabs [aria-selected=true]") == [tab]
    window.page.keyboard.press("?")
    assert window.page.locator("dialog").is_visible()
    window.page.keyboard.press("Escape")
    assert not window.page.locator("dialog").is_visible()


def test_link_opens_its_time_and_follows_the_page(chrome: Any, results: Results, tmp_path: Path) -> None:
    with opened(chrome, written(tmp_path, results), "#t=1906&v=AUV00") as window:
        assert window.time_s == 1906.0
        assert window.ask("() => R.app.selected") == "AUV00"
        window.page.keyboard.press("4")
        window.ask("() => R.app.clock.seek(77)")
        window.page.wait_for_function("() => location.hash === '#t=77&v=AUV02'")
        window.ask("() => { location.hash = '#t=500&v=nobody'; }")
        window.page.wait_for_function("() => R.app.clock.t === 500")
        assert window.ask("() => R.app.selected") is None


def test_the_theme_follows_the_reader_and_the_button(chrome: Any, results: Results, tmp_path: Path) -> None:
    with opened(chrome, written(tmp_path, results), scheme="dark") as window:
        theme = "() => document.documentElement.dataset.theme"
        assert window.ask(theme) == "dark"
        window.page.get_by_label("Light or dark (D)").click()
        assert window.ask(theme) == "light"


def test_no_text_is_smaller_than_12_px_and_nothing_needs_scrolling(window: Window) -> None:
    sizes = "() => [...document.querySelectorAll('#app *')].map((one) => parseFloat(getComputedStyle(one).fontSize))"
    assert min(window.ask(sizes)) >= 12.0
    window_px = "() => [document.documentElement.scrollHeight, document.documentElement.scrollWidth]"
    assert window.ask(window_px) == [720, 1280]
    fonts = "() => [...R.FONT.matchAll(/(\\d+)px/g), ...R.BOLD.matchAll(/(\\d+)px/g)].map((m) => +m[1])"
    assert window.ask(fonts) == [12, 12]


def test_the_view_is_saved_as_drawing(window: Window, tmp_path: Path) -> None:
    window.ask("() => R.app.go(1906, 'AUV02')")
    with window.page.expect_download() as waiting:
        window.page.keyboard.press("s")
    out = tmp_path / "view.svg"
    waiting.value.save_as(out)
    root = ElementTree.parse(out).getroot()
    words = " ".join("".join(one.itertext()) for one in root.iter("{http://www.w3.org/2000/svg}text"))
    for word in ("mapping-rendezvous", "Knowledge of AUV02", "MissionAdministrator", "completed, 100 % of the goal"):
        assert word in words
    assert len(list(root.iter("{http://www.w3.org/2000/svg}path"))) > 100
    assert list(root.iter("{http://www.w3.org/2000/svg}image")) == []
    assert "seed 1" in (root.findtext("{http://www.w3.org/2000/svg}desc") or "")


def test_the_clip_is_saved_as_video(window: Window, tmp_path: Path) -> None:
    window.page.keyboard.press("v")
    window.page.wait_for_timeout(1000)
    with window.page.expect_download() as waiting:
        window.page.keyboard.press("v")
    out = tmp_path / "clip.webm"
    waiting.value.save_as(out)
    assert out.read_bytes()[:4] == EBML
    assert out.stat().st_size > 1_000


def test_equal_lanes_fold_and_unfold(chrome: Any, tmp_path: Path) -> None:
    """Of 16 vehicles 15 begin alike or nearly so: they share fewer lanes than they are, until one is opened."""
    many = recorded(tmp_path / "run", LOSSY, "fleet.size=16", "scenario.duration_s=200", scenario="mapping-patches")
    with opened(chrome, written(tmp_path, many)) as window:
        lanes = "() => R.app.views[0].layout.lanes"
        folded = window.ask(lanes)
        assert len(folded) < 8
        assert sorted(v for lane in folded for v in lane["members"]) == list(range(16))
        head = next(lane for lane in folded if lane.get("head"))
        box = window.page.locator(".lanes canvas").first.bounding_box()
        window.page.mouse.click(box["x"] + 40, box["y"] + head["y"] + 10)
        assert len(window.ask(lanes)) == len(folded) + len(head["members"])


def test_two_runs_share_clock_and_selection_and_mark_their_first_difference(
    chrome: Any, results: Results, tmp_path: Path
) -> None:
    """Without weight of signals the runs of one seed are the same until the first choice that a signal moved."""
    other = recorded(tmp_path / "other", LOSSY, "decision.weight_external=0")
    with opened(chrome, written(tmp_path, results, other)) as window:
        window.page.keyboard.press("2")
        window.page.keyboard.press("j")
        first_s = window.time_s
        assert 0.0 < first_s < results.summary["mission_time_s"]
        assert window.ask("() => R.app.views.map((view) => view.selected)") == [1, 1]
        window.page.keyboard.press("k")
        assert window.texts(".tabs [aria-selected=true]") == ["Knowledge", "Knowledge"]
        looks = "() => R.app.views.map(({ facts }) => [...facts.looks].map(([role, { sign }]) => [role, sign]).join())"
        one, other = window.ask(looks)
        assert one == other
        assert window.texts(".apart") == [f"Differs in decision.weight_external {weight}" for weight in ("2.0", "0.0")]


def test_the_tables_of_a_mission_are_charted_and_listed(window: Window, results: Results) -> None:
    """The newest row first of those by the time of the clock; a row's time is a link to it."""
    rows = results.table("goal").to_pylist()
    window.ask("() => R.app.clock.seek(1000)")
    window.page.keyboard.press("t")
    assert window.texts(".tabs [aria-selected=true]") == ["Tables"]
    so_far = [row for row in rows if row["time_s"] <= 1000.0]
    assert window.texts(".body .note") == [f"{len(so_far)} rows so far"]
    assert window.texts(".body th") == ["time", "goal fraction"]
    told = [float(text) for text in window.texts(".body td:nth-child(2)")]
    assert told == pytest.approx([row["goal_fraction"] for row in so_far[::-1][: len(told)]], abs=2e-4)
    assert window.page.locator(".chart canvas").is_visible()
    window.page.locator(".body td button").last.click()
    assert window.time_s == so_far[-len(told)]["time_s"]


# What the page draws and says at any time is what the tables of the run say

ODD = '<script><b>"🐟'


def test_silences_are_gaps_between_received_packets(window: Window, results: Results) -> None:
    """The longest of each vehicle, begin and end of the run included."""
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


DRAWN = """(view) => {
  const drawn = [], crossed = [], { drawGlyph, drawCross } = R;
  R.drawGlyph = (pen, x, y) => drawn.push([x, y]);
  R.drawCross = (pen, x, y, size, colour) => { if (colour === R.theme.ink) crossed.push([x, y]); };
  view.map.paint();
  Object.assign(R, { drawGlyph, drawCross });
  const { scale, centre, w, h } = view.frame;
  const metres = ([x, y]) => [centre[0] + (x - w / 2) / scale, centre[1] - (y - h / 2) / scale];
  return [drawn.map(metres), crossed.map(metres)];
}"""


def test_vehicles_are_drawn_at_recorded_positions_and_crossed_while_out(chrome: Any, tmp_path: Path) -> None:
    """Within 0.05 m, a bit more than the step of 1/32 m to which the page keeps places."""
    fault = "fault=[{kind='lost',vehicle='AUV02',at_s=40,until_s=70},{kind='joins',vehicle='AUV00',at_s=20}]"
    run = recorded(tmp_path / "run", "scenario.duration_s=100", fault)
    rows = run.table("trajectories").to_pylist()
    with opened(chrome, written(tmp_path, run)) as window:
        for at_s, out in ((10.0, [1]), (30.0, []), (50.0, [3]), (80.0, [])):
            so = {row["vehicle"]: (row["x_m"], row["y_m"]) for row in rows if row["time_s"] == at_s}
            [(drawn, crossed)] = seek(window, [at_s], DRAWN)
            places = [so[vehicle.name] for vehicle in run.scenario.vehicle]
            assert np.allclose(drawn, places, atol=0.05), at_s
            assert [n for n, at in enumerate(places) if any(math.dist(at, one) < 0.05 for one in crossed)] == out
            assert len(crossed) == len(out)


@pytest.mark.parametrize(
    "without", [("organisation", "decisions", "trajectories"), ("packets", "items", "decisions", "coverage", "roles")]
)
def test_run_with_missing_tables_is_shown_with_a_note(chrome: Any, tmp_path: Path, without: tuple[str, ...]) -> None:
    """One of a second, in which nothing is done, with a name that is no name of an element."""
    short = recorded(tmp_path / "run", LOSSY, "scenario.duration_s=1", f"vehicle.AUV01.name='{ODD}'")
    for name in without:
        (short.folder / f"{name}.parquet").unlink()
    with opened(chrome, written(tmp_path, Results.read(short.folder)), "#t=1&v=AUV02") as window:
        for tab in ("minds", "matrix", "cost", "why", "events", "news"):
            window.ask("(tab) => R.app.views[0].showTab(tab)", tab)
        window.ask("() => R.app.setPace('slot')")
        assert len(window.texts(".missing")) >= 1
        assert ODD in window.texts(".body td:first-child")
        assert window.ask("() => document.querySelectorAll('b b, main > b').length") == 0
        tag = "() => new DOMParser().parseFromString(R.app.svg(), 'image/svg+xml').documentElement.tagName"
        assert window.ask(tag) == "svg"


# The page on small screens, and what its colours and marks mean: in a real browser

SIZES = ((390, 844), (768, 1024), (1280, 720))
OUTSIDE = """() => [...document.querySelectorAll("button, select, input, textarea")]
  .filter((one) => one.getClientRects().length).map((one) => [one, one.getBoundingClientRect()])
  .filter(([, box]) => box.left < 0 || box.right > innerWidth || box.width < 1)
  .map(([one, box]) => `${one.textContent || one.className} ${box.left} to ${box.right}`)"""
CONTRASTS = """() => ["light", "dark"].flatMap((name) => {
  R.setTheme(name);
  const { theme } = R;
  const texts = ["ink", "muted", "belief", "warn", "loss"].map((key) => R.contrast(theme[key], theme.paper));
  const looks = R.VEHICLE_FILLS.map((_, v) => R.vehicleLook(v));
  return [...texts, ...looks.map(({ fill, text }) => R.contrast(fill, text))];
})"""


def test_no_control_is_outside_the_window(window: Window) -> None:
    """With each panel open, and after the window was made smaller and larger again."""
    for width, height in (*SIZES, *SIZES[::-1]):
        window.page.set_viewport_size({"width": width, "height": height})
        window.page.wait_for_function("(w) => R.app.views[0].narrow === (w < 1000)", arg=width)
        for tab in window.ask("() => [...document.querySelectorAll('[role=tab]')].map((one) => one.dataset.tab)"):
            window.ask("(tab) => { R.app.select('AUV02'); R.app.clock.seek(1500); R.app.views[0].showTab(tab); }", tab)
            assert window.ask(OUTSIDE) == [], (width, tab)
        assert window.ask("() => document.documentElement.scrollWidth") <= width
        shown = window.texts("[role=tab]")
        assert ("Map" in shown) == (width < 1000)
        assert window.page.locator(".map canvas").count() == (1 if width >= 1000 else 0)  # the last tab is open
    with_map = window.ask("() => { const v = R.app.views[0]; v.showTab('map'); return v.map.canvas.clientWidth; }")
    assert with_map > 300


def test_texts_are_readable_in_both_themes(window: Window) -> None:
    """WCAG 2.1, AA: 4.5."""
    contrasts = window.ask(CONTRASTS)
    assert len(contrasts) == 2 * (5 + 8)
    assert min(contrasts) >= 4.5


def test_task_after_its_expected_end_is_marked_overdue(window: Window) -> None:
    """Before the expected time the note gives it; afterwards it says that the task is overdue."""
    expected_s = window.ask(
        "() => Math.min(...R.plansShown(R.app.views[0].facts, -1, 200)"
        ".flatMap((plan) => plan.tasks.map((task) => task.expected_s ?? Infinity)))"
    )
    assert 200.0 < expected_s < 1900.0
    window.ask("() => { R.app.select(null); R.app.views[0].showTab('plans'); }")
    for time_s, is_late in ((200.0, False), (expected_s + 2.0, True)):
        window.ask("(t) => R.app.go(t, null)", time_s)
        notes = window.texts(".body .tree .note")
        assert any(note.startswith("expected to end at") for note in notes) or is_late
        assert any(note.startswith("overdue since") for note in notes) == is_late


ON_BARS = """(view) => {
  const own = CanvasRenderingContext2D.prototype, { fillText } = own, { drawFlag } = R;
  const texts = [], poles = [], axis = [];
  own.fillText = function (text, x, y) {
    if (this.textBaseline === "middle") texts.push([text, x, x + this.measureText(text).width, y]);
    if (this.textBaseline === "top" && y < 5) axis.push([text, x, x + this.measureText(text).width, y + 6]);
    fillText.call(this, text, x, y);
  };
  R.drawFlag = function (pen, x, top, foot, ...rest) {
    poles.push([x, top, foot]);
    return drawFlag(pen, x, top, foot, ...rest);
  };
  view.laneKey = null;
  view.paintLanes();
  own.fillText = fillText;
  R.drawFlag = drawFlag;
  const { left } = view.scale(view.lanesBox.clientWidth);
  const named = texts.filter(([, x]) => x > left);
  return [poles.length, named.length, [...named, ...axis].filter(([, from, to, y]) => poles.some(
    ([x, top, foot]) => x > from - 1 && x < to + 1 && top < y && y < foot)).map(([text]) => text)];
}"""
"""How many flags and names of roles the lanes have, and the names, and texts of the axis, through which a flag goes."""


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (390, 844)], ids=["tight", "small"])
def test_no_flag_covers_the_name_of_a_role_or_of_a_milestone(window: Window, width: int, height: int) -> None:
    window.page.set_viewport_size({"width": width, "height": height})
    window.page.wait_for_function("(w) => R.app.views[0].narrow === (w < 1000)", arg=width)
    for span_s in (4000, 900, 300):
        for around_s in (0, 1200):
            window.ask("([span, around]) => R.app.views[0].setSpan(span, around)", [span_s, around_s])
            _, n_names, covered = window.ask(f"() => ({ON_BARS})(R.app.views[0])")
            assert n_names > 0
            assert covered == [], (span_s, around_s)
    window.ask("() => R.app.views[0].setSpan(4000, 0)")
    assert window.ask(f"() => ({ON_BARS})(R.app.views[0])")[0] == 9
