"""A vehicle's step costs what the ledger says."""

import pytest

from benchmarks.calls import MISSIONS, TOLERANCE, calls_of_a_step, ledger


@pytest.mark.parametrize("mission", MISSIONS)
def test_a_step_takes_the_calls_of_the_ledger(mission: str) -> None:
    said, counted = ledger()[-1]["calls"][mission], calls_of_a_step(mission)
    assert counted == pytest.approx(said, rel=TOLERANCE), (
        f"{mission}: {counted:.1f} calls of a vehicle-step, {said:.1f} by the ledger. Where that is meant: "
        f'python -m benchmarks.calls write "what was changed, and what it buys"'
    )
