"""Analysis of the study on help: planned contrasts of simulated times."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.help_value import BURSTS, Ratio, Times, figure, ratios


def simulated(gain: float, slower: float = 0.0, n: int = 8) -> Times:
    """Log times of which help takes off ``gain`` at the larger share without loss; the first organisation is slower."""
    logs = np.random.default_rng(1).normal(7.0, 0.2, (n, 1, 1, 1, 1)) + np.zeros((n, 2, 2, 2, 2))
    logs[:, 1, 1, 0] -= gain
    logs[..., 0] += slower
    return Times([0.2, 0.5], ["none", "calls"], ["0", "0.9"], ["central", "cbba-plain"], logs)


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_contrasts_find_the_gain_and_no_difference_between_organisations(gain: float, slower: float) -> None:
    """Half of the contrast with loss is at the smaller share, half of that with the share at the lossy cells."""
    contrasts = simulated(gain, slower).contrasts
    expected = [gain / 2.0, gain / 2.0, 0.0, 0.0]
    for values, mean in zip(contrasts.values(), expected, strict=True):
        assert values == pytest.approx(np.full(8, mean), abs=1e-9)


def test_ratio_of_a_cell_and_its_correction() -> None:
    """Of 2^8 flips only the two with equal signs reach the sum of the cell with a gain."""
    found = ratios(simulated(np.log(2.0)).gains.reshape(8, -1))
    assert [ratio.mean for ratio in found] == pytest.approx([1.0, 1.0, 2.0, 1.0])
    assert (found[2].p, found[0].p) == (2 / 2**8, 1.0)


def test_the_figure_draws_each_ratio_at_its_loss_and_none_of_bursts() -> None:
    times = simulated(0.0)
    times = times._replace(losses=["0", BURSTS, "0.9"], logs=times.logs.repeat(2, axis=3)[:, :, :, :3])
    found = [Ratio(float(1 + number), 1.0, 2.0, 1.0, 1.0) for number in range(6)]
    lines = figure(times, found).axes[0].get_lines()[1:]
    assert [line.get_xdata() for line in lines] == [pytest.approx([0.0, 0.9], abs=0.01)] * 2
    assert [list(line.get_ydata()) for line in lines] == [[1.0, 3.0], [4.0, 6.0]]
