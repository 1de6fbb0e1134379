"""Bursts fitted to traces: the recursion against all sequences of states, laws of the fit, traces of known chains."""

import time
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sampling import sampled

from benchmarks.bursts import CHAINS as KNOWN
from benchmarks.bursts import outcomes, told
from exchange.acoustics.bursts import (
    CHAINS,
    ELLIOTT,
    GILBERT,
    MARKOV,
    BurstModel,
    Kind,
    NoBurstsError,
    Recorded,
    are_spells_long,
    best,
    do_links_differ,
    expected,
    fits,
    improved,
    recorded,
)
from exchange.acoustics.trace import LossSeries, Trace

CHAIN = KNOWN["long spells"]


def of(lost: list[bool], begins: list[bool] | None = None) -> Recorded:
    flags = begins or [number == 0 for number in range(len(lost))]
    return Recorded(np.array(lost), np.array(flags), {("A", "B"): (len(lost), sum(lost))}, 1.0)


def traced(links: dict[tuple[str, str], list[bool]], times_s: list[float] | None = None) -> Trace:
    series = {
        link: LossSeries(tuple(times_s or [2.0 * number for number in range(len(lost))]), tuple(map(float, lost)))
        for link, lost in links.items()
    }
    return Trace(series, 1e6)


inner = st.floats(0.01, 0.99)
models = st.builds(
    lambda share, changes, good, bad: BurstModel(changes * share, changes * (1.0 - share), good, bad),
    inner, inner, inner, inner,
)  # fmt: skip


@st.composite
def records(draw: st.DrawFn, most: int = 7) -> Recorded:
    lost = draw(st.lists(st.booleans(), min_size=1, max_size=most))
    begins = draw(st.lists(st.booleans(), min_size=len(lost), max_size=len(lost)))
    return of(lost, [True, *begins[1:]])


@given(models, records())
def test_states_are_those_of_all_sequences(model: BurstModel, record: Recorded):
    """By hand: the likelihood is a sum over all sequences of states, and so is each number that is expected."""
    chain = [[1.0 - model.p_good_to_bad, model.p_good_to_bad], [model.p_bad_to_good, 1.0 - model.p_bad_to_good]]
    share = [1.0 - model.bad_share, model.bad_share]
    total, changes, begun, bad = 0.0, np.zeros((2, 2)), np.zeros(2), np.zeros(len(record.lost))
    for states in product((0, 1), repeat=len(record.lost)):
        likely = 1.0
        for number, state in enumerate(states):
            likely *= share[state] if record.begins[number] else chain[states[number - 1]][state]
            rate = (model.per_good, model.per_bad)[state]
            likely *= rate if record.lost[number] else 1.0 - rate
        total += likely
        for number, state in enumerate(states):
            bad[number] += likely * state
            if record.begins[number]:
                begun[state] += likely
            else:
                changes[states[number - 1], state] += likely
    found = expected(model, record)
    assert found.log_likelihood == pytest.approx(np.log(total), abs=1e-9)
    assert found.changes == pytest.approx(changes / total, abs=1e-9)
    assert found.begun == pytest.approx(begun / total, abs=1e-9)
    assert found.bad == pytest.approx(bad / total, abs=1e-9)


@given(models, records(most=200), st.sampled_from(CHAINS), st.integers(1, 8))
def test_the_likelihood_never_falls(model: BurstModel, record: Recorded, kind: Kind, n_steps: int):
    model = kind.of(model)
    for _ in range(n_steps):
        by = expected(model, record)
        model = improved(kind, model, by, record)
        assert model.p_good_to_bad + model.p_bad_to_good <= 1.0 + 1e-12
        assert expected(model, record).log_likelihood >= by.log_likelihood - 1e-8
    if kind is MARKOV:
        assert model[2:] == (0.0, 1.0)
    elif kind is GILBERT:
        assert model.per_good == 0.0


@pytest.mark.slow
@given(models, st.booleans())
def test_shares_of_runs_have_the_mean_of_the_chain(model: BurstModel, lost: bool):
    """A mean is the sum of the shares that have 1, 2, ... at least; of received packets by the mirrored chain."""
    mirrored = model._replace(per_good=1.0 - model.per_good, per_bad=1.0 - model.per_bad)
    shares = model.run_shares(lost, 8000)
    assert shares[0] == pytest.approx(1.0)
    assert np.all(np.diff(shares) <= 0.0)
    assert shares.sum() == pytest.approx((model if lost else mirrored).mean_burst, rel=1e-6)


