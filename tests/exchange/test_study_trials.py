"""The slot loop of the study: compiled and not, single and batched, against formulas and the bound."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from exchange.channel.loss import link_uniform, slot_key, trial_key
from exchange.errors import ConfigurationError
from exchange.policy.acknowledgement import Acknowledgement
from exchange.policy.policies import ACK, M_ACK, MPS_ACK, PAPER_POLICIES, POLICIES, STATING, AckPolicy, policy_fault
from exchange.study import compiler, lanes
from exchange.study.lanes import COUNT, SUM, Ints
from exchange.study.parameters import BOUND, ExchangeStudy, LoadKind, StudyLoad
from exchange.study.study import REMEMBERED_WORDS, case_of, play

SEEDS = st.integers(0, (1 << 62) - 1)
SINGLE = ExchangeStudy(nodes=4, per=(0.5,), policies=("ack",), seed=5, max_slots=100_000)
BATCH = replace(SINGLE, load=StudyLoad(LoadKind.BATCH, 3), capacity_bits=300, max_slots=5000)
POISSON = replace(
    SINGLE, load=StudyLoad(LoadKind.POISSON, rate=0.08), capacity_bits=200, queue_items=8, warmup_frames=6,
    window_frames=25, max_slots=5000,
)  # fmt: skip


def outcomes(policy: AckPolicy, study: ExchangeStudy, first: int = 0, is_compiled: bool = True) -> Ints:
    kind, memory = policy.acknowledgement, np.zeros((REMEMBERED_WORDS, study.trials), np.int64)
    loop = compiler.compiled(kind, print) if is_compiled else compiler.as_python(kind)
    return play(loop, kind, case_of(study, policy, study.per[0])._replace(first_trial=first), memory)


@pytest.mark.slow
@pytest.mark.parametrize("name", POLICIES)
def test_compiled_results_equal_interpreted_results(name: str) -> None:
    policy = POLICIES[name]
    for load in (*([] if name in STATING else [SINGLE]), BATCH, POISSON):
        study = replace(load, trials=2, carrier_evidence=name in STATING)
        assert np.array_equal(outcomes(policy, study), outcomes(policy, study, is_compiled=False))


@pytest.mark.parametrize("load", [SINGLE, BATCH, POISSON], ids=["single", "batch", "poisson"])
def test_a_trial_gives_the_same_alone_and_in_a_batch(load: ExchangeStudy) -> None:
    """Lanes do not mix, and a lane that is given to another trial forgets the one before."""
    for policy in (PAPER_POLICIES["ack"], PAPER_POLICIES["mps-ack-repeat"], BOUND):
        together = outcomes(policy, replace(load, trials=150))
        for number in (0, 63, 64, 70, 149):
            assert np.array_equal(outcomes(policy, replace(load, trials=1), first=number)[0], together[number])


@given(
    n_nodes=st.integers(2, 12),
    per=st.floats(0.0, 0.85),
    n_trials=st.integers(1, 100),
    max_slots=st.one_of(st.integers(1, 60), st.just(200_000)),
    name=st.sampled_from(list(PAPER_POLICIES)),
)
@example(5, 0.7, 100, 5, "mps-ack-repeat")
@settings(max_examples=25, deadline=None)
def test_stages_come_in_order_and_no_belief_is_false(n_nodes, per, n_trials, max_slots, name):
    """Also in trials that come to their bound, in the middle of a frame or at its end."""
    study = replace(SINGLE, nodes=n_nodes, per=(per,), trials=n_trials, max_slots=max_slots)
    found = outcomes(PAPER_POLICIES[name], study)
    assert not found[:, lanes.FALSE_BELIEFS].any()
    assert found[:, lanes.SLOTS, SUM].max() <= max_slots
    ended = found[:, lanes.SENDERS_ACKED, COUNT] == 1
    slots = found[ended, : lanes.N_STAGES, SUM]
    assert (slots[:, lanes.DELIVERED] <= slots[:, lanes.SOURCE_ACKED]).all()
    assert (slots[:, lanes.SOURCE_ACKED] <= slots[:, lanes.SENDERS_ACKED]).all()
    assert np.array_equal(found[ended, lanes.SLOTS, SUM], slots[:, lanes.SENDERS_ACKED])


def test_receptions_are_right_for_fleets_that_fill_a_machine_word() -> None:
    """31 nodes: receivers of two slots go into a word; 32, 63 and 64: of one, and of 64 its sign counts."""
    for n_nodes in (31, 32, 63, 64):
        found = outcomes(PAPER_POLICIES["ack-repeat"], replace(SINGLE, nodes=n_nodes, per=(0.1,), trials=3))
        assert (found[:, : lanes.N_STAGES, COUNT] == 1).all()
        for number in range(3):
            heard = {0}
            for slot in range(int(found[number, lanes.DELIVERED, SUM])):
                sender, key = slot % n_nodes, slot_key(trial_key(5, number), slot)
                if sender in heard:
                    heard |= {node for node in range(n_nodes) if link_uniform(key, sender, node) >= 0.1} - {sender}
                assert (len(heard) == n_nodes) == (slot + 1 == found[number, lanes.DELIVERED, SUM])


def test_packets_keep_to_their_capacity() -> None:
    """Header 3 bits, items of 60: a packet of 183 bits carries three of them, one of 182 bits two."""
    for capacity_bits, most in ((183, 3), (182, 2), (63, 1)):
        study = replace(BATCH, per=(0.0,), trials=1, capacity_bits=capacity_bits, max_slots=4)
        found = outcomes(PAPER_POLICIES["ack"], study)
        assert found[0, lanes.DELIVERED, COUNT] == (most == 3)


def test_poisson_load_is_conserved() -> None:
    """Little's law over the window: items in flight = rate x time to acknowledgement; what goes in comes out."""
    study = replace(
        POISSON, nodes=5, per=(0.3,), trials=20, queue_items=40, warmup_frames=100, window_frames=800, max_slots=100_000
    )
    found = outcomes(PAPER_POLICIES["mps-ack"], study)
    sums, counts = found[:, :, SUM].sum(axis=0), found[:, :, COUNT].sum(axis=0)
    offered = sums[lanes.OFFERED] / counts[lanes.OFFERED]
    assert offered == pytest.approx(5 * 0.08, rel=4 / math.sqrt(sums[lanes.OFFERED]))
    assert sums[lanes.REFUSED] == 0
    assert sums[lanes.GOODPUT] / counts[lanes.GOODPUT] == pytest.approx(offered, rel=0.01)
    latency = sums[lanes.SOURCE_ACKED] / counts[lanes.SOURCE_ACKED]
    assert sums[lanes.IN_FLIGHT] / counts[lanes.IN_FLIGHT] == pytest.approx(offered * latency, rel=0.01)


