"""64 trials to a word against one trial at a time: the same numbers, whatever is asked."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from exchange.acoustics.loss import link_draw, link_uniform, slot_key, trial_key
from exchange.policies import ACK, M_ACK, MPS_ACK, PAPER_POLICIES, AckPolicy
from exchange.study import compiler, montecarlo, sliced
from exchange.study.compiler import Form, SlotLoop
from exchange.study.parts import TrialBatch, TrialPlan, memory_of, play
from exchange.study.study import ExchangeStudy, LoadKind, StudyLoad, load_of, p_loss_matrices, workload_named
from exchange.study.trial import Ints

SEEDS = st.integers(0, (1 << 62) - 1)


def plan_of(study: ExchangeStudy, *policies: AckPolicy) -> TrialPlan:
    chosen, load = policies or study.chosen, load_of(study)
    return TrialPlan(
        study.nodes, chosen, study.carrier_evidence, p_loss_matrices(study), load, study.seed, study.trials
    )


def both(study: ExchangeStudy, first_trial: int = 0) -> list[tuple[Ints, Ints]]:
    """The outcomes of each policy, sliced and one trial at a time; the losses are remembered for the next policy."""
    plan, part = plan_of(study), TrialBatch(0, first_trial, study.trials)
    pairs = []
    received: dict[bool, Ints] = {}
    for policy in plan.policies:
        kind = policy.acknowledgement
        assert plan.forms[kind] is Form.SLICED
        outcomes = []
        for form in (Form.SLICED, Form.NARROW):
            loop = SlotLoop(compiler.compiled(kind, form, print), form is Form.SLICED)
            memory = received.setdefault(loop.is_sliced, memory_of(plan, loop, part))
            outcomes.append(play(plan, policy, loop, part, memory))
        pairs.append((outcomes[0], outcomes[1]))
    return pairs


def assert_equal(study: ExchangeStudy, first_trial: int = 0) -> None:
    for policy, (of_words, of_trials) in zip(study.chosen, both(study, first_trial), strict=True):
        different = np.argwhere(of_words != of_trials)
        assert not len(different), f"{policy.name}: (trial, quantity, number) {different[:3].tolist()} of {study}"


def test_fleets_that_fill_the_words_of_draws() -> None:
    """31 nodes: receivers of two slots go into a word; 32, 63 and 64: of one, and of 64 its sign counts."""
    for n_nodes in (31, 32, 63, 64):
        assert_equal(ExchangeStudy(n_nodes, (0.1,), trials=3, policies=("ack-repeat", "mps-ack-repeat")))


@pytest.mark.slow
@given(
    n_nodes=st.integers(2, 12),
    per=st.floats(0.0, 0.85),
    trials=st.integers(1, 200),
    seed=SEEDS,
    max_slots=st.one_of(st.integers(1, 60), st.just(200_000)),
    first_trial=st.integers(0, 10_000),
    evidence=st.booleans(),
    names=st.lists(st.sampled_from(list(PAPER_POLICIES)), min_size=1, max_size=3, unique=True),
)
@example(5, 0.0, 64, (1 << 62) - 1, 1, 0, False, ["ack"])
@example(5, 0.7, 130, 1, 5, 0, False, ["mps-ack-repeat", "ack"])
@example(2, 0.85, 200, 0, 200_000, 9_999, True, ["ack-repeat"])
@settings(max_examples=60, deadline=None)
def test_whatever_is_asked(n_nodes, per, trials, seed, max_slots, first_trial, evidence, names):
    """Also trials that come to their bound, in the middle of a frame or at its end."""
    study = ExchangeStudy(
        n_nodes, (per,), None, tuple(names), trials, carrier_evidence=evidence, seed=seed, max_slots=max_slots
    )
    assert_equal(study, first_trial)


def test_only_a_single_item_that_fits_is_sliced() -> None:
    """Header of ack with five nodes 4 bits, of a matrix 20; items of 60."""
    single = ExchangeStudy(capacity_bits=80)
    assert set(plan_of(single).forms.values()) == {Form.SLICED}
    no_room = plan_of(single)
    tight = TrialPlan(5, no_room.policies, False, no_room.matrices, no_room.load._replace(capacity_bits=79), 1, 1)
    assert tight.forms == {ACK: Form.SLICED, M_ACK: Form.NARROW, MPS_ACK: Form.NARROW}
    for load, form in ((StudyLoad(LoadKind.BATCH, 2), Form.NARROW), (workload_named("poisson:0.02"), Form.WIDE)):
        assert set(plan_of(replace(single, load=load)).forms.values()) == {form}
    batch_of_one = plan_of(replace(single, load=StudyLoad(LoadKind.BATCH)))
    assert set(batch_of_one.forms.values()) == {Form.NARROW}  # an item at every node
    own = AckPolicy(ACK._replace(name="own", bit_sliced=False), False)
    assert plan_of(replace(single, policies=(own,))).forms[own.acknowledgement] is Form.NARROW


# Draws ----------------------------------------------------------------------------------------------------------------


@given(SEEDS, st.integers(0, 1 << 40), st.integers(0, 63), st.integers(0, 63), st.floats(0.0, 1.0))
def test_a_threshold_divides_draws_where_the_probability_does(seed, slot, sender, receiver, p_loss):
    key = slot_key(trial_key(seed, 0), slot)
    draw, uniform = link_draw(key, sender, receiver), link_uniform(key, sender, receiver)
    assert draw * 2.0**-53 == uniform
    for p in (p_loss, uniform, np.nextafter(uniform, 0.0), np.nextafter(uniform, 1.0)):
        assert (draw >= sliced.threshold(float(p))) == (uniform >= p)


def test_an_interpreted_trial_is_the_oracle_of_both() -> None:
    study = ExchangeStudy(4, (0.4,), policies=("mps-ack-repeat",), trials=3)
    plan, part = plan_of(study), TrialBatch(0, 0, 3)
    (policy,) = plan.policies
    loop = SlotLoop(partial(montecarlo.run_trials, policy.acknowledgement), False)
    ((of_words, _),) = both(study)
    assert np.array_equal(of_words, play(plan, policy, loop, part, memory_of(plan, loop, part)))
