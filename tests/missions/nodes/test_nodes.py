"""Nodes of single vehicles: equal knowledge; logs reproduce and resume them."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from diving import BEGAN, together

from missions.errors import ConfigurationError
from missions.nodes import logs
from missions.nodes.alone import NodePlan
from missions.nodes.logs import gone_on, play, read_log
from missions.nodes.node import Mishaps
from missions.scenarios import load

SEED = 5
LOSSY = Mishaps(0.4, 0.1)
UNTIL_S, SETTLE_S = 200.0, 300.0


def plan_of(
    vehicle: str = "AUV00", until_s: float | None = UNTIL_S, settle_s: float = SETTLE_S, **keys: str
) -> NodePlan:
    settings = [("--set", f"{key.replace('__', '.')}={value}") for key, value in keys.items()]
    return NodePlan.of(load("mapping-rendezvous", settings), vehicle, SEED, until_s, settle_s)


@pytest.fixture(scope="module")
def logged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Logs of two vehicles that lost and doubled packets."""
    folder = tmp_path_factory.mktemp("logs")
    _, outcomes = together([plan_of("ASV00"), plan_of("AUV00")], folder, LOSSY)
    assert outcomes[0].items > 0
    assert min(one.packets_lost for one in outcomes) > 0
    assert sum(one.packets_doubled for one in outcomes) > 0
    return folder


@pytest.mark.parametrize("vehicle", ["ASV00", "AUV00"])
def test_log_reproduces_its_vehicle_exactly(logged: Path, vehicle: str) -> None:
    log = read_log(logged / f"{vehicle}.jsonl")
    played = play(log)
    assert played.difference == ""
    assert played.packets_sent > 50
    assert played.state_hash == log.state_hash


def changed(source: Path, target: Path, change) -> Path:
    """A log of which some lines are changed; ``change`` takes number and object of a line, and gives it or None."""
    kept = [change(n, json.loads(line)) for n, line in enumerate(source.read_text().splitlines())]
    target.write_text("".join(json.dumps(one) + "\n" for one in kept if one is not None))
    return target


def altered(line: dict[str, Any]) -> dict[str, Any]:
    """A packet that begins otherwise."""
    return {**line, "data": "00" + line["data"][2:]} if line.get("kind") == "sent" else line


@pytest.mark.parametrize(
    ("kind", "change", "difference"),
    [
        ("sent", altered, "packet 1: "),
        ("heard", lambda line: None, "packet "),  # the acknowledgements in what it says differ
        ("end", lambda line: {**line, "state_hash": "0"}, "state at 500 s: "),
    ],
)
def test_first_difference_of_a_log_is_named(
    logged: Path, tmp_path: Path, kind: str, change: Any, difference: str
) -> None:
    other = changed(
        logged / "AUV00.jsonl", tmp_path / "x.jsonl", lambda n, line: change(line) if line.get("kind") == kind else line
    )
    assert play(read_log(other)).difference.startswith(difference)


def test_truncated_log_is_reproduced_and_resumed(logged: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = (logged / "ASV00.jsonl").read_text().splitlines(keepends=True)
    cut = tmp_path / "x.jsonl"
    cut.write_text("".join(lines[: len(lines) * 3 // 4]))
    log = read_log(cut)
    assert log.state_hash is None
    played = play(log)
    assert played.difference == ""
    assert 10 < played.packets_sent < "".join(lines).count('"sent"')
    monkeypatch.setattr(logs.time, "time", lambda: BEGAN.unix_s + UNTIL_S + SETTLE_S)
    own, going_on, _ = gone_on(cut, plan_of("ASV00"))
    going_on.close()
    assert own.solo.vehicle.beliefs.model.state_hash() == played.state_hash
    assert len(read_log(cut).pauses) == 1


@pytest.mark.parametrize(
    ("seed", "spoil", "says"),
    [
        (SEED + 1, None, "the log of another scenario, seed or end"),
        (SEED, None, "complete"),
        (SEED, lambda n, line: None if line.get("kind") == "end" else altered(line), "not reproduced .*: packet 1"),
    ],
)
def test_log_that_cannot_be_resumed_is_refused(logged: Path, tmp_path: Path, seed: int, spoil: Any, says: str) -> None:
    path = changed(logged / "AUV00.jsonl", tmp_path / "x.jsonl", spoil or (lambda n, line: line))
    with pytest.raises(ConfigurationError, match=says):
        gone_on(path, replace(plan_of(), seed=seed))


@pytest.mark.parametrize("text", ["", "x\n", "{}\n", '{"log": "remoras node", "plan": {}}\n'])
def test_file_without_log_lines_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "x.jsonl").write_text(text)
    with pytest.raises(ConfigurationError, match="no line of a log"):
        read_log(tmp_path / "x.jsonl")


def test_malformed_log_line_is_refused_with_its_number(logged: Path, tmp_path: Path) -> None:
    bad = changed(
        logged / "AUV00.jsonl",
        tmp_path / "x.jsonl",
        lambda n, line: line if n != 3 else {"kind": "sent", "time_s": "?"},
    )
    with pytest.raises(ConfigurationError, match=r"x\.jsonl:4: "):
        read_log(bad)


def test_late_node_is_silent_before_its_start_and_catches_up(tmp_path: Path) -> None:
    late = replace(plan_of("AUV01"), begins_s=120.0)
    _, outcomes = together([plan_of("AUV00"), late], tmp_path, LOSSY)
    assert outcomes[0].state_hash == outcomes[1].state_hash
    log = read_log(tmp_path / "AUV01.jsonl")
    assert min(entry.time_s for entry in log.entries if entry.kind == "sent") >= 120.0
    assert play(log).difference == ""


def test_restarted_node_sends_items_of_its_next_epoch() -> None:
    """Without the epoch its item numbers would restart at 0, and others would take them for known items."""
    again = replace(plan_of("AUV00"), begins_s=60.0, epoch=5)
    nodes, outcomes = together([plan_of("ASV00"), again], None, LOSSY)
    assert outcomes[0].state_hash == outcomes[1].state_hash
    told = nodes[0].solo.vehicle.beliefs.model.digest()
    assert [epoch for origin, epoch in told if origin == 1] == [5]
