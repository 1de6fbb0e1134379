"""Loss models: the probabilities they give, and the bursts of the Gilbert-Elliott channel."""

import math
from itertools import groupby

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.acoustics import loss
from exchange.acoustics.link import Bernoulli, GilbertElliott, LinkModel, Matrix, Perfect, Transmission

P_GB, P_BG, PER_GOOD, PER_BAD = 0.1, 0.3, 0.05, 0.8
"""A link that is bad for 0.1 / (0.1 + 0.3) = 1/4 of the time and loses 3/4 * 0.05 + 1/4 * 0.8 = 0.2375."""
BAD_SHARE, MEAN_PER, CORRELATION = 0.25, 0.2375, 0.6
N_SEEDS = 4000
N_SLOTS = 40_000


def model(seed: int = 1, **changed: float) -> GilbertElliott:
    rates = {"p_good_to_bad": P_GB, "p_bad_to_good": P_BG, "per_good": PER_GOOD, "per_bad": PER_BAD} | changed
    return GilbertElliott(**rates, seed=seed)


def sent(slot: int, sender: int = 0) -> Transmission:
    return Transmission(slot, sender, 1.0 * slot, 512)


def states(link: GilbertElliott, n_slots: int = N_SLOTS) -> list[bool]:
    return [link.is_bad(slot, 0, 1) for slot in range(n_slots)]


def standard_error(p: float, n: int) -> float:
    return math.sqrt(p * (1.0 - p) / n)


@pytest.mark.parametrize("per", [0.0, 0.2, 0.95])
def test_bernoulli_loses_alike_on_every_link_and_a_perfect_channel_nothing(per: float):
    assert {Bernoulli(per).p_loss(sent(slot), 1, range_m) for slot in range(9) for range_m in (1.0, 900.0)} == {per}
    assert Perfect().p_loss(sent(0), 1, 1e9) == 0.0


def test_a_matrix_has_a_probability_of_its_own_in_each_direction():
    matrix = Matrix(0.2, {(1, 0): 0.5, (0, 2): 1.0})
    assert [matrix.p_loss(sent(3, one), other, 100.0) for one, other in [(1, 0), (0, 1), (0, 2), (2, 0)]] == [
        0.5,
        0.2,
        1.0,
        0.2,
    ]


# Gilbert-Elliott ----------------------------------------------------------------------------------


def test_mean_loss_and_share_of_bad_slots_follow_from_the_rates():
    assert model().bad_share == pytest.approx(BAD_SHARE)
    assert model().mean_per == pytest.approx(MEAN_PER)


@pytest.mark.parametrize("slot", [0, 1, 7, 500])
def test_the_chain_is_stationary_from_the_first_slot_on(slot: int):
    """Over seeds, whose chains are independent: four standard errors."""
    share = sum(model(seed).is_bad(slot, 0, 1) for seed in range(N_SEEDS)) / N_SEEDS
    assert abs(share - BAD_SHARE) < 4.0 * standard_error(BAD_SHARE, N_SEEDS)


@pytest.mark.parametrize("n", [1, 2, 3, 6])
@pytest.mark.parametrize("start", [0, 90])
def test_states_n_slots_apart_are_correlated_with_the_nth_power(start: int, n: int):
    """Both slots are bad with probability s^2 + s (1 - s) 0.6^n, s = 1/4: four standard errors over seeds."""
    expected = BAD_SHARE**2 + BAD_SHARE * (1.0 - BAD_SHARE) * CORRELATION**n
    links = [model(seed) for seed in range(N_SEEDS)]
    both = sum(link.is_bad(start + n, 0, 1) and link.is_bad(start, 0, 1) for link in links) / N_SEEDS
    assert abs(both - expected) < 4.0 * standard_error(expected, N_SEEDS)


@pytest.mark.parametrize("is_bad", [True, False])
def test_spells_have_the_mean_length_of_a_geometric_variable(is_bad: bool):
    """Mean 1 / p, 3.33 slots of bad ones; variance (1 - p) / p^2; four standard errors."""
    p = P_BG if is_bad else P_GB
    lengths = [len(list(spell)) for bad, spell in groupby(states(model())) if bad is is_bad][1:-1]
    mean = sum(lengths) / len(lengths)
    assert abs(mean - 1.0 / p) < 4.0 * math.sqrt((1.0 - p) / len(lengths)) / p


def test_the_states_take_no_part_in_the_draws_of_losses():
    """A packet is lost in a bad slot as often as per_bad says, in a good one as per_good: four standard errors."""
    lost: dict[bool, list[bool]] = {True: [], False: []}
    link = model()
    for slot in range(N_SLOTS):
        lost[link.is_bad(slot, 0, 1)].append(loss.uniform(1, 0, slot, 0, 1) < link.p_loss(sent(slot), 1, 100.0))
    for bad, per in ((True, PER_BAD), (False, PER_GOOD)):
        share = sum(lost[bad]) / len(lost[bad])
        assert abs(share - per) < 4.0 * standard_error(per, len(lost[bad]))


