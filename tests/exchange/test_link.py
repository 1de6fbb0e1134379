"""Loss models by the names that a scenario uses."""

import pytest

from exchange.acoustics.link import LINKS, Bernoulli, Perfect, link_named


def test_every_named_model_can_be_had_and_gives_a_probability():
    for name in LINKS:
        assert 0.0 <= link_named(name, 0.3).p_loss(5, 0, 1, 800.0) <= 1.0


@pytest.mark.parametrize("per", [0.0, 0.2, 0.95])
def test_bernoulli_loses_alike_on_every_link_and_a_perfect_channel_nothing(per: float):
    assert link_named("bernoulli", per) == Bernoulli(per)
    assert {Bernoulli(per).p_loss(slot, 0, 1, range_m) for slot in range(9) for range_m in (1.0, 900.0)} == {per}
    assert link_named("perfect", per) == Perfect()
    assert Perfect().p_loss(0, 0, 1, 1e9) == 0.0
