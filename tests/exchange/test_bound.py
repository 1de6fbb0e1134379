"""The bound of the policy study: no policy is sooner in any trial with one item, nor in the mean with many."""

import numpy as np
import pytest
from test_sliced import plan_of

from exchange.ack import Acknowledgement
from exchange.errors import ConfigurationError
from exchange.policies import ACK, POLICIES, AckPolicy
from exchange.study import compiler, trial
from exchange.study.bound import BOUND
from exchange.study.parts import TrialBatch, memory_of, play
from exchange.study.study import ExchangeStudy, LoadKind, StudyLoad
from exchange.study.trial import Ints


def outcomes_of(policy: AckPolicy, study: ExchangeStudy) -> Ints:
    """The outcomes of all trials, as the Python that the study compiles plays them."""
    plan = plan_of(study, policy)
    loop, part = compiler.as_python(policy.acknowledgement), TrialBatch(0, 0, study.trials)
    return play(plan, policy, loop, part, memory_of(plan, loop, part))


def times(outcomes: Ints) -> Ints:
    return outcomes[:, : trial.N_STAGES, trial.SUM]


@pytest.mark.parametrize("per", [0.2, 0.8])
def test_no_policy_is_sooner_with_one_item_in_any_trial(per: float):
    study = ExchangeStudy(nodes=4, per=(per,), trials=20, carrier_evidence=True, seed=4)
    least = times(outcomes_of(BOUND, study))
    for policy in POLICIES.values():
        later = times(outcomes_of(policy, study))
        n_stages = trial.SENDERS_ACKED + 1 if policy.repeat else trial.SENDERS_ACKED  # of fewer senders it asks less
        assert (least <= later)[:, :n_stages].all()
    assert (times(outcomes_of(POLICIES["ack-repeat"], study)) > least).any()


def test_without_loss_it_takes_as_many_packets_as_the_items_fill():
    """Five items of 60 bits at each of three nodes, four to a packet: each node needs two packets of each other."""
    load = StudyLoad(LoadKind.BATCH, 5)
    study = ExchangeStudy(nodes=3, per=(0.0,), trials=1, load=load, capacity_bits=250)
    outcomes = outcomes_of(BOUND, study)[0]
    assert outcomes[trial.DELIVERED, trial.SUM] == 6
    assert outcomes[trial.SOURCE_ACKED, trial.SUM] == 8  # the last to speak has to hear both others once more
    assert outcomes[trial.SENDERS_ACKED, trial.SUM] == 8


def test_machine_code_and_python_come_to_the_same():
    for load, capacity in ((StudyLoad(), None), (StudyLoad(LoadKind.BATCH, 25), 200)):
        study = ExchangeStudy(nodes=3, per=(0.5,), trials=6, load=load, capacity_bits=capacity, policies=("ack",))
        python = outcomes_of(BOUND, study)
        plan = plan_of(study, BOUND)
        loop = compiler.slot_loops(plan.forms, lambda text: None)[BOUND.acknowledgement]
        part = TrialBatch(0, 0, study.trials)
        assert np.array_equal(play(plan, BOUND, loop, part, memory_of(plan, loop, part)), python)


def test_its_name_is_taken():
    own = AckPolicy(Acknowledgement("bound", "mine", ACK.carries, ACK.compose, ACK.learn), repeat=False)
    with pytest.raises(ConfigurationError, match="two policies have the name bound"):
        ExchangeStudy(policies=(own,))
