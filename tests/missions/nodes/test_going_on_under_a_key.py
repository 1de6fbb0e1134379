"""A node that goes on from its log introduces itself by another salt: two that go on from one copied log share none."""

from pathlib import Path

from missions.nodes import LoneVehicle, NodePlan, alone
from missions.nodes.logs import LineKind, LogEntry, Logged, back
from missions.scenarios import load
from remoras.solo import Sent


def said(sent: list[Sent]) -> list[LogEntry]:
    return [LogEntry(LineKind.SENT, one.time_s, one.packet.data) for one in sent]


def gone_on(log: Logged, now_s: float) -> tuple[LoneVehicle, Logged]:
    """Back at a time, and half a minute later: the log repeats up to then, and its next packet tells the new salt."""
    own, difference = back(log, now_s)
    assert difference == ""
    entries = said(own.solo.advance(now_s + 30.0))
    assert own.salt in entries[0].data
    return own, Logged(log.plan, (*log.entries, LogEntry(LineKind.BACK, now_s, own.salt), *entries), None)


def test_two_that_go_on_from_one_copied_log_share_no_salt_and_each_may_go_on_again(tmp_path: Path) -> None:
    key = tmp_path / "fleet.key"
    key.write_text("00112233445566778899aabbccddeeff")
    key.chmod(0o600)
    settings = f"communication.key_file='{key}'", "scenario.duration_s=300"
    plan = NodePlan.of(load("mapping-rendezvous", [("--set", one) for one in settings]), "AUV00", 1, 200.0, 50.0)
    own = alone(plan)
    log = Logged(plan, (LogEntry(LineKind.SALT, 0.0, own.salt), *said(own.solo.advance(40.0))), None)
    salts = [own.salt]
    for _ in range(2):
        first, longer = gone_on(log, 45.0)
        second, _ = gone_on(longer, 90.0)
        salts += first.salt, second.salt
    assert len(set(salts)) == 5
