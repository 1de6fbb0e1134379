"""Loss models: the probabilities they give, and the bursts of the Gilbert-Elliott channel."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.channel import loss
from exchange.channel.link import GilbertElliott, LinkModel, Matrix, Transmission

P_GB, P_BG, PER_GOOD, PER_BAD = 0.1, 0.3, 0.05, 0.8
"""A link that is bad for 0.1 / (0.1 + 0.3) = 1/4 of the time and loses 3/4 * 0.05 + 1/4 * 0.8 = 0.2375."""
BAD_SHARE, CORRELATION = 0.25, 0.6
N_SEEDS = 4000


def model(seed: int = 1, **changed: float) -> GilbertElliott:
    rates = {"p_good_to_bad": P_GB, "p_bad_to_good": P_BG, "per_good": PER_GOOD, "per_bad": PER_BAD} | changed
    return GilbertElliott(**rates, seed=seed)


def sent(slot: int, sender: int = 0) -> Transmission:
    return Transmission(slot, sender, 1.0 * slot, 512)


def standard_error(p: float, n: int) -> float:
    return math.sqrt(p * (1.0 - p) / n)


def test_a_matrix_has_a_probability_of_its_own_in_each_direction():
    matrix = Matrix(0.2, {(1, 0): 0.5, (0, 2): 1.0})
    assert [matrix.p_loss(sent(3, one), other, 100.0) for one, other in [(1, 0), (0, 1), (0, 2), (2, 0)]] == [
        0.5,
        0.2,
        1.0,
        0.2,
    ]


# Gilbert-Elliott ----------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [1, 2, 3, 6])
@pytest.mark.parametrize("start", [0, 90])
def test_states_n_slots_apart_are_correlated_with_the_nth_power(start: int, n: int):
    """Both slots are bad with probability s^2 + s (1 - s) 0.6^n, s = 1/4: four standard errors over seeds."""
    expected = BAD_SHARE**2 + BAD_SHARE * (1.0 - BAD_SHARE) * CORRELATION**n
    links = [model(seed) for seed in range(N_SEEDS)]
    both = sum(link.is_bad(start + n, 0, 1) and link.is_bad(start, 0, 1) for link in links) / N_SEEDS
    assert abs(both - expected) < 4.0 * standard_error(expected, N_SEEDS)


def walked(link: GilbertElliott, slot: int, sender: int, receiver: int) -> bool:
    """State of a link, by walking on from the slot before the first: the definition, without memory."""
    key = loss.state_key(link.seed, link.trial)
    numbers = [loss.link_uniform(loss.slot_key(key, at), sender, receiver) for at in range(-1, slot + 1)]
    bad = numbers[0] < link.bad_share
    for number in numbers[1:]:
        bad = number < link.p_good_to_bad or (bad and number < 1.0 - link.p_bad_to_good)
    return bad


RATES = st.tuples(st.floats(1e-4, 1.0), st.floats(0.0, 1.0)).map(
    lambda pair: (pair[0] * (1.0 - pair[1]), pair[1] * 0.999)
)
ASKED = st.lists(st.tuples(st.integers(0, 120), st.integers(0, 2), st.integers(3, 4)), max_size=40)


@given(RATES, ASKED, st.integers(0, 2**62))
def test_the_link_state_does_not_depend_on_earlier_queries(rates, asked, seed):
    one = GilbertElliott(*rates, PER_GOOD, PER_BAD, seed)
    assert [one.is_bad(*each) for each in asked] == [walked(one, *each) for each in asked]


def lost_packets(link: LinkModel) -> set[int]:
    return {slot for slot in range(300) if loss.uniform(5, 0, slot, 0, 1) < link.p_loss(sent(slot), 1, 100.0)}


@given(RATES, st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_losses_at_a_higher_rate_include_those_at_a_lower_rate(rates, a, b, c):
    p_gb, p_bg = rates
    per_good, per_bad, worse = sorted((a, b, c))
    better = lost_packets(GilbertElliott(p_gb, p_bg, per_good, per_bad, 5))
    assert better <= lost_packets(GilbertElliott(p_gb, p_bg, per_good, worse, 5))
    assert better <= lost_packets(GilbertElliott(p_gb, p_bg, per_bad, per_bad, 5))
    assert better <= lost_packets(GilbertElliott(p_gb + (1.0 - p_gb - p_bg) * 0.9, p_bg, per_good, per_bad, 5))
    assert better <= lost_packets(GilbertElliott(p_gb, 0.5 * p_bg, per_good, per_bad, 5))


@pytest.mark.parametrize(("p_gb", "p_bg"), [(0.0, 0.0), (0.6, 0.5)])
def test_rates_without_a_valid_markov_chain_are_refused(p_gb: float, p_bg: float):
    with pytest.raises(ValueError, match="above 0 and at most 1"):
        model(p_good_to_bad=p_gb, p_bad_to_good=p_bg)
