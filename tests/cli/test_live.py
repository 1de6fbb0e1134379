"""The command that shows a run while it goes: what it serves, what it refuses, and that it gives what ``run`` gives."""

import http.client
import json
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from crashing import Crash
from invoked import remoras
from live_program import LONG, PATIENCE_S, SCENARIO, SEED, SHORT, served, wait_until

from missions.runs.results import Results, write_results
from missions.runs.run import run
from missions.scenarios import load


def assert_same_results(one: Path, other: Path) -> None:
    """Every file is the same bytes; the time that it took (``wall_s`` in the manifest) is left out."""
    assert sorted(path.name for path in one.iterdir()) == sorted(path.name for path in other.iterdir())
    for path in one.iterdir():
        if path.name == "manifest.json":
            told = [json.loads((folder / path.name).read_text()) for folder in (one, other)]
            assert {**told[0], "wall_s": 0} == {**told[1], "wall_s": 0}
        else:
            assert path.read_bytes() == (other / path.name).read_bytes(), path.name


def test_results_are_those_of_run_however_it_was_stepped(tmp_path: Path) -> None:
    write_results(run(load(SCENARIO, SHORT), SEED), tmp_path / "run")
    with served(SHORT, tmp_path / "live") as client:
        assert client.phase == "ready"
        client.control(do="step", n=7)
        wait_until(lambda: client.time_s == 7.0)
        client.control(do="speed", speed=200)
        client.control(do="play")
        wait_until(lambda: client.time_s > 10.0)
        client.control(do="pause")
        client.finished()
        assert client.session.state()["message"].endswith(f"results in {tmp_path / 'live'}")
    assert_same_results(tmp_path / "live", tmp_path / "run")


def test_a_page_gets_all_at_first_and_then_what_is_new(tmp_path: Path) -> None:
    with served(SHORT, tmp_path / "live") as client:
        client.control(do="step", n=5)
        wait_until(lambda: client.time_s == 5.0)
        (first,) = client.blocks(lambda block: True)
        assert (first["part"], first["header"]["end_s"], first["track_rows"]) == (0, 5.0, [6, 6, 6, 6])
        assert first["header"]["verdict"] == "under way, 0 % of the goal"
        client.control(do="speed", speed=60)
        client.control(do="play")
        found = client.blocks(lambda block: bool(block["header"]["run_id"]))
        assert [block["part"] for block in found] == list(range(len(found)))
        rows = [sum(counts) for counts in zip(*(block["track_rows"] for block in found), strict=True)]
        assert rows == [61, 61, 61, 61]  # one at each second of the minute, both ends included
        assert len(found) >= 3
        (again,) = client.blocks(lambda block: True)
        assert (again["part"], again["header"]) == (0, found[-1]["header"])
        wait_until(lambda: len(client.session.audience) == 0)  # who has gone is forgotten
    assert again["header"]["run_id"] == Results.read(tmp_path / "live").summary["run_id"]


def test_a_restart_takes_the_form_and_keeps_the_seed(tmp_path: Path) -> None:
    faults = 'kind = "lost", vehicle = "AUV01", at_s = 20'
    with served(SHORT, tmp_path / "live") as client:
        client.finished()
        form = {"strategy": "central", "policy": "ack-repeat", "per": 0.3, "faults": faults}
        told = client.control(do="restart", form=form)
        assert (told["phase"], told["time_s"]) == ("ready", 0.0)
        assert told["form"] == {**form, "faults": 'kind = "lost", vehicle = "AUV01", at_s = 20.0'}
        client.finished()
    own = [SHORT[0], ("--strategy", "strategy.name=central"), ("--policy", "communication.policy=ack-repeat")]
    own += [("--per", "channel.per=0.3"), ("--set", f"fault=[{{ {faults} }}]")]
    write_results(run(load(SCENARIO, own), SEED), tmp_path / "run")
    assert_same_results(tmp_path / "live", tmp_path / "run")


def test_a_pause_stands_still() -> None:
    with served(LONG) as client:
        client.control(do="speed", speed="full")
        client.control(do="play")
        wait_until(lambda: client.time_s > 5.0)
        at_s = client.control(do="pause")["time_s"]
        client.control(do="step", n=50)
        wait_until(lambda: client.time_s >= at_s + 50.0)
        client.control(do="step", n=1)
        wait_until(lambda: client.time_s >= at_s + 51.0)
        assert client.time_s <= at_s + 52.0  # a step may be under way as the pause is asked for
        assert client.phase == "paused"


