"""Mechanisms of policies that state holdings, each taken out: nothing false is believed, and each bears something."""

from dataclasses import replace

import pytest

from benchmarks import holdings
from benchmarks.holdings import VARIANTS, rows
from exchange.study import compiler, stating


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four nodes, a few items, as Python: what is compiled is the same."""
    monkeypatch.setattr(compiler, "why_uncompiled", lambda: "not here")
    monkeypatch.setattr(holdings, "CELLS", ((4, 0.6),))
    monkeypatch.setattr(holdings, "IN_FLEET", 24)
    monkeypatch.setattr(holdings, "FRAMES", 10)
    monkeypatch.setattr(holdings, "MOST_SLOTS", 200)


def test_with_each_taken_out_all_is_delivered_and_known_and_something_differs() -> None:
    told = {
        name: [replace(row, cpu_s=0.0, policy="", acknowledgement="", repeats=True) for row in rows(name, 2)]
        for name in VARIANTS
    }
    assert all(row.false_beliefs == row.censored_source == 0 for found in told.values() for row in found)
    assert all(told[one] != told[other] for one in told for other in told if one != other)


def test_what_was_taken_out_is_back_afterwards() -> None:
    before = stating.show_holders, stating.compose_packet
    list(rows("statements-only", 2))
    assert before == (stating.show_holders, stating.compose_packet)
