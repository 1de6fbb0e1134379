"""The command ``sea`` without ``--describe``: refusals in one line, a recording at its end."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from invoked import MAIN, refused, remoras

from missions.nodes.recording import RowLog, of_network
from missions.nodes.sea import Sea
from missions.runs import results
from missions.runs.setup import resolved


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--programs", "21=127.0.0.1:99999"], "--programs 21 127.0.0.1:99999: allowed is HOST:PORT"),
        (["--programs", "21=127.0.0.1:1,21=127.0.0.1:2"], "21 is there twice; allowed: one address each"),
        (["--programs", "20=127.0.0.1:1"], "allowed are 21, 22, 27, 28, 29"),
        (["--stations", "21,99"], "allowed: 21, 22, 27, 28, 29"),
        (["--stations", "21,21"], "used 2 times"),
        (["--bind", "0.0.0.0"], "add --token FILE"),
        (["--bind", "localhost"], "allowed is an IPv4 address"),
        (["--bind", "192.0.2.1", "--token", "missing"], "--token missing: cannot be read"),
        (["--speed", "0"], "--speed 0: allowed is more than 0"),
        (["--positions", "missing.csv"], "missing.csv"),
        (["--set", "communication.modem=nothing"], "communication.modem"),
        (["--port", "65535"], "--port: 127.0.0.1:65536"),
        (["--modem", "nanomodem-v3"], "--modem: applies with --describe only"),
        (["--describe", "--speed", "2"], "--speed: applies without --describe only"),
        (["--describe", "--ranges", "500"], "--ranges: applies to the modems of a scenario"),
    ],
)
def test_a_wrong_option_is_refused_in_one_line(options: list[str], said: str):
    message = refused("sea", "mission-2012", *options)
    assert said in message
    assert message.count("\n") == 1


def test_a_port_in_use_and_stations_of_a_scenario_are_refused():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        message = refused("sea", "mission-2012", "--port", taken.getsockname()[1])
    assert "allowed: an address of this machine with a free port for each station" in message
    assert "its vehicles" in refused("sea", "mapping-rendezvous", "--stations", "A,B")


def test_a_service_ends_at_its_time_with_a_recording(tmp_path: Path):
    options = ["--port", "0", "--until", "3", "--speed", "30", "--access", "slots", "--seed", "4", "--json", "--out"]
    done = remoras("sea", "mapping-rendezvous", *options, tmp_path / "sea")
    assert done.exit_code == 0, done.output
    value = json.loads(done.stdout)
    assert [station["station"] for station in value["stations"]] == ["ASV00", "AUV00", "AUV01", "AUV02"]
    assert value["time_s"] == 3.0
    assert remoras("verify", tmp_path / "sea").exit_code == 0
    summary = json.loads((tmp_path / "sea" / results.SUMMARY).read_text())
    assert (summary["n_packets"], summary["seed"], summary["drawn"]) == (0, 4, False)
    assert "is not empty" in refused("sea", "mapping-rendezvous", "--port", 0, "--out", tmp_path / "sea")


def serving(folder: Path) -> tuple[subprocess.Popen[str], int]:
    """A service of its own process, and the port of its first station."""
    options = ["--port", "0", "--speed", "20", "--out", str(folder)]
    command = [sys.executable, "-c", MAIN, "sea", "mission-2012", *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    ports = [line.split()[4] for line in iter(process.stderr.readline, "remoras: Ctrl-C ends it\n")]
    return process, int(ports[0].rstrip(",").rpartition(":")[2])


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
def test_an_interruption_or_a_kill_loses_no_finished_row(end: signal.Signals, tmp_path: Path):
    folder = tmp_path / "sea"
    process, port = serving(folder)
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as program:
            for number in range(5):
                program.sendto(b"before the end %d" % number, ("127.0.0.1", port))
                time.sleep(0.1)
            time.sleep(0.3)  # 6 s of the sea
            process.send_signal(end)
            said, _ = process.communicate(timeout=60.0)
    finally:
        process.kill()
    if end == signal.SIGINT:
        assert process.returncode == 0
        assert said.split()[:3] == ["station", "sent", "received"]
    else:
        assert remoras("sea", folder).stdout == f"{folder}\n"
    assert not (folder / "rows.jsonl").exists()
    assert json.loads((folder / results.SUMMARY).read_text())["n_packets"] == 5
    checked = remoras("verify", folder)
    assert checked.exit_code == 0, checked.output


def test_rows_of_less_than_a_second_give_no_recording(tmp_path: Path):
    sea = Sea(resolved(of_network("mission-2012", "free", [], [])), 1)
    RowLog(tmp_path, sea.setup, 1, sea.recorder).keep(0.5)
    assert "holds no second" in refused("sea", tmp_path)
    for damaged in ("", "[]\n", "noise\n{}\n", '["a", 1]\n[3\n{}\n'):
        (tmp_path / "rows.jsonl").write_text(damaged)
        assert "rows.jsonl: damaged" in refused("sea", tmp_path)