def test_a_restart_goes_on_to_a_time_at_once_and_stands_there() -> None:
    with served(LONG) as client:
        told = client.control(do="restart", form={"per": 0.1}, skip_to_s=200)
        assert (told["phase"], told["form"]["per"]) == ("paused", 0.1)
        wait_until(lambda: client.time_s == 200.0)
        client.control(do="step")
        wait_until(lambda: client.time_s == 201.0)


def test_settings_that_were_changed_once_may_be_changed_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "ours.py").write_text("from remoras.strategies.central import Central as Own\n")
    monkeypatch.syspath_prepend(tmp_path)
    overrides = (*SHORT, ("--strategy", "strategy.name=ours:Own"))
    with served(overrides) as client:
        assert client.control(do="restart", form={"strategy": "cbba", "per": 0.2})["form"]["per"] == 0.2
        told = client.control(do="restart", form={"strategy": "ours:Own", "per": None})
        assert (told["form"]["strategy"], told["form"]["per"]) == ("ours:Own", 0.6)


def test_the_speed_is_a_multiple_of_real_time() -> None:
    with served(LONG) as client:
        client.control(do="speed", speed=20)
        client.control(do="play")
        began = time.monotonic()
        wait_until(lambda: client.time_s >= 20.0)
        assert time.monotonic() - began > 0.9


REFUSED = [
    ({"do": "speed", "speed": 0}, "speed 0: allowed is 0.1 to 10000 times real time, or full"),
    ({"do": "speed", "speed": "fast"}, 'speed "fast": allowed'),
    ({"do": "speed", "speed": True}, "speed true: allowed"),
    ({"do": "step", "n": 0}, "n 0: allowed is a whole number, 1 to 10000"),
    ({"do": "fly"}, "do: allowed are play, pause, step, speed, restart"),
    ({"do": "restart", "form": {"per": 1.5}}, "loss 1.5: allowed is a number, 0 to below 1"),
    ({"do": "restart", "form": {"per": "much"}}, 'loss "much": allowed is a number'),
    ({"do": "restart", "form": {"per": 10**400}}, "00...: allowed is a number, 0 to below 1"),
    ({"do": "restart", "form": {"faults": f"at_s = {'9' * 5000}"}}, "cannot be read"),
    ({"do": "restart", "form": {"strategy": "/etc/passwd.py:X"}}, 'strategy "/etc/passwd.py:X": allowed are'),
    ({"do": "restart", "form": {"policy": "none"}}, 'policy "none": allowed are'),
    ({"do": "restart", "form": {"out": "elsewhere"}}, '"out": no field of the form'),
    ({"do": "restart", "form": {"faults": "lost AUV01"}}, 'faults: "lost AUV01" cannot be read'),
    ({"do": "restart", "form": {"faults": 'kind = "lost", vehicle = "AUV99", at_s = 3'}}, "AUV99"),
    ({"do": "restart", "form": 3}, "form: allowed is an object"),
    ({"do": "restart", "skip_to_s": 1e9}, "skip_to_s 1000000000.0: allowed is a time of the mission, 0 to "),
]
"""What a page may not ask for, and what it is told."""


def test_what_cannot_be_is_refused_and_the_run_goes_on() -> None:
    with served(LONG) as client:
        client.control(do="step", n=5)
        wait_until(lambda: client.time_s == 5.0)
        for what, says in REFUSED:
            assert says in client.refused(**what)
            assert (client.time_s, client.phase) == (5.0, "paused")
        client.control(do="step")
        wait_until(lambda: client.time_s == 6.0)