@given(models, st.integers(1, 9))
def test_so_many_short_steps_are_one(model: BurstModel, n: int):
    short = model.stepped(1.0 / n)
    stays = 1.0 - short.p_good_to_bad - short.p_bad_to_good
    assert stays**n == pytest.approx(1.0 - model.p_good_to_bad - model.p_bad_to_good)
    assert short.loss_rate == pytest.approx(model.loss_rate)


@pytest.mark.slow
@settings(max_examples=20)
@given(st.lists(st.booleans(), min_size=100, max_size=400), st.integers(0, 3))
def test_each_model_is_a_case_of_the_next_and_bad_loses_more(lost: list[bool], n_cuts: int):
    record = of(lost, [number == 0 or number % 80 < n_cuts for number in range(len(lost))])
    try:
        independent, *chains = fits(record)
    except NoBurstsError:
        return
    likely = [fit.log_likelihood for fit in chains]
    assert likely == sorted(likely)
    assert chains[-1].log_likelihood >= independent.log_likelihood - 0.01
    for fit in chains:
        assert fit.model is not None
        assert fit.model.per_good <= fit.model.per_bad
        assert 0.0 < fit.model.p_good_to_bad + fit.model.p_bad_to_good <= 1.0 + 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("model", [CHAIN, KNOWN["short spells"], BurstModel(0.005, 0.01, 0.1, 0.5)])
def test_a_known_chain_is_recovered(model: BurstModel):
    """All four parameters of 20,000 packets are within their 95 % intervals, widened by half."""
    (*_, fit) = fits(of(outcomes(model, 20_000, seed=3)))
    assert fit.model is not None
    assert set(fit.intervals) == set(BurstModel._fields)
    for name, (low, high) in fit.intervals.items():
        slack = 0.25 * (high - low)
        assert low - slack <= getattr(model, name) <= high + slack
        assert low < getattr(fit.model, name) < high


@pytest.mark.slow
def test_what_makes_it_is_chosen():
    """With 5000 packets the simplest model that is true has the least BIC."""
    for model, name in (
        (CHAIN, "gilbert-elliott"),
        (KNOWN["of Gilbert"], "gilbert"),
        (KNOWN["plain Markov"], "markov"),
        (KNOWN["alike, 0.4"], "independent"),
    ):
        assert best(fits(of(outcomes(model, 5000, seed=4)))).name == name


@pytest.mark.slow
def test_intervals_hold_what_they_promise():
    """Of 40 traces of 3000 packets each parameter is outside of its 95 % interval in 6 at most (p = 0.014)."""
    found = [told("long spells", 3000, seed).held for seed in range(1000, 1040)]
    assert {name: sum(not held[name] for held in found) <= 6 for name in BurstModel._fields} == dict.fromkeys(
        BurstModel._fields, True
    )


@pytest.mark.slow
@pytest.mark.parametrize("per", sampled([0.1, 0.4, 0.8], 0.4))
def test_alike_losses_are_no_bursts(per: float):
    """Of 20 traces of 1000 packets one at most is taken for bursts, and none with very strong evidence."""
    found = [told(f"alike, {per}", 1000, seed) for seed in range(1000, 1020)]
    assert sum(one.chosen != "independent" for one in found) <= 1
    assert not any(one.is_strong for one in found)


def test_slots_between_the_packets_are_counted():
    """Packets each fourth slot: by the step of the trace bursts are short, by the slot those of the channel."""
    (*_, fit) = fits(of(outcomes(CHAIN, 20_000, seed=5, every=4)))
    assert fit.model is not None
    slot = fit.model.stepped(0.25)
    assert fit.model.p_bad_to_good > 0.25
    assert slot == pytest.approx(CHAIN, rel=0.15)


