"""The commands that run vehicles in processes of their own, over UDP on loopback.

Processes share a machine with others, so a packet may come later than its slot and be refused: that is one loss more,
and nothing here depends on how many there are. What is asked for holds once all has settled.
"""

import json
import os
import re
import signal
import socket
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

import pytest
from invoked import MAIN, refused, remoras

from missions.nodes.alone import NodePlan
from missions.nodes.swarm import Swarm, swarm
from missions.scenarios import load

SCENARIO = "mapping-rendezvous"
PAIR = ["ASV00", "AUV00"]
SPEED = 40.0
"""At it a slot of 1.8 s is 44 ms of the machine, and a vehicle takes a few hundredths of a processor."""
UNTIL_S, SETTLE_S = 240.0, 260.0
COMMAND_S = 240.0
"""Longest time that a command may take: to start a process takes seconds where others are busy."""


def run(names: list[str], out: Path | None, **more) -> Swarm:
    plans = [NodePlan.of(load(SCENARIO), name, 5, UNTIL_S, SETTLE_S) for name in names]
    return swarm(SCENARIO, plans, SPEED, (0.4, 0.1), out, **more)


@pytest.mark.slow
def test_nodes_agree_after_one_is_killed_and_their_logs_replay(tmp_path: Path) -> None:
    def kill(pids: dict[str, int]) -> None:
        os.kill(pids["AUV02"], signal.SIGKILL)

    found = run([*PAIR, "AUV02"], tmp_path, begun=kill)
    assert list(found.ended) == ["AUV02"]
    one, other = found.vehicles
    assert [one.vehicle, other.vehicle] == PAIR
    assert one.time_s == UNTIL_S + SETTLE_S
    assert one.items > 0
    assert one.state_hash == other.state_hash
    assert found.equal
    for vehicle in found.vehicles:
        assert vehicle.packets_lost > 0
        assert vehicle.packets_heard > 0
        played = json.loads(remoras("node", "--replay", tmp_path / f"{vehicle.vehicle}.jsonl", "--json").stdout)
        assert played["difference"] == ""
        assert played["state_hash"] == vehicle.state_hash
        assert played["packets_sent"] == vehicle.packets_sent


@pytest.mark.slow
def test_a_swarm_by_command_gives_one_json_value() -> None:
    options = ["--vehicles", "ASV00,AUV00", "--until", 60, "--settle", 60, "--speed", SPEED, "--json"]
    done = remoras("swarm", SCENARIO, *options)
    value = json.loads(done.stdout)
    assert [one["vehicle"] for one in value["vehicles"]] == PAIR
    assert done.exit_code == (0 if value["equal"] else 1)
    assert re.search(r"ASV00 \(process \d+\)", done.stderr)


@pytest.mark.slow
def test_a_node_can_join_a_running_mission() -> None:
    def node(vehicle: str, bind: str, peers: str, until_s: float) -> subprocess.Popen[str]:
        options = f"--bind {bind} --peers {peers} --until {until_s} --settle 0 --speed 60 --json"
        command = [sys.executable, "-c", MAIN, "node", SCENARIO, vehicle, *options.split()]
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        bind = f"127.0.0.1:{free.getsockname()[1]}"
    first = node("ASV00", "127.0.0.1:0", f"AUV00={bind}", 600.0)
    try:
        assert first.stderr is not None
        address = re.search(r"listens on (\S+)", first.stderr.readline())
        assert address is not None
        second = node("AUV00", bind, f"ASV00={address[1]}", 600.0)
        try:
            said, told = second.communicate(timeout=COMMAND_S)
        finally:
            second.kill()
        assert "AUV00 joins at" in told
        assert json.loads(said)["packets_heard"] > 0
        assert json.loads(first.communicate(timeout=COMMAND_S)[0])["packets_heard"] > 0
    finally:
        first.kill()


def test_a_node_runs_without_its_peer(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as nobody:
        nobody.bind(("127.0.0.1", 0))
        peer = f"AUV00=127.0.0.1:{nobody.getsockname()[1]}"
    options = ["--peers", peer, "--until", 50, "--settle", 0, "--speed", 1000, "--out", tmp_path]
    done = remoras("node", SCENARIO, "ASV00", *options, "--json")
    assert done.exit_code == 0, done.output
    value = json.loads(done.stdout)
    assert (value["time_s"], value["packets_heard"]) == (50.0, 0)
    assert value["packets_sent"] == 8  # slots of 1.77 s, four in a frame: ASV00 has one each 7.1 s, the first at once
    repeated = remoras("node", "--replay", tmp_path / "ASV00.jsonl")
    assert repeated.exit_code == 0
    assert "8 packets sent as in the log" in repeated.stdout


def test_a_log_that_differs_ends_with_1_and_names_the_packet(tmp_path: Path) -> None:
    remoras("node", SCENARIO, "ASV00", "--until", 30, "--settle", 0, "--speed", 1000, "--out", tmp_path)
    log = tmp_path / "ASV00.jsonl"
    log.write_text(re.sub(r'"data": "..', '"data": "ff', log.read_text(), count=1))
    done = remoras("node", "--replay", log)
    assert done.exit_code == 1
    assert "ASV00 differs from its log: packet 1: " in done.stdout


def test_a_port_in_use_is_reported_in_one_line() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        number = taken.getsockname()[1]
        (message,) = refused("node", SCENARIO, "ASV00", "--bind", f"127.0.0.1:{number}").splitlines()
    why = "allowed is an address of this machine with a free port, or port 0 for any free one"
    assert message == f"remoras: --bind 127.0.0.1:{number}: Address already in use; {why}"


def test_an_invalid_port_and_an_invalid_log_are_named(tmp_path: Path) -> None:
    now = datetime.now(UTC).isoformat()
    (tmp_path / "AUV00.jsonl").write_text("x\n", encoding="utf-8")
    assert "no line of a log" in refused("node", SCENARIO, "AUV00", "--resume", "--out", tmp_path).splitlines()[-1]
    serial = ("--serial", tmp_path / "none", "--start-utc", now, "--set", "communication.modem=nanomodem-v3")
    wrong = refused("node", SCENARIO, "AUV00", *serial)
    assert "No such file or directory; allowed is a serial port" in wrong