# Machine code ---------------------------------------------------------------------------------------------------------


def test_machine_code_is_cached_by_sources_and_versions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    first = compiler.cache_folder(ACK, "1")
    assert first.is_dir()
    assert compiler.cache_folder(ACK, "1") == first
    assert compiler.cache_folder(ACK, "2") != first
    others = [ACK._replace(states=True), M_ACK, MPS_ACK]
    assert len({first, *(compiler.cache_folder(kind, "1") for kind in others)}) == 4
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file"))
    assert compiler.cache_folder(ACK, "1") is None


# The bound ------------------------------------------------------------------------------------------------------------


def times(found: Ints) -> Ints:
    return found[:, : lanes.N_STAGES, SUM]


@pytest.mark.parametrize("per", [0.2, 0.8])
def test_no_policy_is_sooner_than_the_bound_with_one_item_in_any_trial(per: float):
    study = ExchangeStudy(nodes=4, per=(per,), trials=20, carrier_evidence=True, seed=4)
    least = times(outcomes(BOUND, study, is_compiled=False))
    for policy in POLICIES.values():
        later = times(outcomes(policy, study, is_compiled=False))
        n_stages = lanes.SENDERS_ACKED + 1 if policy.repeat else lanes.SENDERS_ACKED  # of fewer senders it asks less
        assert (least <= later)[:, :n_stages].all()
    assert (times(outcomes(POLICIES["ack-repeat"], study, is_compiled=False)) > least).any()


def test_without_loss_the_bound_takes_as_many_packets_as_the_items_fill():
    """Five items of 60 bits at each of three nodes, four to a packet: each node needs two packets of each other."""
    load = StudyLoad(LoadKind.BATCH, 5)
    found = outcomes(
        BOUND, ExchangeStudy(nodes=3, per=(0.0,), trials=1, load=load, capacity_bits=250), is_compiled=False
    )[0]
    assert found[lanes.DELIVERED, SUM] == 6
    assert found[lanes.SOURCE_ACKED, SUM] == 8  # the last to speak has to hear both others once more
    assert found[lanes.SENDERS_ACKED, SUM] == 8


def test_no_policy_may_take_the_name_of_the_bound():
    own = AckPolicy(Acknowledgement("bound", "mine", ACK.carries, ACK.header), repeat=False)
    with pytest.raises(ConfigurationError, match="two policies have the name bound"):
        ExchangeStudy(policies=(own,))


def test_coding_requires_received_set_reports() -> None:
    kind = ACK._replace(name="mine", codes=True)
    assert policy_fault(AckPolicy(kind, True)) == (
        "codes = true needs states = true: coded symbols combine items of reported received sets"
    )
    assert policy_fault(AckPolicy(kind._replace(states=True), True)) is None
    assert policy_fault(AckPolicy(kind._replace(states="yes"), True)) == "states must be true or false, not 'yes'"


def test_acknowledgements_kept_longer_are_known_no_later_in_any_trial_and_sooner_in_some() -> None:
    study = ExchangeStudy(nodes=5, per=(0.8,), trials=30, seed=4)
    cleared, kept = (times(outcomes(POLICIES[name], study, is_compiled=False)) for name in ("mps-ack", "lasting"))
    assert (kept <= cleared).all()
    assert (kept < cleared)[:, lanes.SOURCE_ACKED].any()
    kind = ACK._replace(name="mine", lasts=True)
    assert policy_fault(AckPolicy(kind, True)) == (
        "lasts = true needs relays = true: it stores acknowledgements that others report"
    )
