"""The command ``serve``: refusals in one line, a recording at its end."""

import json
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from invoked import MAIN, refused, remoras

from missions.runs import results


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
    ],
)
def test_a_wrong_option_is_refused_in_one_line(options: list[str], said: str):
    message = refused("serve", "mission-2012", *options)
    assert said in message
    assert message.count("\n") == 1


def test_a_port_in_use_and_stations_of_a_scenario_are_refused():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        message = refused("serve", "mission-2012", "--port", taken.getsockname()[1])
    assert "allowed: an address of this machine with a free port for each station" in message
    assert "its vehicles" in refused("serve", "mapping-rendezvous", "--stations", "A,B")


def test_a_service_ends_at_its_time_with_a_recording(tmp_path: Path):
    options = ["--port", "0", "--until", "3", "--speed", "30", "--access", "slots", "--seed", "4", "--json", "--out"]
    done = remoras("serve", "mapping-rendezvous", *options, tmp_path / "sea")
    assert done.exit_code == 0, done.output
    value = json.loads(done.stdout)
    assert [station["station"] for station in value["stations"]] == ["ASV00", "AUV00", "AUV01", "AUV02"]
    assert value["time_s"] == 3.0
    assert remoras("verify", tmp_path / "sea").exit_code == 0
    summary = json.loads((tmp_path / "sea" / results.SUMMARY).read_text())
    assert (summary["n_packets"], summary["seed"], summary["drawn"]) == (0, 4, False)
    assert "is not empty" in refused("serve", "mapping-rendezvous", "--port", 0, "--out", tmp_path / "sea")


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_an_interruption_ends_it_with_the_recording_written(tmp_path: Path):
    command = [sys.executable, "-c", MAIN, "serve", "mission-2012", "--port", "0", "--out", str(tmp_path / "sea")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        ports = [line.split()[4] for line in iter(process.stderr.readline, "remoras: Ctrl-C ends it\n")]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as program:
            host, _, port = ports[0].rstrip(",").rpartition(":")
            program.sendto(b"before the end", (host, int(port)))
            process.send_signal(signal.SIGINT)
            said, _ = process.communicate(timeout=60.0)
    finally:
        process.kill()
    assert process.returncode == 0
    assert said.split()[:3] == ["station", "sent", "received"]
    assert remoras("verify", tmp_path / "sea").exit_code == 0
