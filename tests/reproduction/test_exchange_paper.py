"""Figures 3, 4 and 5 of Maurelli et al. (TDMA-based exchange policies): claims of captions and text, 2000 trials."""

from collections.abc import Callable, Iterator
from itertools import pairwise

import pytest

from exchange.study.parameters import ExchangeStudy
from exchange.study.study import StudyRow, TrialMean, run

PER = tuple(step / 20 for step in range(1, 17))
LOW = tuple(p for p in PER if p <= 0.15)
HIGH = tuple(p for p in PER if p >= 0.5)
OTHERS = ("ack-repeat", "m-ack", "m-ack-repeat", "mps-ack", "mps-ack-repeat")

Figure = Callable[[str, float], TrialMean]


def figure(rows: list[StudyRow], quantity: str) -> Figure:
    by_key = {(row.policy, row.per): row for row in rows}

    def value(policy: str, per: float) -> TrialMean:
        estimate = getattr(by_key[policy, per], quantity)
        assert isinstance(estimate, TrialMean)
        return estimate

    return value


@pytest.fixture(scope="module")
def rows() -> dict[int, list[StudyRow]]:
    return {nodes: run(ExchangeStudy(nodes=nodes, per=PER, trials=2000, seed=1)) for nodes in (3, 5, 10)}


@pytest.fixture(scope="module")
def figure_3(rows: dict[int, list[StudyRow]]) -> Figure:
    return figure(rows[5], "relative_source")


@pytest.fixture(scope="module")
def figure_4(rows: dict[int, list[StudyRow]]) -> Figure:
    return figure(rows[5], "relative_senders")


@pytest.fixture(scope="module")
def figure_5(rows: dict[int, list[StudyRow]]) -> Figure:
    return figure(rows[10], "relative_senders")


def below(one: TrialMean, other: TrialMean) -> bool:
    """The means are in this order, and the intervals do not meet."""
    assert one.ci95_high is not None
    assert other.ci95_low is not None
    return one.mean < other.mean and one.ci95_high < other.ci95_low


def crossings(value: Figure, falling: str, rising: str) -> Iterator[float]:
    """Loss rates after which `falling` first is better than `rising`."""
    for per, following in pairwise(PER):
        if (
            value(falling, per).mean > value(rising, per).mean
            and value(falling, following).mean <= value(rising, following).mean
        ):
            yield per


@pytest.mark.slow
def test_no_belief_is_false_and_no_trial_is_censored(rows: dict[int, list[StudyRow]]) -> None:
    for row in (row for of_size in rows.values() for row in of_size):
        assert row.false_beliefs == 0
        assert row.censored_senders == 0


# Figure 3: five nodes, until the source knows ------------------------------------------------------------------------


def test_ack_performs_worst(figure_3: Figure) -> None:
    for per in PER:
        for policy in OTHERS:
            assert below(figure_3(policy, per), figure_3("ack", per))


def test_the_repeating_matrix_policies_beat_all_others(figure_3: Figure) -> None:
    for per in PER:
        for policy in ("ack-repeat", "m-ack", "mps-ack"):
            assert figure_3("mps-ack-repeat", per).mean < figure_3(policy, per).mean
            assert figure_3("m-ack-repeat", per).mean < figure_3(policy, per).mean


def test_at_high_loss_mps_ack_passes_ack_repeat(figure_3: Figure) -> None:
    for per in HIGH:
        assert below(figure_3("mps-ack", per), figure_3("ack-repeat", per))


def test_at_high_loss_mps_ack_is_not_far_behind_m_ack_repeat(figure_3: Figure) -> None:
    gaps = {per: figure_3("mps-ack", per).mean - figure_3("m-ack-repeat", per).mean for per in PER}
    assert all(gap > 0 for gap in gaps.values())
    assert max(gaps[per] for per in PER if per >= 0.7) < 0.05
    assert max(gaps.values()) < 0.2


def test_the_matrix_helps_without_repeating(figure_3: Figure) -> None:
    """Section 6: "the extra information provided by the matrix ACKs has a substantial positive effect"."""
    for per in HIGH:
        assert figure_3("m-ack", per).mean < 0.85
        assert figure_3("mps-ack", per).mean < 0.70


# Figure 4: five nodes, until all senders know ------------------------------------------------------------------------


def test_naive_repeating_is_worse_than_ack(figure_4: Figure) -> None:
    for per in PER:
        assert below(figure_4("ack", per), figure_4("ack-repeat", per))


def test_at_low_loss_the_repeating_matrix_policies_are_best(figure_4: Figure) -> None:
    for per in LOW:
        best = sorted(OTHERS, key=lambda policy: figure_4(policy, per).mean)
        assert set(best[:2]) == {"m-ack-repeat", "mps-ack-repeat"}


def test_at_high_loss_the_mps_policies_dominate(figure_4: Figure) -> None:
    for per in HIGH:
        for policy in ("ack", "ack-repeat", "m-ack", "m-ack-repeat"):
            assert below(figure_4("mps-ack", per), figure_4(policy, per))
            assert below(figure_4("mps-ack-repeat", per), figure_4(policy, per))


def test_mps_ack_passes_m_ack_repeat_once(figure_4: Figure) -> None:
    assert list(crossings(figure_4, "mps-ack", "m-ack-repeat")) == [0.15]


# Figure 5: ten nodes, until all senders know; and the three nodes that the paper describes ----------------------------


def test_ten_nodes_show_the_same_trends(figure_5: Figure) -> None:
    for per in PER:
        assert below(figure_5("ack", per), figure_5("ack-repeat", per))
        assert below(figure_5("mps-ack-repeat", per), figure_5("mps-ack", per))
    for per in HIGH:
        for policy in ("ack", "ack-repeat", "m-ack"):
            assert below(figure_5("mps-ack", per), figure_5(policy, per))
    assert len(list(crossings(figure_5, "mps-ack", "m-ack-repeat"))) == 1


def test_repeating_makes_a_larger_difference_with_ten_nodes(figure_4: Figure, figure_5: Figure) -> None:
    for per in PER:
        gaps = [value("mps-ack", per).mean - value("mps-ack-repeat", per).mean for value in (figure_4, figure_5)]
        assert gaps[0] < gaps[1]
    for per in PER[:8]:
        gaps = [value("m-ack", per).mean - value("m-ack-repeat", per).mean for value in (figure_4, figure_5)]
        assert gaps[0] < gaps[1]


def test_with_three_nodes_the_crossing_lies_much_lower(rows: dict[int, list[StudyRow]], figure_4: Figure) -> None:
    """With five nodes between 0.15 and 0.20; with three MPS-ACK is ahead from the lowest rate on."""
    value = figure(rows[3], "relative_senders")
    assert all(value("mps-ack", per).mean < value("m-ack-repeat", per).mean for per in PER)


def test_mps_ack_repeat_delivers_soonest(figure_4: Figure, figure_5: Figure) -> None:
    for value in (figure_4, figure_5):
        for per in PER:
            assert all(value("mps-ack-repeat", per).mean <= value(policy, per).mean for policy in OTHERS)


def test_repeating_speeds_delivery_itself(rows: dict[int, list[StudyRow]]) -> None:
    """Section 6: "having other nodes repeat the information will increase overall distribution speed"."""
    for nodes in (3, 5, 10):
        delivered = figure(rows[nodes], "relative_delivered")
        for per in PER:
            for policy in ("ack-repeat", "m-ack-repeat", "mps-ack-repeat"):
                high = delivered(policy, per).ci95_high
                assert high is not None
                assert high < 1
