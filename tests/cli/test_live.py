"""The command ``live``: its server, its refusals, and results equal to those of ``run``."""

import http.client
import json
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from browsing import Window
from invoked import COMMAND, refused

import remoras

SCENARIO, SEED, PATIENCE_S = "mapping-rendezvous", 3, 60.0
SHORT = ("--seed", str(SEED), "--per", "0.6", "--set", "scenario.duration_s=60")
STEP, START, FULL = {"do": "step"}, {"do": "start"}, {"do": "speed", "speed": "full"}
CRASHING = """
from remoras.strategies.remoras import Remoras

class Crashing(Remoras):
    def adapt(self, work):
        raise RuntimeError("the hull broke")

CRASHING = Crashing()
"""


class Client:
    """HTTP client of a live run at ``host``."""

    def __init__(self, host: str) -> None:
        self.host = host

    def ask(self, method: str, path: str, body: bytes | None = None, **headers: str) -> tuple[int, str]:
        """Status and text of an answer."""
        connection = http.client.HTTPConnection(self.host, timeout=PATIENCE_S)
        given = {name.replace("_", "-"): value for name, value in headers.items()}
        connection.request(method, path, body, {"Content-Type": "application/json", **given})
        answer = connection.getresponse()
        text = answer.read().decode()
        connection.close()
        return answer.status, text

    def control(self, what: object) -> tuple[int, str]:
        return self.ask("POST", "/control", json.dumps(what).encode())

    def news(self, seen: int = 0) -> dict[str, Any]:
        status, text = self.ask("GET", f"/news?{seen}")
        assert status == 200, text
        found: dict[str, Any] = json.loads(text)
        return found

    def when(self, is_so: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """The first news of which something is so."""
        until_s = time.monotonic() + PATIENCE_S
        while not is_so(news := self.news()):
            assert time.monotonic() < until_s, "it takes too long"
            time.sleep(0.02)
        return news


@contextmanager
def served(*arguments: object, cwd: Path | None = None) -> Iterator[Client]:
    """A live run on a free port, interrupted afterwards, which is its usual end."""
    command = [*COMMAND, "live", SCENARIO, "--no-browser", *map(str, arguments)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=cwd)
    try:
        assert process.stdout is not None
        yield Client(process.stdout.readline().removeprefix("http://").rstrip("/\n"))
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE_S) == 0
    finally:
        process.kill()
        process.communicate()


def test_results_of_live_equal_those_of_run(tmp_path: Path) -> None:
    live, whole = tmp_path / "live", tmp_path / "run"
    with served(*SHORT, "--out", live) as client:
        assert client.when(lambda news: news["number"] > 0)["phase"] == "ready"
        for n in range(1, 4):
            assert client.control(STEP)[0] == 200
            assert (client.news()["phase"], client.news()["time_s"]) == ("paused", n)
        client.control({"do": "speed", "speed": 20})
        began_s = time.monotonic()
        client.control(START)
        client.when(lambda news: news["time_s"] >= 13.0)
        assert time.monotonic() - began_s > 0.4
        client.control({"do": "pause"})
        still = client.news()
        assert client.news(still["number"]) == {**still, "data": None}
        client.control(FULL)
        client.control(START)
        last = client.when(lambda news: news["phase"] == "finished")
        client.control(START)
        assert client.news() == last
        assert last["message"].endswith(f"results in {live}")
    remoras.run(SCENARIO, per=0.6, seed=SEED, set="scenario.duration_s=60").save(whole)
    for path in whole.iterdir():
        one, other = path.read_bytes(), (live / path.name).read_bytes()
        if path.name == "manifest.json":  # has the time that it took
            assert {**json.loads(one), "wall_s": 0} == {**json.loads(other), "wall_s": 0}
        else:
            assert one == other, path.name
    assert last["data"] in remoras.open(live).replay().text


