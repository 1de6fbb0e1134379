"""The page on small screens, and what its colours and marks mean: in a real browser."""

import itertools
from pathlib import Path
from typing import Any

import pytest
from browsing import Window
from chromium import opened, seek, written
from replayed import recorded

from missions.runs.results import Results
from visualisation import style
from visualisation.colours import VEHICLES

pytestmark = pytest.mark.slow

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
PICTURES = """() => {
  const canvas = document.createElement("canvas"), pen = canvas.getContext("2d", { willReadFrequently: true });
  const drawn = (draw) => {
    pen.clearRect(0, 0, 40, 20);
    draw();
    return [...pen.getImageData(0, 0, 40, 20).data].join();
  };
  const own = R.vehicleLook(0);
  return [(mark) => R.fillRole(pen, mark, own, 0, 0, 40, 17), (mark) => {
    R.drawGlyph(pen, 20, 10, 0, 0, 8.5, own.fill, R.theme.ink);
    R.drawMarksAt(pen, mark, [[20, 10]], own.text);
  }].map((draw) => R.MARKS.map((mark) => drawn(() => draw(mark))));
}"""
DISCS = """(view) => {
  const own = CanvasRenderingContext2D.prototype, { arc } = own, radii = [];
  own.arc = function (x, y, radius, ...rest) { radii.push(radius); arc.call(this, x, y, radius, ...rest); };
  view.paintMap();
  own.arc = arc;
  return radii.filter((radius) => radius > 24).length;
}"""
"""Arcs of a map that are wider than any symbol."""

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


@pytest.fixture(scope="module")
def crowd(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return recorded(
        tmp_path_factory.mktemp("crowd") / "run", "fleet.size=10", "channel.per=0.6", "scenario.duration_s=500"
    )


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


def test_two_runs_and_a_crowd_fit_a_phone(chrome: Any, results: Results, crowd: Results, tmp_path: Path) -> None:
    for runs in ((results, results), (crowd,)):
        with opened(chrome, written(tmp_path, *runs)) as window:
            window.page.set_viewport_size({"width": 390, "height": 844})
            window.page.wait_for_function("() => R.app.views.every((view) => view.narrow)")
            assert window.ask(OUTSIDE) == []


def test_texts_are_readable_in_both_themes(window: Window) -> None:
    """WCAG 2.1, AA: 4.5."""
    contrasts = window.ask(CONTRASTS)
    assert len(contrasts) == 2 * (5 + 8)
    assert min(contrasts) >= 4.5


def test_a_vehicle_has_the_colour_of_the_figures(window: Window, results: Results) -> None:
    """tests/visualisation/test_colours.py holds these eight apart, also for three kinds of colour blindness."""
    fills = window.ask("() => R.app.views[0].run.vehicles.map((_, v) => R.vehicleLook(v).fill)")
    assert fills == [style.vehicle_look(number).colour for number in range(len(results.scenario.vehicle))]
    assert window.ask("() => R.VEHICLE_FILLS") == list(VEHICLES)
    assert len(set(VEHICLES)) == 8


def test_eight_roles_look_different_on_bars_and_on_icons(window: Window) -> None:
    """Without their labels, on a vehicle of one colour: at least a twentieth of an icon's bytes differ."""
    for pictures in window.ask(PICTURES):
        assert len(pictures) == 8
        for one, other in itertools.combinations([picture.split(",") for picture in pictures], 2):
            assert sum(a != b for a, b in zip(one, other, strict=True)) >= 12
    signs = window.ask("() => [...R.app.views[0].facts.looks.values()].map((mark) => mark.sign)")
    assert len(set(signs)) == len(signs) == 8


def test_what_should_have_ended_is_overdue(window: Window) -> None:
    """Before the time that was expected a note says so; after it, that the task is overdue."""
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


def test_of_a_crowd_one_disc_is_drawn_that_is_pointed_at(
    chrome: Any, crowd: Results, results: Results, tmp_path: Path
) -> None:
    with opened(chrome, written(tmp_path, crowd)) as window:
        window.ask("() => { R.app.select('AUV02'); R.app.clock.seek(400); }")
        assert seek(window, [400.0], DISCS) == [0]
        window.ask("() => { R.app.views[0].facts.pointed = 1; }")
        assert seek(window, [400.0], DISCS) == [1]
    with opened(chrome, written(tmp_path, results)) as window:
        window.ask("() => { R.app.select('AUV02'); }")
        assert seek(window, [1540.0], DISCS)[0] >= 1


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (1280, 1100), (390, 844)], ids=["tight", "roomy", "small"])
def test_no_flag_covers_the_name_of_a_role_or_of_a_milestone(window: Window, width: int, height: int) -> None:
    window.page.set_viewport_size({"width": width, "height": height})
    window.page.wait_for_function("(w) => R.app.views[0].narrow === (w < 1000)", arg=width)
    for span_s in (4000, 900, 300):
        for around_s in (0, 600, 1200, 1800):
            window.ask("([span, around]) => R.app.views[0].setSpan(span, around)", [span_s, around_s])
            _, n_names, covered = window.ask(f"() => ({ON_BARS})(R.app.views[0])")
            assert n_names > 0
            assert covered == [], (span_s, around_s)
    window.ask("() => R.app.views[0].setSpan(4000, 0)")
    assert window.ask(f"() => ({ON_BARS})(R.app.views[0])")[0] == 9
