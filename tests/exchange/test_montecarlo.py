"""The compiled slot loop against the same loop uncompiled, against plain vehicles, and against formulas."""

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from exchange.ack import Acknowledgement
from exchange.acoustics.loss import trial_key, uniform
from exchange.policies import ACK, M_ACK, MPS_ACK, PAPER_POLICIES, AckPolicy
from exchange.study import compiler, montecarlo, trial
from exchange.study.compiler import Form
from exchange.study.trial import CENSORED, COUNT, N_QUANTITIES, NEVER, SUM, Floats, Ints, Load, PolicyRules

SEED = 5

Run = Callable[[Acknowledgement], Callable[..., None]]
"""Makes the slot loop of a kind."""

SINGLE = Load(1, 1, 0.0, 60, NEVER, 0, 0, 100_000)
BATCH = Load(5, 3, 0.0, 60, 300, 0, 0, 100_000)
LARGE_BATCH = Load(5, 30, 0.0, 60, 300, 0, 0, 100_000)
POISSON = Load(5, 8, 0.08, 60, 200, 25, 125, 100_000, math.exp(-0.08))
WIDE_POISSON = Load(5, 20, 0.08, 60, 200, 25, 125, 100_000, math.exp(-0.08))


def p_loss(n_nodes: int, per: float) -> Floats:
    matrix = np.full((n_nodes, n_nodes), per)
    np.fill_diagonal(matrix, 1.0)
    return matrix


def play(
    run: Run, policy: AckPolicy, load: Load, per: float, n_nodes: int = 5, n_trials: int = 3,
    carrier_evidence: bool = False, remembered_slots: int = 40,
) -> Ints:  # fmt: skip
    n_words = -(-load.n_sources * load.columns_per_source // trial.WORD_BITS)
    rules = PolicyRules(policy.repeat, carrier_evidence, n_nodes, n_words)
    outcomes = np.zeros((n_trials, N_QUANTITIES, 3), np.int64)
    received = np.full((n_trials, remembered_slots), montecarlo.NOT_DRAWN, np.int64)
    run(policy.acknowledgement)(rules, load, p_loss(n_nodes, per), SEED, 0, received, outcomes)
    return outcomes


@pytest.fixture(scope="module")
def narrow() -> Run:
    return lambda kind: compiler.compiled(kind, Form.NARROW, print)


@pytest.fixture(scope="module")
def wide() -> Run:
    return lambda kind: compiler.compiled(kind, Form.WIDE, print)


def uncompiled(kind: Acknowledgement) -> Callable[..., None]:
    return partial(montecarlo.run_trials, kind)


@pytest.mark.slow
@pytest.mark.parametrize("carrier_evidence", [False, True])
@pytest.mark.parametrize("name", PAPER_POLICIES)
def test_compiled_is_interpreted(name: str, carrier_evidence: bool, narrow: Run, wide: Run) -> None:
    policy = PAPER_POLICIES[name]
    for load in (SINGLE, BATCH, POISSON):
        expected = play(uncompiled, policy, load, 0.5, carrier_evidence=carrier_evidence, n_trials=1)
        assert np.array_equal(play(narrow, policy, load, 0.5, carrier_evidence=carrier_evidence, n_trials=1), expected)
        assert np.array_equal(play(wide, policy, load, 0.5, carrier_evidence=carrier_evidence, n_trials=1), expected)


@pytest.mark.parametrize("load", [LARGE_BATCH, WIDE_POISSON], ids=["batch", "poisson"])
def test_compiled_is_interpreted_with_items_in_several_words(load: Load, wide: Run) -> None:
    for policy in (PAPER_POLICIES["ack"], PAPER_POLICIES["mps-ack-repeat"]):
        expected = play(uncompiled, policy, load, 0.3, n_trials=1)
        assert np.array_equal(play(wide, policy, load, 0.3, n_trials=1), expected)


def test_who_hears_is_drawn_for_sender_and_receiver() -> None:
    for slot in range(100):
        heard = montecarlo.receivers(trial_key(SEED, 3), slot, 5, p_loss(5, 0.4))
        drawn = [j for j in range(5) if j != slot % 5 and uniform(SEED, 3, slot, slot % 5, j) >= 0.4]
        assert heard == sum(1 << j for j in drawn)


def test_a_trial_that_does_not_end_is_censored_and_not_counted(narrow: Run) -> None:
    outcomes = play(narrow, PAPER_POLICIES["ack"], SINGLE._replace(max_slots=20), 0.7, n_trials=40)
    for stage in range(trial.N_STAGES):
        ended = outcomes[:, stage, CENSORED] == 0
        assert (outcomes[ended, stage, COUNT] == 1).all()
        assert (outcomes[ended, stage, SUM] > 0).all()
        assert (outcomes[~ended, stage, :2] == 0).all()
    assert 0 < outcomes[:, trial.SOURCE_ACKED, CENSORED].sum() <= 40
    assert outcomes[:, trial.SLOTS, SUM].max() == 20


def test_packets_keep_to_their_capacity() -> None:
    """Header 4 bits, items of 60: a packet of 184 bits carries three of them, one of 183 bits two."""
    for capacity_bits, most in ((184, 3), (183, 2), (64, 1)):
        load = BATCH._replace(capacity_bits=capacity_bits)
        rules = PolicyRules(True, False, 5, 1)
        nodes = trial.new_nodes(rules, load, 1)
        montecarlo.header_sizes(ACK, 5, nodes.header_bits)
        trial.clear(nodes)
        for column in range(15):
            trial.add_item(rules, nodes, column // 3, column, 0)
        sent = [montecarlo.play_slot(ACK, rules, load, nodes, slot, 0b11111 & ~(1 << slot % 5)) for slot in range(5)]
        assert sent == [most] * 5


def test_poisson_load_is_conserved(wide: Run) -> None:
    """Little's law over the window: items in flight = rate x time to acknowledgement; what goes in comes out."""
    load = POISSON._replace(columns_per_source=40, window_start=500, window_end=4500)
    outcomes = play(wide, PAPER_POLICIES["mps-ack"], load, 0.3, n_trials=20)
    sums, counts = outcomes[:, :, SUM].sum(axis=0), outcomes[:, :, COUNT].sum(axis=0)
    offered = sums[trial.OFFERED] / counts[trial.OFFERED]
    assert offered == pytest.approx(5 * 0.08, rel=4 / math.sqrt(sums[trial.OFFERED]))
    assert sums[trial.REFUSED] == 0
    assert sums[trial.GOODPUT] / counts[trial.GOODPUT] == pytest.approx(offered, rel=0.01)
    latency = sums[trial.SOURCE_ACKED] / counts[trial.SOURCE_ACKED]
    assert sums[trial.IN_FLIGHT] / counts[trial.IN_FLIGHT] == pytest.approx(offered * latency, rel=0.01)


def test_the_machine_code_is_kept_by_sources_and_versions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    first = compiler.cache_folder(ACK, "1")
    assert first.is_dir()
    assert compiler.cache_folder(ACK, "1") == first
    assert compiler.cache_folder(ACK, "2") != first
    others = [ACK._replace(carries=M_ACK.carries), ACK._replace(period_frames=2), M_ACK, MPS_ACK]
    assert len({first, *(compiler.cache_folder(kind, "1") for kind in others)}) == 5
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file"))
    assert compiler.cache_folder(ACK, "1") is None