def test_only_pages_of_this_machine_may_ask() -> None:
    with served(LONG) as client:
        for host in ("evil.example", f"evil.example:{client.port}", f"127.0.0.1:{client.port + 1}"):
            status, told = client.ask("GET", "/", Host=host)
            assert status == 403
            assert f'host "{host}" is not served' in told["error"]
        for origin in ("http://evil.example", "null", f"https://127.0.0.1:{client.port}"):
            status, told = client.ask("POST", "/control", {"do": "play"}, Origin=origin)
            assert status == 403
            assert f'a page of "{origin}" may not ask' in told["error"]
        assert client.phase == "ready"
        own = f"http://127.0.0.1:{client.port}"
        assert client.ask("POST", "/control", {"do": "play"}, Origin=own)[0] == 200
        status, told = client.ask("POST", "/control", {"do": "play"}, Content_Type="text/plain")
        assert (status, told["error"]) == (400, "content type: allowed is application/json")
        assert client.ask("POST", "/control", b"[" * 90_000)[0] == 400
        assert client.ask("POST", "/control", b"x" * 200_000)[1]["error"] == "longer than 100000 bytes"


def test_no_file_is_served(tmp_path: Path) -> None:
    with served(LONG, tmp_path / "out") as client:
        for path in ("/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/summary.json", "//etc/passwd"):
            status, told = client.ask("GET", path)
            assert status == 404
            assert told["error"] == "served are /, /events and, by POST, /control; no file of this machine is"


def test_a_crash_is_told_and_what_was_there_is_kept(tmp_path: Path, crash: Crash) -> None:
    crash.at(30.0)
    with served(SHORT, tmp_path / "out") as client:
        client.control(do="speed", speed="full")
        client.control(do="play")
        wait_until(lambda: client.phase == "crashed")
        assert client.session.state()["message"] == (
            "RuntimeError: the hull broke; what had happened until then is kept on this page"
        )
        crash.never()
        (shown,) = client.blocks(lambda block: True)
        assert shown["track_rows"] == [31, 31, 31, 31]  # from 0 s to 30 s
        assert shown["header"]["verdict"].endswith("of the goal: crashed at 30.0 s")
        assert not (tmp_path / "out").exists()
        client.control(do="restart")
        client.finished()
    assert Results.read(tmp_path / "out").summary["seed"] == SEED


def test_the_command_serves_until_it_is_interrupted(tmp_path: Path) -> None:
    arguments = ["live", SCENARIO, "--seed", str(SEED), "--no-browser", "--out", str(tmp_path / "live")]
    arguments += ["--set", SHORT[0][1], "--per", "0.6"]
    process = subprocess.Popen(
        [sys.executable, "-c", "from remoras.cli import main; main()", *arguments], stdout=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout is not None
        host = process.stdout.readline().removeprefix("http://").rstrip("/\n")
        assert host.startswith("127.0.0.1:")
        for what in ({"do": "speed", "speed": "full"}, {"do": "play"}):
            connection = http.client.HTTPConnection(host, timeout=PATIENCE_S)
            connection.request("POST", "/control", json.dumps(what), {"Content-Type": "application/json"})
            assert connection.getresponse().status == 200
            connection.close()
        wait_until((tmp_path / "live").is_dir)
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE_S) == 0
    finally:
        process.kill()
        process.communicate()
    write_results(run(load(SCENARIO, SHORT), SEED), tmp_path / "run")
    assert_same_results(tmp_path / "live", tmp_path / "run")


def test_a_port_that_is_taken_is_one_clear_error() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        result = remoras("live", SCENARIO, "--no-browser", "--port", port)
    assert result.exit_code == 2
    assert result.stderr == (
        f"remoras: --port {port}: cannot be listened on: Address already in use; "
        "name another, or 0 for any that is free\n"
    )


def test_libraries_that_are_missing_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("remoras.cli.live.command.NEEDED", ("starlette", "no_such_library"))
    result = remoras("live", SCENARIO, "--no-browser")
    assert result.exit_code == 2
    assert result.stderr == (
        "remoras: live needs no_such_library; install with: python -m pip install no_such_library\n"
    )


def test_results_that_are_there_are_kept_without_force(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    result = remoras("live", SCENARIO, "--no-browser", "--out", tmp_path)
    assert result.exit_code == 2
    assert "exists and is not empty" in result.stderr


def test_half_of_a_surrogate_pair_is_refused_with_the_reason() -> None:
    with served(SHORT) as client:
        for asked in ({"do": "\ud800"}, {"do": "restart", "strategy": "\udfff"}, {"do": "step", "n": ["\ud800"]}):
            assert "half of a surrogate pair" in client.refused(**asked)
        assert client.phase == "ready"
