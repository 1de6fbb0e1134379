"""The slot loop of the study: compiled and not, alone and among others, against formulas, and against the bound."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from exchange.channel.loss import link_draw, link_uniform, slot_key, trial_key, uniform
from exchange.errors import ConfigurationError
from exchange.policy.acknowledgement import Acknowledgement
from exchange.policy.policies import ACK, M_ACK, MPS_ACK, PAPER_POLICIES, POLICIES, STATING, AckPolicy, policy_fault
from exchange.study import compiler, trial, trials
from exchange.study.parameters import BOUND
from exchange.study.parts import REMEMBERED_WORDS, TrialBatch, TrialPlan, play
from exchange.study.study import ExchangeStudy, LoadKind, StudyLoad, load_of, p_loss_matrices
from exchange.study.trial import COUNT, NEVER, SUM, Floats, Ints, Load

SEEDS = st.integers(0, (1 << 62) - 1)
SINGLE = Load(1, 1, 0.0, 60, NEVER, 0, 0, 100_000)
BATCH = Load(4, 3, 0.0, 60, 300, 0, 0, 5000, 1.0, 3, 70)
POISSON = Load(4, 8, 0.08, 60, 200, 25, 125, 5000, math.exp(-0.08), 6, 70)


def p_loss(n_nodes: int, per: float) -> Floats:
    matrix = np.full((n_nodes, n_nodes), per)
    np.fill_diagonal(matrix, 1.0)
    return matrix


def outcomes(
    policy: AckPolicy, load: Load, per: float, n_trials: int, n_nodes: int = 4, evidence: bool = False, first: int = 0,
    is_compiled: bool = True,
) -> Ints:  # fmt: skip
    plan = TrialPlan(n_nodes, (policy,), evidence, (p_loss(n_nodes, per),), load, 5, n_trials)
    kind, part = policy.acknowledgement, TrialBatch(0, first, n_trials)
    loop = compiler.compiled(kind, print) if is_compiled else compiler.as_python(kind)
    return play(plan, policy, loop, part, np.zeros((REMEMBERED_WORDS, n_trials), np.int64))


@pytest.mark.slow
@pytest.mark.parametrize("name", POLICIES)
def test_compiled_is_interpreted(name: str) -> None:
    policy = POLICIES[name]
    for load in (*([] if name in STATING else [SINGLE]), BATCH, POISSON):
        expected = outcomes(policy, load, 0.5, 2, evidence=name in STATING, is_compiled=False)
        assert np.array_equal(outcomes(policy, load, 0.5, 2, evidence=name in STATING), expected)


@pytest.mark.parametrize("load", [SINGLE, BATCH, POISSON], ids=["single", "batch", "poisson"])
def test_a_trial_alone_is_the_trial_among_others(load: Load) -> None:
    """Lanes do not mix, and a lane that is given to another trial forgets the one before."""
    for policy in (PAPER_POLICIES["ack"], PAPER_POLICIES["mps-ack-repeat"], BOUND):
        together = outcomes(policy, load, 0.5, 150)
        for number in (0, 63, 64, 70, 149):
            assert np.array_equal(outcomes(policy, load, 0.5, 1, first=number)[0], together[number])


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
    found = outcomes(PAPER_POLICIES[name], SINGLE._replace(max_slots=max_slots), per, n_trials, n_nodes)
    assert not found[:, trial.FALSE_BELIEFS].any()
    assert found[:, trial.SLOTS, SUM].max() <= max_slots
    ended = found[:, trial.SENDERS_ACKED, COUNT] == 1
    slots = found[ended, : trial.N_STAGES, SUM]
    assert (slots[:, trial.DELIVERED] <= slots[:, trial.SOURCE_ACKED]).all()
    assert (slots[:, trial.SOURCE_ACKED] <= slots[:, trial.SENDERS_ACKED]).all()
    assert np.array_equal(found[ended, trial.SLOTS, SUM], slots[:, trial.SENDERS_ACKED])


def test_fleets_that_fill_the_words_of_draws() -> None:
    """31 nodes: receivers of two slots go into a word; 32, 63 and 64: of one, and of 64 its sign counts."""
    for n_nodes in (31, 32, 63, 64):
        found = outcomes(PAPER_POLICIES["ack-repeat"], SINGLE, 0.1, 3, n_nodes)
        assert (found[:, : trial.N_STAGES, COUNT] == 1).all()
        for number in range(3):
            heard = {0}
            for slot in range(int(found[number, trial.DELIVERED, SUM])):
                sender, key = slot % n_nodes, slot_key(trial_key(5, number), slot)
                if sender in heard:
                    heard |= {node for node in range(n_nodes) if link_uniform(key, sender, node) >= 0.1} - {sender}
                assert (len(heard) == n_nodes) == (slot + 1 == found[number, trial.DELIVERED, SUM])


def test_packets_keep_to_their_capacity() -> None:
    """Header 3 bits, items of 60: a packet of 183 bits carries three of them, one of 182 bits two."""
    for capacity_bits, most in ((183, 3), (182, 2), (63, 1)):
        load = BATCH._replace(capacity_bits=capacity_bits, max_slots=4)
        found = outcomes(PAPER_POLICIES["ack"], load, 0.0, 1)
        assert found[0, trial.DELIVERED, COUNT] == (most == 3)


@given(st.lists(st.tuples(st.integers(0, 20), st.booleans()), min_size=1, max_size=30), st.integers(0, 12))
def test_the_choice_is_the_greedy_one(items: list[tuple[int, bool]], room: int) -> None:
    """Sorted by decreasing weight, then position."""
    weights, waits = (np.array(column, np.int64) for column in zip(*items, strict=True))
    grown = weights + waits
    expected = sorted(np.flatnonzero(waits), key=lambda position: (-grown[position], position))[:room]
    trials.choose(weights, waits, 0, room)
    assert set(np.flatnonzero(waits)) == set(expected)
    assert weights.tolist() == [0 if position in expected else weight for position, weight in enumerate(grown)]


def test_poisson_load_is_conserved() -> None:
    """Little's law over the window: items in flight = rate x time to acknowledgement; what goes in comes out."""
    load = POISSON._replace(n_sources=5, columns_per_source=40, window_start=500, window_end=4500, max_slots=100_000)
    found = outcomes(PAPER_POLICIES["mps-ack"], load, 0.3, 20, 5)
    sums, counts = found[:, :, SUM].sum(axis=0), found[:, :, COUNT].sum(axis=0)
    offered = sums[trial.OFFERED] / counts[trial.OFFERED]
    assert offered == pytest.approx(5 * 0.08, rel=4 / math.sqrt(sums[trial.OFFERED]))
    assert sums[trial.REFUSED] == 0
    assert sums[trial.GOODPUT] / counts[trial.GOODPUT] == pytest.approx(offered, rel=0.01)
    latency = sums[trial.SOURCE_ACKED] / counts[trial.SOURCE_ACKED]
    assert sums[trial.IN_FLIGHT] / counts[trial.IN_FLIGHT] == pytest.approx(offered * latency, rel=0.01)


