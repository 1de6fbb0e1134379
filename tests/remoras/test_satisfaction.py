"""Satisfaction and altruism: laws that hold for all constants.

They are the ones to expect of satisfaction-altruism (Simonin and Ferber 2000): satisfaction is bounded and follows
progress, a signal calls the more the more dissatisfied its emitter is, and a signal that is lost only delays.
"""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from remoras.executive.decision import (
    HIGHEST,
    LOWEST,
    DecisionConstants,
    answered,
    call,
    contentment,
    evolved,
    motivation,
    signal_of,
)

satisfactions = st.floats(LOWEST, HIGHEST)
durations = st.floats(0.0, 1000.0)
weights = st.floats(0.0, 10.0)
progresses = st.none() | st.floats(-1.0, 1.0)
constants_drawn = st.builds(
    DecisionConstants.model_construct,
    weight_continuing=weights,
    weight_external=weights,
    gain_per_s=weights,
    tedium_per_s=st.floats(-10.0, 0.0),
    dismay_per_s=st.floats(-10.0, 0.0),
    fade_per_s=weights,
    signal_memory_s=st.floats(0.1, 1000.0),
)


# Personal satisfaction ----------------------------------------------------------------------------


@given(satisfactions, st.lists(st.tuples(progresses, durations), max_size=20), constants_drawn)
def test_satisfaction_stays_a_signed_byte(start, story, constants) -> None:
    value = start
    for progress, dt_s in story:
        value = evolved(value, progress, dt_s, constants)
        assert LOWEST <= value <= HIGHEST
        assert LOWEST <= signal_of(value) <= HIGHEST


@given(satisfactions, durations, constants_drawn)
def test_satisfaction_follows_the_sign_of_progress(value: float, dt_s: float, constants: DecisionConstants) -> None:
    assert evolved(value, 1.0, dt_s, constants) >= value
    assert evolved(value, 0.0, dt_s, constants) <= value
    assert evolved(value, -1.0, dt_s, constants) <= value
    faded = evolved(value, None, dt_s, constants)
    assert abs(faded) <= abs(value)
    assert faded * value >= 0.0  # an idle role comes to rest at 0 and does not swing through it


@given(satisfactions, progresses, st.integers(1, 50), constants_drawn)
def test_the_length_of_a_tick_does_not_matter(value, progress, n, constants) -> None:
    by_ticks = value
    for _ in range(n):
        by_ticks = evolved(by_ticks, progress, 1.0, constants)
    assert by_ticks == pytest.approx(evolved(value, progress, float(n), constants), abs=1e-9)


# Calls --------------------------------------------------------------------------------------------


@given(st.integers(LOWEST, HIGHEST), durations, constants_drawn)
def test_only_dissatisfaction_emits_negative_signals(value: int, age_s: float, constants: DecisionConstants) -> None:
    strength = call(value, age_s, constants)
    assert 0.0 <= strength <= 1.0
    if value >= 0:
        assert strength == 0.0


@given(st.integers(LOWEST, -1), st.integers(LOWEST, -1), durations, durations, constants_drawn)
def test_signal_intensity_grows_with_dissatisfaction_and_freshness(value, other, age_s, other_age_s, constants) -> None:
    worse, better = sorted((value, other))
    fresher_s, older_s = sorted((age_s, other_age_s))
    assert call(worse, fresher_s, constants) >= call(better, fresher_s, constants)
    assert call(worse, fresher_s, constants) >= call(worse, older_s, constants)


# Motivation ---------------------------------------------------------------------------------------


shares = st.floats(0.0, 1.0)


@given(shares, shares, shares, shares, satisfactions)
def test_a_call_is_compared_with_satisfaction_from_own_work(loud, answers, left, less_left, satisfaction) -> None:
    """A louder call, less work left and less content: each moves more to answer; the contented are not moved."""
    less_left, left = sorted((left, less_left))
    own, less = contentment(left, satisfaction), contentment(less_left, satisfaction)
    assert 0.0 <= less <= own <= 1.0
    assert 0.0 <= answered(loud, answers, own) <= answered(loud, answers, less) <= 1.0
    assert answered(loud, answers, own) <= answered(1.0, answers, own)
    assert answered(loud, 0.0, own) == 0.0
    assert answered(loud, answers, contentment(1.0, HIGHEST)) == 0.0
    if satisfaction <= 0.0:
        assert answered(loud, answers, own) == loud * answers


@given(
    st.floats(0.0, 5.0), st.floats(0.01, 1.0), satisfactions, st.floats(0.0, 1.0), st.floats(0.0, 1.0), constants_drawn
)
def test_motivation_grows_with_each_of_its_sources(importance, stimulus, value, weaker, louder, constants) -> None:
    weaker, louder = sorted((weaker, louder))

    def moved(
        importance: float = importance, stimulus: float = stimulus, heeded: float = weaker, value: float | None = None
    ) -> float:
        return motivation(importance, stimulus, value, heeded, constants)

    assert moved(importance=importance + 1.0) >= moved()
    assert moved(stimulus=min(1.0, 2.0 * stimulus)) >= moved()
    assert moved(heeded=louder) >= moved()
    assert moved(value=HIGHEST) >= moved(value=value) >= moved(value=LOWEST) >= moved()


def test_motivation_is_the_sum_of_its_three_sources() -> None:
    """0.6 * 0.5 + 1.0 * 0.25 + 0.2 * (63.25 + 128) / 255 = 0.3 + 0.25 + 0.15."""
    constants = DecisionConstants(weight_continuing=0.2, weight_external=1.0)
    assert motivation(0.6, 0.5, 63.25, 0.25, constants) == pytest.approx(0.7)