def test_requests_from_other_pages_are_refused_and_change_nothing(tmp_path: Path) -> None:
    with served(*SHORT, "--out", tmp_path / "live") as client:
        before = client.when(lambda news: news["number"] > 0)
        for control in (
            {"do": "fly"}, {"do": ["start"]}, {"do": "start", "strategy": "mine.py:Mine"}, {"do": "step", "n": 5},
            {"do": "restart", "form": {"strategy": "mine.py:Mine"}}, {"set": "strategy.name=mine.py:Mine"},
            {"do": "speed"}, *({"do": "speed", "speed": speed} for speed in (0, -1, 1e9, True, "fast", None, [1])),
            [], 3, "start", None, {"do": "\ud800"},
        ):  # fmt: skip
            status, text = client.control(control)
            assert (status, text.count("\n")) == (400, 1), control
            assert text.startswith('allowed are {"do": "start"}')
        port, own = client.host.partition(":")[2], f"http://{client.host}"
        start = json.dumps(START).encode()
        for status, says, method, path, body, headers in (
            (400, "allowed are", "POST", "/control", b"[" * 150, {}),
            (400, "allowed are", "POST", "/control", b"\xff\x00", {}),
            (400, "allowed are", "POST", "/control", b'{"do": "speed", "speed": NaN}', {}),
            (413, "allowed are 0 to 200 bytes", "POST", "/control", b" " * 201, {}),
            (413, "allowed are 0 to 200 bytes", "POST", "/control", b"", {"Content_Length": "-1"}),
            (415, "allowed is application/json", "POST", "/control", start, {"Content_Type": "text/plain"}),
            (403, 'host "evil.example" is not served', "POST", "/control", start, {"Host": "evil.example"}),
            (403, "is not served", "GET", "/", None, {"Host": f"evil.example:{port}"}),
            (403, "is not served", "GET", "/", None, {"Host": f"127.0.0.1:{int(port) + 1}"}),
            (403, "are refused", "POST", "/control", start, {"Origin": "http://evil.example"}),
            (403, "are refused", "POST", "/control", start, {"Origin": "null"}),
            (403, "are refused", "POST", "/control", start, {"Origin": f"https://{client.host}"}),
            (404, "files are not served", "GET", "/../../etc/passwd", None, {}),
            (404, "files are not served", "GET", "/summary.json", None, {}),
            (404, "files are not served", "GET", "/news?x", None, {}),
            (404, "files are not served", "POST", "/news?0", start, {}),
            (405, "Unsupported method", "PUT", "/control", start, {}),
            (414, "Request-URI Too Long", "GET", "/" + "x" * 70_000, None, {}),
        ):
            answer, text = client.ask(method, path, body, **headers)
            assert (answer, text.count("\n")) == (status, 1), (method, path, headers)
            assert says in text
        assert client.news() == before
        assert client.ask("POST", "/control", start, Origin=own)[0] == 200
    assert not (tmp_path / "live").exists()


def test_a_crash_is_reported_and_existing_results_are_kept(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(CRASHING)
    with served(*SHORT, "--strategy", "mine:CRASHING", "--out", "live", cwd=tmp_path) as client:
        client.control(FULL)
        client.control(START)
        last = client.when(lambda news: news["phase"] == "crashed")
        assert "the hull broke" in last["message"]
        assert last["message"].endswith("; this page keeps the run up to then")
        assert last["data"]
    assert not (tmp_path / "live").exists()


def test_settings_that_cannot_be_served_are_one_error(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        assert refused("live", SCENARIO, "--no-browser", "--port", port) == (
            f"remoras: --port {port}: cannot be listened on: Address already in use; "
            "name another, or 0 for any that is free\n"
        )
    (tmp_path / "mine.txt").write_text("mine")
    assert "exists and is not empty" in refused("live", SCENARIO, "--no-browser", "--out", tmp_path)


@pytest.mark.slow
def test_the_live_page_shows_and_controls_the_run(chrome: Any) -> None:
    with served(*SHORT) as client:
        window = Window(chrome.new_context(viewport={"width": 1280, "height": 720}).new_page())
        page = window.page
        page.goto(f"http://{client.host}/")
        page.wait_for_function("() => R.app && R.live.state")
        assert page.locator(".phase").inner_text() == "ready, 0\xa0s of at most 60\xa0s"
        for time_s in (1, 2):
            page.get_by_role("button", name="Step run").click()
            page.wait_for_function(f"() => R.app.clock.t === {time_s} && R.app.clock.following")
        page.locator(".controls .play").click()
        page.get_by_role("button", name="Step run").click()
        page.wait_for_function("() => R.app.clock.end_s === 3")
        assert window.time_s == 2  # the view holds while the run goes on
        page.locator(".controls .follow").click()
        page.get_by_label("Speed of the run").select_option("full")
        page.get_by_role("button", name="Resume run").click()
        page.wait_for_function("() => R.live.state.phase === 'finished' && R.app.runs[0].header.run_id !== ''")
        page.wait_for_function("() => R.app.clock.t === 60 && !R.app.clock.playing")
        assert "without --out" in page.locator(".live .message").inner_text()
        assert window.ask("() => R.app.runs[0].packets.length") > 20
        assert window.faults == []
        assert {url.split("/")[2] for url in window.requests if url.startswith("http")} == {client.host}
