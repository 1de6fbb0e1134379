"""The controls of the page act: time, pace, selection, panels, links, files, two runs."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from browsing import Window
from chromium import opened, written
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


def test_the_scrub_and_the_ends(window: Window, results: Results) -> None:
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
    assert "What AUV02 knows" in window.texts(".body h2")[0]
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


@pytest.mark.parametrize(
    ("key", "tab"), [("k", "Knowledge"), ("m", "Minds"), ("x", "Matrix"), ("c", "Cost"), ("w", "Why"), ("e", "Events")]
)
def test_keys_open_panels(window: Window, key: str, tab: str) -> None:
    window.page.keyboard.press("3")
    window.page.keyboard.press(key)
    assert window.texts(".tabs [aria-selected=true]") == [tab]
    window.page.keyboard.press("?")
    assert window.page.locator("dialog").is_visible()
    window.page.keyboard.press("Escape")
    assert not window.page.locator("dialog").is_visible()


def test_a_link_opens_its_moment_and_follows(chrome: Any, results: Results, tmp_path: Path) -> None:
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
    for word in ("mapping-rendezvous", "What AUV02 knows", "MissionAdministrator", "completed, 100 % of the goal"):
        assert word in words
    assert len(list(root.iter("{http://www.w3.org/2000/svg}path"))) > 100
    assert list(root.iter("{http://www.w3.org/2000/svg}image")) == []
    assert "seed 1" in (root.findtext("{http://www.w3.org/2000/svg}desc") or "")


def test_the_clip_is_saved_as_video(window: Window, tmp_path: Path) -> None:
    window.page.keyboard.press("v")
    window.page.wait_for_timeout(3000)
    with window.page.expect_download() as waiting:
        window.page.keyboard.press("v")
    out = tmp_path / "clip.webm"
    waiting.value.save_as(out)
    assert out.read_bytes()[:4] == EBML
    assert out.stat().st_size > 1_000


def test_alike_lanes_fold_and_open(chrome: Any, tmp_path: Path) -> None:
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


def test_two_runs_share_clock_and_selection_and_part_at_the_first_difference(
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
        tracks = [
            {(row["time_s"], row["vehicle"]): (row["x_m"], row["y_m"]) for row in one.table("trajectories").to_pylist()}
            for one in (results, other)
        ]
        shared = tracks[0].keys() & tracks[1].keys()
        assert all(tracks[0][key] == tracks[1][key] for key in shared if key[0] <= first_s)
        assert any(tracks[0][key] != tracks[1][key] for key in shared if key[0] > first_s)
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