def test_links_that_differ_are_told_from_bursts():
    """Two links of independent losses look like one with spells as long as the trace; rates of links tell more."""
    links = {
        ("A", "B"): outcomes(BurstModel(0.5, 0.5, 0.1, 0.1), 2000, seed=6),
        ("B", "A"): outcomes(BurstModel(0.5, 0.5, 0.6, 0.6), 2000, seed=7),
    }
    found = fits(recorded(traced(links)))
    assert best(found).name == "links"
    assert best(found).per_link == pytest.approx({("A", "B"): 0.1, ("B", "A"): 0.6}, abs=0.03)
    assert found[0].bic - found[-1].bic > 10.0  # this chain alone would have been taken for bursts


def rated(links: dict[tuple[str, str], BurstModel], n: int, seed: int) -> tuple[Recorded, BurstModel]:
    """Packets of links, and the chain that is fitted to all of them together."""
    lost = {link: outcomes(model, n, seed, receiver=number) for number, (link, model) in enumerate(links.items(), 1)}
    record = recorded(traced(lost))
    model = fits(record)[-1].model
    assert model is not None
    return record, model


@pytest.mark.slow
def test_links_with_bursts_that_differ_are_told_too():
    """Alike ones differ in the share that they lose, too, by chance of their spells: 1 in 100 is taken for others."""
    alike = {(name, "S"): CHAIN for name in "ABCDEF"}
    found = [do_links_differ(*rated(alike, 300, seed)) for seed in range(20)]
    assert sum(found) <= 2
    other = {**alike, ("A", "S"): CHAIN._replace(per_good=0.3)}
    assert do_links_differ(*rated(other, 1000, seed=1))


def test_spells_as_long_as_the_trace_are_told():
    record, model = rated({("A", "B"): BurstModel(0.002, 0.003, 0.05, 0.8)}, 1500, seed=1)
    assert are_spells_long(record, model)
    record, model = rated({("A", "B"): CHAIN}, 1500, seed=2)
    assert not are_spells_long(record, model)


def test_a_link_or_all_of_them():
    links = {("A", "B"): [False, True] * 60, ("B", "A"): [False] * 150}
    assert recorded(traced(links)).per_link == {("A", "B"): (120, 60), ("B", "A"): (150, 0)}
    one = recorded(traced(links), ("A", "B"))
    assert (len(one.lost), one.n_pieces, one.step_s, one.mean_burst) == (120, 1, 2.0, pytest.approx(1.0, rel=0.01))


def test_a_long_gap_begins_a_piece():
    times_s = [1.0 * number for number in range(100)] + [200.0 + number for number in range(100)] + [305.0]
    record = recorded(traced({("A", "B"): [True] * 201}, times_s))
    assert np.flatnonzero(record.begins).tolist() == [0, 100, 200]


def test_runs_are_counted_from_where_they_began():
    """The first of a piece is passed over, the last is cut: 1 1 0 1 1 1 | 0 1 1 0 0 1."""
    lost = [bool(int(digit)) for digit in "110111011001"]
    record = of(lost, [number in (0, 6) for number in range(12)])
    assert record.runs(lost=True) == ([2], [3, 1])
    assert record.runs(lost=False) == ([1, 2], [])


@pytest.mark.parametrize(
    ("lost", "says"),
    [
        ([True, False] * 49, "98 packets are too few to tell bursts; needed are 100 at least"),
        ([False] * 500, "all 500 packets were received: there are no bursts to fit; the loss rate is 0.006 at most"),
        ([True] * 500, "all 500 packets were lost: there are no bursts to fit; the loss rate is 0.99 at least"),
        (([False] * 50 + [True] * 10) * 9, "9 runs of lost packets in 540 are too few"),
    ],
)
def test_what_tells_nothing_is_refused(lost: list[bool], says: str):
    with pytest.raises(NoBurstsError, match=says):
        fits(of(lost))


def test_what_has_no_outcomes_is_refused():
    with pytest.raises(NoBurstsError, match="has no packet of A to C; allowed: A,B"):
        recorded(traced({("A", "B"): [True]}), ("A", "C"))
    rates = Trace({("A", "B"): LossSeries((0.0, 1.0), (0.5, 1.0))}, 2.0)
    with pytest.raises(NoBurstsError, match=r"has rates \(per\)"):
        recorded(rates)


@pytest.mark.slow
def test_a_hundred_thousand_packets_take_seconds():
    record = of(outcomes(KNOWN["short spells"], 100_000, seed=8))
    begun_s = time.process_time()
    assert best(fits(record)).name == ELLIOTT.name
    assert time.process_time() - begun_s < 60.0
