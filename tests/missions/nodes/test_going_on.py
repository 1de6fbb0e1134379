"""A node whose process was ended goes on from its log: it knows what it knew, and tells nothing twice as new."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from exchange.drivers import AT_ONCE, Ether
from missions.errors import ConfigurationError
from missions.nodes import logs
from missions.nodes.alone import NodePlan, alone
from missions.nodes.logs import Began, LineKind, NodeLog, gone_on, play, read_log
from missions.nodes.node import Mishaps, VehicleNode
from missions.scenarios import load

SEED, UNTIL_S, SETTLE_S, AWAY_S = 5, 900.0, 300.0, 30.0
BEGAN = Began(1_000_000.0, 1.0)
LOSSY = Mishaps(0.3, 0.1)
N_KILLS, SPEED = 5, 20.0
LINES_OF_A_LIFE, PATIENCE_S = 10, 60.0
"""The process is killed when its log has so many lines more, or after so long."""
COMMAND = [sys.executable, "-m", "remoras"]


def plan_of(vehicle: str, seed: int = SEED) -> NodePlan:
    return NodePlan.of(load("mapping-rendezvous"), vehicle, seed, UNTIL_S, SETTLE_S)


class Dive:
    """Two vehicles; the process of the second is ended at times, and begins again a while after."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.path = folder / "AUV00.jsonl"
        self._monkeypatch = monkeypatch
        self._folder = folder
        plans = [plan_of("ASV00"), plan_of("AUV00")]
        own = [alone(plan) for plan in plans]
        self._ether = Ether(own[0].setup.modem.packet_s)
        self._drivers = [self._ether.driver() for _ in own]
        self.ship = VehicleNode(own[0], self._drivers[0], AT_ONCE, None, LOSSY)
        self.node = VehicleNode(own[1], self._drivers[1], AT_ONCE, NodeLog(folder, plans[1], BEGAN), LOSSY)

    def go(self, until_s: float) -> None:
        """Let both go on until then."""
        while (node := min(self.ship, self.node, key=lambda one: one.next_s)).next_s < until_s:
            node.step()

    def end_and_begin(self, at_s: float) -> set[str]:
        """End the process of the second, and begin it again; returns what it had held."""
        self.go(at_s)
        held = self.held()
        self._drivers[1].close()
        away = self.node
        while self.ship.next_s < at_s + AWAY_S:
            self.ship.step()
        self._monkeypatch.setattr(logs.time, "time", lambda: BEGAN.unix_s + at_s + AWAY_S)
        own, log, _ = gone_on(self.path, plan_of("AUV00"))
        assert own.solo.vehicle is not away.solo.vehicle
        self._drivers[1] = self._ether.driver()
        self.node = VehicleNode(own, self._drivers[1], AT_ONCE, log, LOSSY)
        return held

    def held(self) -> set[str]:
        """What it holds, by identity and content."""
        return {f"{guid} {block}" for guid, block in self.node.solo.vehicle.beliefs.model.items()}

    def ended(self) -> tuple[str, str]:
        """States of both at the end."""
        self.go(UNTIL_S + SETTLE_S)
        return self.ship.run().state_hash, self.node.run().state_hash


@pytest.fixture
def dive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Dive:
    """It has not begun."""
    return Dive(tmp_path, monkeypatch)


def mapped_by_life(dive: Dive) -> dict[int, set[tuple[int, float]]]:
    """Cells that the ship was told of by the other, by the life in which they were told."""
    node, model = dive.node.solo.vehicle.data.node, dive.ship.solo.vehicle.beliefs.model
    told: dict[int, set[tuple[int, float]]] = {}
    for (origin, epoch, _), block in model.items():
        if origin == node and block is not None:
            cells = {(fact.subject, fact.value) for fact in block.facts if isinstance(fact.value, float)}
            told.setdefault(epoch, set()).update(cells)
    return told


def test_it_knows_what_it_knew_and_all_know_the_same_at_the_end(dive: Dive) -> None:
    times_s = (150.0, 250.0, 400.0, 550.0, 700.0)
    for at_s in times_s:
        before = dive.end_and_begin(at_s)
        assert before
        assert before <= dive.held()
    ship, node = dive.ended()
    assert ship == node
    mapped = mapped_by_life(dive)
    assert [*mapped] == [0, 1, 2, 3, 4, 5]
    n_cells = len(set().union(*mapped.values()))
    assert n_cells > 20
    # Nothing is told twice, but for the cell below it: the sensor is on again there, and maps it once more.
    assert sum(map(len, mapped.values())) - n_cells <= len(times_s)
    pauses = read_log(dive.path).pauses
    assert [round(until_s - AWAY_S) for _, until_s in pauses] == [*times_s]


def test_its_log_repeats_it_over_all_its_lives(dive: Dive) -> None:
    for at_s in (150.0, 400.0):
        dive.end_and_begin(at_s)
    dive.ended()
    played = play(read_log(dive.path))
    assert played.difference == ""
    assert played.packets_sent > 50