def test_losses_are_as_frequent_as_the_stationary_mean():
    """Four standard errors of a correlated sum: with d = 0.8 - 0.05 and s = 1/4, the variance of the number of losses
    is m (1 - m) + 2 d^2 s (1 - s) 0.6 / (1 - 0.6) = 0.497 per slot."""
    link = model(seed=8)
    lost = sum(loss.uniform(8, 0, slot, 0, 1) < link.p_loss(sent(slot), 1, 100.0) for slot in range(N_SLOTS))
    assert abs(lost / N_SLOTS - MEAN_PER) < 4.0 * math.sqrt(0.497 / N_SLOTS)


def test_links_directions_seeds_and_trials_have_states_of_their_own():
    """Two independent links are both bad in 1/16 of the slots; of correlated sums the variance is below four times that
    of independent ones, so eight standard errors of those are four at least."""
    trial = GilbertElliott(P_GB, P_BG, PER_GOOD, PER_BAD, seed=1, trial=1)
    link = model()
    one, others = states(link), [states(model(seed=2)), states(trial)]
    others += [[link.is_bad(slot, *pair) for slot in range(N_SLOTS)] for pair in [(1, 0), (0, 2)]]
    for other in others:
        both = sum(a and b for a, b in zip(one, other, strict=True)) / N_SLOTS
        assert abs(both - BAD_SHARE**2) < 8.0 * standard_error(BAD_SHARE**2, N_SLOTS)


def test_the_states_are_pinned():
    """Runs are repeated from their seed: these states, first computed by this program, must never change."""
    assert (
        "".join("-#"[bad] for bad in states(model(seed=2), 60))
        == "#---#######------------------------######-#--------------###"
    )


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
def test_the_state_is_a_pure_function_whatever_was_asked_before(
    rates: tuple[float, float], asked: list[tuple[int, int, int]], seed: int
):
    one = GilbertElliott(*rates, PER_GOOD, PER_BAD, seed)
    assert [one.is_bad(*each) for each in asked] == [walked(one, *each) for each in asked]


@given(st.data(), ASKED)
def test_the_order_of_asking_does_not_matter(data: st.DataObject, asked: list[tuple[int, int, int]]):
    shuffled = data.draw(st.permutations(asked))
    one, other = model(3, p_good_to_bad=0.02, p_bad_to_good=0.05), model(3, p_good_to_bad=0.02, p_bad_to_good=0.05)
    assert {each: one.is_bad(*each) for each in asked} == {each: other.is_bad(*each) for each in shuffled}


def lost_packets(link: LinkModel, n_slots: int = 300) -> set[int]:
    return {slot for slot in range(n_slots) if loss.uniform(5, 0, slot, 0, 1) < link.p_loss(sent(slot), 1, 100.0)}


@given(RATES, st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_worse_channel_of_the_same_seed_loses_what_the_better_one_does_and_more(
    rates: tuple[float, float], a: float, b: float, c: float
):
    p_gb, p_bg = rates
    per_good, per_bad, worse = sorted((a, b, c))
    better = lost_packets(GilbertElliott(p_gb, p_bg, per_good, per_bad, 5))
    assert better <= lost_packets(GilbertElliott(p_gb, p_bg, per_good, worse, 5))
    assert better <= lost_packets(GilbertElliott(p_gb, p_bg, per_bad, per_bad, 5))
    assert better <= lost_packets(GilbertElliott(p_gb + (1.0 - p_gb - p_bg) * 0.9, p_bg, per_good, per_bad, 5))
    assert better <= lost_packets(GilbertElliott(p_gb, 0.5 * p_bg, per_good, per_bad, 5))


def test_a_slow_chain_takes_one_draw_for_each_slot_that_went_by(monkeypatch: pytest.MonkeyPatch):
    """A link of eight nodes, asked in each eighth slot: at rates of 1e-6 hardly a number decides."""
    draws = []
    link_uniform = loss.link_uniform

    def counted(key: int, sender: int, receiver: int) -> float:
        draws.append(key)
        return link_uniform(key, sender, receiver)

    monkeypatch.setattr(loss, "link_uniform", counted)
    link = model(p_good_to_bad=1e-6, p_bad_to_good=1e-6)
    for slot in range(0, 8000, 8):
        link.is_bad(slot, 0, 1)
    assert len(draws) <= 8000 + 1


@pytest.mark.parametrize(("p_gb", "p_bg"), [(0.0, 0.0), (0.6, 0.5)])
def test_rates_that_make_no_such_chain_are_refused(p_gb: float, p_bg: float):
    with pytest.raises(ValueError, match="above 0 and at most 1"):
        model(p_good_to_bad=p_gb, p_bad_to_good=p_bg)


def test_a_link_that_never_recovers_is_bad_and_one_that_never_fails_is_good():
    assert all(states(model(p_bad_to_good=0.0), 50))
    assert not any(states(model(p_good_to_bad=0.0), 50))