# Draws ----------------------------------------------------------------------------------------------------------------


def test_who_hears_is_drawn_for_sender_and_receiver() -> None:
    thresholds = trials.thresholds_of(p_loss(5, 0.4))
    for slot in range(100):
        heard = trials.draw_word(trial_key(5, 3), slot - slot % 5, slot % 5, 1, 5, thresholds)
        drawn = [j for j in range(5) if j != slot % 5 and uniform(5, 3, slot, slot % 5, j) >= 0.4]
        assert heard == sum(1 << j for j in drawn)


@given(SEEDS, st.integers(0, 1 << 40), st.integers(0, 63), st.integers(0, 63), st.floats(0.0, 1.0))
def test_a_threshold_divides_draws_where_the_probability_does(seed, slot, sender, receiver, p_loss):
    key = slot_key(trial_key(seed, 0), slot)
    draw, number = link_draw(key, sender, receiver), link_uniform(key, sender, receiver)
    assert draw * 2.0**-53 == number
    for p in (p_loss, number, np.nextafter(number, 0.0), np.nextafter(number, 1.0)):
        assert (draw >= trials.threshold(float(p))) == (number >= p)


# Machine code ---------------------------------------------------------------------------------------------------------


def test_the_machine_code_is_kept_by_sources_and_versions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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


def of_study(policy: AckPolicy, study: ExchangeStudy) -> Ints:
    matrix = p_loss_matrices(study)[0]
    plan = TrialPlan(study.nodes, (policy,), True, (matrix,), load_of(study), study.seed, study.trials)
    loop: Callable[..., Any] = compiler.as_python(policy.acknowledgement)
    memory = np.zeros((REMEMBERED_WORDS, study.trials), np.int64)
    return play(plan, policy, loop, TrialBatch(0, 0, study.trials), memory)


def times(found: Ints) -> Ints:
    return found[:, : trial.N_STAGES, SUM]


@pytest.mark.parametrize("per", [0.2, 0.8])
def test_no_policy_is_sooner_than_the_bound_with_one_item_in_any_trial(per: float):
    study = ExchangeStudy(nodes=4, per=(per,), trials=20, carrier_evidence=True, seed=4)
    least = times(of_study(BOUND, study))
    for policy in POLICIES.values():
        later = times(of_study(policy, study))
        n_stages = trial.SENDERS_ACKED + 1 if policy.repeat else trial.SENDERS_ACKED  # of fewer senders it asks less
        assert (least <= later)[:, :n_stages].all()
    assert (times(of_study(POLICIES["ack-repeat"], study)) > least).any()


def test_without_loss_the_bound_takes_as_many_packets_as_the_items_fill():
    """Five items of 60 bits at each of three nodes, four to a packet: each node needs two packets of each other."""
    load = StudyLoad(LoadKind.BATCH, 5)
    found = of_study(BOUND, ExchangeStudy(nodes=3, per=(0.0,), trials=1, load=load, capacity_bits=250))[0]
    assert found[trial.DELIVERED, SUM] == 6
    assert found[trial.SOURCE_ACKED, SUM] == 8  # the last to speak has to hear both others once more
    assert found[trial.SENDERS_ACKED, SUM] == 8


def test_the_name_of_the_bound_is_taken():
    own = AckPolicy(Acknowledgement("bound", "mine", ACK.carries, ACK.header), repeat=False)
    with pytest.raises(ConfigurationError, match="two policies have the name bound"):
        ExchangeStudy(policies=(own,))


def test_what_is_coded_has_to_be_stated() -> None:
    kind = ACK._replace(name="mine", codes=True)
    assert policy_fault(AckPolicy(kind, True)) == (
        "codes is true and states is not: symbols are over what statements say to be held"
    )
    assert policy_fault(AckPolicy(kind._replace(states=True), True)) is None
    assert policy_fault(AckPolicy(kind._replace(states="yes"), True)) == "states must be true or false, not 'yes'"