def test_a_line_that_was_not_finished_is_written_over(dive: Dive) -> None:
    dive.go(150.0)
    with dive.path.open("a", encoding="utf-8") as file:
        file.write('{"kind": "heard", "time_')
    dive.end_and_begin(150.0)
    dive.ended()
    lines = [json.loads(line) for line in dive.path.read_text(encoding="utf-8").splitlines()]
    assert [line.get("kind") for line in lines].count(LineKind.BACK) == 1


def test_without_its_log_it_knows_nothing_of_before(dive: Dive) -> None:
    before = dive.end_and_begin(400.0)
    anew = alone(replace(plan_of("AUV00"), begins_s=430.0, epoch=1))
    anew.solo.advance(431.0)
    assert not before & {f"{guid} {block}" for guid, block in anew.solo.vehicle.beliefs.model.items()}


def test_a_log_that_cannot_be_gone_on_with_is_named(dive: Dive, tmp_path: Path) -> None:
    dive.go(100.0)
    with pytest.raises(ConfigurationError, match="of another scenario, seed or end"):
        gone_on(dive.path, plan_of("AUV00", seed=SEED + 1))
    lines = dive.path.read_text(encoding="utf-8").splitlines()
    sent = next(place for place, line in enumerate(lines) if '"sent"' in line)
    spoilt = tmp_path / "spoilt.jsonl"
    spoilt.write_text(
        "\n".join([*lines[:sent], lines[sent].replace('"data": "', '"data": "00'), *lines[sent + 1 :], ""]),
        encoding="utf-8",
    )
    with pytest.raises(ConfigurationError, match="not repeated by this version: packet 1"):
        gone_on(spoilt, plan_of("AUV00"))
    spoilt.write_text("\n".join([lines[0].replace('"began": {', '"other": {'), *lines[1:], ""]), encoding="utf-8")
    with pytest.raises(ConfigurationError, match="without a start"):
        gone_on(spoilt, plan_of("AUV00"))
    dive.ended()
    with pytest.raises(ConfigurationError, match="complete"):
        gone_on(dive.path, plan_of("AUV00"))


def killed(folder: Path) -> tuple[Path, str]:
    """Kill one of two nodes ``N_KILLS`` times; return its log, and the output of all processes."""
    ports = {name: free_port() for name in ("ASV00", "AUV00")}
    start = time.monotonic() + 2.0
    out = folder / "killed"
    log = out / "AUV00.jsonl"

    def begin(name: str, *more: str) -> subprocess.Popen[str]:
        (other,) = set(ports) - {name}
        command = [
            *COMMAND, "node", "mapping-rendezvous", name, "--bind", f"127.0.0.1:{ports[name]}",
            "--peers", f"{other}=127.0.0.1:{ports[other]}", "--speed", f"{SPEED:g}", "--start", f"{start}",
            "--until", "500", "--settle", "200", "--json", *more,
        ]  # fmt: skip
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    ship, said = begin("ASV00"), []
    for life in range(N_KILLS + 1):
        node = begin("AUV00", "--out", str(out), "--resume")
        if life < N_KILLS:
            wait_for(log, n_lines(log) + LINES_OF_A_LIFE)
            os.kill(node.pid, signal.SIGKILL)
        printed, told = node.communicate()
        said.append(f"life {life}, exit {node.returncode}: {told.strip() or '-'}")
    outcomes = {"ASV00": json.loads(ship.communicate()[0]), "AUV00": json.loads(printed)}
    again = subprocess.run([*COMMAND, "node", "--replay", str(log)], capture_output=True, text=True, check=False)
    said += [f"{name}: {found['items']} items, state {found['state_hash']}" for name, found in outcomes.items()]
    said += ["they know the same" if len({one["state_hash"] for one in outcomes.values()}) == 1 else "THEY DIFFER"]
    said += [again.stdout.strip() + again.stderr.strip()]
    return log, "\n".join(said)


def n_lines(log: Path) -> int:
    """How many lines a log has."""
    return log.read_bytes().count(b"\n") if log.is_file() else 0


def wait_for(log: Path, n: int) -> None:
    """Wait until a log has so many lines."""
    until_s = time.monotonic() + PATIENCE_S
    while n_lines(log) < n and time.monotonic() < until_s:
        time.sleep(0.05)


def free_port() -> int:
    """A UDP port that nobody has."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@pytest.mark.thorough
def test_a_process_that_is_killed_five_times_knows_in_the_end_what_its_peer_knows(tmp_path: Path) -> None:
    """Real processes, sockets and kills."""
    log, said = killed(tmp_path)
    assert said.count("exit -9") == N_KILLS == 5
    assert said.count("goes on at") == 5
    assert "they know the same" in said
    assert "packets sent as in the log" in said
    assert len(read_log(log).pauses) == 5
