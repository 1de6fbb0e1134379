"""Vehicles by themselves: they come to know the same through packets, and their logs repeat them bit by bit."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from exchange.drivers import AT_ONCE, Ether
from exchange.packets import ItemUid
from missions.errors import ConfigurationError, OutputError
from missions.nodes.alone import NodePlan, alone
from missions.nodes.logs import NodeLog, play, read_log
from missions.nodes.node import Mishaps, NodeOutcome, VehicleNode
from missions.scenarios import load

SEED = 5
LOSSY = Mishaps(0.4, 0.1)
UNTIL_S, SETTLE_S = 200.0, 300.0


def plan_of(
    vehicle: str = "AUV00", until_s: float | None = UNTIL_S, settle_s: float = SETTLE_S, **keys: str
) -> NodePlan:
    settings = [("--set", f"{key.replace('__', '.')}={value}") for key, value in keys.items()]
    return NodePlan.of(load("mapping-rendezvous", settings), vehicle, SEED, until_s, settle_s)


def together(
    plans: list[NodePlan], out: Path | None = None, mishaps: Mishaps = LOSSY
) -> tuple[list[VehicleNode], list[NodeOutcome]]:
    """Vehicles of one process that hear each other, each step that of the one whose turn it is."""
    all_alone = [alone(plan) for plan in plans]
    ether = Ether(all_alone[0].setup.modem.packet_s)
    logs = [None if out is None else NodeLog(out, plan) for plan in plans]
    nodes = [VehicleNode(own, ether.driver(), AT_ONCE, log, mishaps) for own, log in zip(all_alone, logs, strict=True)]
    while True:
        node = min(nodes, key=lambda one: one.next_s)
        if node.next_s >= plans[0].end_s:
            break
        node.step()
    return nodes, [node.run() for node in nodes]


@pytest.fixture(scope="module")
def logged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Logs of two vehicles that lost and doubled packets."""
    folder = tmp_path_factory.mktemp("logs")
    _, outcomes = together([plan_of("ASV00"), plan_of("AUV00")], folder)
    assert outcomes[0].items > 0
    assert min(one.packets_lost for one in outcomes) > 0
    assert sum(one.packets_doubled for one in outcomes) > 0
    return folder


def test_all_come_to_know_the_same_and_nobody_believes_what_is_false() -> None:
    names = ["ASV00", "AUV00", "AUV01", "AUV02"]
    nodes, outcomes = together([plan_of(name) for name in names])
    assert len({one.state_hash for one in outcomes}) == 1
    assert len({json.dumps(one.digest, sort_keys=True) for one in outcomes}) == 1
    assert [one.open for one in outcomes] == [0, 0, 0, 0]
    assert {*outcomes[0].digest} == {*names}  # each has something to tell
    managers = [node.solo.vehicle.radio.manager for node in nodes]
    origins = {name: nodes[0].solo.vehicle.social.database[name].node for name in names}
    uids = [ItemUid(origins[o], n, 0) for o, (highest, _) in outcomes[0].digest.items() for n in range(highest + 1)]
    believed = 0
    for manager in managers:
        for peer, other in enumerate(managers):
            for uid in uids if manager is not other else ():
                believed += manager.believes(peer, uid)
                assert other.holds(uid) or not manager.believes(peer, uid)
    assert believed > 0


def test_losses_are_those_of_a_run_on_bernoulli() -> None:
    """The share is that of the option, within 4 standard errors of 4000 draws: 4 sqrt(0.4 0.6 / 4000) = 0.031."""
    drawn = [LOSSY.copies(SEED, slot, 0, 1) for slot in range(4000)]
    assert abs(drawn.count(0) / 4000 - 0.4) < 0.031
    assert abs(drawn.count(2) / (4000 - drawn.count(0)) - 0.1) < 4 * (0.09 / 2400) ** 0.5
    assert [Mishaps(0.2).copies(SEED, slot, 0, 1) for slot in range(4000)].count(0) < drawn.count(0)
    assert all(LOSSY.copies(SEED, slot, 0, 1) == 0 for slot in range(500) if Mishaps(0.2).copies(SEED, slot, 0, 1) == 0)


@pytest.mark.parametrize("vehicle", ["ASV00", "AUV00"])
def test_a_log_repeats_its_vehicle_bit_by_bit(logged: Path, vehicle: str) -> None:
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


def test_a_log_that_differs_is_named_at_the_first_packet_that_differs(logged: Path, tmp_path: Path) -> None:
    sent = 0

    def spoil(number: int, line: dict) -> dict:
        nonlocal sent
        sent += line.get("kind") == "sent"
        if line.get("kind") == "sent" and sent >= 7:
            return {**line, "data": "00" + line["data"][2:]}
        return line

    played = play(read_log(changed(logged / "AUV00.jsonl", tmp_path / "x.jsonl", spoil)))
    assert played.difference.startswith("packet 7: ")


