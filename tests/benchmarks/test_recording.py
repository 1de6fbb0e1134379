"""What is recorded of a run in a sweep takes no more room than it may."""

import pytest

from benchmarks.recording import SAMPLED_BYTES, sampled_bytes


@pytest.mark.slow
def test_tables_of_sampled_runs_are_small() -> None:
    """About twice their size before items and decisions were recorded."""
    assert sampled_bytes() <= SAMPLED_BYTES
