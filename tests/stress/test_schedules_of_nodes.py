"""Vehicles as separate processes: the same invariants, under conditions that no simulated fleet meets."""

from dataclasses import replace

import pytest
from hypothesis import assume, given, note, settings
from planted import believe_what_anybody_may_write
from stress.nodes import judge_nodes
from stress.schedules import CAMPAIGN, OF_NODES, Schedule, StressFault, node_schedules, node_settings
from test_trials import CASES, fault

from missions.errors import ConfigurationError


def check(schedule: Schedule) -> None:
    note(schedule.as_toml())
    try:
        outcome = judge_nodes(schedule)
    except ConfigurationError:  # no setting for vehicles by themselves
        assume(False)
    assert outcome.broken is None, outcome.broken


@pytest.mark.slow
@settings(max_examples=20, derandomize=True, **CAMPAIGN)
@given(node_schedules())
def test_no_schedule_of_nodes_violates_an_invariant(schedule: Schedule) -> None:
    check(schedule)


@pytest.mark.slow
@pytest.mark.thorough
@settings(max_examples=5000, **CAMPAIGN)
@given(node_schedules() | node_schedules(wide=True))
def test_no_further_schedule_of_nodes_violates_an_invariant(schedule: Schedule) -> None:
    check(schedule)


@pytest.mark.parametrize(("what", "per"), [
    (StressFault("noise", 1.0, until_s=30.0, share=0.25, packets=1), 0.0),
    (StressFault("noise", 5.0, until_s=100.0, packets=4), 0.2),
    (StressFault("foreign", 1.0, until_s=100.0), 0.0),
])  # fmt: skip
def test_packets_of_outsiders_change_nothing_under_a_key(what: StressFault, per: float) -> None:
    """Neither few random packets in the beginning nor many for long, nor another fleet: all come to know the same."""
    quiet = Schedule(3, 130.0, 600.0, node_settings("ack", per, "key"))
    alone, beside = judge_nodes(quiet), judge_nodes(replace(quiet, fault=(what,)))
    assert beside.happened == {what.kind}
    assert alone.completed
    assert beside.completed
    assert beside.broken is None
    if not per:  # where packets are lost, an introduction more may come before all are known to each other
        assert (beside.digest, beside.end_s) == (alone.digest, alone.end_s)


@pytest.mark.slow
def test_trust_in_unauthenticated_bytes_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    believe_what_anybody_may_write(monkeypatch)
    noise = StressFault("noise", 1.0, until_s=60.0, packets=40)
    outcome = judge_nodes(Schedule(1, 80.0, 600.0, node_settings("mps-ack-repeat", 0.0, "key"), (noise,)))
    assert outcome.broken is not None


def test_every_fault_kind_of_nodes_occurs_and_violates_nothing() -> None:
    own = fault("killed", "AUV00", at_s=100.0, until_s=150.0), fault("noise", ""), fault("foreign", "")
    found = [one for case in CASES.values() for one in case if one.kind in OF_NODES]
    outcome = judge_nodes(Schedule(1, 210.0, 600.0, node_settings("ack", 0.0, "key"), (*found, *own)))
    assert outcome.broken is None, outcome.broken
    assert outcome.happened == set(OF_NODES)


def test_a_resumed_node_lacks_only_observations_after_its_last_log_line() -> None:
    killed = fault("killed", "AUV00", at_s=61.4, until_s=78.0)
    outcome = judge_nodes(Schedule(0, 78.0, 600.0, node_settings("ack", 0.0, "key"), (killed,)))
    assert outcome.broken is None, outcome.broken
    assert "killed" in outcome.happened


def test_a_belief_about_an_item_that_was_decoded_without_need_is_true() -> None:
    """It came as a coded repair, and was set aside."""
    needs = "communication.needs_follow='groups'", "group.Operational.information='held by head'"
    given = (*node_settings("adaptive", 0.4, "checksum"), *needs, "communication.needs.playsRole=1")
    outcome = judge_nodes(Schedule(1, 41.2, 600.0, given, (StressFault("deaf", 1.0, "AUV01"),)))
    assert outcome.broken is None, outcome.broken