def test_a_packet_that_was_not_heard_makes_a_difference(logged: Path, tmp_path: Path) -> None:
    """Without all that was heard, the acknowledgements in what it says differ."""
    deaf = changed(
        logged / "AUV00.jsonl", tmp_path / "x.jsonl", lambda n, line: None if line.get("kind") == "heard" else line
    )
    assert play(read_log(deaf)).difference.startswith("packet ")


def test_a_state_that_differs_is_told(logged: Path, tmp_path: Path) -> None:
    other = changed(
        logged / "AUV00.jsonl",
        tmp_path / "x.jsonl",
        lambda n, line: line | {"state_hash": "0"} if line.get("kind") == "end" else line,
    )
    assert play(read_log(other)).difference.startswith("state at 500 s: ")


def test_the_log_of_a_node_that_was_killed_repeats_it_as_far_as_it_goes(logged: Path, tmp_path: Path) -> None:
    text = (logged / "ASV00.jsonl").read_text()
    cut = tmp_path / "x.jsonl"
    cut.write_text(text[: len(text) * 3 // 4])
    log = read_log(cut)
    assert log.state_hash is None
    played = play(log)
    assert played.difference == ""
    assert 10 < played.packets_sent < text.count('"sent"')


@pytest.mark.parametrize("text", ["", "x\n", "{}\n", '{"log": "remoras node", "plan": {}}\n'])
def test_what_is_no_log_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "x.jsonl").write_text(text)
    with pytest.raises(ConfigurationError, match="no line of a log"):
        read_log(tmp_path / "x.jsonl")


def test_a_bad_line_is_named(logged: Path, tmp_path: Path) -> None:
    bad = changed(
        logged / "AUV00.jsonl",
        tmp_path / "x.jsonl",
        lambda n, line: line if n != 3 else {"kind": "sent", "time_s": "?"},
    )
    with pytest.raises(ConfigurationError, match=r"x\.jsonl:4: "):
        read_log(bad)


def test_a_log_is_not_written_over(tmp_path: Path) -> None:
    NodeLog(tmp_path, plan_of()).close()
    with pytest.raises(OutputError, match="is there already; name another folder by --out"):
        NodeLog(tmp_path, plan_of())


def test_one_that_comes_late_neither_speaks_nor_knows_before_and_catches_up(tmp_path: Path) -> None:
    late = replace(plan_of("AUV01"), begins_s=120.0)
    _, outcomes = together([plan_of("AUV00"), late], tmp_path)
    assert outcomes[0].state_hash == outcomes[1].state_hash
    log = read_log(tmp_path / "AUV01.jsonl")
    assert min(entry.time_s for entry in log.entries if entry.kind == "sent") >= 120.0
    assert play(log).difference == ""


@pytest.mark.parametrize("epoch", [1, 5])
def test_one_that_is_started_again_tells_in_its_next_epoch(epoch: int) -> None:
    """Without the epoch, it would number what it tells from 0, and the others would take it for what they know."""
    again = replace(plan_of("AUV00"), begins_s=60.0, epoch=epoch)
    _, outcomes = together([plan_of("ASV00"), again])
    assert outcomes[0].state_hash == outcomes[1].state_hash
    assert f"AUV00.e{epoch}" in outcomes[0].digest
    assert "AUV00" not in outcomes[0].digest


def test_one_alone_goes_on() -> None:
    _, (outcome,) = together([plan_of("ASV00", settle_s=0.0)])
    assert outcome.time_s == UNTIL_S
    assert outcome.packets_heard == 0
    assert outcome.open > 0  # what nobody has acknowledged


def test_one_that_is_lost_by_a_fault_falls_silent(tmp_path: Path) -> None:
    plan = plan_of("AUV00", fault='[{ kind = "lost", vehicle = "AUV00", at_s = 50.0 }]')
    _, (outcome,) = together([plan], tmp_path)
    assert not outcome.is_alive
    assert max(entry.time_s for entry in read_log(tmp_path / "AUV00.jsonl").entries) < 50.0


def test_misfits_are_named_with_what_is_allowed() -> None:
    with pytest.raises(ConfigurationError, match="VEHICLE = AUV0: one of ASV00, AUV00, AUV01, AUV02"):
        plan_of("AUV0")
    with pytest.raises(ConfigurationError, match=r"--until = 1e\+06: a time up to scenario.duration_s"):
        plan_of(until_s=1e6)
    with pytest.raises(ConfigurationError, match=r"strategy\.name = oracle: a strategy that tells by packets"):
        plan_of(strategy__name="oracle").setup()
    with pytest.raises(ConfigurationError, match="--epoch = 256: 0 to 255"):
        replace(plan_of(), epoch=256).setup()
