"""The page of a live run in a browser: it follows and steers the run, and asks only the program that serves it."""

import base64
import random
import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.append(str(Path(__file__).parent.parent / "visualisation" / "replay"))

from browsing import Window
from crashing import Crash
from live_program import LONG, SHORT, Client, served, wait_until
from replayed import data_of

import remoras
from missions.fault import kinds
from missions.runs.results import Results

pytestmark = pytest.mark.slow


BOTH = """async ([text, times_s]) => {
  const told = (run) => times_s.map((t) => run.vehicles.map((_, v) => {
    const { x, y, heading } = run.at(v, t);
    const social = [run.organisation(v, t), run.plansOf(v, t).map((plan) => run.tasksOf(plan, t))];
    return [x, y, heading, run.mind(v, t), run.why(v, t), run.bars(v), social];
  })).concat([run.truth(times_s[0]), run.matrix(times_s[0]), run.header]);
  return [R.app.runs[0], await R.decode(text)].map((run) => JSON.stringify(told(run)));
}"""
"""All that is asked at these times of the run that the page shows, and of the data of a replay."""


def opened(chrome: Any, client: Client) -> Window:
    context = chrome.new_context(viewport={"width": 1280, "height": 720})
    window = Window(context.new_page())
    window.page.goto(client.server.url)
    window.page.wait_for_function("() => R.app && R.live.state")
    return window


def assert_sound(window: Window, client: Client) -> None:
    """The page complained of nothing, and asked only the program that serves it."""
    assert window.faults == []
    assert [url for url in window.requests if not url.startswith((client.server.url, "data:", "blob:"))] == []


def test_the_page_follows_the_run_and_steers_it(chrome: Any) -> None:
    with served(SHORT) as client:
        window = opened(chrome, client)
        page = window.page
        assert page.locator(".phase").inner_text() == "ready, 0\xa0s of at most 60\xa0s"
        page.get_by_role("button", name="Step run").click()
        page.get_by_role("button", name="Step run").click()
        wait_until(lambda: client.time_s == 2.0)
        page.wait_for_function("() => R.app.clock.t === 2")
        page.get_by_label("Speed of the run").select_option("full")
        page.get_by_role("button", name="Resume run").click()
        page.wait_for_function("() => R.live.state.phase === 'finished' && R.app.runs[0].header.run_id !== ''")
        page.wait_for_function("() => R.app.clock.t === 60 && !R.app.clock.playing")
        assert "no folder was named with --out" in page.locator(".live .message").inner_text()
        assert window.ask("() => R.app.runs[0].packets.length") > 20
        page.get_by_label("faults").fill('kind = "lost", vehicle = "AUV01", at_s = 20')
        page.get_by_label("loss").fill("0.2")
        page.get_by_role("button", name="Restart").click()
        page.wait_for_function("() => R.live.state.phase === 'ready' && R.app.runs[0].header.per === 0.2")
        page.get_by_role("button", name="▶ Start").click()
        page.wait_for_function("() => R.live.state.phase === 'finished' && R.app.runs[0].faults.length === 1")
        assert_sound(window, client)


def test_a_finished_page_holds_what_a_replay_of_the_results_holds(chrome: Any, tmp_path: Path) -> None:
    with served(SHORT, tmp_path / "live") as client:
        window = opened(chrome, client)
        client.control(do="step", n=20)
        window.page.wait_for_function("() => R.app.clock.t === 20")
        client.finished()
        window.page.wait_for_function("() => R.app.runs[0].header.run_id !== ''")
        replayed = base64.b64encode(data_of(Results.read(tmp_path / "live"))).decode()
        times_s = [random.Random(n).uniform(0.0, 60.0) for n in range(20)]
        live, replay = window.ask(BOTH, [replayed, times_s])
        assert live == replay
        assert_sound(window, client)


