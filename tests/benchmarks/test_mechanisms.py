"""Every mechanism can be taken out: its scenario is valid with it and without, and something differs."""

import pytest

from benchmarks.mechanisms import CLASSIFIED, HUNT, MECHANISMS, Mechanism, measured, row
from missions.scenarios import load


@pytest.mark.parametrize("name", MECHANISMS)
def test_what_takes_it_out_is_allowed_and_changes_the_scenario(name: str) -> None:
    of = MECHANISMS[name]
    with_it, without = (load(of.scenario, [("--set", key) for key in (*of.keys, *keys)]) for keys in (of.into, of.out))
    assert (with_it != without) != (of.patch is not Mechanism(HUNT).patch)


def test_what_is_inert_loses_nothing() -> None:
    """The title of a scenario bears nothing, and a row says so: each pair is the same."""
    short = ("scenario.duration_s=500.0",)
    inert = Mechanism(HUNT, ('scenario.title="another"',), measure=CLASSIFIED)
    assert measured(inert, 1, True, short) == measured(inert, 1, False, short) < 500.0


def test_a_row_is_the_paired_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("benchmarks.mechanisms.measured", lambda of, seed, is_out, more: 100.0 + seed * (1 + is_out))
    of = row("policies", 3)
    assert (of["with"], of["change"], of["same"], of["n"]) == (102.0, 2.0, 0, 3)
    low, high = of["interval"]
    assert low < 1.0
    assert high > 3.0
