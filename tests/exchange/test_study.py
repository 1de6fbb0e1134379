"""The policy study as users call it: closed forms, intervals, paired comparison, refusals."""

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from exchange.errors import ConfigurationError
from exchange.policy.policies import ACK, M_ACK, AckPolicy
from exchange.study import study as studies
from exchange.study.parameters import ExchangeStudy, workload_named
from exchange.study.study import StudyRow, TrialMean, run


def rows_by_policy(study: ExchangeStudy) -> dict[str, StudyRow]:
    return {row.policy: row for row in run(study)}


def standard_error(estimate: TrialMean) -> float:
    assert estimate.ci95_high is not None
    return (estimate.ci95_high - estimate.mean) / studies.Z_95


def agrees(estimate: TrialMean | None, expected: float) -> bool:
    return abs(estimate.mean - expected) < 4 * standard_error(estimate)


def expected_last_slot(n_nodes: int, successes: Sequence[float], slots_in_frame: Sequence[int]) -> float:
    """Mean of max_j ((G_j - 1) N + slot_j), G_j geometric with success probability s_j: the sum of P(max > s)."""
    mean, slot = 0.0, 0
    while True:
        p_all_done = math.prod(
            1 - (1 - success) ** (1 + (slot - in_frame) // n_nodes) if slot >= in_frame else 0.0
            for success, in_frame in zip(successes, slots_in_frame, strict=True)
        )
        if p_all_done > 1 - 1e-12:
            return mean
        mean += 1 - p_all_done
        slot += 1


# Closed forms (paper, section 5.2) ------------------------------------------------------------------------------------


@pytest.mark.parametrize("n_nodes", [2, 3, 5, 10])
@pytest.mark.parametrize("per", [0.1, 0.5, 0.8])
def test_all_receivers_take_the_maximum_of_geometric_variables(n_nodes: int, per: float) -> None:
    """E(T delivered) = 1 / (1 - p), E(T acked) = 1 / (1 - p)^2 frames of one receiver."""
    row = rows_by_policy(ExchangeStudy(nodes=n_nodes, per=(per,), policies=("ack",), trials=8000))["ack"]
    n_others = n_nodes - 1
    assert agrees(row.delivered_slots, expected_last_slot(n_nodes, [1 - per] * n_others, [1] * n_others))
    in_frame = [receiver + 1 for receiver in range(1, n_nodes)]
    assert agrees(row.source_acked_slots, expected_last_slot(n_nodes, [(1 - per) ** 2] * n_others, in_frame))


def test_without_loss_everything_takes_one_frame() -> None:
    for row in run(ExchangeStudy(per=(0.0,), trials=10)):
        assert row.delivered_slots == TrialMean(1.0, 1.0, 1.0)
        assert row.source_acked_slots == TrialMean(5.0, 5.0, 5.0)
        assert row.false_beliefs == 0


# Rows -----------------------------------------------------------------------------------------------------------------


def test_rows_are_ordered_and_have_the_contract_columns() -> None:
    rows = run(ExchangeStudy(per=(0.1, 0.4), policies=("mps-ack", "ack-repeat"), trials=20))
    assert [(row.per, row.policy) for row in rows] == [
        (0.1, "mps-ack"), (0.1, "ack-repeat"), (0.4, "mps-ack"), (0.4, "ack-repeat"),
    ]  # fmt: skip
    values = json.loads(json.dumps(rows[0].as_json(), allow_nan=False))
    for name in ("source_acked_slots", "senders_acked_slots", "delivered_slots", "item_transmissions"):
        assert set(values[name]) == {"mean", "ci95_low", "ci95_high"}
    assert values["header_bits"] == 20
    assert values["load"] == "single"
    assert values["items"] == 1
    assert values["carrier_evidence"] is False
    assert 0 < values["relative_source"] < 1
    assert values["relative_source_ci95"][0] < values["relative_source"] < values["relative_source_ci95"][1]
    assert {"nodes", "trials", "relative_senders", "false_beliefs", "cpu_s"} <= set(values)


def numbers(rows: list[StudyRow]) -> list[StudyRow]:
    return [replace(row, cpu_s=0.0) for row in rows]


def test_results_do_not_depend_on_workers_or_other_policies() -> None:
    study = ExchangeStudy(per=(0.3, 0.6), trials=1100)
    alone = run(replace(study, per=(0.6,), policies=("m-ack",)))
    together = run(study, jobs=3)
    assert numbers(together) == numbers(run(study))
    assert numbers(alone) == [row for row in numbers(together) if (row.per, row.policy) == (0.6, "m-ack")]


def test_censored_trials_are_counted_separately() -> None:
    row = rows_by_policy(ExchangeStudy(per=(0.7,), policies=("ack",), trials=400, max_slots=30))["ack"]
    assert 0 < row.censored_delivered < row.censored_source == row.censored_senders < 400
    assert row.delivered_slots.mean <= 30
    none = rows_by_policy(ExchangeStudy(per=(0.99,), policies=("ack",), trials=4, max_slots=5))["ack"]
    assert none.censored_source == 4
    assert none.source_acked_slots is None
    assert none.relative_source is None
    assert json.dumps(none.as_json(), allow_nan=False)


def test_poisson_load_reports_throughput() -> None:
    study = ExchangeStudy(trials=60, load=workload_named("poisson:0.02"), capacity_bits=256, per=(0.2,))
    row = rows_by_policy(study)["mps-ack"]
    assert row.load == "poisson:0.02"
    assert row.items is None
    assert agrees(row.offered_items_per_slot, 0.1)
    assert agrees(row.goodput_items_per_slot, 0.1)
    assert row.refused_fraction == TrialMean(0.0, 0.0, 0.0)
    assert row.items_in_flight is not None
    assert row.delivered_slots.mean < row.source_acked_slots.mean
    single = rows_by_policy(ExchangeStudy(trials=60))["mps-ack"]
    assert single.goodput_items_per_slot is None


# Intervals ------------------------------------------------------------------------------------------------------------


def outcomes_of(sums: Any, counts: Any) -> np.ndarray[Any, np.dtype[np.int64]]:
    return np.stack([np.asarray(sums), np.asarray(counts)], axis=-1)[:, None, :].astype(np.int64)


def test_intervals_have_their_nominal_coverage() -> None:
    """Ratio of two correlated means, true value 1.5, 400 times: 95 % within four standard errors of a proportion."""
    dice = np.random.default_rng(1)
    covered = 0
    for _ in range(400):
        common = dice.geometric(0.2, 200)
        policy = outcomes_of(15 * common + dice.integers(-3, 4, 200), np.full(200, 3))
        baseline = outcomes_of(10 * common + dice.integers(-3, 4, 200), np.full(200, 3))
        estimate = studies.relative_mean(studies.moments(policy, baseline)[0])
        assert estimate.ci95_low is not None
        assert estimate.ci95_high is not None
        covered += estimate.ci95_low <= 1.5 <= estimate.ci95_high
    assert covered / 400 == pytest.approx(0.95, abs=4 * math.sqrt(0.95 * 0.05 / 400))


# What is refused ------------------------------------------------------------------------------------------------------


NAMESAKES = tuple(AckPolicy(kind._replace(name="own"), repeat=False) for kind in (ACK, M_ACK))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"per": (1.0,)}, "per is 1: every packet is lost and the exchange never ends"),
        ({"per": (-0.1,)}, r"per is -0\.1: a loss probability must be from 0 to below 1"),
        ({"per": (float("nan"),)}, "per is nan"),
        ({"per": ()}, "per is empty"),
        ({"nodes": 1}, "nodes is 1: allowed are 2 to 64"),
        ({"trials": 0}, "trials is 0"),
        ({"policies": ("mack",)}, "unknown policy 'mack'.*m-ack"),
        ({"capacity_bits": 63, "policies": ("ack",)}, "capacity_bits is 63: with 5 nodes policy ack needs 64"),
        ({"load": workload_named("poisson:1"), "max_slots": 100}, "warm-up and window"),
        ({"policies": NAMESAKES}, "two policies have the name own"),
    ],
)
def test_invalid_settings_are_refused_with_given_and_allowed_values(settings, message):
    with pytest.raises(ConfigurationError, match=message):
        ExchangeStudy(**settings)


@pytest.mark.parametrize("text", ["triple", "poisson", "poisson:", "poisson:x", "single:3", "poisson:0", "poisson:-1"])
def test_an_unknown_load_is_refused(text: str) -> None:
    with pytest.raises(ConfigurationError, match="poisson"):
        workload_named(text)