def test_settings_apply_from_a_moment_on_and_the_view_may_hold(chrome: Any) -> None:
    with served(LONG) as client:
        window = opened(chrome, client)
        page = window.page
        client.control(do="step", n=100)
        page.wait_for_function("() => R.app.clock.t === 100 && R.app.clock.following")
        before = window.ask("() => JSON.stringify(R.app.runs[0].packets.slice(0, 40))")
        assert page.get_by_label("Kind of a fault").locator("option").all_inner_texts() == list(kinds())
        page.get_by_label("Vehicle of a fault").select_option("AUV01")
        assert page.get_by_role("button", name="Apply here").is_disabled()
        page.get_by_role("button", name="+ fault").click()
        assert page.get_by_label("faults").input_value() == 'kind = "lost", vehicle = "AUV01", at_s = 100'
        page.get_by_role("button", name="Apply here").click()
        page.wait_for_function("() => R.live.state.form.faults !== '' && R.live.data.about.part === 0")
        assert window.time_s == 100
        assert window.ask("() => JSON.stringify(R.app.runs[0].packets.slice(0, 40))") == before
        assert page.locator(".controls .play").inner_text() == "❚❚ Hold"
        page.locator(".controls .play").click()
        client.control(do="step", n=100)
        page.wait_for_function("() => R.app.runs[0].header.end_s === 200 && R.app.runs[0].faults.length === 1")
        assert window.time_s == 100
        page.locator(".controls .follow").click()
        page.wait_for_function("() => R.app.clock.t === 200 && R.app.clock.following")
        assert_sound(window, client)


def test_what_is_refused_is_said_and_the_run_stays(chrome: Any) -> None:
    with served(LONG) as client:
        window = opened(chrome, client)
        window.page.get_by_label("loss").fill("1.5")
        window.page.get_by_role("button", name="Restart").click()
        window.page.wait_for_function("() => document.querySelector('.live .message.bad')")
        assert "loss 1.5: allowed is a number, 0 to below 1" in window.page.locator(".live .message").inner_text()
        assert client.phase == "ready"


def test_a_crash_is_said_and_the_page_keeps_what_it_had(chrome: Any, crash: Crash) -> None:
    crash.at(30.0)
    with served(SHORT) as client:
        window = opened(chrome, client)
        window.page.get_by_label("Speed of the run").select_option("full")
        window.page.get_by_role("button", name="▶ Start").click()
        window.page.wait_for_function("() => R.live.state.phase === 'crashed' && R.app.clock.end_s === 30")
        window.page.wait_for_function("() => document.querySelector('.verdict').textContent.includes('crashed')")
        assert "crashed at 30.0 s" in window.page.locator(".verdict").inner_text()
        assert window.texts(".live .message") == [client.session.state()["message"]]
        assert window.ask("() => R.app.runs[0].packets.length") > 10
        assert_sound(window, client)


def test_an_answer_that_comes_after_later_news_changes_nothing(chrome: Any, crash: Crash) -> None:
    crash.at(30.0)
    with served(SHORT) as client:
        window = opened(chrome, client)
        window.page.get_by_label("Speed of the run").select_option("full")
        window.page.wait_for_function("() => R.live.state.speed === null")
        older = {**window.ask("() => R.live.state"), "phase": "running"}
        held: list[Any] = []
        window.page.route("**/control", lambda route: (route.fetch(), held.append(route)))
        window.page.get_by_role("button", name="▶ Start").click()
        window.page.wait_for_function("() => R.live.state.phase === 'crashed'")
        with window.page.expect_response("**/control"):
            held[0].fulfill(json=older)
        window.page.wait_for_timeout(100)
        assert window.ask("() => R.live.state.phase") == "crashed"
        assert window.texts(".live .message") == [client.session.state()["message"]]
        assert_sound(window, client)


def test_a_notebook_shows_the_page_in_a_frame(chrome: Any, tmp_path: Path) -> None:
    shown = remoras.run("mapping-rendezvous", per=0.6, set={"scenario.duration_s": 40.0}).replay()
    notebook = tmp_path / "notebook.html"
    notebook.write_text(f"<!DOCTYPE html><title>n</title>{shown._repr_html_()}", encoding="utf-8")
    window = Window(chrome.new_context().new_page())
    window.page.goto(notebook.as_uri())
    frame = window.page.wait_for_selector("iframe").content_frame()
    frame.wait_for_function("() => globalThis.R && R.app")
    frame.evaluate("() => R.app.clock.seek(20)")
    window.page.wait_for_timeout(600)  # longer than the page waits before it writes its address
    assert frame.evaluate("() => R.app.clock.t") == 20
    assert window.faults == []
