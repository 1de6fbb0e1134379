"""Vehicles by themselves come to know the same; their logs repeat them, and they go on from their logs."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from diving import step_until, together

from exchange.drivers import AT_ONCE, Ether
from exchange.packets import ItemUid
from missions.errors import ConfigurationError
from missions.nodes import logs
from missions.nodes.alone import NodePlan, alone
from missions.nodes.logs import Began, NodeLog, gone_on, play, read_log
from missions.nodes.node import Mishaps, VehicleNode
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


def test_all_come_to_know_the_same_and_nobody_believes_what_is_false() -> None:
    names = ["ASV00", "AUV00", "AUV01", "AUV02"]
    nodes, outcomes = together([plan_of(name) for name in names], None, LOSSY)
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


@pytest.mark.parametrize(
    ("kind", "change", "difference"),
    [
        ("sent", lambda line: {**line, "data": "00" + line["data"][2:]}, "packet 1: "),
        ("heard", lambda line: None, "packet "),  # the acknowledgements in what it says differ
        ("end", lambda line: {**line, "state_hash": "0"}, "state at 500 s: "),
    ],
)
def test_a_log_that_differs_is_named_where_it_does(
    logged: Path, tmp_path: Path, kind: str, change: Any, difference: str
) -> None:
    other = changed(
        logged / "AUV00.jsonl", tmp_path / "x.jsonl", lambda n, line: change(line) if line.get("kind") == kind else line
    )
    assert play(read_log(other)).difference.startswith(difference)


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


def test_one_that_comes_late_neither_speaks_nor_knows_before_and_catches_up(tmp_path: Path) -> None:
    late = replace(plan_of("AUV01"), begins_s=120.0)
    _, outcomes = together([plan_of("AUV00"), late], tmp_path, LOSSY)
    assert outcomes[0].state_hash == outcomes[1].state_hash
    log = read_log(tmp_path / "AUV01.jsonl")
    assert min(entry.time_s for entry in log.entries if entry.kind == "sent") >= 120.0
    assert play(log).difference == ""


def test_one_that_is_started_again_tells_in_its_next_epoch() -> None:
    """Without the epoch, it would number what it tells from 0, and the others would take it for what they know."""
    again = replace(plan_of("AUV00"), begins_s=60.0, epoch=5)
    _, outcomes = together([plan_of("ASV00"), again], None, LOSSY)
    assert outcomes[0].state_hash == outcomes[1].state_hash
    assert "AUV00.e5" in outcomes[0].digest
    assert "AUV00" not in outcomes[0].digest


def test_misfits_are_named_with_what_is_allowed() -> None:
    with pytest.raises(ConfigurationError, match="VEHICLE = AUV0: one of ASV00, AUV00, AUV01, AUV02"):
        plan_of("AUV0")
    with pytest.raises(ConfigurationError, match=r"--until = 1e\+06: a time up to scenario.duration_s"):
        plan_of(until_s=1e6)
    with pytest.raises(ConfigurationError, match=r"strategy\.name = oracle: a bound without packets"):
        plan_of(strategy__name="oracle").setup()
    with pytest.raises(ConfigurationError, match="--epoch = 256: allowed: 0 to 255"):
        replace(plan_of(), epoch=256).setup()


DIVE_SEED, DIVE_UNTIL_S, DIVE_SETTLE_S, AWAY_S = 5, 900.0, 300.0, 30.0
BEGAN = Began(1_000_000.0, 1.0)
LOSING = Mishaps(0.3, 0.1)


def dive_plan_of(vehicle: str, seed: int = DIVE_SEED) -> NodePlan:
    return NodePlan.of(load("mapping-rendezvous"), vehicle, seed, DIVE_UNTIL_S, DIVE_SETTLE_S)


class Dive:
    """Two vehicles; the process of the second is ended at times, and begins again a while after."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.path = folder / "AUV00.jsonl"
        self._monkeypatch = monkeypatch
        self._folder = folder
        plans = [dive_plan_of("ASV00"), dive_plan_of("AUV00")]
        own = [alone(plan) for plan in plans]
        self._ether = Ether(own[0].setup.modem.packet_s)
        self._drivers = [self._ether.driver() for _ in own]
        self.ship = VehicleNode(own[0], self._drivers[0], AT_ONCE, None, LOSING)
        self.node = VehicleNode(own[1], self._drivers[1], AT_ONCE, NodeLog(folder, plans[1], BEGAN), LOSING)

    def go(self, until_s: float) -> None:
        """Let both go on until then."""
        step_until(until_s, self.ship, self.node)

    def end_and_begin(self, at_s: float) -> set[str]:
        """End the process of the second, and begin it again; returns what it had held."""
        self.go(at_s)
        held = self.held()
        self._drivers[1].close()
        away = self.node
        step_until(at_s + AWAY_S, self.ship)
        self._monkeypatch.setattr(logs.time, "time", lambda: BEGAN.unix_s + at_s + AWAY_S)
        own, log, _ = gone_on(self.path, dive_plan_of("AUV00"))
        assert own.solo.vehicle is not away.solo.vehicle
        self._drivers[1] = self._ether.driver()
        self.node = VehicleNode(own, self._drivers[1], AT_ONCE, log, LOSING)
        return held

    def held(self) -> set[str]:
        """What it holds, by identity and content."""
        return {f"{guid} {block}" for guid, block in self.node.solo.vehicle.beliefs.model.items()}

    def ended(self) -> tuple[str, str]:
        """States of both at the end."""
        self.go(DIVE_UNTIL_S + DIVE_SETTLE_S)
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
    log = read_log(dive.path)
    assert [round(until_s - AWAY_S) for _, until_s in log.pauses] == [*times_s]
    played = play(log)
    assert (played.difference, played.packets_sent > 50) == ("", True)


def test_a_log_that_cannot_be_gone_on_with_is_named(dive: Dive, tmp_path: Path) -> None:
    dive.go(100.0)
    with pytest.raises(ConfigurationError, match="of another scenario, seed or end"):
        gone_on(dive.path, dive_plan_of("AUV00", seed=DIVE_SEED + 1))
    lines = dive.path.read_text(encoding="utf-8").splitlines()
    sent = next(place for place, line in enumerate(lines) if '"sent"' in line)
    spoilt = tmp_path / "spoilt.jsonl"
    spoilt.write_text(
        "\n".join([*lines[:sent], lines[sent].replace('"data": "', '"data": "00'), *lines[sent + 1 :], ""]),
        encoding="utf-8",
    )
    with pytest.raises(ConfigurationError, match="not repeated by this version: packet 1"):
        gone_on(spoilt, dive_plan_of("AUV00"))
    spoilt.write_text("\n".join([lines[0].replace('"began": {', '"other": {'), *lines[1:], ""]), encoding="utf-8")
    with pytest.raises(ConfigurationError, match="without a start"):
        gone_on(spoilt, dive_plan_of("AUV00"))
    dive.ended()
    with pytest.raises(ConfigurationError, match="complete"):
        gone_on(dive.path, dive_plan_of("AUV00"))
